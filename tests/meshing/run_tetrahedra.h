// Runs palpate-tetrahedra as users do. CMake sets PALPATE_TETRAHEDRA_PROGRAM.
#pragma once

#include "tests/support/program_run.h"

namespace palpate::tests {

inline ProgramRun run_tetrahedra(const std::filesystem::path& folder, const std::string& arguments) {
  return run_in(folder, std::string(PALPATE_TETRAHEDRA_PROGRAM) + " " + arguments);
}

}  // namespace palpate::tests
