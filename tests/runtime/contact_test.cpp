// Contacts against the dense solve of the same mesh: displacements, forces, alpha_v, rows that come and go.
#include "tests/runtime/touched_box.h"
#include "tests/support/box_corridor.h"

namespace palpate::tests {
namespace {

// u and the nodal forces K u with the given dofs imposed and the bundle's fixed dofs at zero.
struct Reference {
  Eigen::VectorXd u, force;
};
Reference dirichlet(const TouchedBox& box, const std::vector<std::pair<Eigen::Index, double>>& imposed) {
  const Eigen::MatrixXd stiffness = box.stiffness();
  std::vector<bool> held(box.fixed.begin(), box.fixed.end());
  Eigen::VectorXd u = Eigen::VectorXd::Zero(box.dofs());
  for (const auto& [dof, value] : imposed) held[dof] = true, u[dof] = value;
  u = solve_imposed(stiffness, held, u, Eigen::VectorXd::Zero(u.size()));
  return {u, stiffness * u};
}

Eigen::Vector3d wave(std::int32_t n) {
  return 0.002 * Eigen::Vector3d(std::sin(3.1 * n), std::cos(1.7 * n), std::sin(0.9 * n + 1));
}

double relative_difference(const std::vector<float>& u, const Eigen::VectorXd& reference) {
  const Eigen::VectorXd ours =
      Eigen::Map<const Eigen::VectorXf>(u.data(), static_cast<Eigen::Index>(u.size())).cast<double>();
  return (ours - reference).norm() / reference.norm();
}

// A scene in which one tool holds grips.
struct Held : TouchedScene {
  Held(const TouchedBox& box, const SceneDef& def, const std::vector<palpate_grip>& grips) : TouchedScene(box, def) {
    hold(grips);
  }
};

class Superposition : public testing::TestWithParam<int> {};

// The bound: columns are stored to 6e-8 of their largest entry; the contact system amplifies that by its condition,
// about 30 for a patch of all nodes here, and sums it over sqrt(3 contacts) <= 20 columns: 4e-5 at the worst, 1e-5
// allowed.
TEST_P(Superposition, OfNodeContactsEqualsAFullDirichletSolve) {
  SceneDef def = unlimited_def(PALPATE_SHAPE_VOLUME);
  def.max_points = def.max_contact_nodes = 200;
  const int count = std::min<int>(GetParam(), static_cast<int>(tiny_box().touchable.size()));
  std::vector<palpate_grip> grips;
  std::vector<std::pair<Eigen::Index, double>> imposed;
  for (int c = 0; c < count; ++c) {
    const std::int32_t n = tiny_box().touchable[c * tiny_box().touchable.size() / count];
    grips.push_back(grip_at_node(n, wave(n)));
    for (int d = 0; d < 3; ++d) imposed.emplace_back(3 * n + d, wave(n)[d]);
  }
  Held held(tiny_box(), def, grips);
  Contacts& contacts = held.contacts;
  EXPECT_EQ(held.flags, 0u);
  const Reference reference = dirichlet(tiny_box(), imposed);
  EXPECT_LT(relative_difference(held.shape(), reference.u), 1e-5);

  // The contact forces are the reactions K u, and the tool feels their sum reversed.
  ASSERT_EQ(contacts->node_count, count);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero(), expected_sum = Eigen::Vector3d::Zero();
  double largest = 0, error = 0;
  for (int c = 0; c < count; ++c) {
    const palpate_contact_node& node = contacts.nodes()[c];
    const Eigen::Vector3d expected = reference.force.segment<3>(3 * node.node), force(node.force);
    error = std::max(error, (force - expected).norm()), largest = std::max(largest, expected.norm());
    sum += force, expected_sum += expected;
  }
  EXPECT_LT(error, 1e-5 * largest);
  EXPECT_LT((held.force() + sum).norm(), 1e-12 * largest * count);
}
INSTANTIATE_TEST_SUITE_P(Contacts, Superposition, testing::Values(1, 4, 30, 1000));

TEST(Contact, WithSingleFixedDofsEqualsAFullDirichletSolve) {
  const TouchedBox box({.single_dof = true});
  // The last surface node is fixed along x alone: its imposed x is ignored, its imposed y and z are held.
  const std::int32_t held = box.body.surface_nodes - 1, other = box.touchable[3];
  const std::vector<palpate_grip> grips = {grip_at_node(held, wave(held)), grip_at_node(other, wave(other))};
  std::vector<std::pair<Eigen::Index, double>> imposed;
  for (int d = 0; d < 3; ++d) {
    if (d > 0) imposed.emplace_back(3 * held + d, wave(held)[d]);
    imposed.emplace_back(3 * other + d, wave(other)[d]);
  }
  const Reference reference = dirichlet(box, imposed);
  const auto u = Held(box, unlimited_def(), grips).shape();
  EXPECT_LT(relative_difference(u, reference.u.head(u.size())), 1e-6);  // two contacts: a few roundings of f32
}

TEST(Contact, LeavesTheAxesThatAGripDoesNotImposeForceFree) {
  const std::int32_t n = tiny_box().body.triangles[tiny_box().far_triangle()][0];
  Held held(tiny_box(), unlimited_def(), {grip_at_node(n, {9, 9, -0.003}, 4)});
  Contacts& contacts = held.contacts;
  EXPECT_EQ(held.flags, 0u);
  const Reference reference = dirichlet(tiny_box(), {{3 * n + 2, -0.003}});
  const auto u = held.shape();
  EXPECT_LT(relative_difference(u, reference.u.head(u.size())), 1e-6);
  EXPECT_EQ(contacts.nodes()[0].force[0], 0);
  EXPECT_EQ(contacts.nodes()[0].force[1], 0);
  EXPECT_NEAR(contacts.nodes()[0].force[2], reference.force[3 * n + 2], 1e-6 * std::abs(reference.force[3 * n + 2]));
}

// Moves one point of a triangle by d under a contact model; returns the point's motion and the work d.F.
struct PlaceMotion {
  Eigen::Vector3d motion, force;
};
PlaceMotion move_place(palpate_contact_model model, Eigen::Vector3d k, Eigen::Vector3d d) {
  const std::int32_t triangle = tiny_box().far_triangle();
  Held held(tiny_box(), unlimited_def(model), {grip_at_place(triangle, k, d)});
  EXPECT_EQ(held.flags, 0u);
  const auto u = held.shape();
  PlaceMotion result{Eigen::Vector3d::Zero(), -held.force()};
  for (int v = 0; v < 3; ++v)
    for (int i = 0; i < 3; ++i) result.motion[i] += k[v] * u[3 * tiny_box().body.triangles[triangle][v] + i];
  return result;
}

// Twice the elastic energy of a shape, from the dense stiffness.
double energy_of(palpate_contact_model model, Eigen::Vector3d k, Eigen::Vector3d d) {
  const auto u =
      Held(tiny_box(), unlimited_def(model, PALPATE_SHAPE_VOLUME), {grip_at_place(tiny_box().far_triangle(), k, d)})
          .shape();
  const Eigen::VectorXd v = Eigen::Map<const Eigen::VectorXf>(u.data(), tiny_box().dofs()).cast<double>();
  return v.dot(tiny_box().stiffness() * v);
}

TEST(Contact, MovesItsPlaceByTheImposedDisplacementUnderTriangleAndPoint) {
  const Eigen::Vector3d d(-0.003, 0.001, 0.0005);
  for (const auto model : {PALPATE_CONTACT_TRIANGLE, PALPATE_CONTACT_POINT})
    for (const Eigen::Vector3d& k : {Eigen::Vector3d(.2, .3, .5), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(.5, .5, 0),
                                     Eigen::Vector3d(.01, .01, .98)}) {
      const PlaceMotion moved = move_place(model, k, d);
      EXPECT_LT((moved.motion - d).norm(), 1e-6 * d.norm()) << "model " << model;  // f32 columns, three summed
    }
}

TEST(Contact, OfAPointStoresLessEnergyThanThatOfATriangle) {
  const Eigen::Vector3d d(-0.003, 0.001, 0.0005);
  for (const Eigen::Vector3d& k :
       {Eigen::Vector3d(.2, .3, .5), Eigen::Vector3d(.5, .5, 0), Eigen::Vector3d(.01, .01, .98)}) {
    const double point = energy_of(PALPATE_CONTACT_POINT, k, d), triangle = energy_of(PALPATE_CONTACT_TRIANGLE, k, d);
    EXPECT_LT(point, triangle);
    // Clapeyron: twice the energy is force times displacement, for the point's single motion.
    EXPECT_NEAR(point, move_place(PALPATE_CONTACT_POINT, k, d).force.dot(d), 1e-5 * point);  // f32 shape
  }
}

TEST(Contact, ImposesThePapersAlphaOnTheThreeVertices) {
  const Eigen::Vector3d k(.2, .3, .5), d(-0.003, 0.001, 0.0005);
  const std::int32_t triangle = tiny_box().far_triangle();
  const auto u = Held(tiny_box(), unlimited_def(PALPATE_CONTACT_TRIANGLE), {grip_at_place(triangle, k, d)}).shape();
  double interpolated = 0;
  for (int v = 0; v < 3; ++v) {
    const double alpha = k[v] + 1 - k.squaredNorm();
    interpolated += k[v] * alpha;
    for (int i = 0; i < 3; ++i)
      EXPECT_NEAR(u[3 * tiny_box().body.triangles[triangle][v] + i], alpha * d[i], 1e-6 * d.norm());  // f32 columns
  }
  EXPECT_NEAR(interpolated, 1, 1e-15);
}

TEST(Contact, HoldsTheNearestVertexUnderNode) {
  const Eigen::Vector3d d(-0.003, 0.001, 0.0005);
  Held held(tiny_box(), unlimited_def(PALPATE_CONTACT_NODE),
            {grip_at_place(tiny_box().far_triangle(), {.2, .7, .1}, d)});
  ASSERT_EQ(held.contacts->node_count, 1);
  EXPECT_EQ(held.contacts.nodes()[0].node, tiny_box().body.triangles[tiny_box().far_triangle()][1]);
}

// ---- near-dependent rows -----------------------------------------------------------------------------------------

TEST(Contact, AcceptsMoreThanThreePlacesInATriangle) {
  const Eigen::Vector3d d(-0.002, 0.001, 0);
  std::vector<palpate_grip> grips;
  for (const Eigen::Vector3d& k :
       {Eigen::Vector3d(.6, .2, .2), Eigen::Vector3d(.2, .6, .2), Eigen::Vector3d(.2, .2, .6),
        Eigen::Vector3d(.3, .3, .4), Eigen::Vector3d(.4, .4, .2)})
    grips.push_back(grip_at_place(tiny_box().far_triangle(), k, d));
  Held held(tiny_box(), unlimited_def(), grips);
  EXPECT_EQ(held.flags, 0u);  // the targets do not conflict
  const auto u = held.shape();
  for (const std::int32_t n : tiny_box().body.triangles[tiny_box().far_triangle()])
    for (int i = 0; i < 3; ++i)
      EXPECT_NEAR(u[3 * n + i], d[i], 1e-5 * d.norm());  // all agree: the triangle moves as one
}

TEST(Contact, GivesAnUntouchableVertexsWeightToTheOthersAndSaysSo) {
  const Eigen::Vector3d d(0, 0, 0.002);
  for (std::size_t t = 0; t < tiny_box().body.triangles.size(); ++t) {
    int fixed_vertices = 0;
    for (const std::int32_t n : tiny_box().body.triangles[t]) fixed_vertices += tiny_box().fixed[3 * n];
    if (fixed_vertices == 0) continue;
    Held held(tiny_box(), unlimited_def(), {grip_at_place(static_cast<std::int32_t>(t), {.3, .3, .4}, d)});
    Contacts& contacts = held.contacts;
    EXPECT_EQ(held.flags, PALPATE_STEP_NOT_TOUCHABLE);
    EXPECT_EQ(contacts->node_count, 3 - fixed_vertices);
    EXPECT_EQ(palpate_contacts_tool(contacts, 0)->contact_count, fixed_vertices < 3 ? 1 : 0);
    if (fixed_vertices == 3) {
      EXPECT_EQ(Eigen::Vector3d(palpate_contacts_tool(contacts, 0)->force).norm(), 0);
    }
  }
}

TEST(Contact, KeepsTheFirstOnesWhenThereAreTooMany) {
  SceneDef def = unlimited_def();
  def.max_points = def.max_contact_nodes = 4;
  std::vector<palpate_grip> grips;
  for (int i = 0; i < 9; ++i) grips.push_back(grip_at_node(tiny_box().touchable[4 * i], wave(i)));
  Held held(tiny_box(), def, grips);
  EXPECT_EQ(held.flags, PALPATE_STEP_CONTACTS_DROPPED);
  ASSERT_EQ(held.contacts->node_count, 4);
  for (int i = 0; i < 4; ++i) EXPECT_EQ(held.contacts.nodes()[i].node, grips[i].node);
}

// ---- contacts that come and go ----------------------------------------------------------------------------------

// Contacts on every node of the face x = size and of the top. Contacts come and go at both ends of the list, one in the middle
// moves to another node, and axes change. After each step the answer equals that of a scene that has played that step alone.
TEST(Contact, ThatComesAndGoesLeavesTheAnswerOfAFreshScene) {
  SceneDef def = unlimited_def();
  def.max_points = def.max_contact_nodes = 60;
  TouchedScene scene(tiny_box(), def);
  const int touchable = static_cast<int>(tiny_box().touchable.size());
  for (int step = 0; step < 200; ++step) {
    std::vector<palpate_grip> grips;
    for (int g = step % 17; g < 12 + step % 23; ++g) {
      const std::int32_t n = tiny_box().touchable[(g == 15 ? 30 + step : g) % touchable];
      grips.push_back(grip_at_node(n, wave(n), g == 14 && step % 3 == 0 ? 5u : 7u));
    }
    const palpate_step_flags flags = scene.hold(grips);
    Held fresh(tiny_box(), def, grips);
    Contacts& expected = fresh.contacts;
    EXPECT_EQ(fresh.flags, flags);
    ASSERT_EQ(scene.contacts->node_count, expected->node_count);
    double largest = 0, off = 0;
    for (int e = 0; e < expected->node_count; ++e)
      for (int i = 0; i < 3; ++i) {
        largest = std::max(largest, std::abs(expected.nodes()[e].force[i]));
        off = std::max(off, std::abs(scene.contacts.nodes()[e].force[i] - expected.nodes()[e].force[i]));
      }
    EXPECT_LE(off, 4e-10 * largest) << step;  // 1e-16 times 100 rows times a condition of some ten thousand
  }
}

}  // namespace
}  // namespace palpate::tests
