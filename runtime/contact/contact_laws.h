// Contacts that may release or slip: projected block Gauss-Seidel on the contact matrix. The blocks are the constraints.
//
// The system is (H W H^T + soft) r = d: r the reactions of the rows (N), d their targets (m), W the compliance between the
// contact nodes. A law forbids some reactions: a pull, or a tangential force beyond friction times the normal force.
#pragma once

#include <cstdint>

#include "runtime/contact/contact_constraints.h"

namespace palpate {

// Where the rows of one constraint stand in the system.
struct RowsOfConstraint {
  std::int32_t at[3];  // row of each axis of the frame; -1: not imposed, or it cannot move
};

// The contact system as the solver stores it. Rows that are not in use have a reaction of zero.
struct ContactSystem {
  const double* matrix = nullptr;  // [rows_end][stride] H W H^T, m/N, symmetric
  std::size_t stride = 0;
  std::int32_t rows_end = 0;
  const double* soft = nullptr;    // [rows_end] m/N, added to the diagonal
  const double* target = nullptr;  // [rows_end] m
  const ContactConstraint* constraints = nullptr;
  const RowsOfConstraint* rows = nullptr;  // [constraint_count]
  std::int32_t constraint_count = 0;
};

// By how much the constraints are missed, at the row that is missed most.
struct ContactResidual {
  double displacement = 0;  // m
  double force = 0;         // N: the same, divided by the row's own compliance
  std::int32_t sweeps = 0;  // of projected Gauss-Seidel; 0 where the factor alone solved the system
};

// True where no contact pulls that may not, and no tangential force exceeds its friction.
bool obeys_laws(const ContactSystem& system, const double* reaction);

// Improves reaction ([rows_end] N; in: a start, such as the last step's) until a sweep changes no displacement by more than
// `tolerance` metres, or for most_sweeps sweeps; returns their number. A sweep solves each constraint exactly with the
// reactions of all others held: a sticking one by its 3 x 3 system; a normal force that may not pull is cut at zero; a contact
// that would exceed its friction slips, with r_t = -mu r_n w_t / |w_t|, where w_t is the slip of the anchor past the tool.
// Cost: rows_end^2 multiply-adds per sweep.
std::int32_t sweep_contacts(const ContactSystem& system, double* reaction, double tolerance, std::int32_t most_sweeps);

// By how much the laws are missed. A held row: by its displacement. A normal row that may release: by the smaller of its gap
// and its push. Friction: by the change that one step of the projection would make.
ContactResidual law_residual(const ContactSystem& system, const double* reaction);

// m, by how much the rows of constraint p miss their targets: achieved minus target.
Vec3 missed(const ContactSystem& system, const double* reaction, std::int32_t p);

}  // namespace palpate
