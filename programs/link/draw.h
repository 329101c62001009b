// The half that draws: computes the shape of the newest contacts, at the scene's rate.
#pragma once

#include <functional>

#include "programs/link/contacts_receiver.h"
#include "programs/player/player.h"
#include "programs/player/scene_warnings.h"
#include "programs/player/timed_loop.h"

namespace palpate {

struct DrawOptions {
  double seconds = 0;    // 0: until the sender has stopped
  double silence = 0.5;  // s without fresh contacts after which that is said
};

struct DrawRun {
  LoopTiming shape;
  FlagCounts flags;
  LinkCounts link;
  std::vector<double> way_us;  // of the datagrams taken, from their sending to their coming; needs clocks that agree
  std::vector<double> age_us;  // of the contacts drawn, from their sending to the end of their shape
  std::uint64_t shapes = 0;    // drawn: contacts that came since the one before
  std::uint64_t held = 0;      // times nothing new had come, and the shape stayed as it was
  std::uint64_t silences = 0;
  double longest_silence = 0;  // s
  bool ended = false;          // the sender said that it stops
};

// player: of the half `shape`. listening: a bound datagram socket. A thread of its own receives the datagrams, so that
// old contacts do not fill the system's buffer while a shape is computed. on_shape is called for each shape; say is called
// with a line for the user when no datagram comes for a while, and when one comes again.
DrawRun draw(Player& player, std::uint64_t bundle, int listening, const DrawOptions& options,
             const std::atomic<bool>* stop, const std::function<void(const ShapeRecord&)>& on_shape,
             const std::function<void(const std::string&)>& say);

std::string draw_table(const DrawRun& run);

// JSON text of summary.json, with the warnings of the program so far.
std::string draw_summary(const DrawRun& run, const Player& player, int shapes_written);

}  // namespace palpate
