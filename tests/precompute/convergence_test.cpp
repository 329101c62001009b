// Orders of convergence of the elements, by a manufactured displacement on the unit box.
#include <cmath>
#include <numbers>

#include "precompute/quadratic_tetrahedra.h"
#include "tests/precompute/imposed.h"

namespace palpate::tests {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double pi = std::numbers::pi;

// u = w + (mu / lambda) (s(x) s(y) s(z), 0, 0) with s = sin(pi .) and w = (s(x) c(y) s(z), -c(x) s(y) s(z), 0) free of
// divergence: the stress stays of order one as nu -> 1/2.
struct Manufactured {
  double mu, lambda;

  Vector3d displacement(const Vector3d& p) const {
    const Vector3d s = (pi * p).array().sin(), c = (pi * p).array().cos();
    return {s[0] * c[1] * s[2] + mu / lambda * s[0] * s[1] * s[2], -c[0] * s[1] * s[2], 0};
  }
  Matrix3d gradient(const Vector3d& p) const {  // d u_i / d x_j
    const Vector3d s = (pi * p).array().sin(), c = (pi * p).array().cos();
    const double r = mu / lambda;
    Matrix3d g;
    g << c[0] * c[1] * s[2] + r * c[0] * s[1] * s[2], -s[0] * s[1] * s[2] + r * s[0] * c[1] * s[2],
        s[0] * c[1] * c[2] + r * s[0] * s[1] * c[2], s[0] * s[1] * s[2], -c[0] * c[1] * s[2], -c[0] * s[1] * c[2], 0, 0,
        0;
    return pi * g;
  }
  // -div sigma = -(lambda + mu) grad div u - mu laplace u
  Vector3d force(const Vector3d& p) const {
    const Vector3d s = (pi * p).array().sin(), c = (pi * p).array().cos();
    const double a = (lambda + mu) * mu / lambda;
    const Vector3d pressure(s[0] * s[1] * s[2], -c[0] * c[1] * s[2], -c[0] * s[1] * c[2]);
    return pi * pi * (a * pressure + 3 * mu * displacement(p));
  }
};

struct Errors {
  double displacement, strain;  // in the 2-norm over the box: of u, and of its gradient (of the order of the energy)
};

// Fourteen points of degree 5 (Walkington), barycentric, weights of one.
template <class Visit>
void at_points(const Visit& visit) {
  constexpr double a = 0.31088591926330060980, b = 0.092735250310891226402, c = 0.045503704125649649492;
  for (int i = 0; i < 4; ++i) {
    Eigen::Vector4d l = Eigen::Vector4d::Constant(a);
    l[i] = 1 - 3 * a;
    visit(l, 0.11268792571801585080);
    l.setConstant(b);
    l[i] = 1 - 3 * b;
    visit(l, 0.073493043116361949544);
    for (int j = 0; j < i; ++j) {
      l.setConstant(c);
      l[i] = l[j] = 0.5 - c;
      visit(l, 0.042546020777081466438);
    }
  }
}

constexpr int kEdges[6][2] = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};

// Shape functions of the element in one straight tetrahedron, and their gradients.
void shapes(int nodes, const Eigen::Vector4d& l, const Eigen::Matrix<double, 3, 4>& g, Eigen::VectorXd* shape,
            Eigen::Matrix3Xd* slope) {
  shape->resize(nodes), slope->resize(3, nodes);
  for (int i = 0; i < 4; ++i) {
    (*shape)[i] = nodes == 4 ? l[i] : l[i] * (2 * l[i] - 1);
    slope->col(i) = (nodes == 4 ? 1 : 4 * l[i] - 1) * g.col(i);
  }
  for (int e = 0; e < nodes - 4; ++e) {
    const auto [i, j] = kEdges[e];
    (*shape)[4 + e] = 4 * l[i] * l[j];
    slope->col(4 + e) = 4 * (l[i] * g.col(j) + l[j] * g.col(i));
  }
}

Errors errors(Element element, double poisson, int cells) {
  const Manufactured exact{1 / (2 * (1 + poisson)), poisson / ((1 + poisson) * (1 - 2 * poisson))};
  ElasticBody body = body_of(box_mesh({cells, cells, cells}, {1, 1, 1}), {{1, poisson, 0}});
  hold(body, [](const Point& p) {
    for (int d = 0; d < 3; ++d)
      if (p[d] == 0 || p[d] == 1) return 7;
    return 0;
  });
  const Discretisation discretisation = discretise(body, element);
  std::vector<std::vector<std::int32_t>> elements;
  if (element == Element::p2_p0)
    for (const auto& c : quadratic_mesh(body).cells) elements.emplace_back(c.begin(), c.end());
  else
    for (const auto& t : body.tetrahedra) elements.emplace_back(t.begin(), t.end());

  Eigen::VectorXd shape;
  Eigen::Matrix3Xd slope;
  const auto each_point = [&](const auto& visit) {
    for (const auto& nodes : elements) {
      Eigen::Matrix<double, 3, 4> x, g;
      for (int i = 0; i < 4; ++i) x.col(i) = Vector3d(discretisation.coordinates[nodes[i]].data());
      const Matrix3d sides = x.rightCols<3>().colwise() - x.col(0);
      g.rightCols<3>() = sides.inverse().transpose();
      g.col(0) = -g.rightCols<3>().rowwise().sum();
      at_points([&](const Eigen::Vector4d& l, double weight) {
        shapes(static_cast<int>(nodes.size()), l, g, &shape, &slope);
        visit(nodes, Vector3d(x * l), weight * sides.determinant() / 6);
      });
    }
  };
  std::vector<double> load(3 * discretisation.coordinates.size(), 0.0);
  each_point([&](const auto& nodes, const Vector3d& p, double volume) {
    const Vector3d f = volume * exact.force(p);
    for (std::size_t a = 0; a < nodes.size(); ++a)
      for (int d = 0; d < 3; ++d) load[3 * static_cast<std::size_t>(nodes[a]) + d] += shape[a] * f[d];
  });
  const auto u = solve_with_imposed(
      discretisation,
      [&](const Point& p) {
        const Vector3d v = exact.displacement(Vector3d(p.data()));
        return Point{v[0], v[1], v[2]};
      },
      load, 1e-10);
  Errors sum{0, 0};
  each_point([&](const auto& nodes, const Vector3d& p, double volume) {
    Vector3d value = -exact.displacement(p);
    Matrix3d gradient = -exact.gradient(p);
    for (std::size_t a = 0; a < nodes.size(); ++a) {
      const Vector3d node(&u[3 * static_cast<std::size_t>(nodes[a])]);
      value += shape[a] * node;
      gradient += node * slope.col(a).transpose();
    }
    sum.displacement += volume * value.squaredNorm();
    sum.strain += volume * gradient.squaredNorm();
  });
  return {std::sqrt(sum.displacement), std::sqrt(sum.strain)};
}

// Theory for all three: 2 in the displacement, 1 in the strain (p2-p0 because its dilatation is constant in each cell;
// its quadratic part falls faster, and on these meshes shows).
void expect_orders(Element element, double poisson, int coarse, int fine) {
  const Errors before = errors(element, poisson, coarse), after = errors(element, poisson, fine);
  const double ratio = std::log(static_cast<double>(fine) / coarse);
  const double displacement = std::log(before.displacement / after.displacement) / ratio;
  const double strain = std::log(before.strain / after.strain) / ratio;
  EXPECT_NEAR(displacement, 2, 0.15) << name_of(element) << ' ' << poisson;
  EXPECT_GT(strain, 0.85) << name_of(element) << ' ' << poisson;
  EXPECT_LT(strain, element == Element::p2_p0 ? 2 : 1.15) << name_of(element) << ' ' << poisson;
}

TEST(Convergence, AllElementsReachTheirOrders) {
  expect_orders(Element::p1, 0.3, 12, 18);
  for (const double poisson : {0.3, 0.4999}) {
    expect_orders(Element::p1_anp, poisson, 12, 18);
    expect_orders(Element::p2_p0, poisson, 6, 10);
  }
}

TEST(Convergence, LinearTetrahedraDoNotConvergeNearIncompressibilityOnMeshesOneCanAfford) {
  EXPECT_GT(errors(Element::p1, 0.4999, 12).displacement, 0.9 * errors(Element::p1, 0.4999, 6).displacement);
}

}  // namespace
}  // namespace palpate::tests
