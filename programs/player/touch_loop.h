// The loop of the thread that touches: for palpate-run --realtime, palpate-feel and palpate-igtl.
#pragma once

#include "programs/player/player.h"
#include "programs/player/scene_warnings.h"
#include "programs/player/timed_loop.h"

namespace palpate {

struct TouchLoop {
  Player& player;
  LoopTiming& timing;  // what is measured
  FlagCounts& flags;
  double rate;  // Hz
  std::uint64_t steps;
  LateSteps late = LateSteps::left_out;
  const std::atomic<bool>* stop = nullptr;
};

// Resets the scene, asks for SCHED_FIFO, and makes a step whenever one is due, from `start` on. move(index, before) places the tools of
// step `index`, the one after step `before`; slot() tells where the contacts go, of contacts_bytes; made(index, end) has them,
// `end` being when the step ended.
template <typename Move, typename Slot, typename Made>
void run_touch_loop(const TouchLoop& loop, Nanoseconds start, std::size_t contacts_bytes, const Move& move,
                    const Slot& slot, const Made& made) {
  palpate_scene_reset(loop.player.runtime_scene());
  loop.timing.scheduling = ask_for_fifo(80);
  std::uint64_t before = 0;
  run_loop(loop.timing, start, loop.rate, loop.steps, loop.late, loop.stop, [&](std::uint64_t index) {
    move(index, before);
    palpate_contacts* const contacts = slot();
    const Nanoseconds begin = now();
    loop.flags.add(
        loop.player.touch(static_cast<double>(index - before + (index == 0)) / loop.rate, contacts, contacts_bytes));
    const Nanoseconds end = now();
    before = index;
    made(index, end);
    return end - begin;
  });
}

}  // namespace palpate
