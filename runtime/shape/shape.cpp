// The shape half: gathers the columns of all contact nodes, sums them chunk by chunk, corrects and writes.
#include "runtime/shape/shape.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "runtime/base/alignment.h"
#include "runtime/base/contact_nodes.h"
#include "runtime/base/host_struct.h"
#include "runtime/dense/superposition.h"

namespace palpate {
namespace {

// Columns first .. first + count - 1 of the state's arrays: those of one corrected tool, or of all that are not corrected.
struct Group {
  int first = 0, count = 0;
  Vec3 direction;    // d_t of the corrected tool, unit
  double share = 0;  // of the correction
  bool corrected = false;
};

constexpr int kLanes = 64;  // nodes that correct_lanes handles at once

// Compares bits as integers, because compilers vectorise that and not std::isfinite: the sum reaches the sign's bit where all bits of the
// exponent are set. The loop joins by "or" and not by a maximum, whose latency would set its time.
bool all_finite(const float* x, std::size_t count) {
  std::uint32_t any = 0;
  for (std::size_t i = 0; i < count; ++i) any |= (std::bit_cast<std::uint32_t>(x[i]) & 0x7f800000u) + 0x00800000u;
  return any < 0x80000000u;
}

// The radial correction. A node's displacement u splits into a part along the tool's direction d, which stays, and a part
// orthogonal to d of length r, which gets the length P(r). Returns true where some r was outside P's measured range.
// P(r)/r is a Chebyshev sum, evaluated by Clenshaw's recurrence for many nodes side by side. share: of this change, 0 .. 1.
// Source: Cotin, Delingette and Ayache 1999, eqs 3-6.
bool correct_lanes(const ResponseCurve& curve, Vec3 direction, double share, int count, float* u) {
  const float dx = static_cast<float>(direction.x), dy = static_cast<float>(direction.y),
              dz = static_cast<float>(direction.z);
  const float range = static_cast<float>(curve.range()), end = static_cast<float>(curve.end_value()),
              slope = static_cast<float>(curve.end_slope());
  const double* coefficient = curve.ratio_coefficients();
  float r[kLanes], t[kLanes], b1[kLanes], b2[kLanes], along[kLanes];
  bool outside = false;
  for (int i = 0; i < count; ++i) {
    const float x = u[3 * i], y = u[3 * i + 1], z = u[3 * i + 2];
    along[i] = x * dx + y * dy + z * dz;
    const float ox = x - along[i] * dx, oy = y - along[i] * dy, oz = z - along[i] * dz;
    r[i] = std::sqrt(ox * ox + oy * oy + oz * oz);
    t[i] = std::min(1.0f, 2 * r[i] / range - 1);
    b1[i] = b2[i] = 0;
  }
  for (int k = curve.ratio_count() - 1; k >= 1; --k) {
    const float c = static_cast<float>(coefficient[k]);
    for (int i = 0; i < count; ++i) {
      const float b0 = c + 2 * t[i] * b1[i] - b2[i];
      b2[i] = b1[i];
      b1[i] = b0;
    }
  }
  const float c0 = static_cast<float>(coefficient[0]), left = static_cast<float>(1 - share);
  for (int i = 0; i < count; ++i) {
    float ratio = c0 + t[i] * b1[i] - b2[i];
    if (r[i] > range) {
      ratio = (end + slope * (r[i] - range)) / r[i];
      outside = true;
    }
    ratio += left * (1 - ratio);
    const float d[3] = {dx, dy, dz};
    for (int c = 0; c < 3; ++c) u[3 * i + c] = along[i] * d[c] + ratio * (u[3 * i + c] - along[i] * d[c]);
  }
  return outside;
}

class Shape {
 public:
  Shape(const StepContext& context, ShapeState& state, Compliance* compliance, palpate_shape_out& out)
      : context_(context), shape_state_(state), compliance_(compliance), out_(out) {}

  std::uint32_t step(const palpate_contacts* contacts) {
    if (!contacts || !is_aligned(contacts) ||
        !has_layout(*contacts, context_.def.max_contact_nodes, shape_state_.held, shape_state_.moved_surface.count)) {
      flags_ |= PALPATE_STEP_BAD_INPUT;
      contacts = nullptr;
    } else if (contacts->bundle != context_.bundle.index.header.index_checksum) {
      flags_ |= PALPATE_STEP_OTHER_BUNDLE;
      contacts = nullptr;
    }
    if (holds_displacements() && !shape_state_.held.adds) {
      copy_field(contacts);
      return flags_;
    }
    gather(contacts);
    added_ = contacts && holds_displacements() ? palpate_contacts_field(contacts) : nullptr;
    amounts_ = contacts && shape_state_.moved_surface.count > 0 ? palpate_contacts_amounts(contacts) : nullptr;
    if (amounts_ && !are_sound_amounts()) {
      flags_ |= PALPATE_STEP_BAD_INPUT;
      amounts_ = nullptr;
    }
    const std::int32_t wanted = std::min(shape_state_.nodes, out_.node_capacity),
                       surface = context_.tensors.surface_nodes;
    if (compliance_)
      for (int g = 0; g < group_count_; ++g) make_field(g);
    for (std::int32_t n = 0; n < wanted;) {
      const bool interior = n >= surface;
      const std::int32_t end = interior ? wanted : std::min(wanted, surface);
      const std::int32_t count = std::min(ShapeState::kChunkNodes, end - n);
      chunk(n, count, [&](int g, float* target) {
        if (interior)
          superpose_interior(g, n - surface, count, target);
        else if (compliance_)
          copy_group_field(g, n, count, target);
        else
          superpose_surface(g, n, count, target);
      });
      n += count;
    }
    out_.node_count = wanted;
    if (context_.bundle.is_lost()) flags_ |= PALPATE_STEP_BUNDLE_LOST;
    return flags_;
  }

 private:
  bool holds_displacements() const { return kHasEffects && shape_state_.held.nodes > 0; }
  // The contacts hold the displacements.
  void copy_field(const palpate_contacts* contacts) {
    const std::int32_t wanted = std::min(shape_state_.nodes, out_.node_capacity);
    for (std::int32_t n = 0; n < wanted;) {
      const std::int32_t count = std::min(ShapeState::kChunkNodes, wanted - n);
      const std::size_t floats = 3 * static_cast<std::size_t>(count);
      float* const field =
          out_.displacements ? out_.displacements + 3 * static_cast<std::size_t>(n) : shape_state_.field;
      if (contacts)
        std::copy_n(palpate_contacts_field(contacts) + 3 * static_cast<std::size_t>(n), floats, field);
      else
        std::fill(field, field + floats, 0.0f);
      finish_chunk(n, count, field);
      n += count;
    }
    out_.node_count = wanted;
    if (context_.bundle.is_lost()) flags_ |= PALPATE_STEP_BUNDLE_LOST;
  }

  // Contacts may have come through a socket, so the step trusts no number in them.
  bool is_sound(const palpate_contact_node& node, std::int32_t tool_count) const {
    const int source = enum_number(node.source);
    const bool of_tool = source <= kLastSourceOfTools;
    if (node.column < 0 || node.column >= context_.tensors.all_columns() || source < 0 || source > kLastSource ||
        (of_tool && (node.index < 0 || node.index >= tool_count)))
      return false;
    for (const double u : node.modified_displacement)
      if (!(std::fabs(u) <= 1e12)) return false;
    return true;
  }

  bool are_sound_amounts() const {
    constexpr double farthest = 1e6;  // m
    for (std::int32_t m = 0; m < shape_state_.moved_surface.count; ++m)
      if (!(std::fabs(amounts_[m]) * shape_state_.moved_surface.longest[m] <= farthest)) return false;
    return true;
  }

  // Adds the offset at nodes first .. first + count - 1, which are all on the surface or all inside.
  void add_offset(std::int32_t first, std::int32_t count, float* field) const {
    const std::int32_t surface = context_.tensors.surface_nodes;
    const OffsetRows& rows = first < surface ? shape_state_.moved_surface : shape_state_.moved_interior;
    const std::size_t at = 3 * static_cast<std::size_t>(first < surface ? first : first - surface);
    for (std::int32_t m = 0; m < rows.count; ++m) {
      const float* const u = rows.row(m) + at;
      const auto amount = static_cast<float>(amounts_[m]);
      for (std::size_t i = 0; i < 3 * static_cast<std::size_t>(count) && amount != 0; ++i) field[i] += amount * u[i];
    }
  }

  // d_t of a tool, of the length that touch.cpp explains; zero where the tool's contribution stays linear.
  Vec3 direction(const palpate_contacts& contacts, std::int32_t tool) {
    if (!shape_state_.radial.exists()) return Vec3{};
    const Vec3 d = load3(tools_behind(contacts)[tool].direction);
    if (length(d) <= 1 + 1e-6) return d;
    flags_ |= PALPATE_STEP_BAD_INPUT;
    return Vec3{};
  }

  // Contacts -> groups of columns. The tools that need no correction share the first group.
  void gather(const palpate_contacts* contacts) {
    group_count_ = 0;
    if (!contacts) return;
    bool corrected[PALPATE_MAX_TOOLS] = {};
    Vec3 d[PALPATE_MAX_TOOLS];
    double share[PALPATE_MAX_TOOLS] = {};
    for (std::int32_t t = 0; t < contacts->tool_count; ++t) {
      d[t] = direction(*contacts, t);
      share[t] = length(d[t]);
      if (std::fabs(share[t] - 1) <= 1e-6)
        share[t] = 1;
      else
        d[t] = unit_or_zero(d[t]);
      corrected[t] = shape_state_.radial.exists() && dot(d[t], d[t]) > 0;
    }
    add_group(
        *contacts, [&](std::int32_t tool) { return tool < 0 || !corrected[tool]; }, Group{});
    for (std::int32_t t = 0; t < contacts->tool_count; ++t)
      if (corrected[t])
        add_group(
            *contacts, [&](std::int32_t tool) { return tool == t; }, Group{0, 0, d[t], share[t], true});
  }

  // Contacts that share a node share its three columns: their coefficients are summed in double precision first.
  template <class Belongs>
  void add_group(const palpate_contacts& contacts, Belongs belongs, Group group) {
    group.first = column_count_;
    const palpate_contact_node* nodes = nodes_behind(contacts);
    for (std::int32_t e = 0; e < contacts.node_count; ++e) {
      const palpate_contact_node& node = nodes[e];
      if (!is_sound(node, contacts.tool_count)) {
        flags_ |= PALPATE_STEP_BAD_INPUT;
        continue;
      }
      // Where organs come near one another most of their contact nodes have no force.
      const std::int32_t tool = node.source == PALPATE_SOURCE_TOOL ? node.index : -1;
      if (!belongs(tool) || is_zero(load3(node.modified_displacement))) continue;
      std::int32_t& slot = shape_state_.slot_of_column[node.column];
      if (slot == 0) slot = 1 + add_columns(node.column, group);
      for (int j = 0; j < 3; ++j) shape_state_.sum[slot - 1 + j] += node.modified_displacement[j];
    }
    for (int c = group.first; c < group.first + group.count; ++c) {
      shape_state_.coefficient[c] = static_cast<float>(shape_state_.sum[c] * shape_state_.row_scale[c]);
      if (shape_state_.interior.numbers)
        shape_state_.interior_coefficient[c] = static_cast<float>(shape_state_.sum[c] * interior_scale(c));
    }
    for (std::int32_t e = 0; e < contacts.node_count; ++e)  // as before the call
      if (nodes[e].column >= 0 && nodes[e].column < context_.tensors.all_columns())
        shape_state_.slot_of_column[nodes[e].column] = 0;
    if (group.count > 0) groups_[group_count_++] = group;
  }

  int add_columns(std::int32_t column, Group& group) {
    const int first = column_count_;
    shape_state_.column_of_sums[column_count_ / 3] = column;
    for (int j = 0; j < 3; ++j) {
      shape_state_.sum[column_count_] = 0;
      shape_state_.surface_column[column_count_] = context_.tensors.surface_row(column, j);
      if (shape_state_.interior.numbers)
        shape_state_.interior_column[column_count_] =
            context_.tensors.is_of_surface(column)
                ? shape_state_.interior.row(column, j)
                : shape_state_.corridor_interior.row(column - context_.tensors.columns, j);
      shape_state_.row_scale[column_count_] = context_.tensors.row_scale(column, j);
      ++column_count_;
    }
    group.count += 3;
    return first;
  }

  // Whether entry c of the state's arrays is of a corridor node, whose rows are stored in f32 without a scale.
  bool is_of_corridor(int c) const { return !context_.tensors.is_of_surface(shape_state_.column_of_sums[c / 3]); }
  // Of the interior's rows, which may be of another type than the surface's.
  float interior_scale(int c) const {
    return is_of_corridor(c) ? 1.0f : shape_state_.interior.row_scale(shape_state_.column_of_sums[c / 3], c % 3);
  }

  float* group_field(int g) const {
    return shape_state_.group_field +
           3 * static_cast<std::size_t>(g) * static_cast<std::size_t>(context_.tensors.surface_nodes);
  }

  // The surface field of a group's columns on the surface, in the order of the compliance's slots: u_n = sum_k C_nk T^f_k u~_k. It
  // equals eq. 9, because T^u_nk = C_nk T^f_k.
  void make_field(int g) {
    const Group& group = groups_[g];
    const Tensors& tensors = context_.tensors;
    std::int32_t loads = 0;
    for (int c = group.first; c < group.first + group.count; c += 3) {
      const std::int32_t column = shape_state_.column_of_sums[c / 3];
      if (tensors.is_of_surface(column))
        shape_state_.loads[loads++] = {compliance_->slot_of_column(column),
                                       tensors.stiffness_of(column) * load3(shape_state_.sum + c)};
    }
    compliance_->field(shape_state_.loads, loads, group_field(g));
  }

  // A group's field at surface nodes first .. first + count - 1. The columns of corridor nodes are stored as rows.
  void copy_group_field(int g, std::int32_t first, std::int32_t count, float* field) const {
    compliance_->at_nodes(group_field(g), first, count, field);
    const Group& group = groups_[g];
    for (int c = group.first; c < group.first + group.count; ++c)
      if (const std::int32_t column = shape_state_.column_of_sums[c / 3]; is_of_corridor(c))
        add_row(static_cast<const float*>(context_.tensors.surface_row(column, c % 3)) +
                    3 * static_cast<std::size_t>(first),
                shape_state_.coefficient[c], 3 * static_cast<std::size_t>(count), field);
  }
  static void add_row(const float* row, float coefficient, std::size_t numbers, float* field) {
    for (std::size_t i = 0; i < numbers; ++i) field[i] += coefficient * row[i];
  }

  // A group's field on the surface from stored rows, at nodes first .. first + count - 1.
  void superpose_surface(int g, std::int32_t first, std::int32_t count, float* out) const {
    superpose_by_type(
        g, [&](int c) { return context_.tensors.row_type(shape_state_.column_of_sums[c / 3]); },
        shape_state_.surface_column, shape_state_.coefficient, first, count, out);
  }

  // The same inside, at the first .. first + count - 1 of the interior nodes.
  void superpose_interior(int g, std::int32_t first, std::int32_t count, float* out) const {
    superpose_by_type(
        g, [&](int c) { return is_of_corridor(c) ? shape_state_.corridor_interior.type : shape_state_.interior.type; },
        shape_state_.interior_column, shape_state_.interior_coefficient, first, count, out);
  }

  // Neighbours of one stored type at a time. type_of(c): of entry c of columns and coefficients.
  template <class TypeOf>
  void superpose_by_type(int g, TypeOf type_of, const void* const* columns, const float* coefficients,
                         std::int32_t first, std::int32_t count, float* out) const {
    const std::size_t at = 3 * static_cast<std::size_t>(first), numbers = 3 * static_cast<std::size_t>(count);
    const int begin = groups_[g].first, end = begin + groups_[g].count;
    for (int c = begin, next = begin; c < end; c = next) {
      const formats::ElementType type = type_of(c);
      while (next < end && type_of(next) == type) next += 3;
      if (c == begin)
        superpose(type, columns + c, coefficients + c, next - c, at, numbers, out);
      else
        superpose_onto(type, columns + c, coefficients + c, next - c, at, numbers, out);
    }
  }

  // Completes nodes first .. first + count - 1 of the output. field_of(g, target) writes the displacements by group g.
  template <class FieldOf>
  void chunk(std::int32_t first, std::int32_t count, FieldOf field_of) {
    const std::size_t floats = 3 * static_cast<std::size_t>(count);
    float* field = out_.displacements ? out_.displacements + 3 * static_cast<std::size_t>(first) : shape_state_.field;
    bool written = false;
    for (int g = 0; g < group_count_; ++g) {
      float* target = written ? shape_state_.tool_field : field;
      field_of(g, target);
      context_.watch.ended(Pass::superposition);
      if (groups_[g].corrected) {
        correct(groups_[g], count, target);
        context_.watch.ended(Pass::radial);
      }
      if (written)
        for (std::size_t i = 0; i < floats; ++i) field[i] += shape_state_.tool_field[i];
      written = true;
    }
    if (!written) std::fill(field, field + floats, 0.0f);
    if (added_)
      for (std::size_t i = 0; i < floats; ++i) field[i] += added_[3 * static_cast<std::size_t>(first) + i];
    if (amounts_) add_offset(first, count, field);
    finish_chunk(first, count, field);
  }

  // From the displacements of nodes first .. first + count - 1 to their positions.
  void finish_chunk(std::int32_t first, std::int32_t count, float* field) {
    const std::size_t floats = 3 * static_cast<std::size_t>(count);
    if (!all_finite(field, floats)) {
      flags_ |= PALPATE_STEP_UNSOLVED;
      for (std::size_t i = 0; i < floats; ++i)
        if (!std::isfinite(field[i])) field[i] = 0;
    }
    context_.watch.ended(Pass::superposition);
    if (!out_.positions) return;
    const float* rest = shape_state_.rest + 3 * static_cast<std::size_t>(first);
    float* position = out_.positions + 3 * static_cast<std::size_t>(first);
    for (std::size_t i = 0; i < floats; ++i) position[i] = rest[i] + field[i];
    context_.watch.ended(Pass::positions);
  }

  void correct(const Group& group, std::int32_t count, float* u) {
    for (std::int32_t n = 0; n < count; n += kLanes)
      if (correct_lanes(shape_state_.radial, group.direction, group.share, std::min(kLanes, count - n), u + 3 * n))
        flags_ |= PALPATE_STEP_RESPONSE_RANGE;
  }

  const StepContext& context_;
  ShapeState& shape_state_;
  Compliance* const compliance_;
  palpate_shape_out& out_;
  std::uint32_t flags_ = 0;
  Group groups_[PALPATE_MAX_TOOLS + 1];
  int group_count_ = 0, column_count_ = 0;
  const float* added_ = nullptr;     // [nodes][3] m, adds to superposition; nullptr: nothing does
  const double* amounts_ = nullptr;  // of the offset; nullptr: there is none
};

}  // namespace

std::uint32_t shape_step(const StepContext& context, ShapeState& state, Compliance* compliance,
                         const palpate_contacts* contacts, palpate_shape_out& out) {
  return Shape(context, state, compliance, out).step(contacts);
}

}  // namespace palpate
