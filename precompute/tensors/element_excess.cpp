#include "precompute/tensors/element_excess.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "precompute/elements/linear_tetrahedra.h"

namespace palpate {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kSteps = 1;

Vector3d place_of(const ElasticBody& body, std::int32_t node) {
  return Vector3d(body.nodes[node].data());
}

// What p1-ang has more than the element: K' - K = sites - tetrahedra, of the moduli that are averaged anew.
class Difference {
 public:
  Difference(const ElasticBody& body, Element element)
      : body_(body),
        bulk_(element == Element::p1 ? 1 : 0),
        shear_(averaged_shear_of(Element::p1_ang)),
        sites_(nodal_dilatations(body, shear_)) {}

  // x, result: [3 N]
  std::vector<double> times(const std::vector<double>& x) const {
    std::vector<double> y(x.size(), 0.0);
    const auto at = [&](std::int32_t n) { return Eigen::Map<const Vector3d>(x.data() + 3 * n); };
    const auto add = [&](std::int32_t n, const Vector3d& f) { Eigen::Map<Vector3d>(y.data() + 3 * n) += f; };
    for (std::size_t s = 0; s < sites_.nodes.size(); ++s) {
      const auto nodes = sites_.nodes[s];
      const auto* factor = &sites_.factor[sites_.nodes.first[s]];
      Matrix3d h = Matrix3d::Zero();
      for (std::size_t a = 0; a < nodes.size(); ++a) h += at(nodes[a]) * Vector3d(factor[a].data()).transpose();
      const Matrix3d stress = stress_of(h, bulk_, sites_.shear[s]);
      for (std::size_t a = 0; a < nodes.size(); ++a) add(nodes[a], stress * Vector3d(factor[a].data()));
    }
    for (std::size_t t = 0; t < body_.tetrahedra.size(); ++t) {
      const auto& nodes = body_.tetrahedra[t];
      Matrix3d edges;
      for (int a = 0; a < 3; ++a)
        edges.row(a) =
            (place_of(body_, nodes[static_cast<std::size_t>(a) + 1]) - place_of(body_, nodes[0])).transpose();
      const double volume = edges.determinant() / 6;
      const Matrix3d gradients = edges.inverse();  // of corners 1, 2, 3, in columns
      Matrix3d h = Matrix3d::Zero();
      for (int a = 0; a < 3; ++a)
        h += (at(nodes[static_cast<std::size_t>(a) + 1]) - at(nodes[0])) * gradients.col(a).transpose();
      const Moduli moduli = moduli_of(body_.materials[body_.region[t]]);
      const Matrix3d forces = volume * stress_of(h, bulk_ * moduli.bulk, shear_ * moduli.shear) * gradients;
      for (int a = 0; a < 3; ++a) add(nodes[static_cast<std::size_t>(a) + 1], -forces.col(a));
      add(nodes[0], forces.rowwise().sum());
    }
    return y;
  }

 private:
  static Matrix3d stress_of(const Matrix3d& h, double bulk, double shear) {
    return shear * (h + h.transpose()) + (bulk - 2 * shear / 3) * h.trace() * Matrix3d::Identity();
  }

  const ElasticBody& body_;
  double bulk_, shear_;  // shares that are averaged anew
  Dilatations sites_;
};

// Vectors of rows of K, one for each probe.
using Columns = std::vector<std::vector<double>>;

class Rows {
 public:
  Rows(const Discretisation& discretisation, const HeldStiffness& held, ColumnSolver& solver)
      : discretisation_(discretisation), held_(held), solver_(solver) {}

  std::vector<double> of_nodes(const std::vector<double>& nodes) const {
    std::vector<double> rows(3 * held_.node_of_row.size());
    for (std::size_t r = 0; r < held_.node_of_row.size(); ++r)
      for (std::size_t i = 0; i < 3; ++i) {
        const auto n = static_cast<std::size_t>(held_.node_of_row[r]);
        rows[3 * r + i] = discretisation_.fixed[n][i] ? 0 : nodes[3 * n + i];
      }
    return rows;
  }
  std::vector<double> to_nodes(const std::vector<double>& rows) const {
    std::vector<double> nodes(3 * discretisation_.coordinates.size(), 0.0);
    for (std::size_t r = 0; r < held_.node_of_row.size(); ++r)
      for (std::size_t i = 0; i < 3; ++i)
        nodes[3 * static_cast<std::size_t>(held_.node_of_row[r]) + i] = rows[3 * r + i];
    return nodes;
  }
  Columns solve(const Columns& b) const {
    const auto width = static_cast<std::size_t>(solver_.width()), dofs = static_cast<std::size_t>(solver_.dofs());
    std::vector<double> x(dofs * width);
    std::vector<ColumnReport> reports(width);
    Columns result(b.size(), std::vector<double>(dofs));
    for (std::size_t begin = 0; begin < b.size(); begin += width) {
      const std::size_t count = std::min(width, b.size() - begin);
      std::vector<Load> loads;
      for (std::size_t i = 0; i < dofs; ++i)
        for (std::size_t c = 0; c < count; ++c)
          if (b[begin + c][i] != 0)
            loads.push_back({static_cast<std::int64_t>(i), static_cast<std::int32_t>(c), b[begin + c][i]});
      solver_.solve(loads, x.data(), reports);
      for (std::size_t c = 0; c < count; ++c)
        for (std::size_t i = 0; i < dofs; ++i) result[begin + c][i] = x[i * width + c];
    }
    return result;
  }

 private:
  const Discretisation& discretisation_;
  const HeldStiffness& held_;
  ColumnSolver& solver_;
};

double dot(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}
void add_multiple(double factor, const std::vector<double>& a, std::vector<double>& sum) {
  for (std::size_t i = 0; i < a.size(); ++i) sum[i] += factor * a[i];
}

}  // namespace

std::vector<std::vector<double>> element_probes(const ElasticBody& body) {
  std::vector<std::vector<double>> probes;
  std::vector<double> volume(body.nodes.size(), 0.0);
  for (const auto& t : body.tetrahedra) {
    Matrix3d edges;
    for (int a = 0; a < 3; ++a)
      edges.row(a) = (place_of(body, t[static_cast<std::size_t>(a) + 1]) - place_of(body, t[0])).transpose();
    for (const auto n : t) volume[static_cast<std::size_t>(n)] += edges.determinant() / 24;
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::vector<double>& load = probes.emplace_back(3 * body.nodes.size(), 0.0);
    for (std::size_t n = 0; n < volume.size(); ++n) load[3 * n + axis] = volume[n];
  }
  return probes;
}

ElementExcess measure_element_excess(const ElasticBody& body, Element element, const Discretisation& discretisation,
                                     const HeldStiffness& held, ColumnSolver& solver) {
  const Rows rows(discretisation, held, solver);
  Columns load;
  for (const auto& probe : element_probes(body)) load.push_back(rows.of_nodes(probe));
  Columns x = rows.solve(load);
  std::vector<double> first;
  for (std::size_t c = 0; c < x.size(); ++c) first.push_back(dot(load[c], x[c]));
  const Difference difference(body, element);
  const auto more = [&](const std::vector<double>& v) { return rows.of_nodes(difference.times(rows.to_nodes(v))); };
  Columns r, p;
  for (const auto& column : x) {
    r.push_back(more(column));
    for (double& value : r.back()) value = -value;
  }
  std::vector<double> last(x.size(), 0.0);  // r . K^-1 r
  for (int step = 0; step < kSteps; ++step) {
    const Columns z = rows.solve(r);
    for (std::size_t c = 0; c < x.size(); ++c) {
      const double now = dot(r[c], z[c]);
      if (!(now > 0)) continue;
      if (step == 0) p.resize(x.size());
      std::vector<double> way = z[c];
      if (step > 0 && last[c] > 0) add_multiple(now / last[c], p[c], way);
      std::vector<double> stiff = multiply(held.matrix, way);
      add_multiple(1, more(way), stiff);
      const double share = now / dot(way, stiff);
      add_multiple(share, way, x[c]), add_multiple(-share, stiff, r[c]);
      p[c] = std::move(way), last[c] = now;
    }
  }
  std::vector<double> excess;
  for (std::size_t c = 0; c < x.size(); ++c)
    // f . x + r . x <= f . u, where K' u = f, and misses it by the square of what x misses.
    if (first[c] > 0) excess.push_back((dot(load[c], x[c]) + dot(r[c], x[c])) / first[c] - 1);
  if (excess.empty()) return {};
  std::sort(excess.begin(), excess.end());
  return {static_cast<int>(excess.size()), excess.back(), excess[excess.size() / 2]};
}

}  // namespace palpate
