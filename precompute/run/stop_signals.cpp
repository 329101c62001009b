#include "precompute/run/stop_signals.h"

#include <signal.h>
#include <unistd.h>

#include <cstring>

namespace palpate {
namespace {

sigset_t watched() {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction action {};
    if (::sigaction(signal, nullptr, &action) == 0 && action.sa_handler != SIG_IGN) sigaddset(&set, signal);
  }
  return set;
}

// Ends the program by the signal itself, so that its parent (a shell, make) sees what ended it.
[[noreturn]] void end_by(int signal) {
  ::signal(signal, SIG_DFL);
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, signal);
  ::pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
  ::raise(signal);
  ::_exit(128 + signal);
}

}  // namespace

void block_stop_signals() {
  const sigset_t set = watched();
  ::pthread_sigmask(SIG_BLOCK, &set, nullptr);
}

StopSignals::StopSignals() : thread_([this] { watch(); }) {}

StopSignals::~StopSignals() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  ::pthread_kill(thread_.native_handle(), SIGTERM);
  thread_.join();
}

void StopSignals::on_stop(std::function<void(const std::string&)> farewell) {
  const std::lock_guard lock(mutex_);
  farewell_ = std::move(farewell);
}

void StopSignals::watch() {
  sigset_t set = watched();
  sigaddset(&set, SIGTERM);  // also how the destructor wakes this thread
  ::pthread_sigmask(SIG_BLOCK, &set, nullptr);
  int signal = 0;
  ::sigwait(&set, &signal);
  const std::lock_guard lock(mutex_);
  if (ending_) return;
  if (farewell_) farewell_(std::string("SIG") + ::sigabbrev_np(signal));
  end_by(signal);
}

}  // namespace palpate
