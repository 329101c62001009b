#include "programs/player/timed_loop.h"

#include <fmt/format.h>
#include <sched.h>
#include <sys/resource.h>
#include <time.h>

#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>

#include "programs/player/summary.h"

namespace palpate {
namespace {

constexpr std::pair<const char*, double> kShares[] = {{"p50", .5},     {"p90", .9},       {"p99", .99},
                                                      {"p99.9", .999}, {"p99.99", .9999}, {"max", 1}};

Nanoseconds read(clockid_t clock) {
  timespec time = {};
  clock_gettime(clock, &time);
  return time.tv_sec * Nanoseconds{1000000000} + time.tv_nsec;
}

}  // namespace

Nanoseconds now() {
  return read(CLOCK_MONOTONIC);
}

Nanoseconds wall_clock() {
  return read(CLOCK_REALTIME);
}

void sleep_until(Nanoseconds when) {
  const timespec time = {when / 1000000000, when % 1000000000};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &time, nullptr) == EINTR) {
  }
}

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

nlohmann::ordered_json percentile_summary(const std::vector<double>& values) {
  nlohmann::ordered_json out;
  for (const auto& [name, share] : kShares) out[name] = percentile(values, share);
  return out;
}

std::string percentile_head(const std::string& unit) {
  std::string head = fmt::format("{:<18}", unit);
  for (const auto& [name, share] : kShares) head += fmt::format("{:>10}", name);
  return head;
}

std::string percentile_row(const std::string& name, const std::vector<double>& values) {
  if (values.empty()) return {};
  std::string row = fmt::format("\n{:<18}", name);
  for (const auto& [_, share] : kShares) row += fmt::format("{:>10.2f}", percentile(values, share));
  return row;
}

nlohmann::ordered_json loop_summary(const LoopTiming& loop) {
  return {{"steps", loop.work.size()},
          {"missed_deadlines", loop.missed},
          {"scheduling", loop.scheduling},
          {"preempted", loop.preempted},
          {"work_us", percentile_summary(loop.work)},
          {"wake_up_us", percentile_summary(loop.wake_up)}};
}

}  // namespace palpate
