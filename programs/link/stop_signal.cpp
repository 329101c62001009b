#include "programs/link/stop_signal.h"

#include <signal.h>

namespace palpate {
namespace {

std::atomic<bool> stopped{false};
static_assert(std::atomic<bool>::is_always_lock_free);  // safe in a handler

void stop(int) {
  stopped.store(true);
}

}  // namespace

std::atomic<bool>& stop_on_signal() {
  struct sigaction action = {};
  action.sa_handler = &stop;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  return stopped;
}

}  // namespace palpate
