// Runs the programs on a small box, as users do. CMake defines PALPATE_PRECOMPUTE and the like as their paths.
#pragma once

#include <cstdlib>
#include <fstream>
#include <regex>

#include "tests/support/box_files.h"
#include "tests/support/program_run.h"

namespace palpate::tests {

class Programs {
 public:
  Programs() : folder_(fresh_folder()) {
    // Open MPI starts as root only with both variables.
    ::setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
    ::setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
    ::setenv("HWLOC_COMPONENTS", "-gl", 1);  // Open MPI must not search for X servers
    write_mesh(folder_ / "box.msh", mesh());
    write("organ.toml", organ());
    write("bc.toml", kBoundary);
  }
  ~Programs() { std::filesystem::remove_all(folder_); }

  const std::filesystem::path& folder() const { return folder_; }
  static TetrahedralMesh mesh() { return box_mesh({3, 2, 2}, {60, 50, 40}, 0.15); }
  static std::string organ() { return kOrgan; }
  void write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }

  // A program that hangs is ended after a minute.
  ProgramRun execute(const std::string& command) { return run_in(folder_, "timeout 60 " + command); }
  ProgramRun precompute(const std::string& bundle, const std::string& more = "") {
    for (const char* ending : {"", ".part", ".journal"}) std::filesystem::remove(folder_ / (bundle + ending));
    return execute(std::string(PALPATE_PRECOMPUTE) + " box.msh --organ organ.toml --boundary bc.toml -o " + bundle +
                   " --quiet " + more);
  }
  bool verifies(const std::string& bundle) {
    return execute(std::string(PALPATE_BUNDLE) + " verify " + bundle +
                   " --mesh box.msh --organ organ.toml --boundary bc.toml")
               .code == 0;
  }
  ProgramRun run(const std::string& arguments) { return execute(std::string(PALPATE_RUN) + " " + arguments); }

  bool left_anything(const std::string& output) const {
    for (const char* ending : {"", ".part", ".part.new", ".journal"})
      if (std::filesystem::exists(folder_ / (output + ending))) return true;
    return false;
  }
  // True if no table and no report of a run contains NaN or an infinity.
  bool holds_only_numbers(const std::string& output) const {
    const std::regex none("(^|[^a-z])-?(nan|inf)([^a-z]|$)", std::regex::icase);
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_ / output))
      if (entry.path().extension() == ".csv" || entry.path().extension() == ".json")
        if (std::regex_search(file_bytes(entry.path()), none)) return false;
    return true;
  }

 private:
  std::filesystem::path folder_;
};

}  // namespace palpate::tests
