// Links of an organ whose supports move, under pressure and gravity: against the dense body under the forces that the links report, and
// against a pose that moves where the motion is rigid.
#include <Eigen/Dense>
#include <numbers>

#include "tests/runtime/asked_scene.h"
#include "tests/runtime/linked_scene.h"
#include "tests/runtime/moved_box.h"
#include "tests/support/box_corridor.h"

namespace palpate::tests {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::Vector4d;
using Eigen::VectorXd;

const MovedBox& box() {
  static const MovedBox shared(true);
  return shared;
}

// A triangle of the far face none of whose nodes is held.
std::int32_t free_triangle(int which) {
  for (int i = 0;; ++i) {
    const std::int32_t triangle = box().far_triangle(i);
    bool held = false;
    for (const auto node : box().body.triangles[triangle]) held = held || box().fixed[3 * node];
    if (!held && which-- == 0) return triangle;
  }
}

palpate_link_end beside(std::int32_t triangle, const Vector3d& way) {
  return in_world(box().place(triangle, kMiddle) + way);
}

SceneDef linked_def() {
  SceneDef def = moved_def();
  def.collision = PALPATE_COLLISION_OFF, def.links.max_links = 8;
  return def;
}

struct Played : LinkedScene {
  explicit Played(const std::vector<palpate_link>& given) : LinkedScene(box(), linked_def()) { set(given); }
};

// The dense body under motions, and the forces that the links report on their ends.
VectorXd solve_fully(const Vector4d& q, Played& played) {
  const MatrixXd k = box().stiffness();
  VectorXd load = k * box().motions.field * q, u = VectorXd::Zero(k.rows());
  for (Eigen::Index i = 0; i < k.rows(); ++i)
    if (box().fixed[i]) u[i] = box().motions.field.row(i).dot(q);
  for (std::size_t l = 0; l < played.links.size(); ++l)
    for (int e = 0; e < 2; ++e) {
      const palpate_link_end& end = played.links[l].ends[e];
      for (int v = 0; v < 3 && end.kind == PALPATE_END_SURFACE_POINT; ++v)
        load.segment<3>(3 * box().body.triangles[end.triangle][v]) +=
            (e ? -1 : 1) * end.barycentric[v] * Vector3d(played.state(l).force);
    }
  return solve_imposed(k, {box().fixed.begin(), box().fixed.end()}, u, load);
}

// Columns and motions are stored in single precision: 6e-8 of displacements of a centimetre, some of them. A line that turned by less than
// 0.1 milliradian keeps its row.
void expect_equilibrium(const Vector4d& q, Played& played) {
  played.expect_laws(solve_fully(q, played), 2e-8, 0, 2e-3);
}

Vector4d phase(double t) {
  return {0.005 * std::sin(t), 0.05 * std::cos(t), 80 * std::sin(2 * t), 9.81 * std::cos(t)};
}

TEST(MovedLinks, OfABreathingOrganHaveTheForcesOfAFullSolveAtEveryPhase) {
  const std::int32_t one = box().far_triangle(0), other = box().far_triangle(14), third = box().far_triangle(7);
  Played played(
      {link_of(PALPATE_LINK_THREAD, on_surface(one), on_surface(other), 0.02, 200),
       link_of(PALPATE_LINK_SPRING, on_surface(third), beside(third, {0.01, 0.02, -0.01}), 0.02, 60),
       link_of(PALPATE_LINK_CLIP, on_surface(box().far_triangle(3)), on_surface(box().far_triangle(9)), 0, 400)});
  for (int p = 0; p < 8; ++p) {
    const Vector4d q = phase(2 * std::numbers::pi * p / 8);
    set_amounts(played.scene.get(), q);
    ASSERT_EQ(played.steps(60), 0u) << p;
    expect_equilibrium(q, played);
  }
}

TEST(MovedLinks, AnOrganThatHangsOnALigamentIsHeldBackInEachBreath) {
  const std::int32_t triangle = free_triangle(4);
  // A thread that is just slack at rest: it bears a force while the organ moves away from its point, and none else.
  Played played({link_of(PALPATE_LINK_THREAD, on_surface(triangle), beside(triangle, {-0.03, 0, 0}), 0.0302, 300)});
  int taut = 0, slack = 0;
  for (int s = 0; s < 600; ++s) {
    const double breath = 0.004 * std::sin(2 * std::numbers::pi * s / 200);
    set_amounts(played.scene.get(), {breath, 0, 0, 0});
    ASSERT_EQ(played.steps(1), 0u);
    const palpate_link_state& state = played.state();
    (state.condition == PALPATE_LINK_TAUT ? taut : slack)++;
    EXPECT_GE(state.tension, 0);
    EXPECT_LT(state.tension, 0.004 * 300);
    if (s % 200 == 50) {
      played.steps(40);
      EXPECT_GT(state.tension, 0.05);
      expect_equilibrium({breath, 0, 0, 0}, played);
    }
    if (breath < 0) {
      EXPECT_EQ(state.tension, 0) << s;
    }
  }
  EXPECT_GT(taut, 200);
  EXPECT_GT(slack, 200);
}

TEST(MovedLinks, ALinkToAFixedPlaceFollowsTheSupportThatHoldsIt) {
  // All three vertices of this triangle are held and move with the supports.
  std::int32_t fixed = -1;
  for (std::int32_t f = 0; f < static_cast<std::int32_t>(box().body.triangles.size()) && fixed < 0; ++f) {
    bool all = true;
    for (int v = 0; v < 3; ++v) all = all && box().fixed[3 * (box().body.triangles[f][v])];
    if (all) fixed = f;
  }
  ASSERT_GE(fixed, 0);
  Played played({link_of(PALPATE_LINK_SPRING, on_surface(fixed), on_surface(free_triangle(4)), 0.04, 40)});
  for (const double q : {0.0, 0.004, -0.003}) {
    set_amounts(played.scene.get(), {q, 0.02, 0, 0});
    ASSERT_EQ(played.steps(60), 0u);
    expect_equilibrium({q, 0.02, 0, 0}, played);
  }
}

TEST(MovedLinks, AHeldVolumeIsMetBesideALink) {
  Played played({link_of(PALPATE_LINK_THREAD, on_surface(box().far_triangle(0)), on_surface(box().far_triangle(14)),
                         0.02, INFINITY)});
  constexpr double volume = 2e-6;
  set_amounts(played.scene.get(), {0.002, 0, 0, 5});
  ASSERT_EQ(palpate_scene_hold_volume(played.scene.get(), kFilling, 1, volume, nullptr), PALPATE_OK);
  ASSERT_EQ(played.steps(60), 0u);
  const palpate_motion_state& filling = *palpate_scene_motion_state(played.scene.get(), kFilling);
  EXPECT_NEAR(filling.volume, volume, 1e-5 * volume);
  expect_equilibrium({0.002, 0, filling.amount, 5}, played);
}

TEST(MovedLinks, GoOnFromASavedStateWithTheSameBits) {
  const std::vector<palpate_link> links = {
      link_of(PALPATE_LINK_THREAD, on_surface(box().far_triangle(0)), on_surface(box().far_triangle(14)), 0.026, 200)};
  Played saved(links), restored(links);
  const auto breathe = [](Played& played, int s) {
    set_amounts(played.scene.get(), {0.004 * std::sin(0.05 * s), 0, 60 * std::sin(0.11 * s), 0});
    played.steps(1);
  };
  for (int s = 0; s < 40; ++s) breathe(saved, s);
  restore_from(saved.scene.get(), restored.scene.get());
  for (int s = 40; s < 120; ++s) {
    breathe(saved, s), breathe(restored, s);
    ASSERT_TRUE(saved.has_bytes_of(restored)) << s;
    ASSERT_EQ(std::memcmp(&saved.state(), &restored.state(), sizeof(palpate_link_state)), 0) << s;
  }
}

// A slack thread is measured only where its bound is used up: it must see what motions do to it, too.
TEST(MovedLinks, ASlackThreadIsStretchedByTheMotionsAlone) {
  const std::int32_t triangle = free_triangle(4);
  Played played({link_of(PALPATE_LINK_THREAD, on_surface(triangle), beside(triangle, {-0.02, 0, 0}), 0.022, INFINITY)});
  for (int s = 0; s < 30; ++s) {
    set_amounts(played.scene.get(), {0, 0, 0, 0});
    played.steps(1);
    ASSERT_EQ(played.state().condition, PALPATE_LINK_SLACK);
  }
  set_amounts(played.scene.get(), {0.004, 0, 0, 0});
  played.steps(2);
  EXPECT_EQ(played.state().condition, PALPATE_LINK_TAUT);
  EXPECT_GT(played.state().tension, 0.01);
}

}  // namespace
}  // namespace palpate::tests
