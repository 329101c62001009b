// An indenter of many points that differ in height by 0.2 mm, pressed in and dragged. Several points lie in each
// triangle, so several contacts hold each vertex, each at another displacement. With friction 20 they wedge one another.
#pragma once

#include <palpate/palpate_scene_def.hpp>

#include <random>

#include "runtime/scene/scene.h"
#include "tests/runtime/touched_box.h"

namespace palpate::tests {

struct RoughIndenter : TouchedScene {
  static constexpr int kPoints = 24, kSteps = 300;
  static constexpr double kDepth = 0.004, kDrag = 0.008;
  // What palpate.h trusts: 1e-6 of the largest u*, and 1e-9 m. A vertex gets at most 1.34 times the displacement of its point: the
  // most that k + 1 - (sum of squares) can be.
  static double trusted() { return 1e-6 * 1.34 * std::hypot(kDepth, kDrag) + 1e-9; }

  // first: of the points, on the face of the box whose outward normal is +x.
  RoughIndenter(const TouchedBox& box, const Eigen::Vector3d& first, double friction,
                palpate_contact_law law = PALPATE_LAW_COULOMB, palpate_contact_model contact = PALPATE_CONTACT_TRIANGLE,
                std::int64_t max_operations = 1'500'000)  // for some steps of Newton's method with 216 rows
      : TouchedScene(box, with_operations(unlimited_def(law, contact), max_operations)),
        place(first),
        points(kPoints),
        mu(friction) {}
  palpate_step_flags step(int s) {
    std::mt19937 random(29);
    std::uniform_real_distribution<double> rough(-1e-4, 1e-4);
    const double depth = kDepth * std::min(1.0, s / 100.0) - 2e-4, along = kDrag * std::max(0, s - 100) / 200;
    for (int i = 0; i < kPoints; ++i)
      points[i] = place + Eigen::Vector3d(rough(random) - depth, 0.0024 * (i % 6) + along, 0.0024 * (i / 6));  // NOLINT
    const std::vector<PointState> before(scene->touch.points.of_tool[0], scene->touch.points.of_tool[0] + kPoints);
    touch({point_tool(points[0].data(), kPoints, 0.002, mu)});
    for (int i = 0; i < kPoints; ++i) {
      const PointState &old = before[i], &now = scene->touch.points.of_tool[0][i];
      if (!old.contact || !now.contact || old.outward.x < 1) continue;
      const Vec3 way = now.anchor_at_rest - old.anchor_at_rest;
      const double ahead = std::hypot(points[i].y() - old.anchor_at_rest.y, points[i].z() - old.anchor_at_rest.z);
      farthest_slide = std::max(farthest_slide, std::hypot(way.y, way.z) - ahead);
    }
    return flags;
  }

  // Of the last step, in the frames of the contacts: a node's force has the direction of the surface's normal, which turns at the
  // edges of the face.
  struct Forces {
    double pull = 0, beyond_friction = 0;  // N, the largest
    double over_limit = 0;                 // a row's reaction over its limit of contact_solver.h, the largest
  };
  Forces forces() const {
    Forces found;
    const ContactConstraints& set = scene->touch.rows.set();
    const ContactSystem system = scene->touch.solver.last_system();
    double target = 0;
    for (std::int32_t p = 0; p < set.constraint_count; ++p)
      for (int i = 0; i < 3; ++i) target = std::max(target, std::fabs(set.target[p][i]));
    for (std::int32_t p = 0; p < set.constraint_count; ++p) {
      const Vec3 r = scene->touch.solver.reaction(p);
      const Mat3 own = own_compliance(system, p);
      found.pull = std::max(found.pull, -r.x);
      found.beyond_friction = std::max(found.beyond_friction, std::hypot(r.y, r.z) - mu * r.x * (1 + 1e-9));
      for (int i = 0; i < 3; ++i)
        found.over_limit =
            std::max(found.over_limit, std::fabs(r[i]) * own.m[i][i] / (ReactionLimit::kMostForce * target));
    }
    return found;
  }

  Eigen::Vector3d place;
  std::vector<Eigen::Vector3d> points;
  double mu;
  // m, of an anchor on that face in a step, beyond its distance from the tool point across the normal
  double farthest_slide = 0;
};

}  // namespace palpate::tests
