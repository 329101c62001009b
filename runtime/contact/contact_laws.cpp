#include "runtime/contact/contact_laws.h"

#include <algorithm>
#include <cmath>

#include "runtime/dense/dense_rows.h"

namespace palpate {
namespace {

// Relative rounding by which a tangential force may exceed its friction.
constexpr double kRounding = 1e-12;

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

Vec3 cut_tangent(Vec3 r, double most) {
  const double size = length({0, r.y, r.z});
  if (size > most) r.y *= most / size, r.z *= most / size;
  return r;
}

// Rounds of coordinate descent on one constraint whose reactions are limited.
constexpr int kRoundsOfOne = 20;

// Where of three rows the first one alone exceeds its limit: that row at its limit, and the others
// exactly with it held. False where these exceed theirs then.
bool first_at_limit(const Mat3& own, Vec3 c, Vec3 most, Vec3* r) {
  if (!(std::fabs(r->x) > most.x)) return false;
  const double x = r->x > 0 ? most.x : -most.x, l = own.m[2][1] / own.m[1][1];
  const double y = c.y - own.m[1][0] * x, z = (c.z - own.m[2][0] * x - l * y) / (own.m[2][2] - l * own.m[1][2]);
  const Vec3 found = {x, (y - own.m[1][2] * z) / own.m[1][1], z};
  if (!(std::fabs(found.y) <= most.y && std::fabs(found.z) <= most.z)) return false;
  *r = found;
  return true;
}

// The same as constraint_force() where that exceeds the limits: the rows one after the other, each exactly with the others held.
Vec3 limited_force(const ContactConstraint& constraint, const Mat3& own, Vec3 c, Vec3 most, Vec3 r) {
  const bool pushes = constraint.law == ContactLaw::unilateral || constraint.law == ContactLaw::coulomb;
  const double across = std::max(own.m[1][1], own.m[2][2]);
  if (!pushes && first_at_limit(own, c, most, &r)) return r;
  r = within_limits(constraint, r, most);
  for (int round = 0; round < kRoundsOfOne; ++round) {
    if (constraint.law == ContactLaw::coulomb) {
      r.x = std::clamp(r.x + (c.x - dot({own.m[0][0], own.m[0][1], own.m[0][2]}, r)) / own.m[0][0], 0.0, most.x);
      const Vec3 off = c - own * r;
      r.y += off.y / across, r.z += off.z / across;
      r = cut_tangent(r, most_friction(constraint, r.x, most));
      continue;
    }
    for (int i = 0; i < 3; ++i) {
      const double off = c[i] - dot({own.m[i][0], own.m[i][1], own.m[i][2]}, r);
      r[i] = std::clamp(r[i] + off / own.m[i][i], pushes ? 0.0 : -most[i], most[i]);
    }
    if (pushes) r.y = r.z = 0;
  }
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

}  // namespace

Vec3 solve3(const Mat3& a, Vec3 b) {
  const double l10 = a.m[1][0] / a.m[0][0], l20 = a.m[2][0] / a.m[0][0];
  const double d1 = a.m[1][1] - l10 * a.m[0][1], e = a.m[2][1] - l20 * a.m[0][1], l21 = e / d1;
  const double d2 = a.m[2][2] - l20 * a.m[0][2] - l21 * (a.m[1][2] - l10 * a.m[0][2]);
  const double y1 = b.y - l10 * b.x, y2 = b.z - l20 * b.x - l21 * y1;
  const double z = y2 / d2, y = (y1 - (a.m[1][2] - l10 * a.m[0][2]) * z) / d1;
  return {(b.x - a.m[0][1] * y - a.m[0][2] * z) / a.m[0][0], y, z};
}

Mat3 own_compliance(const ContactSystem& system, std::int32_t p) {
  if (system.own) return system.own[p];
  Mat3 own;
  double most = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const std::int32_t row = system.rows[p].at[i], column = system.rows[p].at[j];
      if (row < 0 || column < 0) continue;
      own.m[i][j] =
          system.matrix[static_cast<std::size_t>(row) * system.stride + column] + (i == j ? system.soft[row] : 0);
      most = std::max(most, i == j ? own.m[i][j] : 0);
    }
  for (int i = 0; i < 3; ++i)
    if (system.rows[p].at[i] < 0) own.m[i][i] = most > 0 ? most : 1;
  return own;
}

void find_own_compliances(const ContactSystem& system, Mat3* own) {
  ContactSystem from = system;
  from.own = nullptr;
  for (std::int32_t p = 0; p < system.constraint_count; ++p) own[p] = own_compliance(from, p);
}

Vec3 most_of(const ContactSystem& system, std::int32_t p) {
  Vec3 most = {INFINITY, INFINITY, INFINITY};
  for (int i = 0; i < 3; ++i)
    if (const std::int32_t row = system.rows[p].at[i]; row >= 0 && system.most) most[i] = system.most[row];
  if (const double limit = system.constraints[p].limit; limit > 0) most.x = std::min(most.x, limit);
  return most;
}

double most_friction(const ContactConstraint& constraint, double normal, Vec3 most) {
  return std::min(constraint.friction * std::max(0.0, normal), std::min(most.y, most.z));
}

Vec3 within_limits(const ContactConstraint& constraint, Vec3 r, Vec3 most) {
  if (constraint.law != ContactLaw::coulomb) {
    for (int i = 0; i < 3; ++i) r[i] = std::clamp(r[i], -most[i], most[i]);
    return r;
  }
  // A tangential force that friction allows keeps its bits.
  if (r.x <= most.x) return cut_tangent(r, std::min(most.y, most.z));
  r.x = most.x;
  return cut_tangent(r, most_friction(constraint, r.x, most));
}

Vec3 gather(const ContactSystem& system, const double* numbers, std::int32_t p) {
  Vec3 v;
  for (int i = 0; i < 3; ++i)
    if (const std::int32_t row = system.rows[p].at[i]; row >= 0) v[i] = numbers[row];
  return v;
}

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
    if (!may_give_way(constraint)) continue;
    const Vec3 r = gather(system, reaction, p);
    if (constraint.limit > 0 && std::fabs(r.x) > constraint.limit * (1 + kRounding)) return false;
    if (constraint.law == ContactLaw::sticking || constraint.law == ContactLaw::sliding) continue;
    if (r.x < 0) return false;
    if (constraint.law == ContactLaw::coulomb && length({0, r.y, r.z}) > constraint.friction * r.x * (1 + kRounding))
      return false;
  }
  return true;
}

namespace {

// H W H^T r at one constraint, in a sweep that changes r: by its rows, or by the displacement of the nodes, which follows r.
class RunningProduct {
 public:
  RunningProduct(const ContactSystem& system, const double* reaction) : system_(system), reaction_(reaction) {
    if (!sweeps_nodes(system)) return;
    nodes_ = system.shared;
    std::fill(nodes_->force(), nodes_->force() + nodes_->axes(), 0.0);
    for (std::int32_t p = 0; p < system.constraint_count; ++p)
      nodes_->spread(system.constraints[p], gather(system, reaction, p), nodes_->force());
    nodes_->move(nodes_->force(), nodes_->moved());
  }
  Vec3 missed(std::int32_t p) const {
    if (!nodes_) return palpate::missed(system_, reaction_, p);
    const ContactConstraint& constraint = system_.constraints[p];
    return nodes_->along(constraint, nodes_->moved()) + constraint.local * gather(system_, reaction_, p) -
           gather(system_, system_.target, p);
  }
  void changed(std::int32_t p, Vec3 by) {
    if (nodes_) nodes_->add_moved(system_.constraints[p], by, nodes_->moved());
  }
  static std::int64_t operations_of_nodes(const SharedNodes& nodes) {
    return nodes.operations_to_spread() + nodes.operations_to_move() +
           9 * std::int64_t{nodes.count()} * nodes.contact_nodes();
  }
  static bool sweeps_nodes(const ContactSystem& system) {
    return system.shared && operations_of_nodes(*system.shared) < std::int64_t{system.rows_end} * system.rows_end;
  }

 private:
  const ContactSystem& system_;
  const double* reaction_;
  const SharedNodes* nodes_ = nullptr;
};

// (H W H^T + soft) r, less the targets where `target` is not nullptr.
void multiply(const ContactSystem& system, const double* reaction, const double* target, double* product) {
  std::fill(product, product + system.rows_end, 0.0);
  const SharedNodes* const nodes = system.shared;
  if (nodes) {
    std::fill(nodes->force(), nodes->force() + nodes->axes(), 0.0);
    for (std::int32_t p = 0; p < system.constraint_count; ++p)
      nodes->spread(system.constraints[p], gather(system, reaction, p), nodes->force());
    nodes->move(nodes->force(), nodes->moved());
  }
  for (std::int32_t p = 0; p < system.constraint_count; ++p) {
    const ContactConstraint& constraint = system.constraints[p];
    Vec3 along;
    if (nodes) along = nodes->along(constraint, nodes->moved()) + constraint.local * gather(system, reaction, p);
    for (int i = 0; i < 3; ++i) {
      const std::int32_t row = system.rows[p].at[i];
      if (row < 0) continue;
      if (!nodes)
        along[i] = dot_rows(system.rows_end, system.matrix + static_cast<std::size_t>(row) * system.stride, reaction);
      product[row] = (target ? along[i] - target[row] : along[i]) + system.soft[row] * reaction[row];
    }
  }
}

}  // namespace

std::int64_t operations_of_sweep(const ContactSystem& system) {
  const std::int64_t rows = system.rows_end, products = RunningProduct::sweeps_nodes(system)
                                                            ? RunningProduct::operations_of_nodes(*system.shared)
                                                            : rows * rows;
  return products + 600 * std::int64_t{system.constraint_count};
}

std::int64_t operations_of_product(const ContactSystem& system) {
  if (system.shared) return 2 * system.shared->operations_to_spread() + system.shared->operations_to_move();
  return std::int64_t{system.rows_end} * system.rows_end;
}

double sweep_contacts(const ContactSystem& system, double* reaction) {
  double change = 0;
  RunningProduct product(system, reaction);
  for (std::int32_t p = 0; p < system.constraint_count; ++p) {
    const Mat3 own = own_compliance(system, p);
    const Vec3 before = gather(system, reaction, p), off = product.missed(p);
    // c: the target minus the displacement by all other constraints. `off` does not contain the soft part of the diagonal.
    Vec3 c = own * before - off;
    for (int i = 0; i < 3; ++i) {
      const std::int32_t row = system.rows[p].at[i];
      c[i] = row < 0 ? 0 : c[i] - system.soft[row] * before[i];
    }
    const Vec3 most = most_of(system, p);
    Vec3 now = constraint_force(system.constraints[p], own, c);
    if (std::fabs(now.x) > most.x || std::fabs(now.y) > most.y || std::fabs(now.z) > most.z)
      now = limited_force(system.constraints[p], own, c, most, now);
    for (int i = 0; i < 3; ++i) {
      const std::int32_t row = system.rows[p].at[i];
      if (row < 0) continue;
      reaction[row] = now[i];
      change = std::max(change, std::fabs(now[i] - before[i]) * own.m[i][i]);
    }
    product.changed(p, gather(system, reaction, p) - before);
  }
  return change;
}

void find_product(const ContactSystem& system, const double* reaction, double* product) {
  multiply(system, reaction, nullptr, product);
}

void find_ahead(const ContactSystem& system, const double* reaction, double* ahead) {
  multiply(system, reaction, system.target, ahead);
}

Vec3 missed_by_law(const ContactConstraint& constraint, const Mat3& own, Vec3 r, Vec3 ahead, Vec3 most) {
  if (constraint.law == ContactLaw::sticking || constraint.law == ContactLaw::sliding) {
    for (int i = 0; i < 3; ++i)
      ahead[i] = std::max(std::min(ahead[i], own.m[i][i] * (r[i] + most[i])), own.m[i][i] * (r[i] - most[i]));
    return ahead;
  }
  const double x = std::max(std::min(ahead.x, r.x * own.m[0][0]), own.m[0][0] * (r.x - most.x));
  if (constraint.law == ContactLaw::unilateral) return {x, 0, 0};
  // One step of the projection: back along the miss, then onto the disc of tangential forces that friction allows.
  const double compliance = std::max(own.m[1][1], own.m[2][2]), limit = most_friction(constraint, r.x, most);
  double y = r.y - ahead.y / compliance, z = r.z - ahead.z / compliance;
  if (const double size = length({0, y, z}); size > limit) y *= limit / size, z *= limit / size;
  return {x, compliance * (r.y - y), compliance * (r.z - z)};
}

ContactResidual law_residual(const ContactSystem& system, const double* reaction, const double* ahead) {
  ContactResidual residual;
  for (std::int32_t p = 0; p < system.constraint_count; ++p) {
    const Mat3 own = own_compliance(system, p);
    const Vec3 off = missed_by_law(system.constraints[p], own, gather(system, reaction, p), gather(system, ahead, p),
                                   most_of(system, p));
    for (int i = 0; i < 3; ++i) {
      if (system.rows[p].at[i] < 0) continue;
      residual.displacement = std::max(residual.displacement, std::fabs(off[i]));
      residual.force = std::max(residual.force, std::fabs(off[i]) / own.m[i][i]);
    }
  }
  return residual;
}

}  // namespace palpate
