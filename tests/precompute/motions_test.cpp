// Motions of supports, pressure and gravity: rigid motions, dense solves of the energy, Lame's thick sphere, volumes.
#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <map>
#include <numbers>

#include "formats/organ_config.h"
#include "precompute/elements/motion_loads.h"
#include "precompute/tensors/motions.h"
#include "precompute/tensors/preload.h"
#include "precompute/tensors/probe_columns.h"
#include "studies/bodies/imposed.h"
#include "studies/validation/shapes.h"
#include "tests/precompute/support.h"
#include "tests/support/test_files.h"
#include "tests/support/texts.h"

namespace palpate::tests {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using ::testing::HasSubstr;
using Kind = BoundaryConfig::Motion::Kind;

Selector ball(double radius) {
  return {.kind = Selector::Kind::sphere, .number = radius};
}
BoundaryConfig::Fixed held(const Selector& where) {
  return {{true, true, true}, {where}};
}
BoundaryConfig::Foundation foundation(const char* name, const Selector& where, double normal, double tangential) {
  return {.name = name, .normal = {normal, "test"}, .tangential = {tangential, "test"}, .select = {where}};
}
BoundaryConfig::Motion piston(const Point& axis, std::vector<Selector> select = {}) {
  return {.kind = Kind::piston, .name = "piston", .axis = axis, .select = std::move(select)};
}
BoundaryConfig::Motion rotation(const Point& axis, const Point& point, std::vector<Selector> select = {}) {
  return {.kind = Kind::rotation, .name = "rotation", .axis = axis, .point = point, .select = std::move(select)};
}

ElasticBody body_with(const TetrahedralMesh& mesh, const BoundaryConfig& boundary, double poisson = 0.45,
                      double density = 1060) {
  return supported(mesh, {5400, poisson, density}, boundary);
}

TetrahedralMesh box() {
  return box_mesh({3, 3, 2}, {0.06, 0.05, 0.04}, 0.2);
}

struct Solved {
  Discretisation discretisation;
  SolvedMotions motions;
};

// A solver of eight columns: more motions take two batches.
Solved solve(const ElasticBody& body, Element element) {
  Solved result{discretise(body, element), {}};
  const HeldStiffness stiffness = remove_held_dofs(result.discretisation.stiffness, result.discretisation.fixed);
  ColumnSolver solver(stiffness.matrix, row_coordinates(result.discretisation, stiffness),
                      {.tolerance = 1e-13, .width = 8});
  result.motions = solve_motions(result.discretisation, stiffness, motion_loads(body, result.discretisation), solver);
  return result;
}

class Motions : public ::testing::TestWithParam<Element> {};
INSTANTIATE_TEST_SUITE_P(Elements, Motions, ::testing::ValuesIn(kElements), name_of_instance);

// A held face, a foundation that is stiff along its normal, a rope to a point of the world and springs within the body.
BoundaryConfig every_support() {
  BoundaryConfig boundary;
  boundary.fixed = {held(patch("x0"))};
  boundary.foundations = {foundation("below", patch("z0"), 4e5, 1e4)};
  boundary.springs = {
      {.name = "rope", .stiffness = {30, "test"}, .from = {patch("x1")}, .anchor = Point{0.2, 0.1, 0}},
      {.name = "own places", .stiffness = {20, "test"}, .from = {patch("y1")}},
      {.name = "inside", .stiffness = {50, "test"}, .from = {patch("y0")}, .to = {nearest({0.06, 0.05, 0.04})}}};
  return boundary;
}

TEST_P(Motions, ARigidMotionOfAllSupportsComesBackExactly) {
  BoundaryConfig boundary = every_support();
  // Springs within the body turn with it to first order only where they are along the line between their ends: they are.
  boundary.motions = {piston({1, -2, 0.5}), rotation({0.3, 0.2, -1}, {0.01, 0.02, 0})};
  const ElasticBody body = body_with(box(), boundary);
  const Solved solved = solve(body, GetParam());
  const Vector3d way = Vector3d(1, -2, 0.5).normalized(), axis = Vector3d(0.3, 0.2, -1).normalized();
  for (int m = 0; m < 2; ++m) {
    std::vector<double> nodes;
    for (const Point& p : solved.discretisation.coordinates) {
      const Vector3d u = m == 0 ? way : axis.cross(Vector3d(p.data()) - Vector3d(0.01, 0.02, 0));
      nodes.insert(nodes.end(), u.data(), u.data() + 3);
    }
    const std::vector<double> expected = read_vertices(solved.discretisation, nodes);
    const double size = m == 0 ? 1 : 0.06;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      if (body.fixed[i / 3][i % 3]) {
        ASSERT_NEAR(solved.motions.displacement[m][i], nodes[i], 1e-15);  // what it imposes, to the last digits
        continue;
      }
      // Rounding of K: its condition here is 1e4.
      ASSERT_NEAR(solved.motions.displacement[m][i], expected[i], 1e-9 * size) << m << ' ' << i;
    }
  }
}

// Minimises the energy of the body plus that of its soft supports, whose bases move: K_body u + K_base (u - U) = 0, with the bases'
// matrix as the difference between K with and without them, and held dofs in their places.
VectorXd dense_answer(const TetrahedralMesh& mesh, const BoundaryConfig& boundary, Element element,
                      const std::function<Vector3d(const Point&)>& way) {
  BoundaryConfig bare = boundary;
  bare.foundations.clear(), bare.springs.clear(), bare.motions.clear();
  const Discretisation d = discretise(body_with(mesh, boundary), element);
  const MatrixXd all = dense(d.stiffness);
  const MatrixXd base = all - dense(discretise(body_with(mesh, bare), element).stiffness);
  VectorXd imposed(all.rows());
  for (std::size_t n = 0; n < d.coordinates.size(); ++n)
    imposed.segment<3>(static_cast<Eigen::Index>(3 * n)) = way(d.coordinates[n]);
  std::vector<Eigen::Index> free, fixed;
  for (Eigen::Index i = 0; i < all.rows(); ++i) (d.fixed[i / 3][i % 3] ? fixed : free).push_back(i);
  VectorXd u = imposed;
  const VectorXd load = VectorXd((base * imposed)(free)) - MatrixXd(all(free, fixed)) * VectorXd(imposed(fixed));
  const VectorXd solved = MatrixXd(all(free, free)).llt().solve(load);
  u(free) = solved;
  return u;
}

TEST_P(Motions, ASupportThatMovesAmongOthersMatchesADenseSolve) {
  // The face x0 and all that is near it move; the rest of the foundation, the rope and the face x1 stay.
  BoundaryConfig boundary;
  boundary.fixed = {held(patch("x0")), held(patch("x1"))};
  boundary.foundations = {foundation("below", patch("z0"), 4e5, 1e4)};
  boundary.springs = {{.name = "own places", .stiffness = {20, "test"}, .from = {patch("y1")}}};
  const Selector near_x0{.kind = Selector::Kind::half_space, .a = {0.03, 0, 0}, .b = {1, 0, 0}};
  boundary.motions = {piston({0, 0, 1}, {near_x0}), rotation({0, 1, 0}, {0, 0, 0.02}, {near_x0})};
  const TetrahedralMesh mesh = box();
  const ElasticBody body = body_with(mesh, boundary);
  const Solved solved = solve(body, GetParam());
  const auto& d = solved.discretisation;
  for (int m = 0; m < 2; ++m) {
    const auto rigid = [&](const Vector3d& p) {
      return m == 0 ? Vector3d(0, 0, 1) : Vector3d(0, 1, 0).cross(p - Vector3d(0, 0, 0.02)).eval();
    };
    // Middle nodes of an edge that leaves the moving part have half of the end that moves.
    std::map<Point, Vector3d> way;
    for (std::size_t n = 0; n < d.coordinates.size(); ++n) {
      const auto of_vertex = [&](std::int32_t v) -> Vector3d {
        if (!body.motions[m].moves[v]) return Vector3d::Zero();
        return rigid(Vector3d(d.coordinates[v].data()));
      };
      const auto v = static_cast<std::int32_t>(n);
      if (v < d.vertices) {
        way[d.coordinates[n]] = of_vertex(v);
        continue;
      }
      const auto [a, b] = d.ends[n - static_cast<std::size_t>(d.vertices)];
      const bool both = body.motions[m].moves[a] && body.motions[m].moves[b];
      way[d.coordinates[n]] =
          both ? rigid(Vector3d(d.coordinates[n].data())) : (0.5 * (of_vertex(a) + of_vertex(b))).eval();
    }
    const VectorXd u = dense_answer(mesh, boundary, GetParam(), [&](const Point& p) { return way.at(p); });
    const auto expected = read_vertices(d, {u.data(), static_cast<std::size_t>(u.size())});
    double largest = 0;
    for (const double x : expected) largest = std::max(largest, std::abs(x));
    // The solver's tolerance times a condition of 1e4.
    for (std::size_t i = 0; i < expected.size(); ++i)
      if (!body.fixed[i / 3][i % 3]) {
        ASSERT_NEAR(solved.motions.displacement[m][i], expected[i], 1e-8 * largest) << m << ' ' << i;
      }
  }
}

TEST_P(Motions, GravityAlongThreeAxesAddsUpToThePreload) {
  BoundaryConfig boundary = every_support();
  boundary.motions = {{.kind = Kind::gravity, .name = "gravity"}};
  const ElasticBody body = body_with(box(), boundary);
  ASSERT_EQ(body.motions.size(), 3u);
  EXPECT_EQ(body.motions[2].name, "gravity z");
  const Solved solved = solve(body, GetParam());
  const auto& d = solved.discretisation;
  const HeldStiffness stiffness = remove_held_dofs(d.stiffness, d.fixed);
  ColumnSolver solver(stiffness.matrix, row_coordinates(d, stiffness), {.tolerance = 1e-13, .width = 8});
  const std::array<double, 3> gravity = {3, -9, 2};
  const Preload preload = solve_preload(d, stiffness, gravity, solver);
  double largest = 0;
  for (const double x : preload.displacement) largest = std::max(largest, std::abs(x));
  for (std::size_t i = 0; i < preload.displacement.size(); ++i) {
    double sum = 0;
    for (int m = 0; m < 3; ++m) sum += gravity[m] * solved.motions.displacement[m][i];
    ASSERT_NEAR(sum, preload.displacement[i], 1e-9 * largest);  // the solver's tolerance times the condition
  }
}

// Lame: u(r) of the shell a <= r <= b under the pressures inside and outside.
double lame(double a, double b, double inside, double outside, double young, double poisson, double r) {
  const double a3 = a * a * a, b3 = b * b * b;
  return ((1 - 2 * poisson) * (inside * a3 - outside * b3) * r +
          (1 + poisson) / 2 * (inside - outside) * a3 * b3 / (r * r)) /
         (young * (b3 - a3));
}

TEST_P(Motions, PressureInsideAndOutsideAThickSphereIsLames) {
  constexpr double a = 0.02, b = 0.04;
  const double poisson = GetParam() == Element::p1 ? 0.3 : 0.49;
  BoundaryConfig boundary;
  const std::array<const char*, 3> axes = {"x", "y", "z"};
  for (std::size_t d = 0; d < axes.size(); ++d) {
    Point normal{};
    normal[d] = 1;
    BoundaryConfig::Fixed plane{{}, {{.kind = Selector::Kind::half_space, .whole_mesh = true, .b = normal}}};
    plane.dofs[d] = true;
    boundary.fixed.push_back(plane);
  }
  boundary.motions = {{.kind = Kind::pressure, .name = "inside", .select = {ball(1.001 * a)}},
                      {.kind = Kind::pressure,
                       .name = "outside",
                       .select = {{.kind = Selector::Kind::none_of, .inner = {ball(0.999 * b)}}}}};
  const bool quadratic = GetParam() == Element::p2_p0;
  const ElasticBody body = body_with(validation::shell_octant(a, b, quadratic ? 8 : 16), boundary, poisson);
  const Solved solved = solve(body, GetParam());
  // The bounds of the same elements for the thick sphere of studies/validation: 0.2 % quadratic, 2 % linear.
  const double bound = quadratic ? 0.003 : 0.02;
  for (int m = 0; m < 2; ++m) {
    // The exact displacement, read as the vertices of the element are.
    std::vector<double> exact_nodes;
    for (const Point& point : solved.discretisation.coordinates) {
      const Vector3d p(point.data());
      const Vector3d u = lame(a, b, m == 0, m == 1, 5400, poisson, p.norm()) * p.normalized();
      exact_nodes.insert(exact_nodes.end(), u.data(), u.data() + 3);
    }
    const auto expected = read_vertices(solved.discretisation, exact_nodes);
    const double largest = std::max(std::abs(lame(a, b, m == 0, m == 1, 5400, poisson, a)),
                                    std::abs(lame(a, b, m == 0, m == 1, 5400, poisson, b)));
    for (const double radius : {a, b}) {
      double sum = 0, stated = 0;
      int count = 0;
      for (std::size_t n = 0; n < body.nodes.size(); ++n)
        if (const Vector3d p(body.nodes[n].data()); std::abs(p.norm() - radius) < 1e-9) {
          sum += Eigen::Map<const Vector3d>(&solved.motions.displacement[m][3 * n]).dot(p) / radius;
          stated += Eigen::Map<const Vector3d>(&expected[3 * n]).dot(p) / radius, ++count;
        }
      EXPECT_NEAR(sum / count, stated / count, bound * largest) << m << ' ' << radius;
      const double exact = lame(a, b, m == 0, m == 1, 5400, poisson, radius);
      // An eighth of the sphere; away from where the pressure acts.
      const double volume = (radius == a ? 1 : -1) * exact * std::numbers::pi / 2 * radius * radius;
      const int row = radius == a ? 0 : 1;
      const double own = lame(a, b, row == 0, row == 1, 5400, poisson, radius) * (row == 0 ? 1 : -1) *
                         std::numbers::pi / 2 * radius * radius;
      EXPECT_NEAR(solved.motions.volume[2 * static_cast<std::size_t>(row) + static_cast<std::size_t>(m)], volume,
                  (quadratic ? 0.01 : 0.04) * own)
          << row << ' ' << m;
    }
  }
  EXPECT_NEAR(solved.motions.volume[1], solved.motions.volume[2], 1e-9 * solved.motions.volume[0]);
}

TEST_P(Motions, AForceSweepsTheVolumeThatReciprocityStates) {
  // a^T C f = (C a)^T f: no row of volumes is stored for contacts.
  BoundaryConfig boundary;
  boundary.fixed = {held(patch("x0"))};
  boundary.motions = {{.kind = Kind::pressure, .name = "above", .select = {patch("z1")}}};
  const ElasticBody body = body_with(box(), boundary);
  const Solved solved = solve(body, GetParam());
  const std::int32_t node = body.touchable[7];
  const NodeTensor tensor = solve_node_tensors(body, GetParam(), {{node}}, 1e-13)[0];
  // The field of a force f at the node is T^u f C_kk; the force that moves the node by a unit of dof j is row j of T^f.
  const MotionLoad load = motion_loads(body, solved.discretisation)[0];
  for (int j = 0; j < 3 && GetParam() != Element::p2_p0; ++j) {
    double swept = 0, stated = 0;
    for (std::size_t i = 0; i < load.sweep.size(); ++i)
      swept += load.sweep[i] * tensor.displacement[static_cast<std::size_t>(j) * load.sweep.size() + i];
    for (int i = 0; i < 3; ++i)
      stated += solved.motions.displacement[0][static_cast<std::size_t>(3 * node + i)] *
                tensor.stiffness[static_cast<std::size_t>(3 * i + j)];
    EXPECT_NEAR(swept, stated, 1e-8 * std::abs(swept) + 1e-16);
  }
  EXPECT_GT(solved.motions.volume[0], 0);
}

TEST(MotionsOfFiles, AFieldIsTheRowNearestToEachSupport) {
  const auto folder = fresh_folder();
  BoundaryConfig boundary;
  boundary.fixed = {held(patch("x0"))};
  const ElasticBody plain = body_with(box(), boundary);
  std::ofstream csv(folder / "field.csv");
  csv << "\xef\xbb\xbf# of the held face\nx,y,z,ux,uy,uz\n";  // a byte order mark first, as spreadsheets write it
  for (const Point& p : plain.nodes)
    if (p[0] == 0) csv << p[0] << ',' << p[1] << ", " << p[2] << ',' << 2 * p[1] << ',' << -p[2] << ",0.5\r\n";
  csv.close();
  boundary.motions = {{.kind = Kind::field, .name = "breath", .file = {"field.csv", folder / "field.csv"}}};
  const ElasticBody body = body_with(box(), boundary);
  const Solved solved = solve(body, Element::p1);
  for (std::size_t n = 0; n < body.nodes.size(); ++n) {
    if (!body.fixed[n][0]) continue;
    const double* u = &solved.motions.displacement[0][3 * n];
    EXPECT_NEAR(u[0], 2 * body.nodes[n][1], 1e-5);  // six digits of the file
    EXPECT_NEAR(u[1], -body.nodes[n][2], 1e-5);
    EXPECT_EQ(u[2], 0.5);
  }
}

// The sentence of what makes no body, or "".
std::string refused(const BoundaryConfig& boundary, double density = 1060) {
  return input_error([&] { body_with(box(), boundary, 0.45, density); });
}

TEST(MotionsOfFiles, AreRefusedWithOneSentence) {
  const auto folder = fresh_folder();
  BoundaryConfig boundary;
  boundary.fixed = {held(patch("x0"))};
  const auto with = [&](const BoundaryConfig::Motion& motion) {
    boundary.motions = {motion};
    return refused(boundary);
  };
  EXPECT_THAT(with(piston({0, 0, 1}, {patch("x1")})), HasSubstr("bc.toml:0: [[motion]] \"piston\": "));
  EXPECT_THAT(with({.kind = Kind::pressure,
                    .name = "p",
                    .select = {{.kind = Selector::Kind::nearest, .points = {{0.06, 0.05, 0.04}}}}}),
              HasSubstr("[[motion]] \"p\": "));
  boundary.motions = {{.kind = Kind::gravity, .name = "g"}};
  EXPECT_THAT(refused(boundary, 0), HasSubstr("[[motion]] \"g\": gravity"));
  boundary.motions = {{.kind = Kind::gravity, .name = "g"}, piston({0, 0, 1})};
  boundary.motions[1].name = "g y";
  EXPECT_THAT(refused(boundary), HasSubstr("found \"g y\" twice"));
  boundary.motions.assign(33, piston({0, 0, 1}));
  for (std::size_t i = 0; i < 33; ++i) boundary.motions[i].name = std::to_string(i);
  EXPECT_THAT(refused(boundary), HasSubstr("at most 32"));
  const auto file = [&](const std::string& text) {
    std::ofstream(folder / "f.csv") << text;
    return with({.kind = Kind::field, .name = "f", .file = {"f.csv", folder / "f.csv"}});
  };
  EXPECT_THAT(with({.kind = Kind::field, .name = "f", .file = {"none.csv", folder / "none.csv"}}),
              HasSubstr("none.csv: "));
  EXPECT_THAT(file("1,2,3,4,5,6\n"), HasSubstr("f.csv:1: "));
  EXPECT_THAT(file("x,y,z,ux,uy,uz\n1,2,3,4,5\n"), HasSubstr("f.csv:2: "));
  EXPECT_THAT(file("x,y,z,ux,uy,uz\n1,2,3,4,5,inf\n"), HasSubstr("f.csv:2: "));
  EXPECT_THAT(file("x,y,z,ux,uy,uz\n1,2,3,4,5,6,7\n"), HasSubstr("f.csv:2: "));
  EXPECT_THAT(file("x,y,z,ux,uy,uz\n"), HasSubstr("f.csv: "));
  EXPECT_THAT(file("x,y,z,ux,uy,uz\n0,0,0,1,1,1\n"), HasSubstr("every support"));
}

}  // namespace
}  // namespace palpate::tests
