#include "formats/program.h"

#include <fmt/format.h>
#include <openssl/evp.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <memory>
#include <mutex>
#include <vector>

#include "formats/errors.h"

namespace palpate {

namespace {

bool quiet = false;

std::mutex warned_mutex;
std::vector<std::string> warned;

double seconds_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// What stderr does not take is lost: nobody can be told of it, and the results are elsewhere.
void print_error(const std::string& text) {
  static_cast<void>(std::fwrite(text.data(), 1, text.size(), stderr));
}

// Whether the cursor is behind a progress bar: another line must then begin with a line end.
bool bar_is_open = false;
void close_bar() {
  if (bar_is_open) print_error("\n");
  bar_is_open = false;
}

}  // namespace

void set_quiet(bool on) {
  quiet = on;
}

Progress::Progress(std::string what, std::uint64_t total, std::uint64_t begun)
    : what_(std::move(what)),
      total_(total),
      begun_(begun),
      done_(begun),
      started_(seconds_now()),
      shown_(started_),
      terminal_(::isatty(STDERR_FILENO) == 1) {
  if (terminal_) advance(0);
}

Progress::~Progress() {
  if (terminal_) close_bar();
}

void Progress::advance(std::uint64_t by) {
  done_ += by;
  if (quiet) return;
  const double share = total_ == 0 ? 1.0 : std::min(1.0, static_cast<double>(done_) / static_cast<double>(total_));
  const double begun_share = total_ == 0 ? 0.0 : static_cast<double>(begun_) / static_cast<double>(total_);
  const double now = seconds_now();
  const int tenth = static_cast<int>(share * 10);
  // Ten bars a second on a terminal; elsewhere lines at tenths, one a second at most. The last is always shown.
  const bool early = terminal_ ? now - shown_ < 0.1 : tenth == tenth_ || now - shown_ < 1.0;
  if (done_ > begun_ && (share < 1.0 ? early : tenth == tenth_)) return;
  shown_ = now;
  tenth_ = tenth;

  const double spent = now - started_;
  const std::string rest = share >= 1.0      ? "took " + duration_text(spent)
                           : done_ == begun_ ? std::string("...")
                                             : duration_text(spent * (1.0 - share) / (share - begun_share)) + " left";
  if (!terminal_) {
    print_error(fmt::format("{}: {} % ({} of {}), {}\n", what_, 10 * tenth, std::min(done_, total_), total_, rest));
    return;
  }
  constexpr int kWidth = 30;
  const int filled = static_cast<int>(share * kWidth);
  print_error(fmt::format("\r{} [{:#>{}}{:.>{}}] {:3.0f} % {}\033[K", what_, "", filled, "", kWidth - filled,
                          100 * share, rest));
  std::fflush(stderr);
  bar_is_open = true;
}

void say(const std::string& text) {
  if (quiet) return;
  close_bar();
  print_error(fmt::format("{}\n", text));
}

void note(const std::string& text) {
  if (quiet) return;
  close_bar();
  print_error(fmt::format("note: {}\n", text));
}

void warn(const std::string& text) {
  close_bar();
  print_error(fmt::format("warning: {}\n", text));
  const std::lock_guard<std::mutex> lock(warned_mutex);
  warned.push_back(text);
}

std::vector<std::string> warnings() {
  const std::lock_guard<std::mutex> lock(warned_mutex);
  return warned;
}

void forget_warnings() {
  const std::lock_guard<std::mutex> lock(warned_mutex);
  warned.clear();
}

void say_failure(const std::string& name, std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  std::replace(text.begin(), text.end(), '\n', ' ');
  close_bar();
  print_error(fmt::format("{}: {}\n", name, text));
}

std::string duration_text(double seconds) {
  const auto whole = static_cast<std::uint64_t>(seconds + 0.5);
  if (whole < 60) return fmt::format("{} s", whole);
  if (whole < 3600) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
  return fmt::format("{} h {:02} min", whole / 3600, whole / 60 % 60);
}

std::string sha256_of_file(const std::string& file) {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> in(std::fopen(file.c_str(), "rb"), &std::fclose);
  if (!in) throw InputError(fmt::format("{}: cannot be read: {}", file, std::strerror(errno)));
  const std::unique_ptr<EVP_MD_CTX, void (*)(EVP_MD_CTX*)> state(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
  bool good = state && EVP_DigestInit_ex(state.get(), EVP_sha256(), nullptr) == 1;
  std::vector<unsigned char> buffer(1 << 20);
  for (std::size_t count; good && (count = std::fread(buffer.data(), 1, buffer.size(), in.get())) > 0;)
    good = EVP_DigestUpdate(state.get(), buffer.data(), count) == 1;
  if (std::ferror(in.get())) throw InputError(fmt::format("{}: cannot be read: {}", file, std::strerror(errno)));
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int digest_bytes = 0;
  if (!good || EVP_DigestFinal_ex(state.get(), digest, &digest_bytes) != 1)
    throw OperationError(fmt::format("{}: SHA-256 failed", file));
  std::string text;
  for (unsigned int i = 0; i < digest_bytes; ++i) text += fmt::format("{:02x}", digest[i]);
  return text;
}

}  // namespace palpate
