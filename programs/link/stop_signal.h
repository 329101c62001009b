// Ctrl-C and SIGTERM set a flag, so that a program that they stop can still write its report.
#pragma once

#include <atomic>

namespace palpate {

// True after one of the two signals. After the first call of this function the first signal does not end the program; a
// second one does.
std::atomic<bool>& stop_on_signal();

}  // namespace palpate
