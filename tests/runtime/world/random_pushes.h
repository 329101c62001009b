// Organs pushed on one another at random, and what passes through. A vertex has passed through where it is deeper inside the other organ
// than it has moved against that organ's surface in the step, and deeper than kSlack beyond that, though the step raised no flag: pairs hold
// it where the last step has left both. Where the pair of a held vertex gives way, as its gap tells, the vertex may be as much deeper. Vertices
// of both organs are looked at, where their surface faces the other one's at the nearest place: now, when they were last looked at, and where
// the step has looked for their pair. A vertex that comes in past the side of the other organ does not face it, and nothing holds it
// (docs/method.md, section 17): deeper than kUntold it is told by NOT_TOUCHABLE; else it is counted alone, until it faces a surface and has had
// a step to be pressed out.
#pragma once

#include <algorithm>
#include <functional>
#include <random>
#include <string>
#include <utility>

#include "tests/runtime/world/touching_world.h"

namespace palpate::tests {

// In mean edges of the organ that is entered. Places lag by a tenth of an edge, and the drawn surface lies below the smooth one.
constexpr double kSlack = 0.05, kUntold = 0.1;
// Surfaces face one another where their normals differ by more than 120 degrees. Pairs are made from about 100 degrees on, between the
// smooth normals of both.
constexpr double kFacing = -0.5;

struct PassedThrough {
  std::uint64_t seed;
  int step;
  std::int32_t organ, node, other;  // whose vertex; which; in whom
  double depth, moved;              // m
};
std::string sentence_of(const PassedThrough& found);

struct PushCounts {
  long steps = 0, pressed = 0;  // pressed: steps in which organs press one another
  long flagged = 0;             // steps with a flag other than NOT_TOUCHABLE, which are not looked at
  long told = 0;                // steps with that flag alone
  long told_in_vain = 0;        // those of them in which no vertex is as deep as that, and no pair gives way as much
  long looked = 0, inside = 0;  // vertices; those that are inside the other organ at all
  long past_sides = 0;          // those that are as deep as one that has passed through, and came in past a side
  double deepest = 0;           // mean edges, beyond the motion of the step
  double largest = 0;           // N, between organs
  long found = 0;
};

class RandomPushes {
 public:
  explicit RandomPushes(std::uint64_t seed, palpate_deformation_model deformation = PALPATE_DEFORMATION_LINEAR);

  // Moves the first organ on its way to a place that changes every 40 steps; returns the step's flags.
  palpate_step_flags step(int s);
  // Far away again, nothing is pressed and nothing is displaced: of a linear organ in three steps, of a hyperelastic body in 300.
  bool leaves_nothing();

  // In mean edges: the depth of the deepest vertex where the last step has left both organs, at this step's poses: where the step has looked for
  // its pair; or the most by which a pair gives way, where that is more.
  double deepest_seen() const;

  double pressed() const { return organs_->pressed(0).norm(); }
  bool presses() const { return organs_->pressed(0).norm() > 1e-3; }
  // told: the step raised NOT_TOUCHABLE.
  void look(std::uint64_t seed, int s, bool told, PushCounts* counts,
            const std::function<void(const PassedThrough&)>& tell);

 private:
  double between(double low, double high);
  std::vector<Stack> bodies() const;
  static double mean_edge(const SurfaceFirst& body);
  void set_pose();
  // A point or direction of an organ in the world; pose: of the first one, which alone moves.
  Eigen::Vector3d turned(std::size_t organ, const palpate_pose& pose, const Eigen::Vector3d& v) const;
  Eigen::Vector3d in_world(std::size_t organ, const palpate_pose& pose, const Eigen::Vector3d& p) const;
  Eigen::Vector3d in_organ(std::size_t organ, const palpate_pose& pose, const Eigen::Vector3d& p) const;

  void look_at(std::uint64_t seed, int s, bool told, std::size_t a, std::size_t b, PushCounts* counts,
               const std::function<void(const PassedThrough&)>& tell);
  // m, by which the pair of a vertex of organ a gives way to organ b.
  double given_way(std::size_t a, std::int32_t node, std::size_t b) const;
  std::size_t nearest_triangle(const DeformedTruth& organ, std::size_t triangles, const Eigen::Vector3d& p) const;
  // Whether the surface of organ a at a vertex faces the one of organ b that is nearest to it: as both are now, and as the last step has
  // left them, at this step's poses, where the step has looked for the vertex's pair.
  bool faces_other(std::size_t a, std::int32_t node, std::size_t b) const;
  Eigen::Vector3d in_organ_direction(std::size_t organ, const Eigen::Vector3d& v) const;

  std::mt19937_64 random_;
  palpate_deformation_model deformation_;
  int kind_;
  std::vector<const TouchedBody*> bodies_;
  std::vector<Eigen::Vector3d> place_;
  std::vector<DeformedTruth> truths_, before_;         // now; in the step before
  std::vector<double> edges_;                          // m, mean
  std::vector<std::vector<std::vector<char>>> faces_;  // [carrier][other][vertex] when it was last looked at
  std::unique_ptr<Touching> organs_;
  Eigen::Quaterniond upside_down_ = Eigen::Quaterniond::Identity();
  Eigen::Vector3d start_, at_, goal_, turn_, goal_turn_;
  palpate_pose pose_, was_;
};

// One scene; every `every`th step is looked at. seed: which organs, friction and ways.
void play_pushes(std::uint64_t seed, int steps, int every, PushCounts* counts,
                 const std::function<void(const PassedThrough&)>& tell,
                 palpate_deformation_model deformation = PALPATE_DEFORMATION_LINEAR);

}  // namespace palpate::tests
