// Programs as their users run them, and what they said.
#pragma once

#include <sys/wait.h>

#include <cstdlib>

#include "tests/support/test_files.h"

namespace palpate::tests {

struct ProgramRun {
  int code = -1;  // of the exit, or minus the signal
  std::string out, errors;
};

// A shell's command, run in the folder; what it says lies there as stdout.txt and stderr.txt.
inline ProgramRun run_in(const std::filesystem::path& folder, const std::string& command) {
  const int status =
      std::system(("cd '" + folder.string() + "' && " + command + " > stdout.txt 2> stderr.txt").c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status), file_bytes(folder / "stdout.txt"),
          file_bytes(folder / "stderr.txt")};
}

}  // namespace palpate::tests
