// What a solve will cost, and so which preconditioner serves it.
#pragma once

#include <cstdint>
#include <string>

namespace palpate {

// Predicted from the number of block rows and blocks alone, before anything is ordered or factored.
struct SolverPrediction {
  double factor_bytes = 0;      // peak while factoring with CHOLMOD
  double factor_seconds = 0;    // one rank
  double cholesky_seconds = 0;  // all columns, one core
  double multigrid_seconds = 0;
  double other_bytes = 0;  // the matrix, its copies and the blocks of columns
};
SolverPrediction predict_solver(std::int64_t rows, std::int64_t blocks, std::int64_t columns, int width);

struct SolverChoice {
  bool cholesky = true;
  std::string sentence;  // what was chosen and why, with the figures
};
// available_bytes: what this process may take. ranks share the columns.
SolverChoice choose_solver(const SolverPrediction& prediction, double available_bytes, int ranks);

// Memory that can be had on this machine now (the smaller of MemAvailable and the control group's limit), divided among
// the processes of this program that run on it.
double available_memory_bytes(int processes_here);

}  // namespace palpate
