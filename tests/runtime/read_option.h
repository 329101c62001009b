// The options of programs that play random scenes.
#pragma once

#include <cstdio>
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

// What each of these programs takes.
struct PlayOptions {
  long long steps, scene_steps, seed = 0;

  bool read(const char* argument) {
    return read_option(argument, "--steps=", &steps) || read_option(argument, "--seed=", &seed) ||
           read_option(argument, "--scene-steps=", &scene_steps);
  }
  // False, and a sentence: a scene has no steps, or too many.
  bool check() const {
    if (scene_steps >= 1 && scene_steps <= 1000000) return true;
    std::fprintf(stderr, "--scene-steps: expected 1 .. 1000000\n");
    return false;
  }
};

}  // namespace palpate::tests
