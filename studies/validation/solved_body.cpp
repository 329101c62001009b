#include "studies/validation/solved_body.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "formats/errors.h"
#include "precompute/elements/quadratic_tetrahedra.h"
#include "studies/bodies/imposed.h"
#include "studies/timing/timing.h"

namespace palpate::validation {
namespace {

constexpr double kTolerance = 1e-10;  // of the solver: far below every measured error
constexpr int kEdges[6][2] = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};

template <class Lists>
std::vector<std::vector<std::int32_t>> as_vectors(const Lists& lists) {
  std::vector<std::vector<std::int32_t>> result;
  for (const auto& list : lists) result.emplace_back(list.begin(), list.end());
  return result;
}

// ---- quadrature ----

// Fourteen points of degree 5 (Walkington), barycentric, weights of one.
template <class Visit>
void at_cell_points(const Visit& visit) {
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

// One quadrature point of a cell or a triangle: the shape functions of its nodes, their gradients (cells only), its position,
// and its share of the volume, or of the area as an outward vector.
struct Sample {
  Eigen::VectorXd shape;
  Eigen::Matrix3Xd slope;
  Vector3d position, area;
  double volume = 0;
};

Eigen::Matrix3Xd coordinates_of(const DiscreteBody& discrete, const std::vector<std::int32_t>& nodes) {
  Eigen::Matrix3Xd positions(3, nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i)
    positions.col(static_cast<Eigen::Index>(i)) = Vector3d(discrete.discretisation.coordinates[nodes[i]].data());
  return positions;
}

// Shape functions of `corners` linear or as many quadratic ones and a middle for each edge, and their derivatives after each
// barycentric coordinate, [nodes][corners].
template <class Barycentric>
void shapes(int corners, const Barycentric& l, Eigen::Index nodes, Eigen::VectorXd& shape, Eigen::MatrixXd& after) {
  const bool linear = nodes == corners;
  shape.resize(nodes), after = Eigen::MatrixXd::Zero(nodes, corners);
  for (int i = 0; i < corners; ++i) {
    shape[i] = linear ? l[i] : l[i] * (2 * l[i] - 1);
    after(i, i) = linear ? 1 : 4 * l[i] - 1;
  }
  for (Eigen::Index e = 0; e < nodes - corners; ++e) {
    const auto [i, j] = kEdges[e];  // a triangle's edges are the first three
    shape[corners + e] = 4 * l[i] * l[j];
    after(corners + e, i) = 4 * l[j], after(corners + e, j) = 4 * l[i];
  }
}

// visit(nodes, Sample) at every quadrature point of every cell, curved or not.
template <class Visit>
void each_cell_point(const DiscreteBody& discrete, const Visit& visit) {
  Sample sample;
  Eigen::MatrixXd after;
  for (const auto& nodes : discrete.cells) {
    const Eigen::Matrix3Xd positions = coordinates_of(discrete, nodes);
    at_cell_points([&](const Eigen::Vector4d& l, double weight) {
      shapes(4, l, positions.cols(), sample.shape, after);
      const Eigen::MatrixX3d reduced = after.rightCols<3>().colwise() - after.col(0);
      const Matrix3d jacobian = positions * reduced;  // d x_i / d l_j
      sample.slope = (reduced * jacobian.inverse()).transpose();
      sample.position = positions * sample.shape;
      sample.volume = weight * jacobian.determinant() / 6;
      visit(nodes, sample);
    });
  }
}

// visit(nodes, Sample) at seven points of degree 5 of every surface triangle of which every corner satisfies `on`.
template <class Visit>
void each_surface_point(const DiscreteBody& discrete, const Where& on, const Visit& visit) {
  constexpr double a = 0.470142064105115, b = 0.101286507323456;
  const double points[7][4] = {{1.0 / 3, 1.0 / 3, 1.0 / 3, 0.225},   {a, a, 1 - 2 * a, 0.132394152788506},
                               {a, 1 - 2 * a, a, 0.132394152788506}, {1 - 2 * a, a, a, 0.132394152788506},
                               {b, b, 1 - 2 * b, 0.125939180544827}, {b, 1 - 2 * b, b, 0.125939180544827},
                               {1 - 2 * b, b, b, 0.125939180544827}};
  const auto& coordinates = discrete.discretisation.coordinates;
  Sample sample;
  Eigen::MatrixXd after;
  for (const auto& nodes : discrete.triangles) {
    if (!on(coordinates[nodes[0]]) || !on(coordinates[nodes[1]]) || !on(coordinates[nodes[2]])) continue;
    const Eigen::Matrix3Xd positions = coordinates_of(discrete, nodes);
    for (const auto& point : points) {
      shapes(3, point, positions.cols(), sample.shape, after);
      const Vector3d u = positions * (after.col(1) - after.col(0)), v = positions * (after.col(2) - after.col(0));
      sample.position = positions * sample.shape;
      sample.area = point[3] / 2 * u.cross(v);
      visit(nodes, sample);
    }
  }
}

void add_at(std::vector<double>& load, const std::vector<std::int32_t>& nodes, const Eigen::VectorXd& shape,
            const Vector3d& force) {
  for (std::size_t a = 0; a < nodes.size(); ++a)
    for (int d = 0; d < 3; ++d)
      load[3 * static_cast<std::size_t>(nodes[a]) + d] += shape[static_cast<Eigen::Index>(a)] * force[d];
}

}  // namespace

DiscreteBody discretise_body(ElasticBody body, Element element) {
  DiscreteBody discrete;
  const double begun = studies::processor_seconds();
  discrete.discretisation = discretise(body, element);
  discrete.seconds = studies::processor_seconds() - begun;
  if (element == Element::p2_p0) {
    const QuadraticMesh mesh = quadratic_mesh(body);
    discrete.cells = as_vectors(mesh.cells), discrete.triangles = as_vectors(mesh.triangles);
  } else {
    discrete.cells = as_vectors(body.tetrahedra), discrete.triangles = as_vectors(body.triangles);
  }
  discrete.body = std::move(body);
  return discrete;
}

Answer solve(const DiscreteBody& discrete, const VectorField& imposed, std::vector<double> load) {
  load.resize(3 * discrete.node_count(), 0.0);
  Answer answer;
  const double begun = studies::processor_seconds();
  answer.u = solve_with_imposed(
      discrete.discretisation,
      [&](const Point& p) {
        const Vector3d v = imposed(Vector3d(p.data()));
        return Point{v[0], v[1], v[2]};
      },
      load, kTolerance);
  answer.seconds = studies::processor_seconds() - begun;
  answer.force = multiply(discrete.discretisation.stiffness, std::span<const double>(answer.u));
  return answer;
}

Measured measured_on(const DiscreteBody& discrete, const Answer& answer, std::vector<Quantity> quantities) {
  std::size_t unknowns = 0;
  for (const auto& fixed : discrete.discretisation.fixed) unknowns += 3u - fixed[0] - fixed[1] - fixed[2];
  return {discrete.body.nodes.size(), unknowns, discrete.seconds, answer.seconds, std::move(quantities)};
}

std::vector<double> body_load(const DiscreteBody& discrete, const VectorField& density) {
  std::vector<double> load(3 * discrete.node_count(), 0.0);
  each_cell_point(discrete, [&](const auto& nodes, const Sample& sample) {
    add_at(load, nodes, sample.shape, sample.volume * density(sample.position));
  });
  return load;
}

std::vector<double> traction_load(const DiscreteBody& discrete, const Where& on, const Traction& traction) {
  std::vector<double> load(3 * discrete.node_count(), 0.0);
  each_surface_point(discrete, on, [&](const auto& nodes, const Sample& sample) {
    add_at(load, nodes, sample.shape, sample.area.norm() * traction(sample.position, sample.area.normalized()));
  });
  return load;
}

double surface_area(const DiscreteBody& discrete, const Where& on) {
  double area = 0;
  each_surface_point(discrete, on, [&](const auto&, const Sample& sample) { area += sample.area.norm(); });
  return area;
}

namespace {

// Gradient of u in a cell, at the point with barycentric coordinates l.
Matrix3d gradient_at(const DiscreteBody& discrete, const Answer& answer, const std::vector<std::int32_t>& nodes,
                     const Eigen::Vector4d& l) {
  Eigen::VectorXd shape;
  Eigen::MatrixXd after;
  const Eigen::Matrix3Xd positions = coordinates_of(discrete, nodes);
  shapes(4, l, positions.cols(), shape, after);
  const Eigen::MatrixX3d reduced = after.rightCols<3>().colwise() - after.col(0);
  const Eigen::MatrixX3d slope = reduced * Matrix3d(positions * reduced).inverse();
  Matrix3d gradient = Matrix3d::Zero();
  for (std::size_t a = 0; a < nodes.size(); ++a)
    gradient += answer.at(static_cast<std::size_t>(nodes[a])) * slope.row(static_cast<Eigen::Index>(a));
  return gradient;
}

bool touch(const std::vector<std::int32_t>& cell, const std::vector<char>& vertices) {
  return std::any_of(cell.begin(), cell.begin() + 4,
                     [&](auto n) { return vertices[static_cast<std::size_t>(n)] != 0; });
}

}  // namespace

Matrix3d recovered_stress(const DiscreteBody& discrete, const Answer& answer, std::int32_t vertex) {
  std::vector<char> near(discrete.body.nodes.size(), 0), around;
  near[static_cast<std::size_t>(vertex)] = 1;
  around = near;
  for (const auto& cell : discrete.cells)
    if (touch(cell, near))
      for (int a = 0; a < 4; ++a) around[static_cast<std::size_t>(cell[static_cast<std::size_t>(a)])] = 1;
  const Vector3d centre(discrete.body.nodes[static_cast<std::size_t>(vertex)].data());
  std::vector<std::array<double, 10>> rows;
  std::vector<Matrix3d> stresses;
  const Eigen::Vector4d middle = Eigen::Vector4d::Constant(0.25);
  for (std::size_t c = 0; c < discrete.cells.size(); ++c) {
    const auto& nodes = discrete.cells[c];
    if (!touch(nodes, around)) continue;
    const Eigen::Matrix3Xd positions = coordinates_of(discrete, nodes);
    const Vector3d x = positions.leftCols<4>().rowwise().mean() - centre;
    rows.push_back({1, x[0], x[1], x[2], x[0] * x[0], x[1] * x[1], x[2] * x[2], x[0] * x[1], x[1] * x[2], x[2] * x[0]});
    const Matrix3d gradient = gradient_at(discrete, answer, nodes, middle);
    double dilatation = 0, weights = 0;
    at_cell_points([&](const Eigen::Vector4d& l, double weight) {
      dilatation += weight * gradient_at(discrete, answer, nodes, l).trace(), weights += weight;
    });
    const Material& m = discrete.body.materials[static_cast<std::size_t>(discrete.body.region[c])];
    const Matrix3d strain = (gradient + gradient.transpose()) / 2;
    stresses.push_back(2 * shear_modulus(m) * (strain - strain.trace() / 3 * Matrix3d::Identity()) +
                       m.young / (3 * (1 - 2 * m.poisson)) * dilatation / weights * Matrix3d::Identity());
  }
  Eigen::MatrixXd fit(rows.size(), 10), values(rows.size(), 9);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    fit.row(static_cast<Eigen::Index>(i)) = Eigen::Map<const Eigen::Matrix<double, 1, 10>>(rows[i].data());
    values.row(static_cast<Eigen::Index>(i)) = Eigen::Map<const Eigen::Matrix<double, 1, 9>>(stresses[i].data());
  }
  const Eigen::RowVectorXd scale = fit.colwise().norm();
  const Eigen::MatrixXd coefficients = (fit * scale.cwiseInverse().asDiagonal()).colPivHouseholderQr().solve(values);
  const Eigen::Matrix<double, 9, 1> at_centre = coefficients.row(0).transpose() / scale[0];
  return Eigen::Map<const Matrix3d>(at_centre.data());
}

FieldError field_error(const DiscreteBody& discrete, const Answer& answer, const VectorField& displacement,
                       const GradientField& gradient, const Where& within) {
  double off = 0, all = 0, off_gradient = 0, all_gradient = 0;
  const std::vector<std::int32_t>* cell = nullptr;
  bool counts = false;
  each_cell_point(discrete, [&](const std::vector<std::int32_t>& nodes, const Sample& sample) {
    if (cell != &nodes) {
      cell = &nodes;
      const Vector3d middle = coordinates_of(discrete, nodes).leftCols<4>().rowwise().mean();
      counts = within({middle[0], middle[1], middle[2]});
    }
    if (!counts) return;
    const Vector3d exact = displacement(sample.position);
    const Matrix3d exact_gradient = gradient(sample.position);
    Vector3d value = -exact;
    Matrix3d slope = -exact_gradient;
    for (std::size_t a = 0; a < nodes.size(); ++a) {
      const Vector3d u = answer.at(static_cast<std::size_t>(nodes[a]));
      value += sample.shape[static_cast<Eigen::Index>(a)] * u;
      slope += u * sample.slope.col(static_cast<Eigen::Index>(a)).transpose();
    }
    off += sample.volume * value.squaredNorm(), all += sample.volume * exact.squaredNorm();
    off_gradient += sample.volume * slope.squaredNorm(), all_gradient += sample.volume * exact_gradient.squaredNorm();
  });
  return {std::sqrt(off / all), std::sqrt(off_gradient / all_gradient)};
}

Vector3d total_force(const DiscreteBody& discrete, const Answer& answer, const Where& on) {
  Vector3d sum = Vector3d::Zero();
  for (std::size_t n = 0; n < discrete.node_count(); ++n)
    if (on(discrete.discretisation.coordinates[n])) sum += Vector3d(&answer.force[3 * n]);
  return sum;
}

std::int32_t node_at(const DiscreteBody& discrete, const Point& point) {
  const Vector3d there(point.data());
  for (std::size_t n = 0; n < discrete.body.nodes.size(); ++n)
    if ((Vector3d(discrete.body.nodes[n].data()) - there).norm() <= 1e-9 * there.norm())
      return static_cast<std::int32_t>(n);
  throw OperationError(fmt::format("the mesh has no node at ({:g}, {:g}, {:g})", point[0], point[1], point[2]));
}

}  // namespace palpate::validation
