#include "programs/player/explain.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cstring>
#include <limits>
#include <map>

#include "programs/player/summary.h"

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
    return fmt::format("{:<7} {:<24} {:>9} {:>9} {:>9} {:>11} {:>11} {:>6}  {}\n", cells...);
  };
  std::string table = row("half", "pass", "maps", "reads", "flops", "predicted", "measured", "ratio", "sections");
  for (const auto& [pass, work, predicted, measured] : passes) {
    const bool in_step = std::strcmp(pass.half, "create") != 0;
    const auto time = [&](double us) { return in_step ? fmt::format("{:.3f} us", us) : std::string("-"); };
    table += row(pass.half, pass.name, amount(static_cast<double>(pass.mapped_bytes), "B"), amount(work.bytes, "B"),
                 amount(work.flops, ""), time(predicted), time(measured),
                 measured > 0 ? fmt::format("{:.2f}", predicted / measured) : "-", pass.sections);
  }
  return table;
}

namespace {

// ---- what the passes take ------------------------------------------------------------------------------------------

// The runtime calls this at the end of each part of a pass; the time since the last call belongs to the pass.
class PassTimer {
 public:
  explicit PassTimer(int passes) : us_(static_cast<std::size_t>(passes)) {
    std::vector<double> empty;
    for (int i = 0; i < 1000; ++i) {
      begin();
      passed(this, 0);
      empty.push_back(us_[0]);
    }
    clock_us_ = percentile(empty, .5);
  }
  void begin() {
    std::fill(us_.begin(), us_.end(), 0);
    last_ = Clock::now();
  }
  static void passed(void* user, std::int32_t pass) {
    PassTimer& timer = *static_cast<PassTimer*>(user);
    const Clock::time_point now = Clock::now();
    timer.us_[static_cast<std::size_t>(pass)] +=
        std::chrono::duration<double, std::micro>(now - timer.last_).count() - timer.clock_us_;
    timer.last_ = now;
  }
  const std::vector<double>& us() const { return us_; }  // [pass] of the step since begin()

 private:
  Clock::time_point last_;
  double clock_us_ = 0;
  std::vector<double> us_;
};

struct Step {
  palpate_step_load load;
  double us;                    // of the call, where nobody watched
  std::vector<double> pass_us;  // where somebody did
  std::int32_t operations = 0;  // that a touch counted
};
struct Steps {
  std::vector<Step> touch, shape, deform;
};

constexpr int kRowsOfDisc = 9;  // of a grasp: three constraints of three rows

palpate_step_load load_of(const Player& player, const palpate_contacts& contacts) {
  palpate_step_load load = palpate_default_step_load();
  load.tools = contacts.tool_count;
  for (std::size_t t = 0; t < player.points().size(); ++t) {
    load.points += static_cast<std::int32_t>(player.points()[t].size());
    load.grips += static_cast<std::int32_t>(player.grips()[t].size());
  }
  const SceneConfig::Law law = player.scene().law;
  const int rows_of_place = law == SceneConfig::Law::sliding || law == SceneConfig::Law::unilateral ? 1 : 3;
  for (std::size_t t = 0; t < player.grips().size(); ++t) {
    const int grips = static_cast<int>(player.grips()[t].size());
    for (const palpate_grip& grip : player.grips()[t]) load.rows += std::popcount(grip.axes);
    const int places =
        std::max(0, palpate_contacts_tool(&contacts, static_cast<std::int32_t>(t))->contact_count - grips);
    const palpate_grasp_state* grasp = palpate_scene_grasp_state(player.runtime_scene(), static_cast<std::int32_t>(t));
    const bool grasps = grasp && (grasp->condition == PALPATE_GRASP_HOLDS || grasp->condition == PALPATE_GRASP_SLIPS);
    const int discs = std::min(places, !grasps ? 0 : player.held().grasp(t)->opposite_triangle >= 0 ? 2 : 1);
    load.rows += rows_of_place * (places - discs) + kRowsOfDisc * discs;
  }
  for (std::size_t s = 0; s < player.held().links().size(); ++s) {
    const palpate_link_state* link = palpate_scene_link_state(player.runtime_scene(), static_cast<std::int32_t>(s));
    if (!link || link->condition != PALPATE_LINK_TAUT) continue;
    load.rows += player.held().links()[s].kind == PALPATE_LINK_CLIP ? 3 : 1;
  }
  for (std::int32_t t = 0; t < contacts.tool_count; ++t) {
    const palpate_tool_state& tool = *palpate_contacts_tool(&contacts, t);
    load.contacts += tool.contact_count, load.slips += tool.slip_count;
  }
  load.nodes = contacts.node_count, load.sweeps = contacts.sweeps;
  load.newton_steps = contacts.newton_steps;
  return load;
}

// Three plays with a watcher and three without.
Steps play_steps(Player& player, int passes) {
  Steps steps;
  PassTimer timer(passes);
  for (int round = 0; round < 6; ++round) {
    const bool watched = round % 2 == 1;
    palpate_watch_passes(player.runtime_scene(), watched ? PassTimer::passed : nullptr, &timer);
    const std::size_t first_touch = steps.touch.size(), first_shape = steps.shape.size(),
                      first_deform = steps.deform.size();
    const auto add = [&](std::vector<Step>& to, const palpate_contacts& contacts) {
      to.push_back({load_of(player, contacts), 0, watched ? timer.us() : std::vector<double>(), contacts.operations});
    };
    const Timing timing =
        player.play([&](const TouchRecord& touch) { add(steps.touch, touch.contacts); },
                    [&](const ShapeRecord& shape) { add(steps.shape, shape.contacts); }, [&] { timer.begin(); },
                    [&] {
                      steps.deform.push_back(steps.touch.back());
                      if (watched) steps.deform.back().pass_us = timer.us();
                    });
    for (std::size_t i = first_touch; i < steps.touch.size(); ++i) steps.touch[i].us = timing.touch_us[i - first_touch];
    for (std::size_t i = first_shape; i < steps.shape.size(); ++i) steps.shape[i].us = timing.shape_us[i - first_shape];
    for (std::size_t i = first_deform; i < steps.deform.size(); ++i)
      steps.deform[i].us = timing.deform_us[i - first_deform];
  }
  palpate_watch_passes(player.runtime_scene(), nullptr, nullptr);
  return steps;
}

// The most common number of contact nodes among the steps in contact; the larger one if two are equally common.
int usual_nodes(const std::vector<Step>& steps) {
  std::map<int, int> count;
  for (const Step& step : steps)
    if (step.load.nodes > 0) ++count[step.load.nodes];
  const auto most =
      std::max_element(count.begin(), count.end(), [](const auto& a, const auto& b) { return a.second <= b.second; });
  return most == count.end() ? 0 : most->first;
}

// Medians over the steps with that many nodes.
struct Usual {
  palpate_step_load load = palpate_default_step_load();
  double us = 0;
  std::vector<double> pass_us;
};

Usual usual(const std::vector<Step>& steps, int nodes, std::size_t passes) {
  Usual found;
  const auto median = [&](const auto& value_of, bool watched) {
    std::vector<double> values;
    for (const Step& step : steps)
      if (step.load.nodes == nodes && watched == !step.pass_us.empty()) values.push_back(value_of(step));
    return percentile(values, .5);
  };
  for (auto member : {&palpate_step_load::tools, &palpate_step_load::points, &palpate_step_load::grips,
                      &palpate_step_load::contacts, &palpate_step_load::rows, &palpate_step_load::nodes,
                      &palpate_step_load::slips, &palpate_step_load::sweeps, &palpate_step_load::newton_steps})
    found.load.*member = static_cast<std::int32_t>(median([&](const Step& s) { return s.load.*member; }, false));
  found.us = median([](const Step& s) { return s.us; }, false);
  for (std::size_t p = 0; p < passes; ++p)
    found.pass_us.push_back(std::max(0.0, median([&](const Step& s) { return s.pass_us[p]; }, true)));
  return found;
}

std::int32_t most_counted(const std::vector<Step>& steps) {
  std::int32_t most = 0;
  for (const Step& step : steps) most = std::max(most, step.operations);
  return most;
}

}  // namespace

std::string explain(Player& player) {
  std::vector<palpate_plan_pass> plan;
  while (const palpate_plan_pass* pass =
             palpate_scene_plan(player.runtime_scene(), static_cast<std::int32_t>(plan.size())))
    plan.push_back(*pass);
  const int count = static_cast<int>(plan.size());
  const Steps steps = play_steps(player, count);
  const int nodes = usual_nodes(steps.shape.empty() ? steps.touch : steps.shape);
  const Usual touch = usual(steps.touch, nodes, static_cast<std::size_t>(count)),
              shape = usual(steps.shape, nodes, static_cast<std::size_t>(count)),
              deform = usual(steps.deform, nodes, static_cast<std::size_t>(count));
  std::vector<PassCost> passes;
  double predicted_touch = 0, predicted_shape = 0, predicted_deform = 0;
  for (int p = 0; p < count; ++p) {
    PassCost cost = {plan[static_cast<std::size_t>(p)]};
    const char* const half = plan[static_cast<std::size_t>(p)].half;
    const bool in_shape = std::strcmp(half, "shape") == 0, in_deform = std::strcmp(half, "deform") == 0;
    cost.work = palpate_predict_pass(player.runtime_scene(), p, &touch.load);
    const MachineRates rates = measure_machine(static_cast<std::uint64_t>(cost.work.bytes));
    cost.predicted_us = 1e6 * predicted_seconds(cost.work, rates);
    cost.measured_us = (in_shape ? shape : in_deform ? deform : touch).pass_us[static_cast<std::size_t>(p)];
    (in_shape ? predicted_shape : in_deform ? predicted_deform : predicted_touch) += cost.predicted_us;
    passes.push_back(cost);
  }
  const MachineRates rates = measure_machine(1 << 20);
  const palpate_step_load& load = touch.load;
  return plan_table(passes) +
         fmt::format(
             "with {} contact nodes of {} contacts, {} tool points, {} grips, {} of them slipping, {} sweeps and {} "
             "steps of Newton's method; 1 MB "
             "read at "
             "{:.1f} GB/s, {:.1f} Gflop/s, {:.2f} Gstep/s\n"
             "predicted: touch {:.2f} us, shape {:.2f} us; measured, median of the whole calls alone: touch {:.2f} us, "
             "shape {:.2f} us\n",
             load.nodes, load.contacts, load.points, load.grips, load.slips, load.sweeps, load.newton_steps,
             rates.bytes_per_second / 1e9, rates.flops_per_second / 1e9, rates.steps_per_second / 1e9, predicted_touch,
             predicted_shape, touch.us, shape.us) +
         fmt::format("a touch counts at most {} operations, whatever the tools do; these counted {} at most\n",
                     palpate_scene_most_operations(player.runtime_scene()), most_counted(steps.touch)) +
         (steps.deform.empty() ? std::string()
                               : fmt::format("beside the touch: predicted {:.2f} us a solve, measured {:.2f} us\n",
                                             predicted_deform, deform.us));
}

}  // namespace palpate
