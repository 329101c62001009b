// 64 tool points that hover, press, slide at their depth over a box and jump. All begin at one place, so that many of them hold one
// triangle, each at another displacement, and sticking contacts contradict one another in most steps.
#pragma once

#include <palpate/palpate_scene_def.hpp>

#include "runtime/scene/scene.h"
#include "tests/runtime/touched_box.h"
#include "tests/support/wandering_points.h"

namespace palpate::tests {

struct SlidingCrowd : TouchedScene {
  static constexpr int kTools = 4, kPointsOfATool = 16;
  static const TouchedBox& box() {
    static const TouchedBox shared(TinyBox{.cells = {4, 6, 6}, .size = {0.06, 0.1, 0.1}, .interior = false});
    return shared;
  }

  SlidingCrowd(palpate_contact_model contact, palpate_contact_law law,
               std::int64_t most_operations = SceneDef().max_operations)
      : TouchedScene(box(),
                     with_operations(with(SceneDef(), PALPATE_COLLISION_DEFORMED, contact, law), most_operations)),
        surface(box().bundle()),
        wanderers(kTools * kPointsOfATool, WanderingPoint(surface, random)),
        points(wanderers.size()),
        tools(kTools, palpate_default_tool()) {
    for (int t = 0; t < kTools; ++t) {
      tools[t].points = points[t * kPointsOfATool].data();
      tools[t].point_count = kPointsOfATool;
    }
  }

  void step() {
    for (std::size_t p = 0; p < points.size(); ++p) points[p] = wanderers[p].step();
    touch(tools);
    const ContactConstraints& set = scene->touch.rows.set();
    const ContactSystem system = scene->touch.solver.last_system();
    largest_target = largest_force = 0;
    for (std::int32_t p = 0; p < set.constraint_count; ++p) {
      largest_target = std::max(largest_target, length(set.target[p]));
      const Vec3 r = scene->touch.solver.reaction(p);
      const Mat3 own = own_compliance(system, p);
      for (int i = 0; i < 3; ++i) largest_force = std::max(largest_force, std::fabs(r[i]) * own.m[i][i]);
    }
    const auto u = shape();
    largest_displacement = 0;
    for (std::size_t n = 0; n < u.size(); n += 3)
      largest_displacement =
          std::max(largest_displacement,
                   std::sqrt(double{u[n]} * u[n] + double{u[n + 1]} * u[n + 1] + double{u[n + 2]} * u[n + 2]));
  }

  WanderingRandom random;
  VisitedSurface surface;
  std::vector<WanderingPoint> wanderers;
  std::vector<VisitedSurface::Point> points;
  std::vector<palpate_tool> tools;
  double largest_target = 0;        // m
  double largest_displacement = 0;  // m, of a surface node as it is drawn
  double largest_force = 0;         // m: a row's reaction times its own compliance
};

}  // namespace palpate::tests
