#include "formats/processor_limit.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <vector>

namespace palpate {
namespace {

// What the signal handler reads. While text is null the handler does nothing.
std::atomic<double> limit_seconds{0};
std::atomic<const char*> last_line{nullptr};
std::vector<char> line;

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

// Calls only functions that a signal handler may call: getrusage is a plain system call on Linux.
void end_when_over(int) {
  const char* text = last_line.load();
  if (text == nullptr || processor_seconds() < limit_seconds.load()) return;
  for (std::size_t left = std::strlen(text); left > 0;) {
    const ssize_t sent = write(STDERR_FILENO, text, left);
    if (sent <= 0) break;
    text += sent, left -= static_cast<std::size_t>(sent);
  }
  _exit(1);
}

void tick(int microseconds) {
  const itimerval period = {{0, microseconds}, {0, microseconds}};
  setitimer(ITIMER_PROF, &period, nullptr);
}

}  // namespace

double processor_seconds() {
  double sum = 0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    getrusage(who, &usage);
    sum += seconds(usage.ru_utime) + seconds(usage.ru_stime);
  }
  return sum;
}

ProcessorLimit::ProcessorLimit(std::string name, double limit, const std::string& sentence) : name_(std::move(name)) {
  change(limit, sentence);
  struct sigaction action {};
  action.sa_handler = end_when_over;
  action.sa_flags = SA_RESTART;
  sigaction(SIGPROF, &action, nullptr);
  tick(100'000);
}

ProcessorLimit::~ProcessorLimit() {
  tick(0);
  last_line = nullptr;
}

void ProcessorLimit::change(double limit, const std::string& sentence) {
  last_line = nullptr;
  std::string text = fmt::format("{}: {}", name_, sentence);
  std::replace(text.begin(), text.end(), '\n', ' ');
  line.assign(text.begin(), text.end());
  line.insert(line.end(), {'\n', '\0'});
  limit_seconds = limit;
  last_line = line.data();
}

}  // namespace palpate
