// The loop of programs that play random scenes for a number of steps.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <string>

namespace palpate::tests {

// Plays one scene for each seed, from `seed` on, until *done reaches `steps`. play(seed, steps of this scene, told): adds to *done, and calls
// told with a sentence for each find. tell(seconds so far): prints what there is, every 10 s and at the end. Returns whether there was
// a find; the first seed with one is printed.
template <typename Play, typename Tell>
bool play_seeds(long long seed, long long steps, long long scene_steps, const long* done, const Play& play,
                const Tell& tell) {
  long long first_failing = -1;
  double told = 0;
  const auto start = std::chrono::steady_clock::now();
  const auto seconds = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(); };
  for (long long at = seed; *done < steps; ++at) {
    play(static_cast<std::uint64_t>(at), static_cast<int>(std::min<long long>(scene_steps, steps - *done)),
         [&](const std::string& sentence) {
           if (first_failing < 0) first_failing = at;
           std::printf("%s\n", sentence.c_str());
         });
    if (seconds() < told + 10) continue;
    told = seconds();
    tell(told);
    std::fflush(stdout);
  }
  tell(seconds());
  if (first_failing >= 0) std::printf("first failing seed: %lld\n", first_failing);
  return first_failing >= 0;
}

}  // namespace palpate::tests
