// Runs palpate-tetrahedra as users do; it must end with that code, unless it is -1. CMake sets PALPATE_TETRAHEDRA_PROGRAM.
#pragma once

#include "tests/support/program_run.h"

namespace palpate::tests {

inline ProgramRun run_tetrahedra(const std::filesystem::path& folder, const std::string& arguments, int code = 0) {
  const ProgramRun run = run_in(folder, std::string(PALPATE_TETRAHEDRA_PROGRAM) + " " + arguments);
  EXPECT_TRUE(code == -1 || run.code == code) << arguments << ": " << run.code << "\n" << run.errors;
  return run;
}

}  // namespace palpate::tests
