// Runs palpate-surface as users do. CMake sets PALPATE_SURFACE_PROGRAM.
#pragma once

#include "tests/support/program_run.h"

namespace palpate::tests {

inline ProgramRun run_surface(const std::filesystem::path& folder, const std::string& arguments) {
  return run_in(folder, std::string(PALPATE_SURFACE_PROGRAM) + " " + arguments);
}

}  // namespace palpate::tests
