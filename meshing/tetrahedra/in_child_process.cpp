#include "meshing/tetrahedra/in_child_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>

#include "formats/errors.h"
#include "meshing/tetrahedra/repeatable_heap.h"

namespace palpate {
namespace {

enum Verdict : char { done = 'd', input_error = 'i', operation_error = 'o' };

void write_all(int descriptor, const std::string& bytes) {
  for (std::size_t sent = 0; sent < bytes.size();) {
    const ssize_t n = write(descriptor, bytes.data() + sent, bytes.size() - sent);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) _exit(1);
    sent += static_cast<std::size_t>(n);
  }
}

[[noreturn]] void be_the_child(int descriptor, const std::function<std::string()>& work, double processor_limit) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // the kernel kills the child when the program ends
  const rlimit no_core = {0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  for (const int signal : {SIGSEGV, SIGABRT, SIGFPE, SIGBUS, SIGILL, SIGPROF}) std::signal(signal, SIG_DFL);
  if (processor_limit > 0) {  // counts from the fork; the kernel then sends SIGPROF
    const double seconds = std::floor(processor_limit);
    const itimerval limit = {{0, 0},
                             {static_cast<time_t>(seconds),
                              std::max<suseconds_t>(1, static_cast<suseconds_t>(1e6 * (processor_limit - seconds)))}};
    setitimer(ITIMER_PROF, &limit, nullptr);
  }
  const int silence = open("/dev/null", O_WRONLY);
  dup2(silence, STDOUT_FILENO);
  dup2(silence, STDERR_FILENO);
  std::string answer;
  try {
    use_repeatable_heap();
    answer = static_cast<char>(done) + work();
  } catch (const InputError& error) {
    answer = static_cast<char>(input_error) + std::string(error.what());
  } catch (const std::bad_alloc&) {
    answer = static_cast<char>(operation_error) + std::string("out of memory");
  } catch (const std::exception& error) {
    answer = static_cast<char>(operation_error) + std::string(error.what());
  } catch (const std::string& error) {  // gmsh throws these
    answer = static_cast<char>(operation_error) + error;
  } catch (...) {
    answer = static_cast<char>(operation_error) + std::string("unknown exception");
  }
  write_all(descriptor, answer);
  _exit(0);
}

// Reads all that the child writes until it closes the pipe. Returns false when the time runs out first.
bool read_until_closed(int descriptor, double time_limit, std::string& bytes) {
  using Clock = std::chrono::steady_clock;
  const auto deadline =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(time_limit));
  std::string buffer(1 << 16, '\0');
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    if (left <= 0) return false;
    pollfd waiting = {descriptor, POLLIN, 0};
    const int ready = poll(&waiting, 1, static_cast<int>(std::min<long long>(left, 1000)));
    if (ready < 0 && errno != EINTR) throw OperationError(fmt::format("poll failed: {}", std::strerror(errno)));
    if (ready <= 0) continue;
    const ssize_t n = read(descriptor, buffer.data(), buffer.size());
    if (n == 0) return true;
    if (n < 0 && errno != EINTR) throw OperationError(fmt::format("read failed: {}", std::strerror(errno)));
    if (n > 0) bytes.append(buffer.data(), static_cast<std::size_t>(n));
  }
}

}  // namespace

std::string run_in_child(const std::string& what, double time_limit, const std::function<std::string()>& work,
                         double processor_limit) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw OperationError(fmt::format("pipe failed: {}", std::strerror(errno)));
  std::fflush(nullptr);  // otherwise the child would print our buffered output a second time
  const pid_t child = fork();
  if (child < 0) throw OperationError(fmt::format("fork failed: {}", std::strerror(errno)));
  if (child == 0) {
    close(ends[0]);
    be_the_child(ends[1], work, processor_limit);
  }
  close(ends[1]);
  std::string answer;
  const bool finished = read_until_closed(ends[0], time_limit, answer);
  close(ends[0]);
  if (!finished) kill(child, SIGKILL);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!finished)
    throw OutOfTime(
        fmt::format("{} did not finish within {:g} s and was stopped; give it longer with --time-limit, "
                    "or ask for larger elements",
                    what, time_limit));
  if (processor_limit > 0 && WIFSIGNALED(status) && WTERMSIG(status) == SIGPROF)
    throw OutOfTime(
        fmt::format("{} did not finish within {:.2g} s of processor time and was stopped", what, processor_limit));
  if (WIFSIGNALED(status))
    throw OperationError(fmt::format("{} crashed ({}); its input passed our checks, so please report it with the input",
                                     what, strsignal(WTERMSIG(status))));
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || answer.empty())
    throw OperationError(fmt::format("{} ended without an answer (exit status {})", what, WEXITSTATUS(status)));
  const std::string rest = answer.substr(1);
  if (answer[0] == input_error) throw InputError(rest);
  if (answer[0] == operation_error) throw OperationError(fmt::format("{} failed: {}", what, rest));
  return rest;
}

}  // namespace palpate
