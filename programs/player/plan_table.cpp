#include "programs/player/plan_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <limits>

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;

std::string amount(double value, const char* unit) {
  for (const auto& [scale, prefix] : {std::pair{1e9, "G"}, {1e6, "M"}, {1e3, "k"}})
    if (value >= scale) return fmt::format("{:.3g} {}{}", value / scale, prefix, unit);
  return value > 0 ? fmt::format("{:.3g} {}", value, unit) : "-";
}

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// ---- the machine ---------------------------------------------------------------------------------------------------

// Of some runs of at least 100 us each, s per call of work.
template <typename Work>
double shortest(const Work& work) {
  double best = std::numeric_limits<double>::infinity();
  for (int run = 0; run < 10; ++run) {
    const auto start = Clock::now();
    double spent = 0;
    int calls = 0;
    do {
      work();
      ++calls;
      spent = seconds_since(start);
    } while (spent < 1e-4);
    best = std::min(best, spent / calls);
  }
  return best;
}

// Compiled for the widest vector instructions that the loader may choose, as the runtime's own loops are.
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define PALPATE_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define PALPATE_CLONES
#endif
constexpr std::size_t kLanes = 64;

// count: a multiple of kLanes.
PALPATE_CLONES float read_run(const float* run, std::size_t count) {
  float sum[kLanes] = {};
  for (std::size_t i = 0; i < count; i += kLanes)
    for (std::size_t lane = 0; lane < kLanes; ++lane) sum[lane] += run[i + lane];
  float all = 0;
  for (const float lane : sum) all += lane;
  return all;
}

PALPATE_CLONES float multiply_and_add(float factor, std::size_t times) {
  float x[kLanes] = {};
  for (std::size_t i = 0; i < times; ++i)
    for (std::size_t lane = 0; lane < kLanes; ++lane) x[lane] = x[lane] * factor + 1;
  float all = 0;
  for (const float lane : x) all += lane;
  return all;
}

double wait_for_each_other(double factor, std::size_t times) {
  double x = 1;
  for (std::size_t i = 0; i < times; ++i) x = x * factor + 1;
  return x;
}

}  // namespace

MachineRates measure_machine(std::uint64_t bytes) {
  const std::vector<float> run(std::max<std::uint64_t>(1024, bytes / sizeof(float)) / kLanes * kLanes, 1.0f);
  constexpr std::size_t kTimes = 1000;
  volatile double used = 0.5;  // so that no loop is optimised away
  const double read = shortest([&] { used = used + read_run(run.data(), run.size()); });
  const double add = shortest([&] { used = multiply_and_add(static_cast<float>(used) * 0, kTimes); });
  const double wait = shortest([&] { used = wait_for_each_other(used * 0, kTimes); });
  return {static_cast<double>(run.size() * sizeof(float)) / read, 2.0 * kLanes * kTimes / add, kTimes / wait};
}

double predicted_seconds(const palpate_pass_work& work, const MachineRates& rates) {
  return std::max(work.bytes / rates.bytes_per_second, work.flops / rates.flops_per_second) +
         work.steps / rates.steps_per_second;
}

// ---- the table -----------------------------------------------------------------------------------------------------

std::string plan_table(const std::vector<PassCost>& passes) {
  const auto row = [](auto... cells) {
    return fmt::format("{:<7} {:<24} {:>9} {:>9} {:>9} {:>9} {:>11} {:>11} {:>6}  {}\n", cells...);
  };
  std::string table =
      row("half", "pass", "maps", "memory", "reads", "flops", "predicted", "measured", "ratio", "sections");
  std::string of;
  for (const auto& [pass, whose, work, predicted, measured] : passes) {
    if (whose != of) table += fmt::format("{}:\n", of = whose);
    const bool in_step = std::strcmp(pass.half, "create") != 0;
    const auto time = [&](double us) { return in_step ? fmt::format("{:.3f} us", us) : std::string("-"); };
    table += row(pass.half, pass.name, amount(static_cast<double>(pass.mapped_bytes), "B"),
                 amount(static_cast<double>(pass.memory_bytes), "B"), amount(work.bytes, "B"), amount(work.flops, ""),
                 time(predicted), time(measured), measured > 0 ? fmt::format("{:.2f}", predicted / measured) : "-",
                 pass.sections);
  }
  return table;
}

}  // namespace palpate
