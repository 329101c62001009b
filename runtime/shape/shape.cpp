// The render half: contacts -> superposition (eq. 9) -> radial correction -> displaced nodes.
#include <algorithm>
#include <bit>
#include <cmath>

#include "runtime/dense/superposition.h"
#include "runtime/scene/scene.h"

namespace palpate {
namespace {

// The columns of one tool (or, without a correction, of all) in the scene's arrays, from `first`.
struct Group {
  int first = 0, count = 0;
  Vec3 direction;
  bool corrected = false;
};

constexpr int kLanes = 64;

// As integers, so that a compiler looks at many at once.
bool all_finite(const float* x, std::size_t count) {
  std::int32_t largest = 0;
  for (std::size_t i = 0; i < count; ++i) largest = std::max(largest, std::bit_cast<std::int32_t>(x[i]) & 0x7fffffff);
  return largest < 0x7f800000;
}

// u = a d + o: keeps a d and makes the length r of o P(r), per node. Returns true when an r was outside P's range.
// Source: Cotin, Delingette and Ayache 1999, eqs 3-6; DESIGN section 4.
bool correct_lanes(const ResponseCurve& curve, Vec3 direction, int count, float* u) {
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
  const float c0 = static_cast<float>(coefficient[0]);
  for (int i = 0; i < count; ++i) {
    float ratio = c0 + t[i] * b1[i] - b2[i];
    if (r[i] > range) {
      ratio = (end + slope * (r[i] - range)) / r[i];
      outside = true;
    }
    const float d[3] = {dx, dy, dz};
    for (int c = 0; c < 3; ++c) u[3 * i + c] = along[i] * d[c] + ratio * (u[3 * i + c] - along[i] * d[c]);
  }
  return outside;
}

class Shape {
 public:
  Shape(palpate_scene& scene, palpate_shape_out& out) : scene_(scene), half_(scene.shape), out_(out) {}

  std::uint32_t step(const palpate_contacts* contacts) {
    if (!is_sound(contacts)) {
      flags_ |= PALPATE_STEP_BAD_INPUT;
      contacts = nullptr;
    }
    gather(contacts);
    const std::int32_t wanted = std::min(half_.nodes, out_.node_capacity), surface = scene_.tensors.surface_nodes;
    if (scene_.tensors.compliance)
      for (int g = 0; g < group_count_; ++g) make_field(g);
    for (std::int32_t n = 0; n < wanted;) {
      const bool interior = n >= surface;
      const std::int32_t end = interior ? wanted : std::min(wanted, surface);
      const std::int32_t count = std::min(ShapeHalf::kChunkNodes, end - n);
      chunk(n, count, [&](int g, float* target) {
        if (interior)
          superpose_rows(half_.interior.type, half_.interior_column, g, n - surface, count, target);
        else if (scene_.tensors.compliance)
          std::copy_n(group_field(g) + 3 * static_cast<std::size_t>(n), 3 * static_cast<std::size_t>(count), target);
        else
          superpose_rows(scene_.tensors.surface.type, half_.surface_column, g, n, count, target);
      });
      n += count;
    }
    out_.node_count = wanted;
    if (scene_.bundle->is_lost()) flags_ |= PALPATE_STEP_BUNDLE_LOST;
    return flags_;
  }

 private:
  // Contacts may have come through a socket: nothing in them is trusted.
  bool is_sound(const palpate_contacts* contacts) const {
    if (!contacts || !is_aligned(contacts) || contacts->node_count < 0 ||
        contacts->node_count > scene_.def.max_contact_nodes)
      return false;
    const std::size_t bytes =
        sizeof(palpate_contacts) + static_cast<std::size_t>(contacts->node_count) * sizeof(palpate_contact_node);
    return contacts->used_bytes == bytes && contacts->tool_count >= 0 && contacts->tool_count <= PALPATE_MAX_TOOLS;
  }
  bool is_sound(const palpate_contact_node& node, std::int32_t tool_count) const {
    if (node.column < 0 || node.column >= scene_.tensors.columns || node.tool < 0 || node.tool >= tool_count)
      return false;
    for (const double u : node.modified_displacement)
      if (!(std::fabs(u) <= 1e12)) return false;
    return true;
  }

  // A unit vector, or zero: then the tool has no direction and its contribution stays linear.
  Vec3 direction(const palpate_contacts& contacts, std::int32_t tool) {
    if (!kHasEffects || scene_.def.radial == PALPATE_RADIAL_OFF) return Vec3{};
    const Vec3 d = load3(contacts.tools[tool].direction);
    const double size = length(d);
    if (size == 0) return Vec3{};
    if (std::fabs(size - 1) <= 1e-6) return d;
    flags_ |= PALPATE_STEP_BAD_INPUT;
    return Vec3{};
  }

  // Contacts -> groups of columns. What needs no correction goes into the first group together.
  void gather(const palpate_contacts* contacts) {
    group_count_ = 0;
    if (!contacts) return;
    bool corrected[PALPATE_MAX_TOOLS] = {};
    Vec3 d[PALPATE_MAX_TOOLS];
    for (std::int32_t t = 0; t < contacts->tool_count; ++t) {
      d[t] = direction(*contacts, t);
      corrected[t] = kHasEffects && dot(d[t], d[t]) > 0;
    }
    add_group(
        *contacts, [&](std::int32_t tool) { return !corrected[tool]; }, Vec3{}, false);
    for (std::int32_t t = 0; t < contacts->tool_count; ++t)
      if (corrected[t])
        add_group(
            *contacts, [&](std::int32_t tool) { return tool == t; }, d[t], true);
  }

  // Contacts that share a node share its columns: their coefficients are added, in double.
  template <class Belongs>
  void add_group(const palpate_contacts& contacts, Belongs belongs, Vec3 d, bool corrected) {
    Group group{column_count_, 0, d, corrected};
    const palpate_contact_node* nodes = palpate_contacts_nodes(&contacts);
    for (std::int32_t e = 0; e < contacts.node_count; ++e) {
      const palpate_contact_node& node = nodes[e];
      if (!is_sound(node, contacts.tool_count)) {
        flags_ |= PALPATE_STEP_BAD_INPUT;
        continue;
      }
      if (!belongs(node.tool)) continue;
      std::int32_t& slot = half_.slot_of_column[node.column];
      if (slot == 0) slot = 1 + add_columns(node.column, group);
      for (int j = 0; j < 3; ++j) half_.sum[slot - 1 + j] += node.modified_displacement[j];
    }
    for (int c = group.first; c < group.first + group.count; ++c)
      half_.coefficient[c] = static_cast<float>(half_.sum[c] * half_.row_scale[c]);
    for (std::int32_t e = 0; e < contacts.node_count; ++e)  // leave the map as it was found
      if (nodes[e].column >= 0 && nodes[e].column < scene_.tensors.columns) half_.slot_of_column[nodes[e].column] = 0;
    if (group.count > 0) groups_[group_count_++] = group;
  }

  int add_columns(std::int32_t column, Group& group) {
    const int first = column_count_;
    if (half_.slot_column) half_.slot_column[column_count_ / 3] = column;
    for (int j = 0; j < 3; ++j) {
      half_.sum[column_count_] = 0;
      half_.surface_column[column_count_] = scene_.tensors.surface.row(column, j);
      if (half_.interior.numbers) half_.interior_column[column_count_] = half_.interior.row(column, j);
      half_.row_scale[column_count_] = scene_.tensors.surface.row_scale(column, j);
      ++column_count_;
    }
    group.count += 3;
    return first;
  }

  float* group_field(int g) const {
    return half_.group_field + 3 * static_cast<std::size_t>(g) * static_cast<std::size_t>(scene_.tensors.surface_nodes);
  }

  // The whole surface field of a group from the compliance: u_n = sum_k C_nk T^f_k u~_k.
  void make_field(int g) {
    const Group& group = groups_[g];
    for (int l = 0; l < group.count / 3; ++l) {
      const int c = group.first + 3 * l;
      const std::int32_t column = half_.slot_column[c / 3];
      half_.loads[l] = {scene_.compliance.place_of_column(column),
                        scene_.tensors.force_of(column) * load3(half_.sum + c)};
    }
    scene_.compliance.field(half_.loads, group.count / 3, group_field(g));
  }

  // A group's field at nodes row_first .. row_first + count - 1 of stored rows.
  void superpose_rows(formats::ElementType type, const void* const* column, int g, std::int32_t row_first,
                      std::int32_t count, float* out) const {
    const Group& group = groups_[g];
    superpose(type, column + group.first, half_.coefficient + group.first, group.count,
              3 * static_cast<std::size_t>(row_first), 3 * static_cast<std::size_t>(count), out);
  }

  // Nodes first .. first + count - 1 of the output; field_of(g, target) gives what a group does there.
  template <class FieldOf>
  void chunk(std::int32_t first, std::int32_t count, FieldOf field_of) {
    const std::size_t floats = 3 * static_cast<std::size_t>(count);
    float* field = out_.displacements ? out_.displacements + 3 * static_cast<std::size_t>(first) : half_.field;
    bool written = false;
    for (int g = 0; g < group_count_; ++g) {
      float* target = written ? half_.tool_field : field;
      field_of(g, target);
      passed(scene_, Pass::superposition);
      if (groups_[g].corrected) {
        correct(groups_[g].direction, count, target);
        passed(scene_, Pass::radial);
      }
      if (written)
        for (std::size_t i = 0; i < floats; ++i) field[i] += half_.tool_field[i];
      written = true;
    }
    if (!written) std::fill(field, field + floats, 0.0f);
    if (!all_finite(field, floats)) {
      flags_ |= PALPATE_STEP_UNSOLVED;
      for (std::size_t i = 0; i < floats; ++i)
        if (!std::isfinite(field[i])) field[i] = 0;
    }
    passed(scene_, Pass::superposition);
    if (!out_.positions) return;
    const float* rest = half_.rest + 3 * static_cast<std::size_t>(first);
    float* position = out_.positions + 3 * static_cast<std::size_t>(first);
    for (std::size_t i = 0; i < floats; ++i) position[i] = rest[i] + field[i];
    passed(scene_, Pass::positions);
  }

  void correct(Vec3 d, std::int32_t count, float* u) {
    for (std::int32_t n = 0; n < count; n += kLanes)
      if (correct_lanes(half_.radial, d, std::min(kLanes, count - n), u + 3 * n)) flags_ |= PALPATE_STEP_RESPONSE_RANGE;
  }

  palpate_scene& scene_;
  ShapeHalf& half_;
  palpate_shape_out& out_;
  std::uint32_t flags_ = 0;
  Group groups_[PALPATE_MAX_TOOLS + 1];
  int group_count_ = 0, column_count_ = 0;
};

}  // namespace
}  // namespace palpate

palpate_step_flags palpate_shape(palpate_scene* scene, const palpate_contacts* contacts, palpate_shape_out* out) {
  if (!scene || !out) return PALPATE_STEP_BAD_INPUT;
  out->node_count = 0;
  if (scene->def.shape == PALPATE_SHAPE_OFF || out->node_capacity < 0) return PALPATE_STEP_BAD_INPUT;
  if (!palpate::is_aligned(out->displacements) || !palpate::is_aligned(out->positions)) return PALPATE_STEP_BAD_INPUT;
  if (!out->displacements && !out->positions) return 0;
  return palpate::Shape(*scene, *out).step(contacts);
}
