// Corridors: which tetrahedra a capsule meets, and the columns of its nodes against dense solves and those of touchable nodes.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "precompute/elements/segment_distance.h"
#include "precompute/tensors/corridor_columns.h"
#include "precompute/tensors/probe_columns.h"
#include "tests/precompute/support.h"
#include "tests/support/texts.h"

namespace palpate::tests {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using ::testing::AllOf;
using ::testing::HasSubstr;
using Point = std::array<double, 3>;

Point mixed(const Point& a, const Point& b, double t) {
  return {a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1]), a[2] + t * (b[2] - a[2])};
}

BoundaryConfig::Fixed held(std::array<bool, 3> dofs, const Selector& where) {
  return {dofs, {where}};
}
Selector inside_near(const Point& p) {
  return {.kind = Selector::Kind::nearest, .whole_mesh = true, .points = {p}};
}

ElasticBody body_with(const TetrahedralMesh& mesh, const std::vector<BoundaryConfig::Corridor>& corridors,
                      const std::vector<BoundaryConfig::Fixed>& fixed = {}) {
  BoundaryConfig boundary;
  boundary.fixed = fixed;
  boundary.corridors = corridors;
  return supported(mesh, {5400, 0.45, 0}, boundary);
}

TetrahedralMesh box(double jitter = 0.2) {
  return box_mesh({4, 4, 3}, {0.06, 0.05, 0.04}, jitter);
}

Corners corners_of(const ElasticBody& body, const std::array<std::int32_t, 4>& t) {
  return {body.nodes[t[0]], body.nodes[t[1]], body.nodes[t[2]], body.nodes[t[3]]};
}

// Whether the point is in the tetrahedron, or misses it by a rounding.
bool holds(const Corners& corners, const Point& p) {
  Eigen::Matrix4d a;
  for (int i = 0; i < 4; ++i) a.col(i) << Vector3d(corners[static_cast<std::size_t>(i)].data()), 1;
  const Eigen::Vector4d share = a.fullPivLu().solve(Eigen::Vector4d(p[0], p[1], p[2], 1));
  return share.minCoeff() >= -1e-13;
}

// ---- which tetrahedra -----------------------------------------------------------------------------------------------

TEST(SegmentDistance, IsThatOfTheNearestOfManyPoints) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-1, 1);
  const auto point = [&] { return Point{place(random), place(random), place(random)}; };
  int through = 0;
  for (int round = 0; round < 300; ++round) {
    const Corners corners = {point(), point(), point(), point()};
    const Point from = point(), to = round % 5 ? point() : from;
    const double found = segment_distance(corners, from, to);
    through += found == 0;
    // Points of the tetrahedron at a 20th of its edges: none is nearer, and one is not farther than their spacing away.
    double nearest = INFINITY, longest = 0;
    constexpr int steps = 20;
    for (int i = 0; i <= steps; ++i)
      for (int j = 0; i + j <= steps; ++j)
        for (int k = 0; i + j + k <= steps; ++k) {
          Point p{};
          const std::array<int, 4> share = {i, j, k, steps - i - j - k};
          for (std::size_t c = 0; c < 4; ++c)
            for (std::size_t d = 0; d < 3; ++d) p[d] += share[c] * corners[c][d] / steps;
          nearest = std::min(nearest, segment_distance(p, from, to));
        }
    for (const Point& a : corners)
      for (const Point& b : corners) longest = std::max(longest, segment_distance(a, b, b));
    EXPECT_LE(found, nearest + 1e-12) << round;
    EXPECT_GE(found, nearest - longest / steps) << round;
  }
  EXPECT_GT(through, 20);
}

TEST(SegmentDistance, IsExactForEachPartOfATetrahedron) {
  const Corners corners = {Point{0, 0, 0}, Point{1, 0, 0}, Point{0, 1, 0}, Point{0, 0, 1}};
  EXPECT_DOUBLE_EQ(segment_distance(corners, {-1, -1, -2}, {-1, -1, -2}), std::sqrt(6.0)) << "a corner";
  EXPECT_DOUBLE_EQ(segment_distance(corners, {0.2, 0.2, -3}, {0.2, 0.2, -0.5}), 0.5) << "an end over a face";
  EXPECT_DOUBLE_EQ(segment_distance(corners, {0.5, -1, -0.5}, {0.5, 1, -0.5}), 0.5) << "the middle over a face";
  EXPECT_DOUBLE_EQ(segment_distance(corners, {0.5, -0.3, -2}, {0.5, -0.3, 2}), 0.3) << "across an edge";
  EXPECT_DOUBLE_EQ(segment_distance(corners, {0, -0.25, -0.25}, {1, -0.25, -0.25}), std::sqrt(0.125)) << "along one";
  EXPECT_EQ(segment_distance(corners, {0.1, 0.1, 0.1}, {0.2, 0.1, 0.1}), 0) << "inside";
  EXPECT_EQ(segment_distance(corners, {0.1, 0.1, -5}, {0.1, 0.1, 5}), 0) << "through";
  EXPECT_EQ(segment_distance(corners, {-1, 1, 0}, {1, -1, 0}), 0) << "through a corner alone";
  EXPECT_EQ(segment_distance(corners, {0, 0, 0}, {1, 0, 0}), 0) << "an edge";
}

TEST(CorridorNodes, AThinCorridorHasTheNodesOfEveryTetrahedronThatItsSegmentPasses) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> share(0, 1);
  const auto anywhere = [&] { return Point{0.06 * share(random), 0.05 * share(random), 0.04 * share(random)}; };
  for (const double jitter : {0.0, 0.2}) {
    const TetrahedralMesh mesh = box(jitter);
    for (int round = 0; round < 12; ++round) {
      // Without jitter, also along edges and through corners of the mesh.
      Point from = anywhere(), to = anywhere();
      if (round % 3 == 0) from = mesh.nodes[static_cast<std::size_t>(17 + 5 * round)];
      if (round % 3 == 1) from = {0.03, -0.01, 0.04 / 3}, to = {0.03, 0.06, 0.04 / 3};
      const ElasticBody body = body_with(mesh, {{"thin", from, to, 1e-9, 4}});
      std::set<std::int32_t> passed;
      for (const auto& t : body.tetrahedra)
        for (int step = 0; step <= 500; ++step)
          if (holds(corners_of(body, t), mixed(from, to, step / 500.0))) {
            for (const auto n : t)
              if (n >= body.surface_count) passed.insert(n);
            break;
          }
      ASSERT_FALSE(passed.empty());
      EXPECT_TRUE(std::includes(body.corridor_nodes.begin(), body.corridor_nodes.end(), passed.begin(), passed.end()))
          << jitter << ' ' << round;
    }
  }
}

TEST(CorridorNodes, AreThoseOfTheTetrahedraWithinTheRadiusAndOfNoOther) {
  const Point from = {0.01, 0.02, 0.015}, to = {0.03, 0.03, 0.02};
  const double radius = 0.004;
  const ElasticBody body = body_with(box(), {{"thick", from, to, radius, 4}});
  std::set<std::int32_t> near;
  for (const auto& t : body.tetrahedra)
    if (segment_distance(corners_of(body, t), from, to) <= radius)
      for (const auto n : t)
        if (n >= body.surface_count) near.insert(n);
  EXPECT_EQ(std::vector<std::int32_t>(near.begin(), near.end()), body.corridor_nodes);
  EXPECT_LT(near.size(), body.nodes.size() - static_cast<std::size_t>(body.surface_count));
  EXPECT_EQ(body.corridors.at(0).nodes, body.corridor_nodes);
}

TEST(CorridorNodes, OfSeveralCorridorsAreOneAscendingList) {
  const ElasticBody body = body_with(box(), {{"end", {0.05, 0.04, 0.03}, {0.05, 0.04, 0.03}, 0.001, 4},
                                             {"begin", {0.01, 0.01, 0.01}, {0.02, 0.02, 0.02}, 0.001, 9},
                                             {"all", {0.03, 0.02, 0.02}, {0.03, 0.02, 0.02}, 0.1, 14}});
  ASSERT_EQ(body.corridors.size(), 3u);
  EXPECT_NE(body.corridors[0].nodes, body.corridors[1].nodes);
  EXPECT_TRUE(std::is_sorted(body.corridor_nodes.begin(), body.corridor_nodes.end()));
  EXPECT_EQ(body.corridor_nodes.size(), 3u * 3 * 2) << "a ball around the box has every node inside it, once";
  EXPECT_EQ(body.corridor_nodes.front(), body.surface_count);
}

std::string refusal_of(const TetrahedralMesh& mesh, const std::vector<BoundaryConfig::Corridor>& corridors) {
  return input_error([&] { body_with(mesh, corridors); });
}

TEST(CorridorNodes, ThatAreNoneOrTooManyAreRefusedInOneSentence) {
  EXPECT_THAT(refusal_of(box(), {{"off", {0.07, 0, 0}, {0.09, 0, 0}, 0.009, 12}}),
              AllOf(HasSubstr("bc.toml:12: [[corridor]] \"off\": "), HasSubstr("mesh_unit")));
  EXPECT_THAT(refusal_of(box(), {{"far", {1e15, -1e15, 1e15}, {2e14, -1e15, 1e15}, 1e3, 12}}), HasSubstr("found none"));
  EXPECT_EQ(refusal_of(box(), {{"on", {0.07, 0.025, 0.02}, {0.09, 0.025, 0.02}, 0.0101, 12}}), "");
  EXPECT_THAT(refusal_of(box_mesh({2, 1, 1}, {2, 1, 1}), {{"flat", {0, 0, 0}, {2, 1, 1}, 0.1, 7}}),
              HasSubstr("bc.toml:7: [[corridor]] \"flat\": "));
  const Point middle = {0.5, 0.5, 0.5};
  EXPECT_THAT(
      refusal_of(box_mesh({14, 14, 14}, {1, 1, 1}), {{"some", middle, middle, 0.01, 3}, {"all", middle, middle, 1, 8}}),
      HasSubstr("bc.toml:8: [[corridor]] \"all\": "));
}

// ---- columns --------------------------------------------------------------------------------------------------------

class CorridorColumns : public ::testing::TestWithParam<Element> {};
INSTANTIATE_TEST_SUITE_P(Elements, CorridorColumns, ::testing::ValuesIn(kElements), name_of_instance);

// Of the nodes inside, one is held along all axes and one along y.
ElasticBody body_with_held_nodes() {
  return body_with(
      box(), {{"across", {0.01, 0.01, 0.01}, {0.05, 0.04, 0.03}, 0.004, 1}},
      {held({true, true, true}, patch("x0")), held({true, true, true}, inside_near({0.015, 0.0125, 0.013})),
       held({false, true, false}, inside_near({0.03, 0.025, 0.026}))});
}

struct Solved {
  Discretisation discretisation;
  SolvedCorridor corridor;
};

Solved solve(const ElasticBody& body, Element element, bool interior = true, int width = 8) {
  Solved result{discretise(body, element), {}};
  const HeldStiffness stiffness = remove_held_dofs(result.discretisation.stiffness, result.discretisation.fixed);
  ColumnSolver solver(stiffness.matrix, row_coordinates(result.discretisation, stiffness),
                      {.tolerance = 1e-13, .width = width});
  result.corridor =
      solve_corridor(result.discretisation, stiffness, {body.corridor_nodes, body.surface_count, interior}, solver);
  return result;
}

TEST_P(CorridorColumns, EqualADenseSolveAndAreZeroOnHeldDofs) {
  const ElasticBody body = body_with_held_nodes();
  const std::size_t k_count = body.corridor_nodes.size(), ns = static_cast<std::size_t>(body.surface_count);
  const std::size_t inside = body.nodes.size() - ns;
  ASSERT_GT(k_count, 3u);
  ASSERT_LT(k_count, inside);
  const auto [d, found] = solve(body, GetParam());
  ASSERT_EQ(found.surface.size(), k_count * 9 * ns);
  ASSERT_EQ(found.interior.size(), k_count * 9 * inside);
  ASSERT_EQ(found.compliance.size(), 9 * k_count * k_count);
  ASSERT_EQ(found.residual.size(), 3 * k_count);
  const MatrixXd all = dense(d.stiffness);
  std::vector<Eigen::Index> free;
  for (Eigen::Index i = 0; i < all.rows(); ++i)
    if (!d.fixed[i / 3][i % 3]) free.push_back(i);
  const auto factor = MatrixXd(all(free, free)).llt();
  int held_columns = 0;
  for (std::size_t k = 0; k < k_count; ++k)
    for (std::size_t j = 0; j < 3; ++j) {
      const auto node = static_cast<std::size_t>(body.corridor_nodes[k]);
      VectorXd load = VectorXd::Zero(all.rows()), u = load;
      if (!body.fixed[node][j]) load(static_cast<Eigen::Index>(3 * node + j)) = 1;
      held_columns += body.fixed[node][j];
      u(free) = VectorXd(factor.solve(VectorXd(load(free))));
      const auto expected = read_vertices(d, {u.data(), static_cast<std::size_t>(u.size())});
      double largest = 0;
      for (const double x : expected) largest = std::max(largest, std::abs(x));
      // Rounding to f32, and the solver's tolerance times a condition of 1e4.
      const double bound = 1e-7 * largest;
      const std::size_t column = 3 * k + j;
      for (std::size_t i = 0; i < expected.size(); ++i) {
        const double stored = i < 3 * ns ? static_cast<double>(found.surface[column * 3 * ns + i])
                                         : static_cast<double>(found.interior[column * 3 * inside + i - 3 * ns]);
        ASSERT_NEAR(stored, expected[i], bound) << k << ' ' << j << ' ' << i;
        if (body.fixed[i / 3][i % 3]) {
          ASSERT_EQ(stored, 0) << i;
        }
      }
      EXPECT_LE(found.residual[column], 1e-13);
      EXPECT_EQ(found.residual[column] == 0, largest == 0);
    }
  EXPECT_EQ(held_columns, 4);
}

TEST_P(CorridorColumns, HaveACompatibleSymmetricCompliance) {
  const ElasticBody body = body_with_held_nodes();
  const auto [d, found] = solve(body, GetParam());
  const std::size_t dofs = 3 * body.corridor_nodes.size(), run = found.interior.size() / dofs;
  for (std::size_t a = 0; a < dofs; ++a)
    for (std::size_t b = 0; b < dofs; ++b) {
      ASSERT_EQ(found.compliance[a * dofs + b], found.compliance[b * dofs + a]) << "to the bit";
      const auto at = static_cast<std::size_t>(3 * (body.corridor_nodes[b / 3] - body.surface_count)) + b % 3;
      ASSERT_EQ(found.compliance[a * dofs + b], found.interior[a * run + at]) << a << ' ' << b;
    }
}

TEST(CorridorBatches, OfAnyWidthGiveTheSameBytesWithAndWithoutTheInterior) {
  const ElasticBody body = body_with_held_nodes();
  const SolvedCorridor narrow = solve(body, Element::p1, true, 8).corridor,
                       wide = solve(body, Element::p1, false, 96).corridor;
  EXPECT_EQ(narrow.surface, wide.surface);
  EXPECT_EQ(narrow.compliance, wide.compliance);
  EXPECT_TRUE(wide.interior.empty());
  EXPECT_EQ(corridor_bytes(body.corridor_nodes.size(), body.nodes.size()),
            4.0 * static_cast<double>(narrow.surface.size() + narrow.interior.size() + narrow.compliance.size()));
}

}  // namespace
}  // namespace palpate::tests
