// palpate-surface as its users run it. PALPATE_SURFACE_PROGRAM is set by CMake.
#pragma once

#include "tests/support/program_run.h"

namespace palpate::tests {

inline ProgramRun run_surface(const std::filesystem::path& folder, const std::string& arguments) {
  return run_in(folder, std::string(PALPATE_SURFACE_PROGRAM) + " " + arguments);
}

}  // namespace palpate::tests
