// The host's log: sentences about opening and creating. A step writes none.
#pragma once

#include <cstdarg>
#include <cstdio>

#include "runtime/include/palpate/palpate.h"

namespace palpate {

struct Log {
  palpate_log write = nullptr;
  void* user = nullptr;

#if defined(__GNUC__)
  __attribute__((format(printf, 3, 4)))
#endif
  void
  say(palpate_log_level level, const char* format, ...) const {
    if (!write) return;
    char text[320];
    va_list arguments;
    va_start(arguments, format);
    std::vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    write(user, level, text);
  }
};

}  // namespace palpate
