// The half that feels: touches in real time and sends the contacts of each step as one datagram.
#pragma once

#include <deque>

#include "programs/link/contacts_datagram.h"
#include "programs/link/sockets.h"
#include "programs/player/player.h"
#include "programs/player/scene_warnings.h"
#include "programs/player/timed_loop.h"

namespace palpate {

struct FeelOptions {
  double seconds = 0;                    // 0: the scene once, both ends included; else over and over for that long
  LateSteps late = LateSteps::left_out;  // caught_up: every step of the path is made, behind the clock if need be
  bool keep = false;                     // keep every datagram
};

struct FeelRun {
  LoopTiming touch;
  FlagCounts flags;
  std::vector<double> send_us;  // of encoding and sending, per step
  std::uint64_t session = 0, sent = 0;
  std::uint64_t not_taken = 0;  // by the system: nobody listened, or its buffer was full
  std::deque<std::vector<unsigned char>> kept;
};

// Player: of the half `touch`. Errors: InputError where the scene may have more contact nodes than one datagram holds.
FeelRun feel(Player& player, std::uint64_t bundle, DatagramSender& sender, const FeelOptions& options,
             const std::atomic<bool>* stop);

std::string feel_table(const FeelRun& run);

// JSON text of summary.json, with the warnings of the program so far.
std::string feel_summary(const FeelRun& run, const Player& player, const std::string& to);

}  // namespace palpate
