// Kills runs of palpate-precompute at random moments, resumes them and compares the bytes of the bundles. Exit code 0
// where all are the same.
#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/box_files.h"
#include "tests/support/file_bytes.h"

namespace palpate::tests {
namespace {

using Clock = std::chrono::steady_clock;
namespace fs = std::filesystem;

struct Options {
  int kills = 10;
  unsigned seed = 1;
  std::string program, injector, mesh, organ, boundary;
  std::string more =
      "--batch 24 -- -column_pc_type jacobi -ksp_rtol 1e-14";  // slow, so that most random moments come while columns are solved
  fs::path folder;
};

double seconds_since(Clock::time_point begun) {
  return std::chrono::duration<double>(Clock::now() - begun).count();
}

// The parent of a process; 0 where the process has ended.
pid_t parent_of(pid_t process) {
  std::ifstream stat("/proc/" + std::to_string(process) + "/stat");
  std::string text{std::istreambuf_iterator<char>(stat), {}};
  const auto name_end = text.rfind(')');
  if (name_end == std::string::npos) return 0;
  char state = 0;
  pid_t parent = 0;
  if (std::sscanf(text.c_str() + name_end + 1, " %c %d", &state, &parent) != 2 || state == 'Z') return 0;
  return parent;
}

// The process itself, then all that it has started.
std::vector<pid_t> family_of(pid_t process) {
  std::vector<pid_t> family = {process};
  for (std::size_t i = 0; i < family.size(); ++i)
    for (const auto& entry : fs::directory_iterator("/proc")) {
      const pid_t other = std::atoi(entry.path().filename().c_str());
      if (other > 0 && parent_of(other) == family[i]) family.push_back(other);
    }
  return family;
}

class KillTest {
 public:
  explicit KillTest(const Options& options) : options_(options), random_(options.seed) {}

  int operator()() {
    const auto begun = Clock::now();
    if (finish("whole.h5", 1) != 0) throw std::runtime_error("the undisturbed run failed: " + said());
    whole_seconds_ = seconds_since(begun);
    whole_ = file_bytes(options_.folder / "whole.h5");
    batches_ = nlohmann::json::parse(file_bytes(options_.folder / "report.json"))["column_batches"];
    fmt::print("undisturbed: {:.2f} s, {} bytes, {} batches of columns\n", whole_seconds_, whole_.size(), batches_);
    int wrong = 0;
    while (killed_ < options_.kills) wrong += !one_bundle();
    fmt::print("{} runs killed, {} that ended before; {} bundles, {} of them with wrong bytes\n", killed_, survived_,
               bundles_, wrong);
    return wrong == 0 ? 0 : 1;
  }

 private:
  // Kills one to three runs on the same output, then lets one finish.
  bool one_bundle() {
    fs::remove(options_.folder / "x.h5");
    std::string story;
    for (int times = between(1, 3); times > 0 && killed_ < options_.kills; --times) story += kill_one() + ", ";
    const int ranks = between(1, 3);
    const int code = finish("x.h5", ranks);
    const bool clean = !fs::exists(options_.folder / "x.h5.part") && !fs::exists(options_.folder / "x.h5.journal");
    const bool held = code == 0 && clean && file_bytes(options_.folder / "x.h5") == whole_;
    const auto report = nlohmann::json::parse(file_bytes(options_.folder / "report.json"), nullptr, false);
    fmt::print("{}{} ranks finished from {} of {} blocks: {}\n", story, ranks,
               report.is_object() ? report["column_batches_of_earlier_runs"].dump() : "?",
               report.is_object() ? report["column_batches"].dump() : "?",
               held ? "same bytes" : "WRONG: " + (code == 0 ? std::string("other bytes or files left") : said()));
    std::fflush(stdout);
    ++bundles_;
    return held;
  }

  // Kills at a random moment, or at a random call on the files of the run, before the call or in the middle of a write.
  std::string kill_one() {
    const int ranks = between(1, 2), how = between(0, 3);
    const bool journal = between(0, 1) == 1;
    const std::string fault =
        how < 2 ? ""
                : fmt::format("{}:{}:{}", how == 2 ? "kill" : "torn",
                              journal ? between(1, batches_ / ranks + 6) : between(1, 60 + 2 * batches_ / ranks),
                              journal ? ".journal" : "x.h5");
    const pid_t child = start("x.h5", ranks, fault);
    if (fault.empty()) {
      const double moment = whole_seconds_ * std::uniform_real_distribution<>(0.2, 1.0)(random_);
      std::this_thread::sleep_for(std::chrono::duration<double>(moment));
      return fmt::format("{} ranks, {} at {:.2f} s", ranks, kill_some(child, ranks), moment);
    }
    const bool ended = wait(child) == 0;
    ++(ended ? survived_ : killed_);
    return fmt::format("{} ranks, {}{}", ranks, fault, ended ? " (not reached)" : "");
  }

  // Kills all processes, or with several ranks one of them at random; then waits until all have ended.
  std::string kill_some(pid_t child, int ranks) {
    const std::vector<pid_t> family = family_of(child);
    const int whom = ranks == 1 ? -1 : between(-1, static_cast<int>(family.size()) - 1);
    for (int i = 0; i < static_cast<int>(family.size()); ++i)
      if (whom < 0 || whom == i) ::kill(family[i], SIGKILL);
    const bool ended = wait(child) == 0;
    ++(ended ? survived_ : killed_);
    for (const pid_t process : family)
      for (int i = 0; i < 1000 && parent_of(process) > 0; ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return ended ? "ended before its kill" : whom < 0 ? "all killed" : fmt::format("process {} killed", whom);
  }

  pid_t start(const std::string& bundle, int ranks, const std::string& fault) {
    const std::string faulty =
        fault.empty() ? "" : "env PALPATE_FAULT=" + fault + " LD_PRELOAD=" + options_.injector + " ";
    const std::string launch = ranks > 1 ? fmt::format("mpiexec --oversubscribe --bind-to none -n {} ", ranks) : "";
    const std::string command = fmt::format(
        "cd '{}' && exec {}{}{} {} --organ {} --boundary {} -o {} --json report.json --quiet {} > said.txt 2>&1",
        options_.folder.string(), launch, faulty, options_.program, options_.mesh, options_.organ, options_.boundary,
        bundle, options_.more);
    const pid_t child = ::fork();
    if (child == 0) {
      ::execl("/bin/sh", "sh", "-c", command.c_str(), static_cast<char*>(nullptr));
      ::_exit(127);
    }
    return child;
  }

  static int wait(pid_t child) {
    int status = 0;
    ::waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

  int finish(const std::string& bundle, int ranks) {
    fs::remove(options_.folder / "report.json");
    return wait(start(bundle, ranks, ""));
  }

  int between(int least, int most) { return std::uniform_int_distribution<>(least, most)(random_); }
  std::string said() const { return file_bytes(options_.folder / "said.txt"); }

  Options options_;
  std::mt19937 random_;
  std::string whole_;
  double whole_seconds_ = 0;
  int batches_ = 0, killed_ = 0, survived_ = 0, bundles_ = 0;
};

int run(int argc, char** argv) {
  Options options;
  CLI::App app("Kills runs of palpate-precompute, resumes them and compares bytes");
  app.add_option("--program", options.program, "palpate-precompute")->required();
  app.add_option("--injector", options.injector, "the library of fault_injector.c")->required();
  app.add_option("--kills", options.kills, "runs to kill")->capture_default_str();
  app.add_option("--seed", options.seed, "of the random moments")->capture_default_str();
  auto* mesh = app.add_option("--mesh", options.mesh, "default: a box");
  app.add_option("--organ", options.organ)->needs(mesh);
  app.add_option("--boundary", options.boundary)->needs(mesh);
  CLI11_PARSE(app, argc, argv);
  ::setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
  ::setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
  ::setenv("HWLOC_COMPONENTS", "-gl", 1);  // Open MPI must not search for X servers
  options.folder = fs::temp_directory_path() / ("palpate_kill_test_" + std::to_string(::getpid()));
  fs::create_directories(options.folder);
  if (options.mesh.empty()) {
    write_box_files(options.folder);
    options.mesh = "box.msh", options.organ = "organ.toml", options.boundary = "bc.toml";
  } else {
    options.more = "--batch 8";
    for (auto* file : {&options.mesh, &options.organ, &options.boundary}) *file = fs::absolute(*file).string();
  }
  const int code = KillTest(options)();
  fs::remove_all(options.folder);
  return code;
}

}  // namespace
}  // namespace palpate::tests

int main(int argc, char** argv) {
  return palpate::tests::run(argc, argv);
}
