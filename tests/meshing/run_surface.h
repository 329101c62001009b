// Runs palpate-surface as users do; it must end with that code, unless it is -1. CMake sets PALPATE_SURFACE_PROGRAM.
#pragma once

#include "tests/support/program_run.h"

namespace palpate::tests {

inline ProgramRun run_surface(const std::filesystem::path& folder, const std::string& arguments, int code = 0) {
  const ProgramRun run = run_in(folder, std::string(PALPATE_SURFACE_PROGRAM) + " " + arguments);
  EXPECT_TRUE(code == -1 || run.code == code) << arguments << ": " << run.code << "\n" << run.errors;
  return run;
}

}  // namespace palpate::tests
