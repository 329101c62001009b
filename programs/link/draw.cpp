#include "programs/link/draw.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <thread>

#include "formats/program.h"
#include "programs/link/sockets.h"
#include "programs/player/contacts_mailbox.h"

namespace palpate {
namespace {

double seconds_of(Nanoseconds time) {
  return static_cast<double>(time) * 1e-9;
}

// Receives datagrams until it is told to stop.
class Receiving {
 public:
  Receiving(const Player& player, const DatagramLimits& limits, int listening)
      : receiver_(limits), mailbox_(palpate_contacts_bytes(player.runtime_scene())), listening_(listening) {}

  void run(const std::atomic<bool>& stop, const std::function<void(const std::string&)>& say) {
    std::vector<unsigned char> room(kMostDatagramBytes);
    while (!stop.load()) {
      const auto count = receive(listening_, 50, room);
      if (!count) continue;
      DatagramNote note;
      const auto verdict = receiver_.take({room.data(), *count}, seconds_of(now()), mailbox_.slot(), &note);
      if (verdict == ContactsReceiver::Verdict::refused) explain_refusal(say);
      if (verdict != ContactsReceiver::Verdict::fresh) continue;
      way_us_.push_back(microseconds(wall_clock() - note.sent));
      mailbox_.publish(note);
      if (note.last) ended_.store(true);  // after the publishing: whoever sees it sees the last contacts
    }
  }

  bool ended() const { return ended_.load(); }
  ContactsMailbox<DatagramNote>& mailbox() { return mailbox_; }
  // Call after run() has returned.
  const LinkCounts& counts() const { return receiver_.counts(); }
  std::vector<double>& way_us() { return way_us_; }

 private:
  // The first of each kind; the others are counted.
  void explain_refusal(const std::function<void(const std::string&)>& say) {
    const DatagramFault fault = receiver_.last_fault();
    if (receiver_.counts().refused[static_cast<std::size_t>(fault)] == 1)
      say(fmt::format("a datagram was refused ({}): {}", name_of(fault), cause_of(fault)));
  }

  ContactsReceiver receiver_;
  ContactsMailbox<DatagramNote> mailbox_;
  int listening_;
  std::vector<double> way_us_;
  std::atomic<bool> ended_{false};
};

// Tells the user once when no fresh datagram has come for a while, and once when one comes again.
class Silence {
 public:
  Silence(DrawRun& run, double limit, Nanoseconds start) : run_(run), limit_(limit), fresh_at_(start) {}

  void watch(bool fresh, const std::function<void(const std::string&)>& say) {
    const Nanoseconds time = now();
    const double silent = seconds_of(time - fresh_at_);
    run_.longest_silence = std::max(run_.longest_silence, silent);
    if (fresh) {
      if (said_) say(fmt::format("contacts come again, after {:.1f} s", silent));
      fresh_at_ = time, said_ = false;
    } else if (!said_ && silent > limit_) {
      say(fmt::format("no contacts for {:.1f} s: {}", limit_,
                      run_.shapes > 0 ? "the last shape is kept" : "nothing is drawn yet"));
      ++run_.silences, said_ = true;
    }
  }

 private:
  DrawRun& run_;
  double limit_;
  Nanoseconds fresh_at_;
  bool said_ = false;
};

nlohmann::ordered_json refusals(const LinkCounts& counts) {
  nlohmann::ordered_json out = nlohmann::ordered_json::object();
  for (int f = 1; f < kDatagramFaults; ++f)
    out[name_of(static_cast<DatagramFault>(f))] = counts.refused[static_cast<std::size_t>(f)];
  return out;
}

}  // namespace

DrawRun draw(Player& player, std::uint64_t bundle, int listening, const DrawOptions& options,
             const std::atomic<bool>* stop, const std::function<void(const ShapeRecord&)>& on_shape,
             const std::function<void(const std::string&)>& say) {
  DrawRun run;
  const double rate = player.scene().shape_hz;
  constexpr double kForever = 1e9;  // s
  const auto steps = static_cast<std::uint64_t>(rate * (options.seconds > 0 ? options.seconds : kForever));
  std::vector<float> displacements(3 * static_cast<std::size_t>(player.shape_node_count()));
  std::vector<float> positions(displacements.size());
  palpate_shape_out out = palpate_default_shape_out();
  out.displacements = displacements.data(), out.positions = positions.data(),
  out.node_capacity = player.shape_node_count();

  Receiving receiving(player, datagram_limits(player, bundle), listening);
  std::atomic<bool> stop_receiving{false}, drawn_last{false};
  std::thread receiver([&] { receiving.run(stop_receiving, say); });
  Silence silence(run, options.silence, now());
  const auto step = [&](std::uint64_t) -> Nanoseconds {
    const bool ended = receiving.ended();  // looked at before the contacts: the last ones are then among them
    if ((stop && stop->load()) || ended) drawn_last.store(true);
    DatagramNote note;
    bool fresh = false;
    const palpate_contacts* contacts = receiving.mailbox().newest(&note, &fresh);
    silence.watch(fresh, say);
    if (!fresh) {
      ++run.held;
      return 0;
    }
    const Nanoseconds begin = now();
    palpate_step_flags flags = palpate_scene_shape(player.runtime_scene(), contacts, &out);
    OrganInside* const inside = player.organ().inside();
    if (inside) flags |= inside->follow(out);
    OrganCrossings* const crossings = player.organ().crossings();
    if (crossings) flags |= crossings->follow(out);
    const Nanoseconds end = now();
    run.flags.add(flags);
    run.age_us.push_back(microseconds(wall_clock() - note.sent));
    ++run.shapes;
    for (std::int32_t t = 0; t < contacts->tool_count; ++t)
      player.place_tool(static_cast<std::size_t>(t), note.positions[static_cast<std::size_t>(t)]);
    on_shape({note.time, flags, player.points(), *contacts, out.node_count, displacements.data(), positions.data(),
              nullptr, nullptr, crossings, inside});
    return end - begin;
  };
  try {
    run_loop(run.shape, now(), rate, steps, LateSteps::left_out, &drawn_last, step);
  } catch (...) {  // on_shape may throw: a full disk
    stop_receiving.store(true);
    receiver.join();
    throw;
  }
  stop_receiving.store(true);
  receiver.join();
  run.ended = receiving.ended();
  run.link = receiving.counts();
  run.way_us = std::move(receiving.way_us());
  run.shape.scheduling = "time-shared";
  return run;
}

std::string draw_table(const DrawRun& run) {
  std::uint64_t refused = 0;
  for (const std::uint64_t count : run.link.refused) refused += count;
  return fmt::format(
             "{} datagrams came: {} fresh, {} late, {} repeated, {} refused; {} lost; {} sessions\n"
             "{} shapes drawn, {} times held, {} silences, the longest {:.2f} s; {} missed deadlines\n",
             run.link.received, run.link.fresh, run.link.late, run.link.repeated, refused, run.link.lost,
             run.link.sessions, run.shapes, run.held, run.silences, run.longest_silence, run.shape.missed) +
         percentile_head("us") + percentile_row("on the way", run.way_us) +
         percentile_row("age when drawn", run.age_us) + percentile_row("shape", run.shape.work) + "\n";
}

std::string draw_summary(const DrawRun& run, const Player& player, int shapes_written) {
  const nlohmann::ordered_json out = {{"scene", player.scene().name},
                                      {"shape_hz", player.scene().shape_hz},
                                      {"shapes", run.shapes},
                                      {"shapes_written", shapes_written},
                                      {"held", run.held},
                                      {"silences", run.silences},
                                      {"longest_silence_s", run.longest_silence},
                                      {"sender_said_goodbye", run.ended},
                                      {"datagrams",
                                       {{"received", run.link.received},
                                        {"fresh", run.link.fresh},
                                        {"late", run.link.late},
                                        {"repeated", run.link.repeated},
                                        {"lost", run.link.lost},
                                        {"sessions", run.link.sessions},
                                        {"refused", refusals(run.link)}}},
                                      {"on_the_way_us", percentile_summary(run.way_us)},
                                      {"age_when_drawn_us", percentile_summary(run.age_us)},
                                      {"shape", loop_summary(run.shape)},
                                      {"warnings", warnings()}};
  return out.dump(2) + "\n";
}

}  // namespace palpate
