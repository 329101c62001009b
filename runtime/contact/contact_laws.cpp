#include "runtime/contact/contact_laws.h"

#include <algorithm>
#include <cmath>

#include "runtime/dense/dense_rows.h"

namespace palpate {
namespace {

// Relative rounding by which a tangential force may exceed its friction.
constexpr double kRounding = 1e-12;

// The constraint's diagonal block of the system on its rows; the identity on the others, whose reactions then stay zero.
Mat3 own_compliance(const ContactSystem& system, std::int32_t p) {
  Mat3 own;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const std::int32_t row = system.rows[p].at[i], column = system.rows[p].at[j];
      if (row >= 0 && column >= 0)
        own.m[i][j] =
            system.matrix[static_cast<std::size_t>(row) * system.stride + column] + (i == j ? system.soft[row] : 0);
      else
        own.m[i][j] = i == j ? 1 : 0;
    }
  return own;
}

// Solves a x = b for a symmetric positive definite a.
Vec3 solve3(const Mat3& a, Vec3 b) {
  const double l10 = a.m[1][0] / a.m[0][0], l20 = a.m[2][0] / a.m[0][0];
  const double d1 = a.m[1][1] - l10 * a.m[0][1], e = a.m[2][1] - l20 * a.m[0][1], l21 = e / d1;
  const double d2 = a.m[2][2] - l20 * a.m[0][2] - l21 * (a.m[1][2] - l10 * a.m[0][2]);
  const double y1 = b.y - l10 * b.x, y2 = b.z - l20 * b.x - l21 * y1;
  const double z = y2 / d2, y = (y1 - (a.m[1][2] - l10 * a.m[0][2]) * z) / d1;
  return {(b.x - a.m[0][1] * y - a.m[0][2] * z) / a.m[0][0], y, z};
}

// The reaction of a slipping contact: (own + lambda on the two tangential rows) r = c with |r_t| = mu r_n. lambda r_t is the
// slip, opposite to the friction. With share = 1 / (1 + lambda / scale), the excess |r_t| - mu r_n changes its sign once as
// share runs from 0 (no friction) to 1 (sticking); false position finds that root (the Illinois variant, which halves the
// value at an end that has stayed twice).
Vec3 slip3(const Mat3& own, Vec3 c, double friction) {
  const double scale = std::max(own.m[1][1], own.m[2][2]);
  const auto force = [&](double share) {
    Mat3 softer = own;
    const double lambda = scale * (1 / share - 1);
    softer.m[1][1] += lambda, softer.m[2][2] += lambda;
    return solve3(softer, c);
  };
  const auto excess = [&](Vec3 r) { return length({0, r.y, r.z}) - friction * r.x; };
  double low = 0, high = 1, at_low = -friction * c.x / own.m[0][0], at_high = excess(force(1));
  Vec3 r = {c.x / own.m[0][0], 0, 0};
  int side = 0;
  for (int round = 0; round < 60; ++round) {
    const double share = std::clamp((low * at_high - high * at_low) / (at_high - at_low), 1e-9, 1.0);
    r = force(share);
    const double e = excess(r);
    if (std::fabs(e) <= kRounding * std::fabs(friction * r.x) || high - low < 1e-15) break;
    if (e > 0) {
      high = share, at_high = e;
      if (side > 0) at_low *= 0.5;
      side = 1;
    } else {
      low = share, at_low = e;
      if (side < 0) at_high *= 0.5;
      side = -1;
    }
  }
  r.x = std::max(0.0, r.x);
  const double size = length({0, r.y, r.z}), most = friction * r.x;
  if (size > 0) r.y *= most / size, r.z *= most / size;
  return r;
}

// The reaction of one constraint under its law, where own r = c without the law.
Vec3 constraint_force(const ContactConstraint& constraint, const Mat3& own, Vec3 c) {
  switch (constraint.law) {
    case ContactLaw::unilateral:
      return {std::max(0.0, c.x / own.m[0][0]), 0, 0};
    case ContactLaw::coulomb: {
      if (!(c.x > 0)) return {};
      if (!(constraint.friction > 0)) return {c.x / own.m[0][0], 0, 0};
      const Vec3 stick = solve3(own, c);
      if (stick.x > 0 && length({0, stick.y, stick.z}) <= constraint.friction * stick.x) return stick;
      return slip3(own, c, constraint.friction);
    }
    default:
      return solve3(own, c);
  }
}

Vec3 gather(const ContactSystem& system, const double* numbers, std::int32_t p) {
  Vec3 v;
  for (int i = 0; i < 3; ++i)
    if (const std::int32_t row = system.rows[p].at[i]; row >= 0) v[i] = numbers[row];
  return v;
}

}  // namespace

Vec3 missed(const ContactSystem& system, const double* reaction, std::int32_t p) {
  Vec3 w;
  for (int i = 0; i < 3; ++i)
    if (const std::int32_t row = system.rows[p].at[i]; row >= 0)
      w[i] = dot_rows(system.rows_end, system.matrix + static_cast<std::size_t>(row) * system.stride, reaction) -
             system.target[row];
  return w;
}

bool obeys_laws(const ContactSystem& system, const double* reaction) {
  for (std::int32_t p = 0; p < system.constraint_count; ++p) {
    const ContactConstraint& constraint = system.constraints[p];
    if (constraint.law == ContactLaw::sticking || constraint.law == ContactLaw::sliding) continue;
    const Vec3 r = gather(system, reaction, p);
    if (r.x < 0) return false;
    if (constraint.law == ContactLaw::coulomb && length({0, r.y, r.z}) > constraint.friction * r.x * (1 + kRounding))
      return false;
  }
  return true;
}

std::int32_t sweep_contacts(const ContactSystem& system, double* reaction, double tolerance, std::int32_t most_sweeps) {
  for (std::int32_t sweep = 1; sweep <= most_sweeps; ++sweep) {
    double change = 0;
    for (std::int32_t p = 0; p < system.constraint_count; ++p) {
      const Mat3 own = own_compliance(system, p);
      const Vec3 before = gather(system, reaction, p), off = missed(system, reaction, p);
      // c: the target minus the displacement by all other constraints. `off` does not contain the soft part of the diagonal.
      Vec3 c = own * before - off;
      for (int i = 0; i < 3; ++i) {
        const std::int32_t row = system.rows[p].at[i];
        c[i] = row < 0 ? 0 : c[i] - system.soft[row] * before[i];
      }
      const Vec3 now = constraint_force(system.constraints[p], own, c);
      for (int i = 0; i < 3; ++i) {
        const std::int32_t row = system.rows[p].at[i];
        if (row < 0) continue;
        reaction[row] = now[i];
        change = std::max(change, std::fabs(now[i] - before[i]) * own.m[i][i]);
      }
    }
    if (change <= tolerance) return sweep;
  }
  return most_sweeps;
}

ContactResidual law_residual(const ContactSystem& system, const double* reaction) {
  ContactResidual residual;
  for (std::int32_t p = 0; p < system.constraint_count; ++p) {
    const ContactConstraint& constraint = system.constraints[p];
    const Mat3 own = own_compliance(system, p);
    const Vec3 r = gather(system, reaction, p);
    Vec3 off = missed(system, reaction, p);
    if (constraint.law == ContactLaw::unilateral || constraint.law == ContactLaw::coulomb)
      off.x = std::min(off.x, r.x * own.m[0][0]);
    if (constraint.law == ContactLaw::coulomb) {
      // One step of the projection: back along the miss, then onto the disc of tangential forces that friction allows.
      const double step = 1 / std::max(own.m[1][1], own.m[2][2]), most = constraint.friction * std::max(0.0, r.x);
      double y = r.y - step * off.y, z = r.z - step * off.z;
      if (const double size = length({0, y, z}); size > most) y *= most / size, z *= most / size;
      off.y = (r.y - y) / step, off.z = (r.z - z) / step;
    }
    for (int i = 0; i < 3; ++i) {
      if (system.rows[p].at[i] < 0) continue;
      residual.displacement = std::max(residual.displacement, std::fabs(off[i]));
      residual.force = std::max(residual.force, std::fabs(off[i]) / own.m[i][i]);
    }
  }
  return residual;
}

}  // namespace palpate
