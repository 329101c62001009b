#include "programs/player/realtime.h"

#include <fmt/format.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <thread>

#include "programs/player/contacts_mailbox.h"
#include "programs/player/deform_thread.h"
#include "programs/player/touch_loop.h"

namespace palpate {
namespace {

using Json = nlohmann::ordered_json;

// Measures for how long the machine stops a thread that only reads the clock.
void measure_gaps(RealtimeRun& run) {
  constexpr Nanoseconds kLong = 500000000, kGap = 5000;
  const Nanoseconds start = now();
  Nanoseconds longest = 0, taken = 0;
  for (Nanoseconds last = start, time = start; last - start < kLong; last = time) {
    time = now();
    longest = std::max(longest, time - last);
    if (time - last > kGap) taken += time - last;
  }
  run.longest_gap = microseconds(longest);
  run.taken_away = static_cast<double>(taken) / kLong;
}

std::string lock_memory(Player& player) {
  palpate_error error = {};
  if (palpate_bundle_prefault(player.bundle(), 1, &error) != PALPATE_OK) return error.text;
  if (mlockall(MCL_CURRENT) != 0) return fmt::format("bundle locked, the program itself not: {}", std::strerror(errno));
  return "locked";
}

// Fills the memory once before the loops start, so that no step allocates or takes a page fault.
void reserve(std::vector<double>& numbers, double count) {
  numbers.assign(static_cast<std::size_t>(count) + 1, 0);
  numbers.clear();
}

}  // namespace

RealtimeRun run_realtime(Player& player, double rate, double seconds) {
  RealtimeRun run;
  run.rate = rate, run.seconds = seconds;
  const SceneConfig& scene = player.scene();
  const double duration = std::max(player.duration(), 1 / rate);
  const bool shaped = scene.def.shape != PALPATE_SHAPE_OFF;
  const int nodes = player.shape_node_count();
  std::vector<float> positions(3 * static_cast<std::size_t>(nodes));

  // The note behind the contacts: when they were published.
  ContactsMailbox<Nanoseconds> mailbox(palpate_contacts_bytes(player.runtime_scene()));

  for (auto* numbers : {&run.touch.work, &run.touch.wake_up}) reserve(*numbers, rate * seconds);
  for (auto* numbers : {&run.shape.work, &run.shape.wake_up, &run.age}) reserve(*numbers, scene.shape_hz * seconds);
  run.memory = lock_memory(player);
  measure_gaps(run);

  const Nanoseconds start = now() + 20000000;  // all threads are there by then
  constexpr double kMostSolves = 10000;        // in a second
  DeformThread deform_thread(player.runtime_scene(), static_cast<std::size_t>(kMostSolves * seconds));
  std::thread shape_thread([&] {
    if (!shaped) return;
    run.shape.scheduling = ask_for_fifo(10);
    palpate_shape_out out = palpate_default_shape_out();
    out.positions = positions.data(), out.node_capacity = nodes;
    const auto steps = static_cast<std::uint64_t>(scene.shape_hz * seconds);
    run_loop(run.shape, start, scene.shape_hz, steps, LateSteps::left_out, nullptr, [&](std::uint64_t) -> Nanoseconds {
      Nanoseconds published = 0;
      const palpate_contacts* contacts = mailbox.newest(&published);
      if (!contacts) return 0;
      const Nanoseconds begin = now();
      const palpate_step_flags flags = palpate_scene_shape(player.runtime_scene(), contacts, &out);
      const Nanoseconds end = now();
      run.shape_flags.add(flags);
      run.age.push_back(microseconds(end - published));
      return end - begin;
    });
  });
  std::thread touch_thread([&] {
    double last = 0;
    run_touch_loop(
        {player, run.touch, run.touch_flags, rate, static_cast<std::uint64_t>(rate * seconds)}, start,
        mailbox.contacts_bytes(),
        [&](std::uint64_t index, std::uint64_t) {
          const double time = std::fmod(static_cast<double>(index) / rate, duration);
          if (time < last)
            palpate_scene_reset(player.runtime_scene());  // from the start again: the tools are back where they began
          last = time;
          player.move_tools(time);
        },
        [&] { return mailbox.slot(); }, [&](std::uint64_t, Nanoseconds end) { mailbox.publish(end); });
  });
  touch_thread.join();
  shape_thread.join();
  deform_thread.stop();
  run.deform = deform_thread.times();
  return run;
}

std::string realtime_table(const RealtimeRun& run) {
  std::string table = fmt::format(
      "touch at {:.0f} Hz for {:.1f} s: {} steps, {} missed deadlines, preempted {} times; {}\n"
      "memory: {}; a thread that only reads the clock was stopped for {:.0f} us at most, {:.1f} % of the time\n",
      run.rate, run.seconds, run.touch.work.size(), run.touch.missed, run.touch.preempted, run.touch.scheduling,
      run.memory, run.longest_gap, 100 * run.taken_away);
  if (!run.shape.work.empty())
    table += fmt::format("shape: {} steps, {} missed deadlines, preempted {} times; {}\n", run.shape.work.size(),
                         run.shape.missed, run.shape.preempted, run.shape.scheduling);
  table += percentile_head("us") + percentile_row("touch", run.touch.work) +
           percentile_row("touch woken late", run.touch.wake_up) + percentile_row("shape", run.shape.work) +
           percentile_row("shape woken late", run.shape.wake_up) + percentile_row("contacts' age", run.age);
  if (!run.deform.empty()) table += percentile_row("solve beside touch", run.deform);
  return table + "\n";
}

std::vector<std::string> realtime_warnings(const std::vector<RealtimeRun>& runs, const Player& player) {
  std::vector<std::string> sentences = player.organ().log().warnings;
  for (const RealtimeRun& run : runs)
    for (const auto& more : {run.touch_flags.warnings(fmt::format("touches at {:g} Hz", run.rate)),
                             run.shape_flags.warnings(fmt::format("shapes beside touch at {:g} Hz", run.rate))})
      sentences.insert(sentences.end(), more.begin(), more.end());
  return sentences;
}

std::string realtime_summary(const std::vector<RealtimeRun>& runs, const Player& player,
                             const std::filesystem::path& bundle) {
  Json out;
  out["scene"] = player.scene().name;
  out["bundle"] = bundle.string();
  out["realtime"] = Json::array();
  for (const RealtimeRun& run : runs) {
    Json entry = {{"touch_hz", run.rate},
                  {"seconds", run.seconds},
                  {"memory", run.memory},
                  {"clock_reader_longest_gap_us", run.longest_gap},
                  {"clock_reader_share_taken_away", run.taken_away},
                  {"touch", loop_summary(run.touch)}};
    if (!run.shape.work.empty()) {
      entry["shape_hz"] = player.scene().shape_hz;
      entry["shape"] = loop_summary(run.shape);
      entry["contacts_age_us"] = percentile_summary(run.age);
    }
    if (!run.deform.empty()) entry["deform_us"] = percentile_summary(run.deform);
    out["realtime"].push_back(entry);
  }
  out["warnings"] = realtime_warnings(runs, player);
  return out.dump(2) + "\n";
}

}  // namespace palpate
