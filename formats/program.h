// What the libraries of every offline program share: lines on stderr, a progress bar, a file's SHA-256.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace palpate {

// A bar with the time left, redrawn ten times a second, where stderr is a terminal. Elsewhere one line at each tenth of
// the work, at most one line a second, and always the last one.
class Progress {
 public:
  // begun: how much of total an earlier run has done; the time left does not count it.
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

// One line on stderr, lost where stderr takes nothing: the text, "note: text", "warning: text". After set_quiet(true), which
// --quiet calls, only warnings appear, and no progress.
void say(const std::string& text);
void note(const std::string& text);
void warn(const std::string& text);
void set_quiet(bool on);

// The texts of all warnings so far, in their order: for reports in files, and for --strict. Any thread may warn.
std::vector<std::string> warnings();
void forget_warnings();

// The last line of a program that fails: "NAME: text". Line ends within the text become spaces.
void say_failure(const std::string& name, std::string text);

// "42 s", "3 min 05 s", "2 h 07 min".
std::string duration_text(double seconds);

// SHA-256 of a file, lower-case hexadecimal, as sha256sum prints it. Errors: InputError when it cannot be read.
std::string sha256_of_file(const std::string& file);

}  // namespace palpate
