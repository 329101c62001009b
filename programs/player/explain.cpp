#include "programs/player/explain.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <map>

#include "programs/player/step_loads.h"
#include "programs/player/summary.h"

namespace palpate {
namespace {

using Clock = std::chrono::steady_clock;

// ---- what the passes take ------------------------------------------------------------------------------------------

// The runtime calls this at the end of each part of a pass; the time since the last call belongs to the pass.
class PassTimer {
 public:
  explicit PassTimer(std::size_t passes) : us_(passes) {
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

using Loads = std::vector<palpate_step_load>;

struct Step {
  Loads loads;
  double us;                    // of the call, where nobody watched
  std::vector<double> pass_us;  // where somebody did
  std::int64_t operations = 0;  // that a touch counted
  int nodes() const {
    int sum = 0;
    for (const palpate_step_load& load : loads) sum = std::max(sum, load.nodes);  // a world's has those of all organs
    return sum;
  }
};
struct Steps {
  std::vector<Step> touch, shape, deform;
};

struct ExplainedPass {
  palpate_plan_pass pass;
  std::string of;
  std::size_t load;  // among those of a step
};

// Of one play, what is told after each touch and shape, before each call, and after the solves beside the touch.
struct PlayEvents {
  std::function<void(Loads, std::int64_t operations)> touched, shaped;
  std::function<void()> before, deformed;
};

// ---- a scene of one organ, and one of several ------------------------------------------------------------------------

class OneOrgan {
 public:
  explicit OneOrgan(Player& player) : player_(player) {}
  std::vector<ExplainedPass> passes() const {
    std::vector<ExplainedPass> all;
    while (const palpate_plan_pass* pass = palpate_scene_plan(scene(), static_cast<std::int32_t>(all.size())))
      all.push_back({*pass, "", 0});
    return all;
  }
  palpate_pass_work predict(std::int32_t pass, const palpate_step_load& load) const {
    return palpate_predict_pass(scene(), pass, &load);
  }
  void watch(palpate_pass_watcher watcher, void* user) { palpate_watch_passes(scene(), watcher, user); }
  Timing play(const PlayEvents& events) {
    const auto loads = [&](const palpate_contacts& contacts) {
      return Loads{load_of(player_.organ(), player_.points(), contacts)};
    };
    return player_.play(
        [&](const TouchRecord& touch) { events.touched(loads(touch.contacts), touch.contacts.operations); },
        [&](const ShapeRecord& shape) { events.shaped(loads(shape.contacts), 0); }, events.before, events.deformed);
  }
  std::string load_sentence(const Loads& loads) const {
    const palpate_step_load& load = loads[0];
    return fmt::format(
        "with {} contact nodes of {} contacts, {} tool points, {} grips, {} of them slipping, {} sweeps and {} "
        "steps of Newton's method; ",
        load.nodes, load.contacts, load.points, load.grips, load.slips, load.sweeps, load.newton_steps);
  }
  std::string operations_sentence(std::int64_t counted) const {
    return fmt::format("a touch counts at most {} operations, whatever the tools do; these counted {} at most\n",
                       palpate_scene_most_operations(scene()), counted);
  }

 private:
  palpate_scene* scene() const { return player_.runtime_scene(); }
  Player& player_;
};

class SeveralOrgans {
 public:
  explicit SeveralOrgans(WorldPlayer& player) : player_(player) {}
  std::vector<ExplainedPass> passes() const {
    std::vector<ExplainedPass> all;
    std::int32_t organ = 0;
    while (const palpate_plan_pass* pass = palpate_world_plan(world(), static_cast<std::int32_t>(all.size()), &organ))
      all.push_back({*pass, organ < 0 ? "the world" : name_of(static_cast<std::size_t>(organ)),
                     organ < 0 ? player_.organ_count() : static_cast<std::size_t>(organ)});
    return all;
  }
  palpate_pass_work predict(std::int32_t pass, const palpate_step_load& load) const {
    return palpate_world_predict_pass(world(), pass, &load);
  }
  void watch(palpate_pass_watcher watcher, void* user) { palpate_world_watch_passes(world(), watcher, user); }
  Timing play(const PlayEvents& events) {
    return player_.play(
        [&](const WorldTouchRecord& touch) {
          std::int64_t operations = 0;
          for (std::int32_t k = 0; k < touch.contacts.organ_count; ++k)
            operations += palpate_world_contacts_organ(&touch.contacts, k)->operations;
          events.touched(loads_of(player_, touch.contacts), operations);
        },
        [&](const WorldShapeRecord& shapes) { events.shaped(loads_of(player_, shapes.contacts), 0); }, events.before,
        events.deformed);
  }
  std::string load_sentence(const Loads& loads) const {
    std::string sentence;
    for (std::size_t k = 0; k < player_.organ_count(); ++k)
      sentence += fmt::format("{}: {} contact nodes, {} contacts of tools, {} tool points near, {} grips\n", name_of(k),
                              loads[k].nodes, loads[k].contacts, loads[k].points, loads[k].grips);
    const palpate_step_load& world = loads.back();
    return sentence +
           fmt::format(
               "with {} pairs, {} rows of organs that touch, {} pairs that slip or carry no force, {} sweeps and {} "
               "steps of Newton's method; ",
               world.contacts, world.contacts > 0 ? world.rows : 0, world.slips, world.sweeps, world.newton_steps);
  }
  std::string operations_sentence(std::int64_t counted) const {
    std::int64_t most = 0;
    for (std::size_t k = 0; k < player_.organ_count(); ++k)
      most += palpate_scene_most_operations(player_.organ(k).runtime_scene());
    return fmt::format(
        "a touch counts at most {} operations of all organs, whatever the tools do, and those of the search for pairs "
        "on top; these counted {} at most\n",
        most, counted);
  }

 private:
  palpate_world* world() const { return player_.runtime_world(); }
  std::string name_of(std::size_t organ) const {
    return fmt::format("organ \"{}\"", player_.scene().organs[organ].name);
  }
  WorldPlayer& player_;
};

// ---- the steps ---------------------------------------------------------------------------------------------------------

// Three plays with a watcher and three without.
template <typename Scene>
Steps play_steps(Scene& scene, std::size_t passes) {
  Steps steps;
  PassTimer timer(passes);
  for (int round = 0; round < 6; ++round) {
    const bool watched = round % 2 == 1;
    scene.watch(watched ? PassTimer::passed : nullptr, &timer);
    const std::size_t first_touch = steps.touch.size(), first_shape = steps.shape.size(),
                      first_deform = steps.deform.size();
    const auto add_to = [&](std::vector<Step>& to) {
      return [&](Loads loads, std::int64_t operations) {
        to.push_back({std::move(loads), 0, watched ? timer.us() : std::vector<double>(), operations});
      };
    };
    const Timing timing = scene.play({add_to(steps.touch), add_to(steps.shape), [&] { timer.begin(); },
                                      [&] {
                                        steps.deform.push_back(steps.touch.back());
                                        if (watched) steps.deform.back().pass_us = timer.us();
                                      }});
    for (std::size_t i = first_touch; i < steps.touch.size(); ++i) steps.touch[i].us = timing.touch_us[i - first_touch];
    for (std::size_t i = first_shape; i < steps.shape.size(); ++i) {
      const std::size_t of_play = i - first_shape;
      steps.shape[i].us = timing.shape_us[of_play];
      for (const auto* more : {&timing.inside_us, &timing.crossings_us})
        if (!more->empty()) steps.shape[i].us += (*more)[of_play];
    }
    for (std::size_t i = first_deform; i < steps.deform.size(); ++i)
      steps.deform[i].us = timing.deform_us[i - first_deform];
  }
  scene.watch(nullptr, nullptr);
  return steps;
}

// The most common number of contact nodes among the steps in contact; the larger one if two are equally common.
int usual_nodes(const std::vector<Step>& steps) {
  std::map<int, int> count;
  for (const Step& step : steps)
    if (step.nodes() > 0) ++count[step.nodes()];
  const auto most =
      std::max_element(count.begin(), count.end(), [](const auto& a, const auto& b) { return a.second <= b.second; });
  return most == count.end() ? 0 : most->first;
}

// Medians over the steps with that many nodes.
struct Usual {
  Loads loads;
  double us = 0;
  std::vector<double> pass_us;
};

Usual usual(const std::vector<Step>& steps, int nodes, std::size_t passes) {
  Usual found;
  const auto median = [&](const auto& value_of, bool watched) {
    std::vector<double> values;
    for (const Step& step : steps)
      if (step.nodes() == nodes && watched == !step.pass_us.empty()) values.push_back(value_of(step));
    return percentile(values, .5);
  };
  found.loads.resize(steps.empty() ? 0 : steps[0].loads.size(), palpate_default_step_load());
  for (std::size_t l = 0; l < found.loads.size(); ++l)
    for (auto member : {&palpate_step_load::tools, &palpate_step_load::points, &palpate_step_load::grips,
                        &palpate_step_load::contacts, &palpate_step_load::rows, &palpate_step_load::nodes,
                        &palpate_step_load::slips, &palpate_step_load::sweeps, &palpate_step_load::newton_steps})
      found.loads[l].*member =
          static_cast<std::int32_t>(median([&](const Step& s) { return s.loads[l].*member; }, false));
  found.us = median([](const Step& s) { return s.us; }, false);
  for (std::size_t p = 0; p < passes; ++p)
    found.pass_us.push_back(std::max(0.0, median([&](const Step& s) { return s.pass_us[p]; }, true)));
  return found;
}

std::int64_t most_counted(const std::vector<Step>& steps) {
  std::int64_t most = 0;
  for (const Step& step : steps) most = std::max(most, step.operations);
  return most;
}

template <typename Scene>
std::string explain_scene(Scene scene) {
  const std::vector<ExplainedPass> plan = scene.passes();
  const Steps steps = play_steps(scene, plan.size());
  const int nodes = usual_nodes(steps.shape.empty() ? steps.touch : steps.shape);
  const Usual touch = usual(steps.touch, nodes, plan.size()), shape = usual(steps.shape, nodes, plan.size()),
              deform = usual(steps.deform, nodes, plan.size());
  std::vector<PassCost> passes;
  double predicted_touch = 0, predicted_shape = 0, predicted_deform = 0;
  for (std::size_t p = 0; p < plan.size(); ++p) {
    PassCost cost = {plan[p].pass, plan[p].of};
    const bool in_shape = std::strcmp(cost.pass.half, "shape") == 0, in_deform = !std::strcmp(cost.pass.half, "deform");
    cost.work = scene.predict(static_cast<std::int32_t>(p), touch.loads[plan[p].load]);
    const MachineRates rates = measure_machine(static_cast<std::uint64_t>(cost.work.bytes));
    cost.predicted_us = 1e6 * predicted_seconds(cost.work, rates);
    cost.measured_us = (in_shape ? shape : in_deform ? deform : touch).pass_us[p];
    (in_shape ? predicted_shape : in_deform ? predicted_deform : predicted_touch) += cost.predicted_us;
    passes.push_back(cost);
  }
  const MachineRates rates = measure_machine(1 << 20);
  return plan_table(passes) + scene.load_sentence(touch.loads) +
         fmt::format(
             "1 MB read at {:.1f} GB/s, {:.1f} Gflop/s, {:.2f} Gstep/s\n"
             "predicted: touch {:.2f} us, shape {:.2f} us; measured, median of the whole calls alone: touch {:.2f} us, "
             "shape {:.2f} us\n",
             rates.bytes_per_second / 1e9, rates.flops_per_second / 1e9, rates.steps_per_second / 1e9, predicted_touch,
             predicted_shape, touch.us, shape.us) +
         scene.operations_sentence(most_counted(steps.touch)) +
         (steps.deform.empty() ? std::string()
                               : fmt::format("beside the touch: predicted {:.2f} us a solve, measured {:.2f} us\n",
                                             predicted_deform, deform.us));
}

std::string note_lines(const PlayedOrgan& organ) {
  std::string lines;
  for (const std::string& note : organ.log().notes) lines += note + "\n";
  return lines;
}

}  // namespace

std::string explain(Player& player) {
  return explain_scene(OneOrgan(player)) + note_lines(player.organ());
}

std::string explain(WorldPlayer& player) {
  std::string text = explain_scene(SeveralOrgans(player));
  for (std::size_t k = 0; k < player.organ_count(); ++k) text += note_lines(player.organ(k));
  return text;
}

}  // namespace palpate
