#include "runtime/query/queried_field.h"

#include <algorithm>

#include "runtime/base/contact_nodes.h"

namespace palpate {
namespace {

// Share of the squared sum of the loads' own norms by which the rounding of stored tensors may falsify the square of their norm:
// rows in half precision, or a compressed compliance; rows in single or double precision.
constexpr double kCoarseRounding = 1e-3, kRounding = 1e-6;

bool is_sound(const palpate_contact_node& node, std::int32_t columns) {
  if (node.column < 0 || node.column >= columns) return false;
  return std::all_of(node.modified_displacement, node.modified_displacement + 3,
                     [](double u) { return std::fabs(u) <= 1e12; });
}

}  // namespace

bool QueriedField::create(SceneMemory& memory, const Tensors& tensors, const std::int32_t* touchable,
                          std::int32_t node_capacity, bool large, double added_reach, const OffsetRows& motions,
                          double moved_reach) {
  const auto surface = static_cast<std::size_t>(tensors.surface_nodes);
  touchable_ = touchable, large_ = large, surface_nodes_ = tensors.surface_nodes;
  if (added_reach > 0) added_ = memory.array<Vec3>(surface), reach_ = added_reach;
  motions_ = motions, moved_reach_ = moved_reach;
  if (motions.numbers) amounts_ = memory.array<double>(static_cast<std::size_t>(motions.count));
  loads_.create(memory, node_capacity);
  known_ = memory.array<Vec3>(surface);
  stamp_ = memory.array<std::uint32_t>(surface);
  return !memory.failed();
}

// field: [nodes][3] m, or nullptr for the surface at rest.
std::uint32_t QueriedField::copy_field(const float* field, std::int32_t nodes) {
  std::uint32_t flags = 0;
  double most = 0, change = 0;
  for (std::int32_t n = 0; n < nodes; ++n) {
    Vec3 u;
    if (field) {
      const float* const at = field + 3 * static_cast<std::size_t>(n);
      u = {static_cast<double>(at[0]), static_cast<double>(at[1]), static_cast<double>(at[2])};
    }
    if (!(dot(u, u) <= 1e12)) u = Vec3{}, flags = PALPATE_STEP_BAD_INPUT;
    const Vec3 moved = u - known_[n];
    most = std::max(most, dot(u, u)), change = std::max(change, dot(moved, moved));
    known_[n] = u;
  }
  norm_ = std::sqrt(most), path_ += std::sqrt(change);
  return flags;
}

std::uint32_t QueriedField::set(const Tensors& tensors, const palpate_contacts* contacts) {
  if (large_) return copy_field(contacts ? palpate_contacts_field(contacts) : nullptr, tensors.surface_nodes);
  std::uint32_t flags = 0;
  bool changed = added_ && take_added(contacts ? palpate_contacts_field(contacts) : nullptr, &flags);
  if (amounts_ && take_amounts(contacts ? palpate_contacts_amounts(contacts) : nullptr, &flags)) changed = true;
  if (!take_loads(tensors, contacts, &flags) && !changed) return flags;
  // However much changed, the field went from one norm to the other.
  path_ += norm_;
  norm_ = norm_of_loads(tensors) + longest_added_ / reach_ + longest_moved_ / moved_reach_;
  path_ += norm_;
  if (++now_ == 0) {
    std::fill(stamp_, stamp_ + tensors.surface_nodes, 0u);
    now_ = 1;
  }
  return flags;
}

// Returns whether the loads have changed. Those of an unsound node do not count.
bool QueriedField::take_loads(const Tensors& tensors, const palpate_contacts* contacts, std::uint32_t* flags) {
  const palpate_contact_node* const first = contacts ? nodes_behind(*contacts) : nullptr;
  const palpate_contact_node* const end = first + (contacts ? contacts->node_count : 0);
  bool changed = false;
  std::int32_t count = 0;
  for (const palpate_contact_node* node = first; node != end; ++node) {
    if (!is_sound(*node, tensors.all_columns())) {
      *flags |= PALPATE_STEP_BAD_INPUT;
      continue;
    }
    const Vec3 u = load3(node->modified_displacement);
    changed = changed || count >= loads_.count() || loads_.column(count) != node->column ||
              loads_.modified(count).x != u.x || loads_.modified(count).y != u.y || loads_.modified(count).z != u.z;
    ++count;
  }
  if (!changed && count == loads_.count()) return false;
  loads_.begin(tensors);
  for (const palpate_contact_node* node = first; node != end; ++node)
    if (is_sound(*node, tensors.all_columns())) loads_.add(node->column, load3(node->modified_displacement));
  return true;
}

// Copies the field that adds to the loads'. Returns whether it has changed.
bool QueriedField::take_added(const float* field, std::uint32_t* flags) {
  bool changed = false;
  double most = 0;
  for (std::int32_t n = 0; n < surface_nodes_; ++n) {
    float u[3] = {};
    if (field) std::copy_n(field + 3 * static_cast<std::size_t>(n), 3, u);
    const Vec3 moved = {static_cast<double>(u[0]), static_cast<double>(u[1]), static_cast<double>(u[2])};
    Vec3& held = added_[n];
    const bool sound = dot(moved, moved) <= 1e12;
    if (!sound) *flags |= PALPATE_STEP_BAD_INPUT;
    const Vec3 now = sound ? moved : Vec3{};
    changed = changed || held.x != now.x || held.y != now.y || held.z != now.z;
    held = now;
    most = std::max(most, dot(now, now));
  }
  longest_added_ = std::sqrt(most);
  return changed;
}

// Copies the amounts of the motions; nullptr: the surface at rest. Returns whether they have changed. Amounts that no scene takes count
// as zero.
bool QueriedField::take_amounts(const double* amounts, std::uint32_t* flags) {
  constexpr double farthest = 1e6;  // m
  bool changed = false;
  double most = 0;
  for (std::int32_t m = 0; m < motions_.count; ++m) {
    double amount = amounts ? amounts[m] : 0;
    const double moves = std::fabs(amount) * motions_.longest[m];
    if (!(moves <= farthest)) amount = 0, *flags |= PALPATE_STEP_BAD_INPUT;
    changed = changed || amounts_[m] != amount;
    amounts_[m] = amount, most += std::fabs(amount) * motions_.longest[m];
  }
  longest_moved_ = most;
  return changed;
}

// sqrt(f^T C f), with the forces f_i = T^f_i u~_i of the loads; C f at the node of load i is sum_j T^u_ij u~_j.
double QueriedField::norm_of_loads(const Tensors& tensors) const {
  double energy = 0, own = 0;
  for (std::int32_t i = 0; i < loads_.count(); ++i) {
    const std::int32_t column = loads_.column(i), node = tensors.node_of(column, touchable_);
    const Vec3 modified = loads_.modified(i), force = tensors.stiffness_of(column) * modified;
    const Vec3 alone = tensors.is_of_surface(column) ? modified : tensors.displacement(node, column) * force;
    own += std::sqrt(std::max(0.0, dot(force, alone)));
    energy += dot(force, loads_.at_node(node));
  }
  const bool coarse = tensors.compliance || tensors.surface.type == formats::ElementType::f16;
  energy = std::max(0.0, energy) + (coarse ? kCoarseRounding : kRounding) * own * own;
  return energy <= own * own ? std::sqrt(energy) : own;  // also where it is not a number
}

Vec3 QueriedField::at_node(std::int32_t node) {
  if (large_) return known_[node];
  if (loads_.count() == 0 && !amounts_) return added_ ? added_[node] : Vec3{};
  if (stamp_[node] == now_) return known_[node];
  Vec3 u = loads_.at_node(node);
  if (added_) u += added_[node];
  if (amounts_) u += motions_.sum_at(amounts_, node);
  stamp_[node] = now_;
  return known_[node] = is_finite(u) ? u : Vec3{};
}

}  // namespace palpate
