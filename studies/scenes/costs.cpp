#include "studies/scenes/costs.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>

#include "formats/program.h"
#include "studies/timing/timing.h"

namespace palpate::scenes {
namespace {

using Eigen::Vector3d;
using Json = nlohmann::ordered_json;

constexpr double kHere[3] = {0, 0, 0};

Vector3d in_world(const palpate_pose& pose, const Vector3d& p) {
  const Eigen::Quaterniond turn(pose.orientation[0], pose.orientation[1], pose.orientation[2], pose.orientation[3]);
  return turn * p + Vector3d(pose.position);
}

Vector3d force_of_pairs(const PlayedWorld& world) {
  Vector3d force = Vector3d::Zero();
  for (const palpate_world_pair* pair : world.pairs()) force += Vector3d(pair->force);
  return force;
}

// Of the force between organs that stand: by how much it changes in a step, the mean of kToRest steps, over its size.
constexpr int kToRest = 300;
double unrest_of(PlayedWorld& world) {
  Vector3d last = force_of_pairs(world);
  const double size = last.norm();
  double way = 0;
  for (int s = 0; s < kToRest; ++s) {
    world.touch();
    const Vector3d now = force_of_pairs(world);
    way += (now - last).norm(), last = now;
  }
  return way / kToRest / size;
}

// A tool of one point that is pressed into a place of the first organ and goes to and fro there.
class PointTool {
 public:
  explicit PointTool(const SurfacePlace& place) : place_(place) {}
  std::vector<palpate_tool> at(double depth) {
    point_ = place_.point - depth * place_.outward;
    palpate_tool tool = palpate_default_tool();
    tool.points = point_.data(), tool.point_count = 1;
    return {tool};
  }

 private:
  SurfacePlace place_;
  Vector3d point_ = Vector3d::Zero();
};

// Solves each organ of a world beside the touch, in a thread of its own.
class SolvedBeside {
 public:
  SolvedBeside(const PlayedWorld& world, int organs) {
    for (int k = 0; k < organs; ++k) threads_.emplace_back([this, scene = world.scene(k)] { solve(scene); });
  }
  SolvedBeside(const SolvedBeside&) = delete;
  SolvedBeside& operator=(const SolvedBeside&) = delete;
  ~SolvedBeside() {
    ends_ = true;
    for (std::thread& thread : threads_) thread.join();
  }
  // Of each organ, so far.
  double solutions() const { return static_cast<double>(solutions_) / static_cast<double>(threads_.size()); }

 private:
  void solve(palpate_scene* scene) {
    while (!ends_)
      if (palpate_scene_deform(scene) > 0)
        ++solutions_;
      else
        std::this_thread::sleep_for(std::chrono::microseconds(100));
  }

  std::atomic<bool> ends_ = false;
  std::atomic<std::int64_t> solutions_ = 0;
  std::vector<std::thread> threads_;
};

// 1,000 touches in a second.
class Pace {
 public:
  void wait() {
    std::this_thread::sleep_until(next_ = std::max(next_ + std::chrono::milliseconds(1), studies::Clock::now()));
  }

 private:
  studies::Clock::time_point next_ = studies::Clock::now();
};

class Costs {
 public:
  Costs(const BakedOrgan& baked, const ScenesOptions& options)
      : baked_(baked),
        options_(options),
        box_(box_of(baked.body())),
        side_(place_at_the_side(baked.body(), box_)),
        plain_(open_bundle(baked.bundle(0))) {
    first_touch_ = gap_of_first_touch(plain_.get(), box_, 1e-3 * box_.size());
  }

  std::vector<Json> run() {
    begin("one organ, one tool");
    organs();
    pairs();
    pairs_beside();
    modes();
    links();
    grips();
    needle();
    return rows_;
  }

 private:
  // Touches that the warm-up and the timed part of every world take; prepare: moves what moves, and returns the tools.
  template <class Prepare>
  void time(const std::string& axis, const std::string& setting, int count, PlayedWorld& world, Prepare prepare) {
    std::vector<double> times;
    palpate_step_flags flags = 0;
    for (int s = 0; s < options_.steps + 100; ++s) {
      const std::vector<palpate_tool> tools = prepare(s);
      const double start = studies::thread_seconds();
      const palpate_step_flags raised = world.touch(tools);
      const double spent = 1e6 * (studies::thread_seconds() - start);
      if (s >= 100) times.push_back(spent), flags |= raised;
    }
    const double median = studies::percentile(times, 0.5);
    if (axis == "reference") reference_ = median;
    rows_.push_back({{"axis", axis},
                     {"setting", setting},
                     {"count", count},
                     {"median_us", median},
                     {"p90_us", studies::percentile(times, 0.9)},
                     {"worst_us", *std::ranges::max_element(times)},
                     {"ratio", median / reference_},
                     {"flags", flags}});
  }

  // The point comes from outside, goes in by 1 % of the organ's size, and moves to and fro by a tenth of that.
  auto pressing_tool() {
    return [this, tool = PointTool(side_)](int s) mutable {
      const double deep = 0.01 * box_.size();
      return tool.at(s < 50 ? deep * (s - 25) / 25 : deep * (1 + 0.1 * std::sin(0.05 * s)));
    };
  }

  // Measures the reference anew, because the speed of a machine drifts.
  void begin(const std::string& axis) {
    say("timing: " + axis);
    PlayedWorld world({{plain_.get(), pose_at(Vector3d(kHere))}}, touching_scene());
    if (rows_.empty()) time("reference", "one organ, one tool", 1, world, pressing_tool());
    std::vector<Json> kept = rows_;
    time("reference", "one organ, one tool", 1, world, pressing_tool());
    rows_ = kept;
  }

  void organs() {
    begin("organs");
    for (int count = 1; count <= options_.organs; count *= 2)
      for (const auto& [setting, apart, max_pairs] :
           {std::tuple("they pass through one another", 0.01, 0), std::tuple("may touch, far", 3.0, 200),
            std::tuple("may touch, near", 0.005, 200)}) {
        const auto stack = stack_of(plain_.get(), box_, count, apart * box_.size(), first_touch_);
        PlayedWorld world(stack, touching_scene(), max_pairs);
        time("organs", setting, count, world, pressing_tool());
      }
  }

  std::vector<int> numbers_of_pairs() const {
    return options_.quick ? std::vector<int>{1, 10} : std::vector<int>{1, 10, 30, 100};
  }
  std::vector<OrganAt> two_near(palpate_bundle* bundle) const {
    return {{bundle, pose_at(Vector3d(kHere))}, {bundle, over(box_, near_gap())}};
  }
  double near_gap() const { return first_touch_ + 0.005 * box_.size(); }
  // They come together, a step of the way in each touch, until so many places press. Returns the gap.
  template <class Wait>
  double press(PlayedWorld& world, int wanted, Wait wait) const {
    double gap = near_gap();
    const double pace = 2e-4 * box_.size(), deepest = first_touch_ - 0.35 * box_.depth();
    while (world.pressing() < wanted && gap > deepest) {
      wait(), world.place(1, over(box_, gap -= pace));
      world.touch();
    }
    return gap;
  }

  void pairs() {
    begin("pairs");
    for (const int wanted : numbers_of_pairs()) {
      PlayedWorld world(two_near(plain_.get()), touching_scene(), 500);
      const double gap = press(world, wanted, [] {});
      const int pressing = world.pressing();
      for (int s = 0; s < kToRest; ++s) world.touch();
      const double unrest = unrest_of(world);
      time("pairs", "stand still", pressing, world, [](int) { return std::vector<palpate_tool>(); });
      rows_.back()["unrest"] = unrest;
      for (const auto& [setting, share] : {std::pair("keep their places", 1e-4), std::pair("move on", 5e-3)})
        time("pairs", setting, pressing, world, [&, share = share](int s) {
          world.place(1, over(box_, gap + share * box_.size() * std::sin(0.05 * s)));
          return std::vector<palpate_tool>();
        });
      if (pressing < wanted) break;  // a small organ has no more vertices there
    }
  }

  // In real time, because solutions come when they come.
  void pairs_beside() {
    if (baked_.large_bundle().empty()) return;
    begin("pairs of bodies beside the touch");
    const Bundle bundle = open_bundle(baked_.large_bundle());
    SceneDef def = touching_scene();
    def.large.deformation = PALPATE_DEFORMATION_LARGE_BESIDE;
    for (const int wanted : numbers_of_pairs()) {
      PlayedWorld world(two_near(bundle.get()), def, 500);
      const SolvedBeside solved(world, 2);
      Pace pace;
      const double gap = press(world, wanted, [&] { pace.wait(); });
      const int pressing = world.pressing();
      for (const auto& [setting, share] :
           {std::pair("keep their places, bodies beside", 1e-4), std::pair("move on, bodies beside", 5e-3)}) {
        const double before = solved.solutions();
        const auto begun = studies::Clock::now();
        time("pairs", setting, pressing, world, [&, share = share](int s) {
          pace.wait();
          world.place(1, over(box_, gap + share * box_.size() * std::sin(0.05 * s)));
          return std::vector<palpate_tool>();
        });
        rows_.back()["solutions_hz"] = (solved.solutions() - before) / studies::seconds_since(begun);
      }
      if (pressing < wanted) break;
    }
  }

  void modes() {
    begin("modes");
    for (const int added : {0, 1, 4, 12}) {
      if (added > options_.modes) break;
      const Bundle bundle = open_bundle(baked_.bundle(added));
      SceneDef def = touching_scene();
      const int count = baked_.own_modes() + added;
      def.motions.motions = count > 0;
      PlayedWorld world({{bundle.get(), pose_at(Vector3d(kHere))}}, def);
      std::vector<double> amounts(static_cast<std::size_t>(count));
      auto tool = pressing_tool();
      time("modes", "amounts change in each touch", count, world, [&](int s) {
        for (std::size_t m = 0; m < amounts.size(); ++m) amounts[m] = 1e-6 * std::sin(0.1 * s + static_cast<double>(m));
        if (count > 0) palpate_scene_set_motions(world.scene(0), amounts.data(), count, nullptr);
        return tool(s);
      });
    }
  }

  void links() {
    begin("links");
    const auto organs = stack_of(plain_.get(), box_, 2, 0.03 * box_.size(), first_touch_);
    for (const int count : options_.quick ? std::vector<int>{0, 10} : std::vector<int>{0, 1, 10, 30}) {
      for (const auto& [setting, kind] :
           {std::pair("springs", PALPATE_LINK_SPRING), std::pair("slack threads", PALPATE_LINK_THREAD)}) {
        PlayedWorld world(organs, touching_scene(), 0, std::max(count, 1));
        auto list = springs_between(touchable_places(baked_.body(), static_cast<std::size_t>(count)), organs,
                                    kind == PALPATE_LINK_SPRING ? 0.9 : 1.5, 5);
        for (palpate_world_link& link : list) link.kind = kind;
        world.set_links(list);
        auto tool = pressing_tool();
        time("links", setting, static_cast<int>(list.size()), world, [&](int s) {
          palpate_pose pose = organs[1].pose;
          pose.position[(box_.axis + 1) % 3] += 2e-3 * box_.size() * std::sin(0.05 * s);
          world.place(1, pose);
          return tool(s);
        });
      }
    }
  }

  void grips() {
    begin("grips");
    for (const int count : options_.quick ? std::vector<int>{1, 4} : std::vector<int>{1, 4, 16, 64}) {
      const auto places = touchable_places(baked_.body(), static_cast<std::size_t>(count));
      PlayedWorld world({{plain_.get(), pose_at(Vector3d(kHere))}}, free_scene());
      std::vector<palpate_grip> grips(places.size(), palpate_default_grip());
      for (std::size_t g = 0; g < grips.size(); ++g) {
        grips[g].kind = PALPATE_GRIP_SURFACE_POINT, grips[g].triangle = places[g].triangle;
        std::ranges::copy(kMiddle, grips[g].barycentric);
      }
      time("grips", "points", static_cast<int>(grips.size()), world, [&](int s) {
        for (palpate_grip& grip : grips) grip.displacement[2] = 0.01 * box_.size() * std::sin(0.05 * s);
        palpate_tool tool = palpate_default_tool();
        tool.grips = grips.data(), tool.grip_count = static_cast<int>(grips.size());
        return std::vector<palpate_tool>{tool};
      });
    }
  }

  void needle() {
    if (!baked_.full().is_linear()) return;  // needles are in linear elements alone
    begin("needle");
    SceneDef def = free_scene();
    def.needles.needles = 1, def.needles.needle_places = 64;
    const double deep = 0.6 * baked_.way().length;
    for (const int wanted : options_.quick ? std::vector<int>{2, 8} : std::vector<int>{2, 8, 16, 32}) {
      PlayedWorld world({{plain_.get(), pose_at(Vector3d(kHere))}}, def);
      const double spacing = std::max(1e-4, deep / (wanted + 1));
      palpate_needle needle{};
      const auto put = [&](double depth, double aside) {
        needle = needle_on(baked_.way(), depth, spacing, aside), needle.friction = 2;
        palpate_tool tool = palpate_default_tool();
        tool.id = 0, tool.parts = &needle.part, tool.has_torque = 1;
        return std::vector<palpate_tool>{tool};
      };
      for (double depth = -0.02 * deep; depth < deep; depth += std::min(spacing / 4, deep / 100))
        world.touch(put(depth, 0));
      const palpate_needle_state* const state = palpate_scene_needle_state(world.scene(0), 0);
      const int places = state ? state->places : 0;
      time("needle", "held, moved aside", places, world,
           [&](int s) { return put(deep, 2e-3 * box_.size() * std::sin(6e-3 * s)); });
    }
  }

  const BakedOrgan& baked_;
  const ScenesOptions& options_;
  const Box box_;
  const SurfacePlace side_;
  const Bundle plain_;
  double first_touch_ = 0, reference_ = 1;
  std::vector<Json> rows_;
};

}  // namespace

std::vector<OrganAt> stack_of(palpate_bundle* bundle, const Box& box, int count, double apart, double touching_gap) {
  std::vector<OrganAt> stack;
  // From one pair to the next: their boxes do not meet.
  const double pitch = 2 * box.depth() + touching_gap + 2 * apart;
  for (int k = 0; k < count; ++k) {
    palpate_pose pose = k % 2 ? over(box, touching_gap + apart) : pose_at({0, 0, 0});
    pose.position[box.axis] += box.sign * pitch * (k / 2);
    stack.push_back({bundle, pose});
  }
  return stack;
}

std::vector<palpate_world_link> springs_between(const std::vector<SurfacePlace>& places,
                                                const std::vector<OrganAt>& organs, double rest_share,
                                                double stiffness) {
  std::vector<palpate_world_link> links(places.size(), palpate_default_world_link());
  for (std::size_t l = 0; l < links.size(); ++l) {
    palpate_world_link& link = links[l];
    link.kind = PALPATE_LINK_SPRING, link.stiffness = stiffness;
    Vector3d end[2];
    for (int e = 0; e < 2; ++e) {
      link.organ[e] = e, link.ends[e].kind = PALPATE_END_SURFACE_POINT, link.ends[e].triangle = places[l].triangle;
      std::ranges::copy(kMiddle, link.ends[e].barycentric);
      end[e] = in_world(organs[static_cast<std::size_t>(e)].pose, places[l].point);
    }
    link.rest_length = rest_share * (end[1] - end[0]).norm();
  }
  return links;
}

palpate_needle needle_on(const Way& way, double depth, double spacing, double aside) {
  palpate_needle needle = palpate_default_needle();
  needle.triangle = way.entry.triangle, needle.radius = 0.5e-3, needle.spacing = spacing;
  std::ranges::copy(kMiddle, needle.barycentric);
  Eigen::Map<Vector3d>(needle.tip) = way.entry.point + depth * way.inwards + aside * way.inwards.unitOrthogonal();
  Eigen::Map<Vector3d>(needle.direction) = way.inwards;
  return needle;
}

std::vector<Json> measure_costs(const BakedOrgan& baked, const ScenesOptions& options) {
  return Costs(baked, options).run();
}

}  // namespace palpate::scenes
