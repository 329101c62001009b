#pragma once

#include <ctime>

namespace palpate::bench {

// Of all threads of this process, s: what other programs on the machine take does not count.
inline double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace palpate::bench
