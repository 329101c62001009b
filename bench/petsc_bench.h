#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "precompute/solver/petsc_session.h"

namespace palpate::bench {

// Calls run(words before "--") in a PETSc session with the options after "--". Returns 2 if there are fewer than `least`
// words.
template <class Run>
int petsc_bench(int argc, char** argv, std::size_t least, const char* usage, Run run) {
  int own = 1;
  while (own < argc && std::strcmp(argv[own], "--") != 0) ++own;
  const std::vector<std::string> words(argv + 1, argv + own), options(argv + std::min(own + 1, argc), argv + argc);
  if (words.size() < least) {
    fmt::print(stderr, "usage: {}\n", usage);
    return 2;
  }
  const PetscSession session(options);
  run(words);
  return 0;
}

}  // namespace palpate::bench
