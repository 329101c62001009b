// Shared by the tests that run palpate-precompute: the files of a box, and ways to start and stop the program.
// PALPATE_PRECOMPUTE is its path.
#pragma once

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

#include "formats/bundle_reader.h"
#include "tests/support/box_files.h"
#include "tests/support/program_run.h"

namespace palpate::tests {

inline formats::BundleIndex index_of(const std::string& bytes) {
  formats::BundleIndex index;
  formats::BundleError error;
  EXPECT_EQ(formats::read_bundle_index(bytes.data(), bytes.size(), &index, &error), formats::BundleStatus::ok)
      << error.text;
  return index;
}

// The numbers of a section; empty where the bundle does not have it.
template <class Value>
std::vector<Value> section(const std::string& bytes, formats::SectionId id) {
  const auto index = index_of(bytes);
  const auto* entry = formats::find_section(index, id);
  std::vector<Value> values;
  if (!entry) return values;
  values.resize(entry->bytes / sizeof(Value));
  std::memcpy(values.data(), bytes.data() + entry->offset, entry->bytes);
  return values;
}

inline std::string text_section(const std::string& bytes, formats::SectionId id) {
  const auto text = section<char>(bytes, id);
  return {text.begin(), text.end()};
}

class ProgramFixture : public ::testing::Test {
 protected:
  void SetUp() override {
    // Open MPI starts as root only with both variables.
    ::setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
    ::setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
    ::setenv("HWLOC_COMPONENTS", "-gl", 1);  // Open MPI must not search for X servers
    folder_ = fresh_folder();
    write_box_files(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) { std::ofstream(folder_ / name) << text; }

  // Runs the program on the files of the box. Returns the exit code; said_ is what it printed.
  int run(const std::string& bundle, const std::string& more = "", int ranks = 0) {
    const std::string command = arguments(bundle, more);
    return execute(ranks > 0 ? kLaunch + " -n " + std::to_string(ranks) + " " + command : command);
  }

  // The bundle's bytes, from a run that must end well.
  std::string made(const std::string& bundle, const std::string& more = "", int ranks = 0) {
    EXPECT_EQ(run(bundle, more, ranks), 0) << said_;
    return file_bytes(folder_ / bundle);
  }

  // Runs two ranks, of which the second has more options.
  int run_unlike(const std::string& bundle, const std::string& more_of_second) {
    return execute(kLaunch + " -n 1 " + arguments(bundle, "") + " : -n 1 " + arguments(bundle, more_of_second));
  }

  static std::string arguments(const std::string& bundle, const std::string& more) {
    return std::string(PALPATE_PRECOMPUTE) + " box.msh --boundary bc.toml -o " + bundle +
           (more.find("--organ") == std::string::npos ? " --organ organ.toml " : " ") + more;
  }

  int execute(const std::string& command) {
    const ProgramRun ended = run_in(folder_, command);
    said_ = ended.errors + ended.out;
    return ended.code;
  }

  // Starts a run that takes seconds (a finer box, a slow preconditioner) and returns when its first columns are
  // written.
  pid_t start_slow(const std::string& bundle, const std::string& more = "") {
    write_mesh(folder_ / "box.msh", box_mesh({12, 10, 8}, {60, 50, 40}, 0.15));
    std::filesystem::remove(folder_ / (bundle + ".journal"));
    const std::string command = "cd '" + folder_.string() + "' && exec " + arguments(bundle, more) +
                                " --batch 8 -- -column_pc_type jacobi -ksp_rtol 1e-14 2> slow.txt";
    const pid_t child = ::fork();
    if (child == 0) {
      ::execl("/bin/sh", "sh", "-c", command.c_str(), static_cast<char*>(nullptr));
      ::_exit(127);
    }
    const auto has_record = [&] {
      const std::string journal = file_bytes(folder_ / (bundle + ".journal"));
      std::uint64_t fingerprint_bytes = 0;    // after 8 bytes that name the format
      if (journal.size() < 24) return false;  // the header
      std::memcpy(&fingerprint_bytes, &journal[8], 8);
      const std::uint64_t records =
          (24 + fingerprint_bytes + 4095) / 4096 * 4096;  // from the page after the fingerprint on
      return fingerprint_bytes > 0 && journal.find_first_not_of('\0', records) != std::string::npos;
    };
    for (int wait = 0; wait < 10000 && !has_record(); ++wait) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return child;
  }

  // Sends the signal and waits. Returns the signal by which the process ended, 0 where it had ended before.
  static int stop(pid_t child, int signal) {
    ::kill(child, signal);
    int status = 0;
    ::waitpid(child, &status, 0);
    return WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  }

  bool nothing_left(const std::string& bundle) {
    for (const char* ending : {"", ".part", ".part.new", ".journal"})
      if (std::filesystem::exists(folder_ / (bundle + ending))) return false;
    return true;
  }

  const std::string kLaunch = "mpiexec --oversubscribe --bind-to none";
  std::filesystem::path folder_;
  std::string said_;
};

}  // namespace palpate::tests
