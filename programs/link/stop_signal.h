// Ctrl-C and SIGTERM as a flag, so that a program that runs until it is told to can still write its report.
#pragma once

#include <atomic>

namespace palpate {

// True once one of the two signals has come. From the first call on they no longer end the program; a second one does.
std::atomic<bool>& stop_on_signal();

}  // namespace palpate
