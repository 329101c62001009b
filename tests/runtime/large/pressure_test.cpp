// Pressures on the deforming surface, and volumes that are held, against Newton's method under the forces that the pressure has on the deformed
// surface.
#include <gmock/gmock.h>

#include <numbers>

#include "tests/runtime/asked_scene.h"
#include "tests/runtime/large/large_scene.h"
#include "tests/runtime/moved_box.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using formats::SectionId;
using ::testing::HasSubstr;

constexpr palpate_deformation_model kLargeModels[] = {PALPATE_DEFORMATION_LARGE, PALPATE_DEFORMATION_LARGE_BESIDE,
                                                      PALPATE_DEFORMATION_LARGE_RENEWED};

// A block of 50 mm, held at the face x = 0, with a cavity of 30 mm in its middle, which has no rim.
DenseBody hollow_block() {
  TetrahedralMesh mesh = box_mesh({5, 5, 5}, {0.05, 0.05, 0.05});
  const auto is_in_cavity = [&](const std::array<std::int32_t, 4>& t) {
    Vector3d centre = Vector3d::Zero();
    for (const auto n : t) centre += Vector3d(mesh.nodes[static_cast<std::size_t>(n)].data()) / 4;
    return (centre - Vector3d::Constant(0.025)).cwiseAbs().maxCoeff() < 0.015;
  };
  TetrahedralMesh hollow;
  std::vector<std::int32_t> number(mesh.nodes.size(), -1);
  for (auto t : mesh.tetrahedra) {
    if (is_in_cavity(t)) continue;
    for (auto& n : t) {
      if (number[static_cast<std::size_t>(n)] < 0) {
        number[static_cast<std::size_t>(n)] = static_cast<std::int32_t>(hollow.nodes.size());
        hollow.nodes.push_back(mesh.nodes[static_cast<std::size_t>(n)]);
      }
      n = number[static_cast<std::size_t>(n)];
    }
    hollow.tetrahedra.push_back(t);
  }
  hollow.region.assign(hollow.tetrahedra.size(), 0), hollow.region_names = {"block"};
  DenseBody dense;
  dense.body = surface_first(hollow);
  dense.fixed.assign(3 * hollow.nodes.size(), 0);
  for (std::size_t i = 0; i < dense.body.mesh.nodes.size(); ++i)
    for (std::size_t d = 0; d < 3; ++d) dense.fixed[3 * i + d] = dense.body.mesh.nodes[i][0] == 0;
  return dense;
}

bool is_in_middle(const Vector3d& p) {
  return (p - Vector3d::Constant(0.025)).cwiseAbs().maxCoeff() < 0.016;
}
bool is_on_far_face(const Vector3d& p) {
  return p[0] > 0.06 - 1e-9;
}

// A body whose only motion is a pressure on the triangles all of whose corners are where `on` says.
struct Pressed : TouchedBody {
  Pressed(const DenseBody& dense, bool (*on)(const Vector3d&))
      : TouchedBody(dense, [&](BundleParts& parts) { add_pressure(parts, dense, on); }),
        pieces(triangles_of(dense, on)),
        seen(*this, false, 0),
        reference(seen.body) {}

  static std::vector<std::array<std::int32_t, 3>> triangles_of(const DenseBody& dense, bool (*on)(const Vector3d&)) {
    std::vector<std::array<std::int32_t, 3>> found;
    for (const auto& t : dense.body.triangles)
      if (std::all_of(t.begin(), t.end(), [&](auto n) { return on(node_of(dense, static_cast<std::size_t>(n))); }))
        found.push_back(t);
    return found;
  }
  // N on each dof at 1 Pa, at the displacement u.
  template <class Nodes>
  static VectorXd force_on(const std::vector<std::array<std::int32_t, 3>>& pieces, Nodes node, const VectorXd& u) {
    VectorXd force = VectorXd::Zero(u.size());
    for (const auto& t : pieces) {
      Vector3d p[3];
      for (int v = 0; v < 3; ++v) p[v] = node(t[v]) + u.segment<3>(3 * t[v]);
      for (const auto n : t) force.segment<3>(3 * n) -= (p[1] - p[0]).cross(p[2] - p[0]) / 6;
    }
    return force;
  }
  static void add_pressure(BundleParts& parts, const DenseBody& dense, bool (*on)(const Vector3d&)) {
    const auto pieces = triangles_of(dense, on);
    const auto n = dense.body.mesh.nodes.size(), ns = static_cast<std::size_t>(dense.body.surface_nodes);
    const VectorXd sweep = force_on(
        pieces, [&](auto i) { return node_of(dense, static_cast<std::size_t>(i)); }, VectorXd::Zero(3 * n));
    std::vector<Eigen::Index> free;
    for (std::size_t i = 0; i < 3 * n; ++i)
      if (!dense.fixed[i]) free.push_back(static_cast<Eigen::Index>(i));
    const Eigen::MatrixXd k = dense_stiffness(dense.body.mesh, dense.young, dense.poisson);
    VectorXd row = VectorXd::Zero(3 * n);
    const VectorXd load = sweep(free), solved = Eigen::MatrixXd(k(free, free)).llt().solve(load);
    row(free) = solved;
    const Eigen::VectorXf numbers = row.cast<float>();
    std::vector<std::uint8_t> pressed;
    for (const auto& t : dense.body.triangles)
      pressed.push_back(std::find(pieces.begin(), pieces.end(), t) != pieces.end());
    parts.set_text(SectionId::motion_names, "pressure\n");
    parts.set(SectionId::motion_kinds, {1}, std::vector<std::int32_t>{4});
    parts.set(SectionId::motion_surface, {1, ns, 3}, std::vector<float>(numbers.begin(), numbers.begin() + 3 * ns));
    if (n > ns)
      parts.set(SectionId::motion_interior, {1, n - ns, 3},
                std::vector<float>(numbers.begin() + 3 * ns, numbers.end()));
    parts.set(SectionId::motion_volume, {1, 1}, std::vector<double>{sweep.dot(row)});
    parts.set(SectionId::motion_pressed, {1, pressed.size()}, pressed);
    parts.set(SectionId::motion_residual, {1}, std::vector<double>{1e-15});
    with_large(false)(parts);
  }

  VectorXd force_at(const VectorXd& u) const {
    return force_on(
        pieces, [&](auto n) { return node(n); }, u);
  }
  // m^3, of the straight way to u.
  double swept(const VectorXd& u) const {
    constexpr int parts = 2;  // Simpson's rule is exact
    VectorXd mean = VectorXd::Zero(u.size());
    for (int i = 0; i <= parts; ++i) mean += (i == 1 ? 4 : 1) / 6.0 * force_at(0.5 * i * u);
    return mean.dot(u);
  }
  // The balance under this pressure and rows, from u on. Returns the force of each row on the body, N.
  VectorXd solve(double pressure, const Eigen::MatrixXd& rows, const VectorXd& target, VectorXd* u) const {
    VectorXd force, last = *u;
    for (int i = 0; i < 200; ++i) {
      force = reference.solve(rows, target, u, 1e-9, {}, nullptr, pressure * force_at(*u));
      if ((*u - last).norm() <= 1e-7 * u->norm()) return force;
      last = *u;
    }
    ADD_FAILURE() << "the balance under the pressure was not found";
    return force;
  }
  std::vector<std::array<std::int32_t, 3>> pieces;
  Seen seen;
  LargeReference reference;
};
const Pressed& hollow() {
  static const Pressed shared(hollow_block(), is_in_middle);
  return shared;
}
const Pressed& with_free_rim() {
  static const Pressed shared(dense_box({}), is_on_far_face);
  return shared;
}
constexpr double kCavity = 27e-6;  // m^3, at rest

struct Played : SolvedScene {
  Played(const Pressed& on, palpate_deformation_model deformation) : SolvedScene(on, def_of(deformation)), body(on) {}
  static SceneDef def_of(palpate_deformation_model deformation) {
    SceneDef def = large_def(PALPATE_CONTACT_NODE);
    def.large.deformation = deformation, def.motions.motions = 1, def.shape = PALPATE_SHAPE_VOLUME;
    return def;
  }
  void set(double pressure) {
    palpate_error error = {};
    EXPECT_EQ(palpate_scene_set_motions(get(), &pressure, 1, &error), PALPATE_OK) << error.text;
  }
  void hold(double volume) {
    palpate_error error = {};
    EXPECT_EQ(palpate_scene_hold_volume(get(), 0, 1, volume, &error), PALPATE_OK) << error.text;
  }
  const palpate_motion_state& state() { return *palpate_scene_motion_state(get(), 0); }
  // Compared with the balance under the pressure that it tells.
  void compare(const Eigen::MatrixXd& rows, const VectorXd& target, double field_error, double force_error) {
    const VectorXd found = field();
    VectorXd u = found;
    const VectorXd on_body = body.solve(state().amount, rows, target, &u);
    std::printf("%.0f Pa, %.2f ml, field %.3f %% of %.1f mm\n", state().amount, 1e6 * state().volume,
                100 * (found - u).norm() / u.norm(), 1e3 * u.cwiseAbs().maxCoeff());
    EXPECT_LE((found - u).norm(), field_error * u.norm());
    if (rows.rows() > 0) {
      EXPECT_LE((force() + on_body).norm(), force_error * on_body.norm());
    }
  }
  const Pressed& body;
};

const Eigen::MatrixXd none(const Pressed& on) {
  return Eigen::MatrixXd::Zero(0, on.dofs());
}

// Of the block.
std::int32_t node_on_far_face() {
  for (std::int32_t n = 0; n < hollow().body.surface_nodes; ++n)
    if ((hollow().node(n) - Vector3d(0.05, 0.02, 0.02)).norm() < 1e-9) return n;
  return -1;
}

// It draws the face, which a tool turns by up to 30 degrees.
constexpr double kPull = -1000;  // Pa
TEST(LargePressure, OnAFaceWhoseRimMovesItFollowsTheSurface) {
  for (const auto deformation : kLargeModels) {
    Played played(with_free_rim(), deformation);
    const std::int32_t node = with_free_rim().touchable.back();
    for (int s = 1; s <= 200; ++s) {
      played.set(kPull * s / 200);
      played.step({tool_of({grip_at_node(node, Vector3d(0, 0, 0.02 * s / 200))})});
    }
    for (int s = 0; s < 30; ++s) played.step({tool_of({grip_at_node(node, Vector3d(0, 0, 0.02))})});
    EXPECT_EQ(played.flags, 0u) << deformation;
    EXPECT_NEAR(played.state().amount, kPull, 1e-9);
    played.compare(rows_of_node(with_free_rim(), node), Vector3d(0, 0, 0.02), 0.01, 0.02);
    EXPECT_NEAR(played.state().volume, with_free_rim().swept(played.field()),
                0.05 * std::abs(played.state().volume));  // which depends on the way
  }
}

TEST(LargePressure, ACavityThatIsBlownUpToTwiceItsVolumeAndPressedIsTheConvergedSolution) {
  for (const auto deformation : kLargeModels) {
    Played played(hollow(), deformation);
    int flagged = 0;
    double short_of = 0;
    for (int s = 1; s <= 400; ++s) {
      played.hold(kCavity * s / 400);
      flagged += played.step() != 0;
      short_of = std::max(short_of, std::abs(played.state().volume - kCavity * s / 400));
    }
    for (int s = 0; s < 30; ++s) played.step();
    EXPECT_EQ(played.flags, 0u) << deformation;
    EXPECT_NEAR(played.state().volume, kCavity, 1e-3 * kCavity) << deformation;
    EXPECT_NEAR(played.state().volume, hollow().swept(played.field()), 1e-4 * kCavity) << deformation;
    played.compare(none(hollow()), VectorXd(0), 0.01, 0);
    const double before = played.state().amount;
    const std::int32_t node = hollow().far_triangle() >= 0
                                  ? hollow().body.triangles[static_cast<std::size_t>(hollow().far_triangle())][0]
                                  : 0;
    const Vector3d start = played.field().segment<3>(3 * node);
    Vector3d target = start;
    for (int s = 1; s <= 150; ++s) {
      target = start + Vector3d(-1e-4 * s, 0, 0);
      flagged += played.step({tool_of({grip_at_node(node, target)})}) != 0;
    }
    for (int s = 0; s < 30; ++s) played.step({tool_of({grip_at_node(node, target)})});
    EXPECT_EQ(played.flags, 0u) << deformation;
    EXPECT_NEAR(played.state().volume, kCavity, 1e-3 * kCavity) << deformation;
    EXPECT_GT(played.state().amount, before) << "a full cavity resists";
    played.compare(rows_of_node(hollow(), node), target, 0.01, 0.02);
    std::printf("flagged %d, short of %.2f %%\n", flagged, 100 * short_of / kCavity);
  }
}

// A tool presses the full cavity, goes aside and lifts.
TEST(LargePressure, AWayOnAFullCavityGivesBackNoMoreThanWentIn) {
  for (const auto deformation : kLargeModels) {
    Played played(hollow(), deformation);
    played.hold(0.4 * kCavity);
    for (int s = 0; s < 60; ++s) played.step();
    const std::int32_t node = node_on_far_face();
    const Vector3d start = played.field().segment<3>(3 * node);
    double work = 0, most = 0;
    Vector3d force = Vector3d::Zero(), there = start;
    for (int s = 1; s <= 400; ++s) {
      const double at = 2 * std::numbers::pi * s / 400;
      const Vector3d target = start + 0.008 * Vector3d(std::cos(at) - 1, std::sin(at), 0);
      played.step({tool_of({grip_at_node(node, target)})});
      work += 0.5 * (force + played.force()).dot(target - there);
      force = played.force(), there = target, most = std::max(most, std::abs(work));
    }
    EXPECT_GT(most, 1e-4) << "hardly any work";
    EXPECT_LT(std::abs(work), 0.02 * most) << deformation;
  }
}

TEST(LargePressure, GoesOnFromWhereItIsWhenAVolumeIsHeldAndLetGo) {
  for (const auto deformation : kLargeModels) {
    Played played(hollow(), deformation);
    for (int s = 1; s <= 100; ++s) played.set(6.0 * s), played.step();
    for (int s = 0; s < 20; ++s) played.step();
    const double volume = played.state().volume;
    EXPECT_EQ(played.state().amount, 600);
    played.hold(volume);
    for (int s = 0; s < 20; ++s) {
      EXPECT_EQ(played.step(), 0u);
      EXPECT_NEAR(played.state().amount, 600, 6) << s;
      EXPECT_NEAR(played.state().volume, volume, 1e-3 * volume) << s;
    }
    played.hold(1.5 * volume);
    for (int s = 0; s < 100; ++s) played.step();
    const double held = played.state().amount;
    EXPECT_GT(held, 700);
    ASSERT_EQ(palpate_scene_hold_volume(played.get(), 0, 0, 0, nullptr), PALPATE_OK);
    for (int s = 0; s < 20; ++s) played.step();
    EXPECT_NEAR(played.state().amount, held, 1e-6 * held);
    EXPECT_NEAR(played.state().volume, 1.5 * volume, 2e-3 * volume);
    played.set(0);
    for (int s = 0; s < 400; ++s) played.step();
    EXPECT_EQ(played.flags, 0u);
    EXPECT_NEAR(played.state().volume, 0, 1e-3 * volume);
    EXPECT_LT(played.field().cwiseAbs().maxCoeff(), 2e-5);
  }
}

// Volumes and a tool that jump about, far beyond what the body can bear at times.
TEST(LargePressure, RandomStepsStayFiniteAndTheBodyComesBack) {
  for (const auto deformation : kLargeModels) {
    Played played(hollow(), deformation);
    const std::int32_t node = node_on_far_face();
    std::uint64_t seed = 7;
    const auto draw = [&] {
      return static_cast<double>((seed = seed * 6364136223846793005u + 1442695040888963407u) >> 11) / 0x1p53;
    };
    int trusted = 0;
    Vector3d target = Vector3d::Zero();
    for (int s = 0; s < 1500; ++s) {
      if (s % 40 == 0) {
        if (draw() < 0.3) {
          ASSERT_EQ(palpate_scene_hold_volume(played.get(), 0, 0, 0, nullptr), PALPATE_OK);
          played.set(2000 * draw() - 1000);
        } else {
          played.hold((2.5 * draw() - 0.8) * kCavity);
        }
      }
      target += 2e-4 * Vector3d(draw() - 0.5, draw() - 0.5, draw() - 0.5);
      const bool touches = s / 60 % 2 == 0;
      if (!touches) target = Vector3d::Zero();
      trusted +=
          played.step(touches ? std::vector{tool_of({grip_at_node(node, target)})} : std::vector<palpate_tool>{}) == 0;
      ASSERT_TRUE(played.field().allFinite()) << s;
      ASSERT_LT(played.field().cwiseAbs().maxCoeff(), 0.2) << s;
      ASSERT_TRUE(std::isfinite(played.state().amount)) << s;
    }
    std::printf("%d: %d of 1500 trusted\n", deformation, trusted);
    EXPECT_GT(trusted, 500) << deformation;
    played.hold(0);
    for (int s = 0; s < 600; ++s) played.step();
    EXPECT_EQ(played.flags, 0u) << deformation;
    EXPECT_NEAR(played.state().volume, 0, 1e-4 * kCavity) << deformation;
    EXPECT_LT(played.field().cwiseAbs().maxCoeff(), 1e-4) << deformation;
  }
}

// Beyond a limit a body under a pressure has no balance: it grows without end.
TEST(LargePressure, APressureBeyondTheBodysLimitStaysFiniteAndIsFlagged) {
  for (const auto deformation : kLargeModels) {
    Played played(hollow(), deformation);
    for (int s = 0; s < 120; ++s) {
      played.set(6000);
      played.step();
      ASSERT_TRUE(played.field().allFinite()) << s;
    }
    EXPECT_NE(played.flags, 0u) << deformation;
    palpate_scene_reset(played.get());
    played.set(0);
    for (int s = 0; s < 30; ++s) played.step();
    EXPECT_EQ(played.flags, 0u) << deformation;
    EXPECT_LT(played.field().cwiseAbs().maxCoeff(), 1e-5) << deformation;
  }
}

TEST(LargePressure, NeedsTheTrianglesOnWhichItActs) {
  const TouchedBody without(dense_box({}), [](BundleParts& parts) {
    add_motions(parts, dense_box({}));
    parts.sections.erase(SectionId::motion_pressed);
    with_large(false)(parts);
  });
  TouchedScene scene(without, Played::def_of(PALPATE_DEFORMATION_LARGE));
  palpate_error error = {};
  EXPECT_EQ(palpate_scene_set_motions(scene.get(), Eigen::Vector4d(0, 0, 1, 0).data(), kMotions, &error),
            PALPATE_ERROR_ARGUMENT);
  EXPECT_THAT(error.text, HasSubstr("pressure 2 needs motion/pressed"));
  EXPECT_EQ(palpate_scene_hold_volume(scene.get(), kFilling, 1, 0, &error), PALPATE_ERROR_ARGUMENT);
  EXPECT_THAT(error.text, HasSubstr("pressure 2"));
}

}  // namespace
}  // namespace palpate::tests
