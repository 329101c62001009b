// The half that draws: the newest contacts that came, as a shape, at the scene's rate.
#pragma once

#include <functional>

#include "programs/link/contacts_receiver.h"
#include "programs/player/player.h"
#include "programs/player/timed_loop.h"

namespace palpate {

struct DrawOptions {
  double seconds = 0;    // 0: until the sender has stopped
  double silence = 0.5;  // s without fresh contacts after which that is said
};

struct DrawRun {
  LoopTiming shape;
  LinkCounts link;
  std::vector<double> way_us;  // of the datagrams taken, from their sending to their coming; needs clocks that agree
  std::vector<double> age_us;  // of the contacts drawn, from their sending to the end of their shape
  std::uint64_t shapes = 0;    // drawn: contacts that came since the one before
  std::uint64_t held = 0;      // times nothing new had come, and the shape stayed as it was
  std::uint64_t silences = 0;
  double longest_silence = 0;  // s
  bool ended = false;          // the sender said that it stops
};

// player: of the half `shape`. listening: a bound datagram socket. A thread of its own takes what comes, so that a slow
// shape never lets the system's buffer fill with old contacts. on_shape is called for every shape drawn, say for a
// line on a silence and on its end.
DrawRun draw(Player& player, std::uint64_t bundle, int listening, const DrawOptions& options,
             const std::atomic<bool>* stop, const std::function<void(const ShapeRecord&)>& on_shape,
             const std::function<void(const std::string&)>& say);

std::string draw_table(const DrawRun& run);

// JSON text of summary.json.
std::string draw_summary(const DrawRun& run, const Player& player, int shapes_written);

}  // namespace palpate
