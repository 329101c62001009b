// What every program has in common: --help, --version, exit codes, log and progress.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <string>

namespace palpate {

// Parses with CLI11 and runs body. Adds --version and --quiet (errors and warnings only). Returns the exit code: 0 done, 1 OperationError (and std::bad_alloc, unknown
// exceptions), 2 InputError or bad usage, 3 VerificationError. One sentence goes to stderr, prefixed "NAME: ".
// define gets the app to add options to; body runs after a successful parse. A number that is not finite is refused in any
// option.
int run_program(int argc, char** argv, const std::string& name, const std::string& description,
                const std::function<void(CLI::App&)>& define, const std::function<void()>& body);

// For an option's check(): a number above 0; or 0 too.
CLI::Validator positive_number();
CLI::Validator non_negative_number();

// A progress bar with time left on a terminal; elsewhere plain lines at tenths, at most one a second and the last. stderr.
class Progress {
 public:
  // begun: how much of total was done before.
  explicit Progress(std::string what, std::uint64_t total, std::uint64_t begun = 0);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void advance(std::uint64_t by = 1);

 private:
  std::string what_;
  std::uint64_t total_, begun_, done_;
  double started_ = 0, shown_ = 0;
  int tenth_ = -1;
  bool terminal_ = false;
};

// Lines for the reader on stderr: as it is, "note: ..." and "warning: ...". --quiet leaves the last alone.
void say(const std::string& text);
void note(const std::string& text);
void warn(const std::string& text);

// The line of a program that ends badly: "NAME: text".
void say_failure(const std::string& name, std::string text);

// "42 s", "3 min 05 s", "2 h 07 min".
std::string duration_text(double seconds);

// SHA-256 of a file, lower-case hexadecimal, as sha256sum prints it. Errors: InputError when it cannot be read.
std::string sha256_of_file(const std::string& file);

}  // namespace palpate
