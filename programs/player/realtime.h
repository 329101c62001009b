// Plays a scene in real time on two threads: touch at the rate of a haptic device, shape at the scene's rate.
#pragma once

#include <string>
#include <vector>

#include "programs/player/player.h"
#include "programs/player/scene_warnings.h"
#include "programs/player/timed_loop.h"

namespace palpate {

struct RealtimeRun {
  double rate = 0, seconds = 0;  // Hz of touch, s
  LoopTiming touch, shape;
  FlagCounts touch_flags, shape_flags;
  std::vector<double> deform;  // us, of each solve beside the touch
  std::vector<double> age;     // us, from the publishing of the contacts to the end of the shape made of them
  double longest_gap = 0;      // us, the longest time a thread that only reads the clock was stopped, in half a second
  double taken_away = 0;       // share of that half second in gaps above 5 us
  std::string memory;          // "locked", or why not
};

// Plays the scene over and over for `seconds`, touch at `rate` Hz, shape at the scene's rate; under large deformation beside the touch a
// third thread solves the body as often as it can. First it
// reads everything that the loops use into memory and locks it there, and asks for SCHED_FIFO for both threads; the result
// says what the system refused. A loop that is late skips the steps that it has missed.
RealtimeRun run_realtime(Player& player, double rate, double seconds);

std::string realtime_table(const RealtimeRun& run);

// The library's warnings of the scene, and the step flags that were raised, a sentence each.
std::vector<std::string> realtime_warnings(const std::vector<RealtimeRun>& runs, const Player& player);

// JSON text of summary.json: one entry per run, and the warnings.
std::string realtime_summary(const std::vector<RealtimeRun>& runs, const Player& player,
                             const std::filesystem::path& bundle);

}  // namespace palpate
