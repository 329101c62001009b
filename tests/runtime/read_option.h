// The options of programs that play random scenes.
#pragma once

#include <cstdlib>
#include <cstring>

namespace palpate::tests {

// The number of --name=NUMBER; false where the argument is another one or has no whole number of 0 or more.
inline bool read_option(const char* argument, const char* name, long long* value) {
  const std::size_t length = std::strlen(name);
  if (std::strncmp(argument, name, length) != 0) return false;
  char* end = nullptr;
  const long long number = std::strtoll(argument + length, &end, 10);
  if (end == argument + length || *end != 0 || number < 0) return false;
  *value = number;
  return true;
}

}  // namespace palpate::tests
