#include "runtime/run/realtime.h"

#include <fmt/format.h>
#include <palpate/palpate_mailbox.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <time.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "runtime/run/summary.h"

namespace palpate {
namespace {

using Json = nlohmann::ordered_json;
using Nanoseconds = std::int64_t;

Nanoseconds now() {
  timespec time = {};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return time.tv_sec * Nanoseconds{1000000000} + time.tv_nsec;
}

void sleep_until(Nanoseconds when) {
  const timespec time = {when / 1000000000, when % 1000000000};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &time, nullptr) == EINTR) {
  }
}

double microseconds(Nanoseconds time) {
  return static_cast<double>(time) * 1e-3;
}

// For the calling thread. Without the right to it the loop runs time-shared with everything else.
std::string ask_for_fifo(int priority) {
  sched_param wanted = {};
  wanted.sched_priority = priority;
  if (sched_setscheduler(0, SCHED_FIFO, &wanted) == 0) return fmt::format("SCHED_FIFO {}", priority);
  return fmt::format("time-shared (SCHED_FIFO refused: {})", std::strerror(errno));
}

long preemptions() {
  rusage usage = {};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_nivcsw;
}

// How often the machine takes the processor away from a thread that does nothing but read the clock.
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

// A loop at fixed times: step(index) is called when it is due, index counts the left out ones as well.
template <typename Step>
void run_loop(LoopTiming& timing, Nanoseconds start, double rate, double seconds, const Step& step) {
  const double period = 1e9 / rate;
  const auto steps = static_cast<std::uint64_t>(rate * seconds);
  const auto due = [&](std::uint64_t index) {
    return start + static_cast<Nanoseconds>(std::llround(static_cast<double>(index) * period));
  };
  const long preempted_before = preemptions();
  for (std::uint64_t index = 0; index < steps;) {
    sleep_until(due(index));
    const Nanoseconds woken = now();
    const Nanoseconds spent = step(index);
    timing.wake_up.push_back(microseconds(woken - due(index)));
    timing.work.push_back(microseconds(spent));
    const Nanoseconds done = now();
    std::uint64_t next = index + 1;
    if (done > due(next)) {
      ++timing.missed;
      next = std::min(steps, static_cast<std::uint64_t>(std::ceil(static_cast<double>(done - start) / period)));
      timing.missed += next - index - 1;
    }
    index = next;
  }
  timing.preempted = preemptions() - preempted_before;
}

// Written once before the loops, so that growing does not happen in them and their pages are there.
void reserve(std::vector<double>& numbers, double count) {
  numbers.assign(static_cast<std::size_t>(count) + 1, 0);
  numbers.clear();
}

constexpr std::pair<const char*, double> kShares[] = {{"p50", .5},     {"p90", .9},       {"p99", .99},
                                                      {"p99.9", .999}, {"p99.99", .9999}, {"max", 1}};

Json percentiles(const std::vector<double>& values) {
  Json out;
  for (const auto& [name, share] : kShares) out[name] = percentile(values, share);
  return out;
}

Json loop_summary(const LoopTiming& loop) {
  return {{"steps", loop.work.size()},         {"missed_deadlines", loop.missed},
          {"scheduling", loop.scheduling},     {"preempted", loop.preempted},
          {"work_us", percentiles(loop.work)}, {"wake_up_us", percentiles(loop.wake_up)}};
}

}  // namespace

RealtimeRun run_realtime(Player& player, double rate, double seconds) {
  RealtimeRun run;
  run.rate = rate, run.seconds = seconds;
  const SceneConfig& scene = player.scene();
  const double duration = std::max(player.duration(), 1 / rate);
  const bool shaped = scene.shape != SceneConfig::Shape::off;
  const int nodes = player.shape_node_count();
  std::vector<float> positions(3 * static_cast<std::size_t>(nodes));

  // The mailbox's slots hold, after the contacts, when they were published.
  const std::size_t stamp = palpate_contacts_bytes(player.runtime_scene());
  const std::size_t contacts_bytes = stamp + sizeof(Nanoseconds);
  const std::size_t words = (palpate_mailbox_bytes(contacts_bytes) + 63) / 64 * 8 + 8;
  std::vector<std::uint64_t> memory(words);
  void* at = memory.data();
  std::size_t room = 8 * words;
  palpate_mailbox* mailbox =
      palpate_mailbox_create(std::align(64, palpate_mailbox_bytes(contacts_bytes), at, room), contacts_bytes);

  for (auto* numbers : {&run.touch.work, &run.touch.wake_up}) reserve(*numbers, rate * seconds);
  for (auto* numbers : {&run.shape.work, &run.shape.wake_up, &run.age}) reserve(*numbers, scene.shape_hz * seconds);
  run.memory = lock_memory(player);
  measure_gaps(run);
  palpate_reset(player.runtime_scene());

  const Nanoseconds start = now() + 20000000;  // both threads are there by then
  std::thread shape_thread([&] {
    if (!shaped) return;
    run.shape.scheduling = ask_for_fifo(10);
    palpate_shape_out out = {nullptr, positions.data(), nodes, 0};
    run_loop(run.shape, start, scene.shape_hz, seconds, [&](std::uint64_t) -> Nanoseconds {
      const palpate_contacts* contacts = palpate_mailbox_newest(mailbox, nullptr);
      if (!contacts) return 0;
      const Nanoseconds begin = now();
      palpate_shape(player.runtime_scene(), contacts, &out);
      const Nanoseconds end = now();
      Nanoseconds published = 0;
      std::memcpy(&published, reinterpret_cast<const char*>(contacts) + stamp, sizeof published);
      run.age.push_back(microseconds(end - published));
      return end - begin;
    });
  });
  std::thread touch_thread([&] {
    run.touch.scheduling = ask_for_fifo(80);
    double last = 0;
    std::uint64_t before = 0;
    run_loop(run.touch, start, rate, seconds, [&](std::uint64_t index) {
      const double time = std::fmod(static_cast<double>(index) / rate, duration);
      if (time < last)
        palpate_reset(player.runtime_scene());  // from the start again: the tools are back where they began
      last = time;
      player.move_tools(time);
      palpate_contacts* contacts = palpate_mailbox_slot(mailbox);
      const Nanoseconds begin = now();
      player.touch(static_cast<double>(index - before + (index == 0)) / rate, contacts);
      const Nanoseconds end = now();
      before = index;
      std::memcpy(reinterpret_cast<char*>(contacts) + stamp, &end, sizeof end);
      palpate_mailbox_publish(mailbox);
      return end - begin;
    });
  });
  touch_thread.join();
  shape_thread.join();
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
  table += fmt::format("{:<18}", "us");
  for (const auto& [name, share] : kShares) table += fmt::format("{:>10}", name);
  const auto row = [&](const char* name, const std::vector<double>& values) {
    if (values.empty()) return;
    table += fmt::format("\n{:<18}", name);
    for (const auto& [_, share] : kShares) table += fmt::format("{:>10.2f}", percentile(values, share));
  };
  row("touch", run.touch.work);
  row("touch woken late", run.touch.wake_up);
  row("shape", run.shape.work);
  row("shape woken late", run.shape.wake_up);
  row("contacts' age", run.age);
  return table + "\n";
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
      entry["contacts_age_us"] = percentiles(run.age);
    }
    out["realtime"].push_back(entry);
  }
  return out.dump(2) + "\n";
}

}  // namespace palpate
