#include "runtime/run/explain.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <numeric>

namespace palpate {
namespace {

constexpr double kFlopRate = 2e9;  // a modest core on short dependent loops

std::string amount(double value, const char* unit) {
  for (const auto& [scale, prefix] : {std::pair{1e9, "G"}, {1e6, "M"}, {1e3, "k"}})
    if (value >= scale) return fmt::format("{:.3g} {}{}", value / scale, prefix, unit);
  return value > 0 ? fmt::format("{:.3g} {}", value, unit) : "-";
}

}  // namespace

double measure_read_rate() {
  using Clock = std::chrono::steady_clock;
  const std::vector<std::uint64_t> words(std::size_t{1} << 24, 1);  // 128 MiB
  double best = 0;
  std::uint64_t sum = 0;
  for (int pass = 0; pass < 3; ++pass) {
    const auto start = Clock::now();
    sum += std::accumulate(words.begin(), words.end(), std::uint64_t{0});
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    best = std::max(best, static_cast<double>(words.size() * sizeof(words[0])) / seconds);
  }
  return sum > 0 ? best : 1;  // the sum is used, so the reads happen
}

std::string plan_table(const palpate_plan_pass* passes, int count, int contact_nodes, double read_rate) {
  const auto row = [](auto... cells) {
    return fmt::format("{:<7} {:<28} {:>10} {:>10} {:>10} {:>10}  {}\n", cells...);
  };
  std::string table = row("half", "pass", "maps", "reads", "flops", "predicted", "sections");
  double predicted[2] = {0, 0};
  for (int p = 0; p < count; ++p) {
    const palpate_plan_pass& pass = passes[p];
    const double bytes = static_cast<double>(pass.bytes_per_contact_node) * contact_nodes;
    const double flops = static_cast<double>(pass.flops_per_contact_node) * contact_nodes;
    const double seconds = std::max(bytes / read_rate, flops / kFlopRate);
    const std::string half = pass.half;
    if (half == "touch") predicted[0] += seconds;
    if (half == "shape") predicted[1] += seconds;
    table += row(pass.half, pass.name, amount(static_cast<double>(pass.mapped_bytes), "B"), amount(bytes, "B"),
                 amount(flops, ""), seconds > 0 ? fmt::format("{:.2f} us", seconds * 1e6) : "-", pass.sections);
  }
  table += fmt::format("predicted with {} contact nodes at {:.1f} GB/s: touch {:.2f} us, shape {:.2f} us\n",
                       contact_nodes, read_rate / 1e9, predicted[0] * 1e6, predicted[1] * 1e6);
  return table;
}

}  // namespace palpate
