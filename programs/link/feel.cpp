#include "programs/link/feel.h"

#include <fmt/format.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "formats/errors.h"
#include "formats/program.h"
#include "programs/player/touch_loop.h"

namespace palpate {
namespace {

// The end of a session is sent several times, since a datagram may be lost.
constexpr int kFarewells = 10;
constexpr auto kFarewellPause = std::chrono::milliseconds(20);

void check_room(const Player& player) {
  if (player.contact_node_limit() > kMostDatagramNodes)
    throw InputError(fmt::format(
        "{}: limits.contact_nodes: expected at most {}, which one datagram holds, found {} ({}); lower it: the first "
        "contacts are kept and a step that has more says so",
        player.scene().file.string(), kMostDatagramNodes, player.contact_node_limit(),
        player.scene().def.max_contact_nodes > 0 ? "as written" : "from the tools' points"));
}

}  // namespace

FeelRun feel(Player& player, std::uint64_t bundle, DatagramSender& sender, const FeelOptions& options,
             const std::atomic<bool>* stop) {
  check_room(player);
  FeelRun run;
  const double rate = player.scene().touch_hz;
  const std::uint64_t once = player.touch_count();
  const std::uint64_t steps = options.seconds > 0 ? static_cast<std::uint64_t>(rate * options.seconds) : once;
  std::vector<std::uint64_t> memory(palpate_contacts_bytes(player.runtime_scene()) / 8 + 1);
  auto* contacts = reinterpret_cast<palpate_contacts*>(memory.data());
  std::vector<unsigned char> datagram(kMostDatagramBytes);
  DatagramNote note;
  note.bundle = bundle;
  note.session = run.session = static_cast<std::uint64_t>(wall_clock());
  const auto send = [&] {
    note.sent = wall_clock();
    const std::size_t bytes = encode_contacts(*contacts, note, datagram.data());
    (sender.send({datagram.data(), bytes}) ? run.sent : run.not_taken) += 1;
    return bytes;
  };

  run_touch_loop(
      {player, run.touch, run.flags, rate, steps, options.late, stop}, now(), memory.size() * sizeof memory[0],
      [&](std::uint64_t index, std::uint64_t before) {
        if (index / once != before / once) palpate_scene_reset(player.runtime_scene());  // the path begins again
        player.move_tools(static_cast<double>(index % once) / rate);
      },
      [&] { return contacts; },
      [&](std::uint64_t index, Nanoseconds touched) {
        ++note.sequence;
        note.time = static_cast<double>(index) / rate;
        std::copy(player.positions().begin(), player.positions().end(), note.positions.begin());
        const std::size_t bytes = send();
        run.send_us.push_back(microseconds(now() - touched));
        if (options.keep) run.kept.emplace_back(datagram.data(), datagram.data() + bytes);
      });
  note.last = true;
  ++note.sequence;
  for (int i = 0; i < kFarewells && note.sequence > 1; ++i) {
    send();
    std::this_thread::sleep_for(kFarewellPause);
  }
  return run;
}

std::string feel_table(const FeelRun& run) {
  return fmt::format("{} steps, {} missed deadlines, preempted {} times; {}\n{} datagrams sent, {} not taken\n",
                     run.touch.work.size(), run.touch.missed, run.touch.preempted, run.touch.scheduling, run.sent,
                     run.not_taken) +
         percentile_head("us") + percentile_row("touch", run.touch.work) + percentile_row("send", run.send_us) +
         percentile_row("touch woken late", run.touch.wake_up) + "\n";
}

std::string feel_summary(const FeelRun& run, const Player& player, const std::string& to) {
  const nlohmann::ordered_json out = {{"scene", player.scene().name},
                                      {"to", to},
                                      {"session", run.session},
                                      {"touch_hz", player.scene().touch_hz},
                                      {"datagrams_sent", run.sent},
                                      {"datagrams_not_taken", run.not_taken},
                                      {"touch", loop_summary(run.touch)},
                                      {"send_us", percentile_summary(run.send_us)},
                                      {"warnings", warnings()}};
  return out.dump(2) + "\n";
}

}  // namespace palpate
