// The elements where nu -> 1/2: a thick sphere under pressure, a bonded punch on deep and thin layers, a cantilever,
// orders of convergence. The bounds are what these elements are known to reach on such meshes, with room for the mesh.
#include <cmath>

#include "precompute/quadratic_tetrahedra.h"
#include "tests/precompute/imposed.h"
#include "tests/precompute/shell_octant.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;

constexpr double kYoung = 1000, kTolerance = 1e-9;

Point nothing(const Point&) {
  return {0, 0, 0};
}

// int N_j (-p n) dA over the surface where on holds at the three vertices: on straight triangles, or on the curved ones
// of the quadratic mesh, seven points of degree 5.
std::vector<double> pressure_load(const ElasticBody& body, const Discretisation& discretisation, Element element,
                                  const std::function<bool(const Point&)>& on, double pressure) {
  std::vector<double> load(3 * discretisation.coordinates.size(), 0.0);
  std::vector<std::array<std::int32_t, 6>> triangles;
  if (element == Element::p2_p0) triangles = quadratic_mesh(body).triangles;
  if (element != Element::p2_p0)
    for (const auto& t : body.triangles) triangles.push_back({t[0], t[1], t[2], -1, -1, -1});
  constexpr double a = 0.470142064105115, b = 0.101286507323456;
  const double points[7][4] = {{1.0 / 3, 1.0 / 3, 1.0 / 3, 0.225},   {a, a, 1 - 2 * a, 0.132394152788506},
                               {a, 1 - 2 * a, a, 0.132394152788506}, {1 - 2 * a, a, a, 0.132394152788506},
                               {b, b, 1 - 2 * b, 0.125939180544827}, {b, 1 - 2 * b, b, 0.125939180544827},
                               {1 - 2 * b, b, b, 0.125939180544827}};
  for (const auto& t : triangles) {
    if (!on(body.nodes[t[0]]) || !on(body.nodes[t[1]]) || !on(body.nodes[t[2]])) continue;
    const int nodes = t[3] < 0 ? 3 : 6;
    for (const auto& q : points) {
      Eigen::Matrix<double, 6, 1> shape;
      Eigen::Matrix<double, 6, 3> slope;  // after each barycentric coordinate
      slope.setZero();
      for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3;
        shape[i] = nodes == 3 ? q[i] : q[i] * (2 * q[i] - 1);
        slope(i, i) = nodes == 3 ? 1 : 4 * q[i] - 1;
        shape[3 + i] = 4 * q[i] * q[j];
        slope(3 + i, i) = 4 * q[j], slope(3 + i, j) = 4 * q[i];
      }
      Vector3d u = Vector3d::Zero(), v = Vector3d::Zero();
      for (int n = 0; n < nodes; ++n) {
        const Vector3d x(discretisation.coordinates[t[n]].data());
        u += (slope(n, 1) - slope(n, 0)) * x, v += (slope(n, 2) - slope(n, 0)) * x;
      }
      const Vector3d force = -pressure * q[3] / 2 * u.cross(v);  // triangles wind outwards
      for (int n = 0; n < nodes; ++n)
        for (int d = 0; d < 3; ++d) load[3 * static_cast<std::size_t>(t[n]) + d] += shape[n] * force[d];
    }
  }
  return load;
}

// Relative error of the displacement of the thick sphere 1 <= r <= 2 under unit pressure inside, in the 2-norm over the
// vertices, each with its share of the volume.
double sphere_error(Element element, double poisson, int n) {
  constexpr double a = 1, b = 2;
  ElasticBody body = body_of(shell_octant(a, b, n), {{kYoung, poisson, 0}});
  body.materials[0].density = 1;
  hold(body, [](const Point& p) { return (p[0] == 0 ? 1 : 0) | (p[1] == 0 ? 2 : 0) | (p[2] == 0 ? 4 : 0); });
  const Discretisation discretisation = discretise(body, element);
  const auto inside = [](const Point& p) { return std::hypot(p[0], p[1], p[2]) < a + 1e-9; };
  const auto u =
      solve_with_imposed(discretisation, nothing, pressure_load(body, discretisation, element, inside, 1), kTolerance);
  const std::vector<double> share = discretise(body, Element::p1).mass;
  double error = 0, size = 0;
  for (std::size_t i = 0; i < body.nodes.size(); ++i) {
    const Vector3d x(body.nodes[i].data());
    const double r = x.norm();
    const Vector3d exact = a * a * a / (kYoung * (b * b * b - a * a * a)) *
                           ((1 - 2 * poisson) * r + (1 + poisson) * b * b * b / (2 * r * r)) * x / r;
    error += share[i] * (Vector3d(&u[3 * i]) - exact).squaredNorm();
    size += share[i] * exact.squaredNorm();
  }
  return std::sqrt(error / size);
}

TEST(NearlyIncompressible, ThickSphereUnderPressure) {
  // Of 2,601 vertices, and 405 for p2-p0. p1 locks; the others hold to .4999 what they have at .3.
  EXPECT_LT(sphere_error(Element::p1, 0.3, 16), 0.017);
  EXPECT_GT(sphere_error(Element::p1, 0.4999, 16), 0.2);
  for (const double poisson : {0.3, 0.49, 0.4999}) {
    EXPECT_LT(sphere_error(Element::p1_anp, poisson, 16), 0.012) << poisson;
    EXPECT_LT(sphere_error(Element::p2_p0, poisson, 8), 0.003) << poisson;
  }
}

// Force of a rigid square bonded to the top of a layer that is bonded to the ground, over half-width 1; the layer is
// 2 x 2 x depth (a quarter of it by symmetry, its far sides free).
double punch_force(Element element, double poisson, double depth, std::array<int, 3> cells) {
  ElasticBody body = body_of(box_mesh(cells, {2, 2, depth}), {{kYoung, poisson, 0}});
  const auto under = [depth](const Point& p) { return p[2] == depth && p[0] <= 1 + 1e-9 && p[1] <= 1 + 1e-9; };
  hold(body, [&](const Point& p) { return p[2] == 0 || under(p) ? 7 : (p[0] == 0 ? 1 : 0) | (p[1] == 0 ? 2 : 0); });
  const Discretisation discretisation = discretise(body, element);
  const auto u = solve_with_imposed(
      discretisation,
      [&](const Point& p) {
        return Point{0, 0, under(p) ? -0.01 : 0};
      },
      std::vector<double>(3 * discretisation.coordinates.size(), 0.0), kTolerance);
  const auto reaction = multiply(discretisation.stiffness, std::span<const double>(u));
  double force = 0;
  for (std::size_t i = 0; i < discretisation.coordinates.size(); ++i)
    if (under(discretisation.coordinates[i])) force -= reaction[3 * i + 2];
  return force;
}

TEST(NearlyIncompressible, BondedPunchOnADeepBlock) {
  // Four elements under the half-width; the pressure is infinite at the edge, so each is stiff by about its size there.
  for (const double poisson : {0.3, 0.49, 0.4999}) {
    const double reference = punch_force(Element::p2_p0, poisson, 2, {10, 10, 10});
    EXPECT_NEAR(punch_force(Element::p2_p0, poisson, 2, {8, 8, 8}) / reference, 1.0, 0.01) << poisson;
    EXPECT_GT(punch_force(Element::p1_anp, poisson, 2, {8, 8, 8}) / reference, 1.0) << poisson;
    EXPECT_LT(punch_force(Element::p1_anp, poisson, 2, {8, 8, 8}) / reference, 1.18) << poisson;
  }
  const double reference = punch_force(Element::p2_p0, 0.4999, 2, {8, 8, 8});
  EXPECT_GT(punch_force(Element::p1, 0.4999, 2, {8, 8, 8}) / reference, 1.7);
}

TEST(NearlyIncompressible, BondedPunchOnAThinLayerAsksForFourElementsAcross) {
  // An eighth as deep as the punch is wide: p1-anp locks with one or two elements across and is 60 % off with four, which
  // is why palpate-precompute warns; p2-p0 is as good with two.
  const double reference = punch_force(Element::p2_p0, 0.4999, 0.25, {16, 16, 3});
  const auto averaged = [&](int across) {
    return punch_force(Element::p1_anp, 0.4999, 0.25, {8, 8, across}) / reference;
  };
  EXPECT_GT(averaged(1), 20);
  EXPECT_GT(averaged(2), 3);
  EXPECT_LT(averaged(4), 1.7);
  EXPECT_NEAR(punch_force(Element::p2_p0, 0.4999, 0.25, {8, 8, 2}) / reference, 1.0, 0.08);
  const double compressible = punch_force(Element::p2_p0, 0.3, 0.25, {16, 16, 3});
  EXPECT_LT(punch_force(Element::p1_anp, 0.3, 0.25, {8, 8, 4}) / compressible, 1.15);
}

// Tip deflection of a 10 x 1 x 1 cantilever over Timoshenko's.
double tip(Element element, double poisson, int n) {
  ElasticBody body = body_of(box_mesh({10 * n, n, n}, {10, 1, 1}), {{kYoung, poisson, 0}});
  hold(body, [](const Point& p) { return p[0] == 0 ? 7 : 0; });
  const Discretisation discretisation = discretise(body, element);
  // A shear traction as the pressure load's x component turned to z.
  auto load = pressure_load(
      body, discretisation, element, [](const Point& p) { return p[0] == 10; }, -0.1);
  for (std::size_t i = 0; i < load.size(); i += 3) load[i + 2] = load[i], load[i] = 0;
  const auto u = solve_with_imposed(discretisation, nothing, load, 1e-7);
  double sum = 0;  // the deflection the load works on
  for (std::size_t i = 0; i < load.size(); ++i) sum += u[i] * load[i];
  const double shear = kYoung / (2 * (1 + poisson)), kappa = 10 * (1 + poisson) / (12 + 11 * poisson);
  return sum / 0.1 / (0.4 + 1 / (kappa * shear));
}

TEST(NearlyIncompressible, Cantilever) {
  // p1-anp is stiff in bending, from below and less so the more elements across; p2-p0, whose cells bend by themselves, is
  // soft with one and within 6 % with two.
  for (const double poisson : {0.3, 0.49, 0.4999}) {
    const double three = tip(Element::p1_anp, poisson, 3), five = tip(Element::p1_anp, poisson, 5);
    EXPECT_GT(three, 0.70) << poisson;
    EXPECT_LT(three, five) << poisson;
    EXPECT_GT(five, 0.84) << poisson;
    EXPECT_LT(five, 1.0) << poisson;
    EXPECT_NEAR(tip(Element::p2_p0, poisson, 2), 1.0, 0.06) << poisson;
  }
  EXPECT_LT(tip(Element::p1, 0.4999, 4), 0.05);
}

}  // namespace
}  // namespace palpate::tests
