#include "runtime/run/explain.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <limits>
#include <numeric>

#include "runtime/run/summary.h"

namespace palpate {
namespace {

std::string amount(double value, const char* unit) {
  for (const auto& [scale, prefix] : {std::pair{1e9, "G"}, {1e6, "M"}, {1e3, "k"}})
    if (value >= scale) return fmt::format("{:.3g} {}{}", value / scale, prefix, unit);
  return value > 0 ? fmt::format("{:.3g} {}", value, unit) : "-";
}

// Of three runs, s.
template <typename Work>
double shortest(const Work& work) {
  using Clock = std::chrono::steady_clock;
  double best = std::numeric_limits<double>::infinity();
  for (int run = 0; run < 3; ++run) {
    const auto start = Clock::now();
    work();
    best = std::min(best, std::chrono::duration<double>(Clock::now() - start).count());
  }
  return std::max(best, 1e-9);
}

}  // namespace

MachineRates measure_machine(std::uint64_t memory_bytes) {
  const std::vector<std::uint64_t> words(std::max<std::uint64_t>(1, memory_bytes / sizeof(std::uint64_t)), 1);
  std::uint64_t sum = 0;
  const double read_seconds = shortest([&] { sum += std::accumulate(words.begin(), words.end(), std::uint64_t{0}); });

  constexpr std::size_t count = 1024, repeats = 1000;
  std::vector<double> x(count, 1e-9), y(count, 1);
  const double add_seconds = shortest([&] {
    for (std::size_t r = 0; r < repeats; ++r)
      for (std::size_t i = 0; i < count; ++i) y[i] += x[i] * y[i];
  });
  if (sum == 0 || y[0] < 1) return {1, 1};  // the results are used, so the loops are not optimised away
  return {static_cast<double>(words.size() * sizeof(words[0])) / read_seconds, 2.0 * count * repeats / add_seconds};
}

std::string plan_table(const palpate_plan_pass* passes, int count, int contact_nodes, const MachineRates& rates) {
  const auto row = [](auto... cells) {
    return fmt::format("{:<7} {:<28} {:>10} {:>10} {:>10} {:>10}  {}\n", cells...);
  };
  std::string table = row("half", "pass", "maps", "reads", "flops", "predicted", "sections");
  double predicted[2] = {0, 0};
  for (int p = 0; p < count; ++p) {
    const palpate_plan_pass& pass = passes[p];
    const double bytes = static_cast<double>(pass.bytes_per_contact_node) * contact_nodes;
    const double flops = static_cast<double>(pass.flops_per_contact_node) * contact_nodes;
    const double seconds = std::max(bytes / rates.bytes_per_second, flops / rates.flops_per_second);
    const std::string half = pass.half;
    if (half == "touch") predicted[0] += seconds;
    if (half == "shape") predicted[1] += seconds;
    table += row(pass.half, pass.name, amount(static_cast<double>(pass.mapped_bytes), "B"), amount(bytes, "B"),
                 amount(flops, ""), seconds > 0 ? fmt::format("{:.2f} us", seconds * 1e6) : "-", pass.sections);
  }
  table += fmt::format(
      "predicted with {} contact nodes at {:.1f} GB/s and {:.1f} Gflop/s: touch {:.2f} us, shape {:.2f} us\n",
      contact_nodes, rates.bytes_per_second / 1e9, rates.flops_per_second / 1e9, predicted[0] * 1e6,
      predicted[1] * 1e6);
  return table;
}

namespace {

// Medians of the calls at the steps with the most contact nodes, us.
struct AtMostNodes {
  int nodes = 0;
  double touch_us = 0, shape_us = 0;
};

AtMostNodes measure(Player& player) {
  std::vector<int> touch_nodes, shape_nodes;  // contact nodes of each step
  const Timing timing =
      player.play([&](const TouchRecord& touch) { touch_nodes.push_back(touch.contacts.node_count); },
                  [&](const ShapeRecord& shape) { shape_nodes.push_back(shape.contacts.node_count); });
  const auto median_at_most = [](const std::vector<double>& microseconds, const std::vector<int>& nodes) {
    const int largest = nodes.empty() ? 0 : *std::max_element(nodes.begin(), nodes.end());
    std::vector<double> chosen;
    for (std::size_t i = 0; i < nodes.size(); ++i)
      if (nodes[i] == largest) chosen.push_back(microseconds[i]);
    return percentile(chosen, .5);
  };
  return {*std::max_element(touch_nodes.begin(), touch_nodes.end()), median_at_most(timing.touch_us, touch_nodes),
          median_at_most(timing.shape_us, shape_nodes)};
}

// One line per effect that can be left out alone: what the step takes less without it. The two scenes are played in turn
// three times and the shorter medians compared, since the machine may be shared.
std::string cost_of_leaving_out(const SceneConfig& scene, Player& player, const std::filesystem::path& bundle) {
  struct Change {
    const char* name;
    bool applies;
    bool in_touch;
    std::function<void(SceneConfig&)> leave_out;
  };
  const Change changes[] = {
      {"following the deformed surface", scene.collision == SceneConfig::Collision::deformed, true,
       [](SceneConfig& s) { s.collision = SceneConfig::Collision::rest; }},
      {"force: response", scene.force == SceneConfig::Force::response, true,
       [](SceneConfig& s) { s.force = SceneConfig::Force::linear; }},
      {"radial: response", scene.radial == SceneConfig::Radial::response, false,
       [](SceneConfig& s) { s.radial = SceneConfig::Radial::off; }},
      {"the interior of shape: volume", scene.shape == SceneConfig::Shape::volume, false,
       [](SceneConfig& s) { s.shape = SceneConfig::Shape::surface; }},
  };
  std::string lines;
  for (const Change& change : changes) {
    if (!change.applies) continue;
    SceneConfig without = scene;
    change.leave_out(without);
    Player other(without, bundle);
    double with_us = std::numeric_limits<double>::infinity(), without_us = with_us;
    for (int round = 0; round < 3; ++round) {
      const AtMostNodes a = measure(player), b = measure(other);
      with_us = std::min(with_us, change.in_touch ? a.touch_us : a.shape_us);
      without_us = std::min(without_us, change.in_touch ? b.touch_us : b.shape_us);
    }
    lines += fmt::format("measured by leaving it out: {} {:.2f} us of {} {:.2f} us\n", change.name,
                         with_us - without_us, change.in_touch ? "touch" : "shape", with_us);
  }
  return lines;
}

}  // namespace

std::string explain(Player& player, const std::filesystem::path& bundle) {
  const AtMostNodes measured = measure(player);
  int count = 0;
  const palpate_plan_pass* passes = palpate_scene_plan(player.runtime_scene(), &count);
  std::uint64_t mapped = 1 << 20;
  for (int p = 0; p < count; ++p) mapped = std::max(mapped, passes[p].mapped_bytes);
  const MachineRates rates = measure_machine(std::min<std::uint64_t>(mapped, 1 << 27));
  return plan_table(passes, count, measured.nodes, rates) +
         fmt::format("measured there, median of the calls alone: touch {:.2f} us, shape {:.2f} us\n", measured.touch_us,
                     measured.shape_us) +
         cost_of_leaving_out(player.scene(), player, bundle);
}

}  // namespace palpate
