// Runs programs by a shell command and keeps their output.
#pragma once

#include <sys/wait.h>

#include <cstdlib>

#include "tests/support/test_files.h"

namespace palpate::tests {

struct ProgramRun {
  int code = -1;  // exit code, or minus the signal's number
  std::string out, errors;
};

// Runs a shell command in the folder and writes its output there: stdout.txt and stderr.txt.
inline ProgramRun run_in(const std::filesystem::path& folder, const std::string& command) {
  const int status =
      std::system(("cd '" + folder.string() + "' && " + command + " > stdout.txt 2> stderr.txt").c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status), file_bytes(folder / "stdout.txt"),
          file_bytes(folder / "stderr.txt")};
}

}  // namespace palpate::tests
