#include "precompute/solver_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>

namespace palpate {
namespace {

// A line such as "MemAvailable:   123 kB".
double memory_available() {
  std::ifstream file("/proc/meminfo");
  std::string key, unit;
  double kilobytes = 0;
  while (file >> key >> kilobytes && std::getline(file, unit))
    if (key == "MemAvailable:") return 1024 * kilobytes;
  return 4e9;
}

// What the control group leaves, where it limits memory at all.
double control_group_left() {
  std::ifstream limit("/sys/fs/cgroup/memory.max"), used("/sys/fs/cgroup/memory.current");
  double most = 0, now = 0;
  if (!(limit >> most) || !(used >> now)) return std::numeric_limits<double>::infinity();
  return std::max(0.0, most - now);
}

std::string gigabytes(double bytes) {
  return fmt::format("{:.2g} GB", bytes / 1e9);
}

std::string duration(double seconds) {
  if (seconds < 100) return fmt::format("{:.2g} s", seconds);
  if (seconds < 6000) return fmt::format("{:.0f} min", seconds / 60);
  return fmt::format("{:.1f} h", seconds / 3600);
}

}  // namespace

SolverPrediction predict_solver(std::int64_t rows, std::int64_t blocks, std::int64_t columns, int width) {
  SolverPrediction result;
  const double n = static_cast<double>(rows), c = static_cast<double>(columns);
  // Nested dissection of a solid: 33.8 million numbers in the factor of 20,000 vertices, and as n^1.52 from 1,700 to
  // 95,000 vertices; peak memory 12 to 23 bytes for each, of which 23 is taken.
  const double factor_numbers = 33.8e6 * std::pow(n / 20000, 1.52);
  result.factor_bytes = 23 * factor_numbers;
  result.factor_seconds = 2.7 * std::pow(n / 20000, 1.9);
  // Two triangular solves of 2 operations a number, at 13 Gflop/s for a block of columns.
  result.cholesky_seconds = result.factor_seconds + c * 4 * factor_numbers / 13e9;
  // To 1e-9 at nu 0.45, blocks of 32: 45 ms a column at 20,000 vertices (bench/multigrid.cpp).
  result.multigrid_seconds = c * 0.045 * std::pow(n / 20000, 1.17);
  // Blocks of ours and of PETSc's copy; x, r, p, w, b of the iteration, two transposed and two of the tensors.
  result.other_bytes = static_cast<double>(blocks) * (76 + 2 * 108) + 3 * n * width * 8 * 10;
  return result;
}

SolverChoice choose_solver(const SolverPrediction& p, double available_bytes, int ranks) {
  const double needed = p.factor_bytes + p.other_bytes;
  const bool fits = needed < 0.8 * available_bytes;
  const double cholesky = p.factor_seconds + (p.cholesky_seconds - p.factor_seconds) / ranks;
  SolverChoice choice;
  choice.cholesky = fits;
  choice.sentence =
      fits ? fmt::format("Cholesky factor as preconditioner: predicted {} of {} available, {}", gigabytes(needed),
                         gigabytes(available_bytes), duration(cholesky))
           : fmt::format(
                 "algebraic multigrid as preconditioner: the Cholesky factor is predicted to need {} of {} "
                 "available; predicted {} in place of {}",
                 gigabytes(needed), gigabytes(available_bytes), duration(p.multigrid_seconds / ranks),
                 duration(cholesky));
  if (ranks > 1) choice.sentence += fmt::format(", for each of {} ranks", ranks);
  return choice;
}

double available_memory_bytes(int processes_here) {
  return std::min(memory_available(), control_group_left()) / std::max(1, processes_here);
}

}  // namespace palpate
