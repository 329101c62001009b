#include "runtime/contact/contact_rows.h"

#include <algorithm>
#include <utility>

namespace palpate {

bool ContactRows::create_set(SceneMemory& memory, std::int32_t entries, std::int32_t blocks, ContactSet* set) {
  set->entries = memory.array<ContactEntry>(static_cast<std::size_t>(entries));
  set->blocks = memory.array<ContactBlock>(static_cast<std::size_t>(blocks));
  set->target = memory.array<Vec3>(static_cast<std::size_t>(blocks));
  set->entry_capacity = entries, set->block_capacity = blocks;
  return !memory.failed();
}

bool ContactRows::create(SceneMemory& memory, const Source& source, std::int32_t entry_capacity,
                         std::int32_t block_capacity) {
  source_ = source;
  return create_set(memory, entry_capacity, block_capacity, &set_) &&
         (!source.patch || create_set(memory, entry_capacity, block_capacity, &last_));
}

void ContactRows::begin() {
  if (source_.patch) std::swap(set_, last_);
  set_.entry_count = set_.block_count = next_in_last_ = 0;
}

bool ContactRows::has_room(std::int32_t blocks, std::int32_t entries) const {
  return set_.block_count + blocks <= set_.block_capacity && set_.entry_count + entries <= set_.entry_capacity;
}

ContactBlock& ContactRows::add_block(const ContactWish& wish, std::int32_t part) {
  ContactBlock& block = set_.blocks[set_.block_count];
  block = ContactBlock{};
  block.first_entry = set_.entry_count;
  block.axes = wish.axes;
  block.tool = wish.tool, block.point = wish.point, block.part = part;
  block.law = wish.law, block.friction = wish.friction, block.share = 1;
  set_.target[set_.block_count++] = wish.displacement;
  return block;
}

void ContactRows::add_entry(const ContactWish& wish, ContactBlock& block, std::int32_t node, double weight) {
  ++block.entry_count;
  set_.entries[set_.entry_count++] = ContactEntry{node, source_.column_of_node[node], wish.tool, wish.point, weight};
}

// Rows along the inward normal and two directions across it, of which its law keeps some.
void ContactRows::frame_block(const ContactWish& wish, ContactBlock& block) {
  if (wish.law == ContactLaw::sticking) return;
  const Vec3 row[3] = {-1 * wish.outward, wish.tangent, cross(wish.outward, wish.tangent)};
  Vec3& target = set_.target[set_.block_count - 1];
  const Vec3 displacement = target;
  block.framed = true;
  for (int i = 0; i < 3; ++i) {
    target[i] = dot(row[i], displacement);
    for (int j = 0; j < 3; ++j) block.frame.m[i][j] = row[i][j];
  }
  block.axes = wish.law == ContactLaw::coulomb ? 7 : 1;
}

std::uint32_t ContactRows::hold_node(const ContactWish& wish, std::int32_t node, bool* made) {
  *made = false;
  if (source_.column_of_node[node] < 0) return PALPATE_STEP_NOT_TOUCHABLE;
  if (!has_room(1, 1)) return PALPATE_STEP_CONTACTS_DROPPED;
  ContactBlock& block = add_block(wish, 0);
  add_entry(wish, block, node, 1);
  frame_block(wish, block);
  *made = true;
  return 0;
}

// The vertex nearest to the place; without positions (grips alone), the one of largest weight.
int ContactRows::nearest_vertex(const SurfacePlace& place, const std::int32_t* node, const double* weight,
                                int count) const {
  const auto at = [&](std::int32_t n) { return load3(source_.rest + 3 * static_cast<std::size_t>(n)); };
  Vec3 centre;
  for (int v = 0; source_.rest && v < 3; ++v)
    centre += place.barycentric[v] * at(source_.triangles[3 * place.triangle + v]);
  int best = 0;
  double least = INFINITY;
  for (int v = 0; v < count; ++v) {
    const double distance = source_.rest ? length(at(node[v]) - centre) : -weight[v];
    if (distance < least) least = distance, best = v;
  }
  return best;
}

std::uint32_t ContactRows::hold_place(const ContactWish& wish, const SurfacePlace& place, bool* made) {
  *made = false;
  if (source_.model == PALPATE_CONTACT_PATCH && wish.radius > 0) return hold_patch(wish, place, made);
  std::int32_t node[3];
  double weight[3];
  int count = 0;
  std::uint32_t flags = 0;
  for (int v = 0; v < 3; ++v) {
    const std::int32_t n = source_.triangles[3 * place.triangle + v];
    if (source_.column_of_node[n] < 0) {
      if (place.barycentric[v] != 0) flags = PALPATE_STEP_NOT_TOUCHABLE;
      continue;
    }
    node[count] = n, weight[count++] = place.barycentric[v];
  }
  if (count == 0) return flags;
  double sum = 0;
  for (int v = 0; v < count; ++v) sum += weight[v] = std::max(0.0, weight[v]);
  for (int v = 0; v < count; ++v) weight[v] = sum > 0 ? weight[v] / sum : 1.0 / count;

  if (source_.model == PALPATE_CONTACT_NODE)
    return flags | hold_node(wish, node[nearest_vertex(place, node, weight, count)], made);
  if (source_.model == PALPATE_CONTACT_TRIANGLE) {
    // The paper's three vertices, each imposed alpha_v d: then the place moves by sum_v k_v alpha_v d = d.
    if (!has_room(count, count)) return flags | PALPATE_STEP_CONTACTS_DROPPED;
    double squares = 0;
    for (int v = 0; v < count; ++v) squares += weight[v] * weight[v];
    for (int v = 0; v < count; ++v) {
      ContactWish part = wish;
      part.displacement = (weight[v] + 1 - squares) * wish.displacement;
      ContactBlock& block = add_block(part, v);
      add_entry(part, block, node[v], 1);
      block.share = weight[v];
      frame_block(part, block);
    }
  } else {
    if (!has_room(1, count)) return flags | PALPATE_STEP_CONTACTS_DROPPED;
    ContactBlock& block = add_block(wish, 0);
    for (int v = 0; v < count; ++v)
      if (weight[v] > 0) add_entry(wish, block, node[v], weight[v]);
    frame_block(wish, block);
  }
  *made = true;
  return flags;
}

// The patch of the last step again, where nothing of it has changed.
bool ContactRows::repeat_patch(const ContactWish& wish, const SurfacePlace& place) {
  const auto before = [&](const ContactBlock& block) {
    return block.tool != wish.tool ? block.tool < wish.tool : block.point < wish.point;
  };
  while (next_in_last_ < last_.block_count && before(last_.blocks[next_in_last_])) ++next_in_last_;
  if (next_in_last_ == last_.block_count) return false;
  const ContactBlock& old = last_.blocks[next_in_last_];
  if (old.tool != wish.tool || old.point != wish.point || old.radius != wish.radius || old.law != wish.law ||
      old.place.triangle != place.triangle ||
      !std::equal(place.barycentric, place.barycentric + 3, old.place.barycentric))
    return false;
  if (!has_room(1, old.entry_count)) return false;
  ContactWish same = wish;
  if (old.framed) same.tangent = Vec3{old.frame.m[1][0], old.frame.m[1][1], old.frame.m[1][2]};
  ContactBlock& block = add_block(same, 0);
  frame_block(same, block);
  block.local = old.local, block.radius = old.radius, block.place = old.place, block.incomplete = old.incomplete;
  for (std::int32_t v = 0; v < old.entry_count; ++v) {
    const ContactEntry& entry = last_.entries[old.first_entry + v];
    add_entry(same, block, entry.node, entry.weight);
  }
  return true;
}

std::uint32_t ContactRows::hold_patch(const ContactWish& wish, const SurfacePlace& place, bool* made) {
  if (repeat_patch(wish, place)) {
    *made = true;
    return set_.blocks[set_.block_count - 1].incomplete ? std::uint32_t{PALPATE_STEP_NOT_TOUCHABLE} : 0;
  }
  ContactPatch& patch = *source_.patch;
  patch.press(place, wish.outward, wish.tangent, wish.radius);
  double sum = 0, whole = 0;
  int held = 0;
  for (int e = 0; e < patch.count(); ++e) {
    whole += patch.weights()[e];
    if (source_.column_of_node[patch.nodes()[e]] < 0) continue;
    sum += patch.weights()[e];
    ++held;
  }
  const std::uint32_t flags = held < patch.count() ? std::uint32_t{PALPATE_STEP_NOT_TOUCHABLE} : 0;
  if (!(sum > 1e-3 * whole)) return flags;
  if (!has_room(1, held)) return flags | PALPATE_STEP_CONTACTS_DROPPED;
  ContactBlock& block = add_block(wish, 0);
  frame_block(wish, block);
  block.local = block.framed ? times_transposed(block.frame * patch.local(), block.frame) : patch.local();
  block.radius = wish.radius, block.place = place, block.incomplete = flags != 0;
  for (int e = 0; e < patch.count(); ++e)
    if (source_.column_of_node[patch.nodes()[e]] >= 0)
      add_entry(wish, block, patch.nodes()[e], patch.weights()[e] / sum);
  *made = true;
  return flags;
}

}  // namespace palpate
