// A server: clients move the scene's tools by OpenIGTLink and receive the surface and the forces.
#pragma once

#include <atomic>
#include <functional>
#include <string>

#include "programs/player/player.h"
#include "programs/player/scene_warnings.h"
#include "programs/player/timed_loop.h"

namespace palpate {

struct IgtlServerOptions {
  double seconds = 0;        // 0: until told to stop
  double surface_rate = 20;  // Hz of POLYDATA and STRING
  double force_rate = 100;   // Hz of SENSOR
  bool on_request = false;   // send the surface to those alone who asked (STT_POLYDATA, GET_POLYDATA)
  std::string device = "organ";
};

struct IgtlServerRun {
  LoopTiming touch;
  FlagCounts touch_flags, shape_flags;
  std::uint64_t clients = 0, poses = 0, surfaces = 0, forces = 0;
  std::uint64_t left_out = 0;  // messages not queued for a client that had not yet taken the ones before
  std::uint64_t refused = 0;   // messages
};

// Touches at the scene's rate in a thread of its own; the calling thread serves listening, a bound stream socket. A tool
// exists from the first TRANSFORM with its name until the client that last moved it leaves. say is called with a line for
// the user when a client comes, leaves, or sends something that is refused; once for each client and kind.
IgtlServerRun serve_igtl(Player& player, int listening, const IgtlServerOptions& options, const std::atomic<bool>* stop,
                         const std::function<void(const std::string&)>& say);

std::string igtl_table(const IgtlServerRun& run);

}  // namespace palpate
