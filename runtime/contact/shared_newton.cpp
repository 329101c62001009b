#include "runtime/contact/shared_newton.h"

#include <algorithm>
#include <cmath>

#include "runtime/dense/dense_lu.h"

namespace palpate {
namespace {

// The inverse of a 3 x 3 matrix, by elimination with the largest pivots. Not finite where it has none.
Mat3 inverted(const Mat3& a) {
  double m[3][6] = {};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) m[i][j] = a.m[i][j];
    m[i][3 + i] = 1;
  }
  for (int k = 0; k < 3; ++k) {
    int best = k;
    for (int i = k + 1; i < 3; ++i)
      if (std::fabs(m[i][k]) > std::fabs(m[best][k])) best = i;
    for (int j = 0; j < 6; ++j) std::swap(m[k][j], m[best][j]);
    const double pivot = m[k][k];
    for (int j = 0; j < 6; ++j) m[k][j] /= pivot;
    for (int i = 0; i < 3; ++i) {
      const double factor = i == k ? 0 : m[i][k];
      for (int j = 0; j < 6 && factor != 0; ++j) m[i][j] -= factor * m[k][j];
    }
  }
  Mat3 inverse;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) inverse.m[i][j] = m[i][3 + j];
  return inverse;
}

Mat3 transposed_times(const Mat3& a, const Mat3& b) {
  Mat3 c;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c.m[i][j] = a.m[0][i] * b.m[0][j] + a.m[1][i] * b.m[1][j] + a.m[2][i] * b.m[2][j];
  return c;
}

}  // namespace

bool SharedNewton::create(SceneMemory& memory, std::int32_t contact_nodes, std::int32_t constraints) {
  capacity_ = std::min(contact_nodes, SharedNodes::kMostNodes);
  inverse_ = memory.array<Mat3>(static_cast<std::size_t>(constraints));
  through_ = memory.array<Mat3>(static_cast<std::size_t>(constraints));
  between_ = memory.array<Mat3>(static_cast<std::size_t>(capacity_) * static_cast<std::size_t>(capacity_));
  return !memory.failed();
}

std::int64_t SharedNewton::operations_to_factor(const ContactSystem& system) {
  return system.shared->operations_to_factor() + 200 * std::int64_t{system.constraint_count} +
         100 * std::int64_t{system.shared->contact_nodes()};
}
std::int64_t SharedNewton::operations_to_solve(const ContactSystem& system) {
  const SharedNodes& nodes = *system.shared;
  return 2 * std::int64_t{nodes.axes()} * nodes.axes() + 2 * nodes.operations_to_spread() +
         30 * std::int64_t{system.constraint_count};
}

void SharedNewton::begin(const ContactSystem& system) {
  for (std::int32_t a = 0; a < system.shared->count(); ++a) {
    Mat3* const row = between_ + static_cast<std::size_t>(a) * static_cast<std::size_t>(capacity_);
    std::fill(row, row + system.shared->count(), Mat3{});
  }
  std::fill(inverse_, inverse_ + system.constraint_count, Mat3{});
  std::fill(through_, through_ + system.constraint_count, Mat3{});
}

void SharedNewton::add(const ContactSystem& system, std::int32_t p, const Mat3& own, const Mat3& weight,
                       const bool has[3]) {
  Mat3 d = own;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (!has[i] || !has[j]) d.m[i][j] = i == j ? 1 : 0;
  Mat3& inverse = inverse_[p] = inverted(d);
  for (int i = 0; i < 3; ++i)
    if (!has[i]) inverse.m[i][i] = 0;
  through_[p] = inverse * weight;
  const SharedNodes& nodes = *system.shared;
  const ContactConstraint& constraint = system.constraints[p];
  const std::int32_t end = constraint.first_node + constraint.node_count;
  for (std::int32_t e = constraint.first_node; e < end; ++e) {
    const Mat3 left = transposed_times(nodes.block(e), through_[p]);
    Mat3* const row = between_ + static_cast<std::size_t>(nodes.node(e)) * static_cast<std::size_t>(capacity_);
    for (std::int32_t f = constraint.first_node; f < end; ++f) add_scaled(row[nodes.node(f)], 1, left * nodes.block(f));
  }
}

// I + K W
bool SharedNewton::factor(const ContactSystem& system, double* matrix, std::size_t stride) {
  const SharedNodes& nodes = *system.shared;
  const std::int32_t axes = nodes.axes();
  for (std::int32_t a = 0; a < nodes.count(); ++a) {
    double* const to = matrix + static_cast<std::size_t>(3 * a) * stride;
    for (int i = 0; i < 3; ++i) {
      double* const row = to + static_cast<std::size_t>(i) * stride;
      std::fill(row, row + axes, 0.0);
      row[3 * a + i] = 1;
    }
    for (std::int32_t b = 0; b < nodes.count(); ++b) {
      const Mat3& k =
          between_[static_cast<std::size_t>(a) * static_cast<std::size_t>(capacity_) + static_cast<std::size_t>(b)];
      const double *const x = nodes.compliance(3 * b), *const y = nodes.compliance(3 * b + 1),
                          *const z = nodes.compliance(3 * b + 2);
      for (int i = 0; i < 3; ++i) {
        if (k.m[i][0] == 0 && k.m[i][1] == 0 && k.m[i][2] == 0) continue;
        double* const row = to + static_cast<std::size_t>(i) * stride;
        for (std::int32_t c = 0; c < axes; ++c) row[c] += k.m[i][0] * x[c] + k.m[i][1] * y[c] + k.m[i][2] * z[c];
      }
    }
  }
  factor_ = matrix, stride_ = stride;
  return factor_lu(axes, matrix, stride);
}

void SharedNewton::solve(const ContactSystem& system, double* change) {
  const SharedNodes& nodes = *system.shared;
  double *const force = nodes.force(), *const moved = nodes.moved();
  const auto put = [&](std::int32_t p, Vec3 x) {
    for (int i = 0; i < 3; ++i)
      if (const std::int32_t row = system.rows[p].at[i]; row >= 0) change[row] = x[i];
  };
  std::fill(force, force + nodes.axes(), 0.0);
  for (std::int32_t p = 0; p < system.constraint_count; ++p) {
    const Vec3 alone = inverse_[p] * gather(system, change, p);
    put(p, alone);
    nodes.spread(system.constraints[p], alone, force);
  }
  solve_lu(nodes.axes(), factor_, stride_, force);
  nodes.move(force, moved);
  for (std::int32_t p = 0; p < system.constraint_count; ++p)
    put(p, gather(system, change, p) - through_[p] * nodes.along(system.constraints[p], moved));
}

}  // namespace palpate
