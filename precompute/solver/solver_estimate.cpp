#include "precompute/solver/solver_estimate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

// Constants of the prediction, fitted to runs of bench/precompute and bench/multigrid with 200 to 100,000 vertices. Where the
// time is arithmetic, the constant is a share of the rate of the triangular solves' kernel, so that the prediction is right
// for a slower machine too.
constexpr double kSolveShare = 0.62;         // share of the kernel's rate that the triangular solves reach
constexpr double kFactorShare = 0.5;         // the same of the factorisation, through BLAS
constexpr double kFactorPerRow = 10e-6;      // s: small supernodes, for which calling BLAS takes longest
constexpr double kFactorPerNumber = 5e-9;    // s: conversion of the factor into our panels
constexpr double kProductShare = 0.45;       // share of the kernel's rate that K x and the residuals reach
constexpr double kPerStoredNumber = 2.5e-9;  // s: conversion to f32, its error, the write
constexpr double kFactorBytes = 3e6;         // bytes that BLAS uses for itself
constexpr double kSinglePasses = 3;          // solves with the factor in single precision until 1e-9
constexpr double kVectors = 3;               // batches of columns where CG does not iterate: x, b, K x
constexpr double kIteratingVectors = 6;      // where it does
constexpr double kSingleSweep = 5e-9;        // s for each number of the batch: CG's vectors, and conversions
constexpr double kMultigridProducts = 300;   // products with K for a column, in all V-cycles, until 1e-9
constexpr double kMultigridSetup = 3.5e-6;   // s per block of K
constexpr double kFactorGain = 0.7;  // what each further rank of a machine adds to the speed of factoring together
constexpr double kShared = 0.06;  // share of a column's time that each further rank costs, which uses the same memory

}  // namespace

SolverEstimate estimate_factor(const SolveSize& size, int width, int number_bytes) {
  const double dofs = 3.0 * size.rows, stored = 3.0 * size.stored_rows;
  SolverEstimate result;
  result.width = width;
  const double renumbered = 76 * size.blocks + 132 * size.form_blocks;  // copies while rows are put in order
  const bool single = number_bytes == 4;
  const double factoring = number_bytes * (size.rectangles + 2 * size.work);
  // A batch in the rows and the numbers of L, where these are not those of K.
  const double of_l = size.block == 3 && !single ? 0 : number_bytes * size.block * size.rows;
  const double columns = width * ((single ? kIteratingVectors : kVectors) * 8 * dofs + of_l + 2 * 4 * stored);
  result.bytes = kFactorBytes + std::max({renumbered, factoring, number_bytes * size.numbers + columns});
  result.shared_bytes = number_bytes * size.rectangles;
  result.own_bytes = kFactorBytes + std::max({renumbered, number_bytes * 2 * size.work, columns});
  result.divided_setup_seconds =
      size.flops / (kFactorShare * size.flops_per_second * (single ? 2 : 1)) + kFactorPerRow * size.rows;
  result.setup_seconds = result.divided_setup_seconds + kFactorPerNumber * size.numbers;
  const double first_pass = size.forward + size.numbers;
  const double passes = single ? (first_pass + (kSinglePasses - 1) * 2 * size.numbers) / 2 : first_pass;
  const double products = single ? kSinglePasses + 1 : 1;
  const double sweeps = single ? kSinglePasses * kSingleSweep * dofs : 0;
  result.column_seconds = 2 * passes / (kSolveShare * size.flops_per_second) +
                          18 * products * size.blocks / (kProductShare * size.flops_per_second) + sweeps +
                          kPerStoredNumber * stored;
  return result;
}

SolverEstimate estimate_multigrid(const SolveSize& size, int width) {
  const double dofs = 3.0 * size.rows, stored = 3.0 * size.stored_rows;
  SolverEstimate result;
  result.width = width;
  result.bytes = kMultigridBytesPerBlock * size.blocks + width * (8 * 8 * dofs + 2 * 4 * stored);
  result.setup_seconds = kMultigridSetup * size.blocks;
  result.column_seconds =
      kMultigridProducts * 18 * size.blocks / (kProductShare * size.flops_per_second) + kPerStoredNumber * stored;
  return result;
}

double seconds_of(const SolverEstimate& estimate, double columns, int ranks, int here, bool shares) {
  const double divided = estimate.divided_setup_seconds, together = 1 + kFactorGain * (here - 1);
  const double setup = estimate.setup_seconds - (shares ? divided - divided / together : 0);
  return setup + std::ceil(columns / ranks) * estimate.column_seconds;
}

double slowdown_of(int here) {
  return 1 + kShared * (here - 1);
}

std::string bytes_text(double bytes) {
  return bytes < 1e9 ? fmt::format("{:.0f} MB", bytes / 1e6) : fmt::format("{:.2f} GB", bytes / 1e9);
}

std::string seconds_text(double seconds) {
  if (seconds < 100) return fmt::format("{:.2g} s", seconds);
  if (seconds < 6000) return fmt::format("{:.0f} min", seconds / 60);
  return fmt::format("{:.1f} h", seconds / 3600);
}

}  // namespace palpate
