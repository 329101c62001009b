// Presses two discs into a bar that is fixed at x = 0, from one side, from opposite sides or around a corner, keeps them there and
// draws them out again. Counts how often contacts begin and end.
#pragma once

#include <palpate/palpate_scene_def.hpp>

#include <random>

#include "tests/runtime/touched_box.h"

namespace palpate::tests {

struct PressedBar {
  TinyBox box;
  double shallowest, deepest;  // m, how far in the discs go
  bool pinched = false;        // always from opposite sides
  double radius = 0.004;       // m
};

// Sums over all pairs. Each disc that touches begins and ends at least once.
struct Unrest {
  int pairs = 0, least = 0;  // beginnings and ends of contacts that must be
  int more = 0, worst = 0;   // that are beyond it: of all pairs, of the worst
  int again = 0;             // contacts that begin within eight steps of their end
  int in_vain = 0;           // steps in which both end, of which one is back within three
  int swinging = 0;  // discs whose force, a while after they have come to rest, still changes by 1e-6 of its largest
  int jumps = 0;     // steps that change a force by more than a tenth of its largest, which takes 200 to come
};

inline void press_pair(const PressedBar& bar, TouchedScene& scene, std::mt19937& random, Unrest* unrest) {
  constexpr int kIn = 200, kRest = 150, kSteps = 2 * kIn + kRest, kSoon = 8;
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const Eigen::Vector3d size(bar.box.size.data());
  Eigen::Vector3d start[2], way[2];
  int axis = 0;
  double side = 0;
  for (int t = 0; t < 2; ++t) {
    const int any_axis = 1 + static_cast<int>(random() % 2);
    const double any_side = random() % 2 ? 1 : -1;
    axis = bar.pinched && t == 1 ? axis : any_axis;
    side = bar.pinched && t == 1 ? -side : any_side;
    start[t] = {size[0] * between(0.58, 0.97), size[1] * between(0.1, 0.9), size[2] * between(0.1, 0.9)};
    start[t][axis] = 0.5 * size[axis] * (1 + side) + 0.002 * side;
    way[t] = -side * (0.002 + between(bar.shallowest, bar.deepest)) * Eigen::Vector3d::Unit(axis);
  }
  std::vector<double> force[2];
  bool held[2] = {}, touched[2] = {};
  int changes = 0, both_ended = -kSteps, ended[2] = {-kSteps, -kSteps};
  for (int step = 0; step <= kSteps; ++step) {
    Eigen::Vector3d point[2];
    for (int t = 0; t < 2; ++t) point[t] = start[t] + way[t] * (std::min({step, kIn, kSteps - step}) / double{kIn});
    scene.touch(tools_of(point, bar.radius, 0.6));
    for (int t = 0; t < 2; ++t) {
      force[t].push_back(scene.force(t).norm());
      const bool holds = scene.touches(t);
      touched[t] = touched[t] || holds;
      if (std::exchange(held[t], holds) == holds) continue;
      ++changes;
      unrest->again += holds && step - ended[t] <= kSoon;
      if (holds && step - both_ended <= 3) ++unrest->in_vain, both_ended = -kSteps;
      if (!holds) ended[t] = step;
    }
    if (ended[0] == step && ended[1] == step) both_ended = step;
  }
  const int least = 2 * (touched[0] + touched[1]);
  ++unrest->pairs, unrest->least += least, unrest->more += changes - least;
  unrest->worst = std::max(unrest->worst, changes - least);
  for (const auto& f : force) {
    const double most = *std::max_element(f.begin(), f.end());
    bool swings = false;
    for (int step = 1; step <= kSteps; ++step) {
      const double change = std::abs(f[step] - f[step - 1]);
      unrest->jumps += !(change <= 0.1 * most);
      swings = swings || (step > kIn + kRest / 2 && step <= kIn + kRest && !(change <= 1e-6 * most));
    }
    unrest->swinging += swings;
  }
}

inline Unrest unrest_of_two_discs(const PressedBar& bar, palpate_contact_law law, int pairs) {
  const TouchedBox body(bar.box);
  std::mt19937 random(5);
  Unrest unrest;
  for (int pair = 0; pair < pairs; ++pair) {
    TouchedScene scene(body, unlimited_def(PALPATE_COLLISION_DEFORMED, law));
    press_pair(bar, scene, random, &unrest);
  }
  return unrest;
}

}  // namespace palpate::tests
