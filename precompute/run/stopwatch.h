// Adds the seconds from its construction to its destruction to a sum.
#pragma once

#include <mpi.h>

namespace palpate {

class Stopwatch {
 public:
  explicit Stopwatch(double* into) : into_(into), begun_(MPI_Wtime()) {}
  ~Stopwatch() { *into_ += MPI_Wtime() - begun_; }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  double* into_;
  double begun_;
};

}  // namespace palpate
