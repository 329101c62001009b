// Contacts that may release or slip: projected block Gauss-Seidel on the small contact matrix.
#pragma once

#include <cstdint>

#include "runtime/contact/contact_set.h"

namespace palpate {

// The rows of one block.
struct ContactRowsOfBlock {
  std::int32_t at[3];  // row of each axis, or -1: not imposed, or it cannot move
};

// The contact system as the solver keeps it. Rows that are free have a reaction of zero.
struct ContactSystem {
  const double* matrix = nullptr;  // [rows_end][stride] H W H^T, m/N, symmetric
  std::size_t stride = 0;
  std::int32_t rows_end = 0;
  const double* soft = nullptr;    // [rows_end] m/N, added to the diagonal
  const double* target = nullptr;  // [rows_end] m
  const ContactBlock* blocks = nullptr;
  const ContactRowsOfBlock* rows = nullptr;  // of each block
  std::int32_t block_count = 0;
};

// How well something holds what was asked, at the row where it is held worst.
struct ContactResidual {
  double displacement = 0;  // m
  double force = 0;         // N: the same, over the row's own compliance
  std::int32_t sweeps = 0;  // of projected Gauss-Seidel; 0 where the factor alone solved
};

// True where no contact pulls that may not, and none holds by more than its friction.
bool obeys_laws(const ContactSystem& system, const double* reaction);

// Improves reaction ([rows_end], N; the start, from the last step) until a sweep changes no displacement by more than
// `tolerance` metres, or after most_sweeps. Each block in turn is solved exactly with the others held: a sticking one by
// its 3 x 3 system; a normal force that may not pull is cut at zero; a contact that would hold by more than its friction
// slips: r_t = -mu r_n w_t / |w_t|, w_t how far the place slips past the tool. Returns the sweeps done.
// Cost: rows^2 multiply-adds per sweep.
std::int32_t sweep_contacts(const ContactSystem& system, double* reaction, double tolerance, std::int32_t most_sweeps);

// By how much the laws are missed: a held row by its displacement; a normal row by the lesser of gap and push; friction by
// what a step of the projection would change.
ContactResidual law_residual(const ContactSystem& system, const double* reaction);

// How far the rows of block p miss their targets: achieved less asked, m.
Vec3 missed(const ContactSystem& system, const double* reaction, std::int32_t p);

}  // namespace palpate
