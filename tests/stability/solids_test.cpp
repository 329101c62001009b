// Solids that the precompute finds hard: units at the ends of what is measured, contrast, slivers, places far away.
#include "formats/organ_config.h"
#include "precompute/column_solver.h"
#include "precompute/discretisation.h"
#include "precompute/probe_columns.h"
#include "precompute/stiffness.h"
#include "tests/precompute/support.h"
#include "tests/stability/stability_case.h"

namespace palpate::tests {
namespace {

using Point = std::array<double, 3>;

// Holds the face of lowest x.
ElasticBody held_body(const TetrahedralMesh& mesh, const std::vector<Material>& materials) {
  ElasticBody body = body_of(mesh, materials);
  double lowest = INFINITY;
  for (const Point& p : body.nodes) lowest = std::min(lowest, p[0]);
  hold(body, [&](const Point& p) { return p[0] == lowest ? 7 : 0; });
  return body;
}

// T^u and T^f of a few nodes, T^f over young * length; a column each.
std::vector<double> tensors_of(const ElasticBody& body, Element element, double newton_per_metre) {
  std::vector<std::int32_t> nodes;
  for (std::size_t k = 0; k < body.touchable.size(); k += body.touchable.size() / 4) nodes.push_back(body.touchable[k]);
  std::vector<double> all;
  for (const NodeTensor& t : solve_node_tensors(body, element, nodes, 1e-12)) {
    all.insert(all.end(), t.displacement.begin(), t.displacement.end());
    for (const double f : t.force) all.push_back(f / newton_per_metre);
  }
  return all;
}

double off(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0, largest = 0;
  for (std::size_t i = 0; i < b.size(); ++i)
    most = std::max(most, std::abs(a[i] - b[i])), largest = std::max(largest, std::abs(b[i]));
  return std::isfinite(most) && a.size() == b.size() ? most / largest : INFINITY;
}

constexpr Element kElements[] = {Element::p1, Element::p1_anp, Element::p2_p0};

TEST(StabilityMesh, FromMicrometresToKilometres) {
  StabilityCase attack(
      "A threshold in metres or newtons somewhere in mesh, support or solver would show at one end of the scale.");
  for (const Element element : kElements) {
    double worst = 0;
    const auto at = [&](double size) {
      const TetrahedralMesh mesh = box_mesh({4, 3, 3}, {6 * size, 5 * size, 4 * size}, 0.15);
      return tensors_of(held_body(mesh, {{5400, 0.45, 0}}), element, 5400 * size);
    };
    const std::vector<double> expected = at(0.01);
    for (const double size : {1e-9, 1e-6, 1.0, 1e3}) worst = std::max(worst, off(at(size), expected));
    attack.hold("tensors at 1 nm to 1 km against 10 mm, " + std::string(name_of(element)), worst, 1e-9,
                "both solved to 1e-12 and a condition of some hundred");
  }
}

TEST(StabilityMesh, FarFromTheOrigin) {
  StabilityCase attack(
      "At 1e7 m a coordinate has nine digits below a metre left: volumes from products of coordinates lose all.");
  // Binary fractions, so that the body far away is the same to the last bit.
  for (const Element element : kElements) {
    const auto at = [&](double away) {
      TetrahedralMesh mesh = box_mesh({4, 4, 4}, {0.0625, 0.0625, 0.03125});
      for (auto& p : mesh.nodes)
        for (double& x : p) x += away;
      return tensors_of(held_body(mesh, {{5400, 0.45, 0}}), element, 1);
    };
    attack.hold("tensors at 1e7 m against those at the origin, " + std::string(name_of(element)), off(at(1e7), at(0)),
                1e-9, "differences of coordinates are exact");
  }
}

TEST(StabilityMaterial, FromOnePascalToATerapascal) {
  StabilityCase attack(
      "A stiffness in pascals compared with a fixed number would refuse jelly, or take steel for singular.");
  for (const Element element : kElements) {
    double worst = 0;
    const auto at = [&](double young) {
      return tensors_of(held_body(box_mesh({4, 3, 3}, {0.06, 0.05, 0.04}, 0.15), {{young, 0.45, 0}}), element, young);
    };
    const std::vector<double> expected = at(5400);
    for (const double young : {1.0, 1e3, 1e6, 1e12}) worst = std::max(worst, off(at(young), expected));
    attack.hold("tensors of 1 Pa to 1 TPa against 5400 Pa, " + std::string(name_of(element)), worst, 1e-9,
                "both solved to 1e-12 and a condition of some hundred");
  }
}

// What the store holds of a touchable node, by linear tetrahedra in extended precision: [3][N][3] as NodeTensor.
using Long = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
std::vector<double> in_extended_precision(const ElasticBody& body, std::int32_t node) {
  const auto dofs = 3 * static_cast<Eigen::Index>(body.nodes.size());
  Long stiffness = Long::Zero(dofs, dofs);
  for (std::size_t e = 0; e < body.tetrahedra.size(); ++e) {
    const auto& t = body.tetrahedra[e];
    const Material& m = body.materials[static_cast<std::size_t>(body.region[e])];
    const long double young = m.young, nu = m.poisson;
    const long double lambda = young * nu / ((1 + nu) * (1 - 2 * nu)), mu = young / (2 * (1 + nu));
    Eigen::Matrix<long double, 3, 3> edges;
    for (int i = 0; i < 3; ++i)
      for (int d = 0; d < 3; ++d)
        edges(i, d) =
            static_cast<long double>(
                body.nodes[static_cast<std::size_t>(t[static_cast<std::size_t>(i) + 1])][static_cast<std::size_t>(d)]) -
            body.nodes[static_cast<std::size_t>(t[0])][static_cast<std::size_t>(d)];
    const long double volume = edges.determinant() / 6;
    EXPECT_GT(volume, 0);
    Eigen::Matrix<long double, 4, 3> gradient;
    gradient.bottomRows<3>() = edges.inverse().transpose();
    gradient.row(0) = -gradient.bottomRows<3>().colwise().sum();
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b) {
        const Eigen::Matrix<long double, 3, 1> ga = gradient.row(a), gb = gradient.row(b);
        stiffness.block<3, 3>(3 * t[static_cast<std::size_t>(a)], 3 * t[static_cast<std::size_t>(b)]) +=
            volume * (lambda * ga * gb.transpose() + mu * gb * ga.transpose() +
                      mu * ga.dot(gb) * Eigen::Matrix<long double, 3, 3>::Identity());
      }
  }
  const std::vector<Eigen::Index> free = free_dofs(body);
  Long load = Long::Zero(dofs, 3);
  for (int j = 0; j < 3; ++j) load(3 * node + j, j) = 1;
  const Long on_free = Long(stiffness(free, free)).llt().solve(Long(load(free, Eigen::all)));
  Long columns = Long::Zero(dofs, 3);
  columns(free, Eigen::all) = on_free;
  const Long field = columns * Long(Eigen::Matrix<long double, 3, 3>(columns.middleRows<3>(3 * node)).inverse());
  std::vector<double> flat;
  for (int j = 0; j < 3; ++j)
    for (Eigen::Index i = 0; i < dofs; ++i) flat.push_back(static_cast<double>(field(i, j)));
  return flat;
}

TEST(StabilityMesh, Slivers) {
  StabilityCase attack(
      "A tetrahedron that is almost flat is stiff as the reciprocal of its height: its volume loses digits, K its "
      "condition, "
      "and the tensors their accuracy, or the factor breaks down.");
  double worst = 0, residual = 0;
  for (const double degrees : {1e1, 1e0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8}) {
    const double height = std::tan(degrees * 3.14159265358979 / 180);
    TetrahedralMesh mesh = box_mesh({3, 3, 3}, {3, 3, 3});
    for (auto& p : mesh.nodes)
      if (p == std::array<double, 3>{1, 1, 1}) p[0] = 2 - height;
    const ElasticBody body = held_body(mesh, {{5400, 0.45, 0}});
    const std::vector<std::int32_t> node = {body.touchable[body.touchable.size() / 2]};
    const NodeTensor tensor = solve_node_tensors(body, Element::p1, node, 1e-9)[0];
    const double error = off(tensor.displacement, in_extended_precision(body, node[0]));
    attack.point("error against sliver angle", "p1", degrees, error);
    const double rounding = 2.2e-16 / height + 1e-9;
    worst = std::max(worst, error / rounding), residual = std::max(residual, tensor.residual / rounding);
  }
  attack.hold("error of a tensor from 10 to 1e-8 degrees, over 2.2e-16 / height + 1e-9", worst, 10,
              "each element's stiffness is rounded by some 2.2e-16 of its edge over its height, and energy follows in "
              "proportion; the tolerance 1e-9; ten for the condition of the rest");
  attack.hold("true residual over the same", residual, 10,
              "what double precision allows of a column: epsilon |K| |x| / |b|");
}

// Solves every dof of eight nodes with one preconditioner.
struct Solved {
  int iterations = 0;
  double residual = 0;
};
Solved solve(const ElasticBody& body, bool cholesky) {
  const Discretisation discretisation = discretise(body, Element::p1_anp);
  const HeldStiffness held = eliminate_held(discretisation.stiffness, discretisation.fixed);
  ColumnSolverOptions options;
  options.cholesky = cholesky, options.width = 24, options.tolerance = 1e-7;
  ColumnSolver solver(held.matrix, row_coordinates(discretisation, held), options);
  const auto width = static_cast<std::size_t>(solver.width());
  std::vector<double> b(static_cast<std::size_t>(solver.dofs()) * width, 0.0), x(b.size());
  for (std::size_t c = 0; c < width; ++c) b[(c * 97 % static_cast<std::size_t>(solver.dofs())) * width + c] = 1;
  std::vector<ColumnReport> reports(width);
  solver.solve(b.data(), x.data(), reports);
  Solved solved;
  for (const ColumnReport& r : reports)
    solved.iterations = std::max(solved.iterations, r.iterations),
    solved.residual = std::max(solved.residual, r.residual);
  return solved;
}

TEST(StabilityMaterial, PoissonsRatioTowardsAHalf) {
  StabilityCase attack(
      "As nu goes to 1/2 plain linear tetrahedra lock: force without end. The two elements that are meant for it must "
      "not.");
  const auto force = [](Element element, double nu) {
    const ElasticBody body = held_body(box_mesh({4, 4, 4}, {0.06, 0.06, 0.06}), {{5400, nu, 0}});
    std::vector<std::int32_t> middle;
    for (const std::int32_t n : body.touchable)
      if (body.nodes[static_cast<std::size_t>(n)] == Point{0.06, 0.03, 0.03}) middle = {n};
    return solve_node_tensors(body, element, middle, 1e-9).at(0).force[0];
  };
  double anp = 0, locks = 0;
  const double anp_first = force(Element::p1_anp, 0.3) / force(Element::p2_p0, 0.3);
  for (const double nu : {0.3, 0.4, 0.45, 0.49, 0.495, 0.499, 0.4995, 0.4999}) {
    const double reference = force(Element::p2_p0, nu);
    const double p1 = force(Element::p1, nu) / reference, averaged = force(Element::p1_anp, nu) / reference;
    attack.point("force against nu", "p1", nu, p1);
    attack.point("force against nu", "p1-anp", nu, averaged);
    attack.point("force against nu", "p2-p0", nu, 1);
    anp = std::max(anp, std::abs(averaged / anp_first - 1)), locks = std::max(locks, p1);
  }
  attack.hold("force of p1-anp over p2-p0, change from nu 0.3 to 0.4999", anp, 0.25,
              "it does not lock: what a coarse mesh adds to a point's force does not grow with nu");
  attack.hold("1 over the locking of p1 at 0.4999", 1 / locks, 0.5,
              "the attack is as sharp as it says: p1 locks twofold and more");
}

TEST(StabilityMaterial, ContrastInBlocksAndInThinLayers) {
  StabilityCase attack(
      "Where soft and stiff meet, multigrid's coarse levels average the two; iterations can grow with the contrast "
      "without "
      "end.");
  const int n = quick_or_long(8, 16);
  struct Pattern {
    const char* name;
    std::function<bool(Point)> stiff;  // of a place in [0, 1]^3
  };
  const Pattern patterns[] = {
      {"blocks", [](Point p) { return (p[0] < 0.5) != ((p[1] < 0.5) != (p[2] < 0.5)); }},
      {"stiff layers one element thin", [n](Point p) { return static_cast<int>(p[2] * n) % 4 == 2; }},
      {"soft layers one element thin", [n](Point p) { return static_cast<int>(p[2] * n) % 4 != 2; }},
  };
  for (const Pattern& pattern : patterns)
    for (const bool cholesky : {true, false}) {
      int most = 0;
      double residual = 0;
      for (const double contrast : {1.0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6}) {
        TetrahedralMesh mesh = box_mesh({n, n, n}, {1, 1, 1});
        mesh.region_names = {"soft", "stiff"};
        for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e) {
          Point centre{};
          for (const std::int32_t v : mesh.tetrahedra[e])
            for (std::size_t d = 0; d < 3; ++d) centre[d] += 0.25 * mesh.nodes[static_cast<std::size_t>(v)][d];
          mesh.region[e] = pattern.stiff(centre);
        }
        const Solved solved = solve(held_body(mesh, {{1000, 0.45, 0}, {1000 * contrast, 0.45, 0}}), cholesky);
        most = std::max(most, solved.iterations), residual = std::max(residual, solved.residual);
        if (!cholesky) attack.point("iterations against contrast", pattern.name, contrast, solved.iterations);
      }
      const std::string of = std::string(pattern.name) + (cholesky ? ", factor" : ", multigrid");
      attack.hold(
          "iterations to 1e-7 up to a contrast of 1e6, " + of, most, cholesky ? 3 : 400,
          cholesky ? "a backward stable factor and its refinement" : "what the solver's defaults give up at is 1000");
      attack.hold("true residual, " + of, residual, 1e-7, "the tolerance asked for");
    }
}

}  // namespace
}  // namespace palpate::tests
