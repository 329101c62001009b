// Predicts the memory and the time of a solver from the size of its factor, which solver_plan.h counts on a mesh.
#pragma once

#include <cstdint>
#include <string>

namespace palpate {

// What the prediction needs to know of a solve.
struct SolveSize {
  double rows = 0, blocks = 0;      // of K: nodes that can move, and 3 x 3 blocks that are not zero
  double form_blocks = 0;           // 4 x 4 blocks of its pressure form, where that is factored; else 0
  double columns = 0;               // to solve
  double stored_rows = 0;           // nodes whose displacement is written for each column
  int block = 3;                    // rows of a block of the factor: 3 for K, 4 for its pressure form
  double numbers = 0;               // that the factor stores
  double rectangles = 0, work = 0;  // numbers that factoring holds (supernodal_factorisation.h)
  double flops = 0;                 // of the factorisation
  double forward = 0;  // numbers of the factor that the forward substitution of a batch reads, mean of all batches
  double flops_per_second = 0;  // of the triangular solves' kernel on this machine
};

// Bytes and seconds are of one rank, beyond what the process holds when the plan is made.
struct SolverEstimate {
  int width = 0;                     // columns in a batch
  double bytes = 0;                  // at the peak
  double shared_bytes = 0;           // of bytes: the factor, which the ranks of a machine hold once if they share it
  double own_bytes = 0;              // at the peak, of a rank that shares the factor: what it holds beside the factor
  double setup_seconds = 0;          // factoring, or building the levels
  double divided_setup_seconds = 0;  // of setup_seconds: what the ranks of a machine divide if they share the factor
  double column_seconds = 0;         // solving, certifying and converting one column
};

// number_bytes: 8, or 4 for the factor in single precision, which takes three solves where the other takes one.
SolverEstimate estimate_factor(const SolveSize& size, int width, int number_bytes);
SolverEstimate estimate_multigrid(const SolveSize& size, int width);

// s, of one of `ranks` ranks, of which `here` run on its machine and share the factor, where there is one to share.
double seconds_of(const SolverEstimate& estimate, double columns, int ranks, int here, bool shares);
// By how much `here` ranks of a machine, which use the same memory, slow one another.
double slowdown_of(int here);

// Bytes that multigrid takes at its peak for each 3 x 3 block of K, without its batches of columns: PETSc's copy of K and the
// levels that GAMG builds. Measured with 19,656 vertices: 100 (p1) and less (p1-anp) on one rank, 270 on two ranks that share K.
inline constexpr double kMultigridBytesPerBlock = 300;

std::string bytes_text(double bytes);      // "616 MB", "12.5 GB"
std::string seconds_text(double seconds);  // "2.3 s", "94 min", "18.7 h"

}  // namespace palpate
