#include "runtime/cut/cut_large.h"

#include <algorithm>

#include "runtime/cut/dense_loops.h"

namespace palpate {

bool CutLarge::create(SceneMemory& memory, const Parts& parts, TouchState* touch) {
  touch_ = touch, follower_ = parts.follower, fixed_ = parts.body->fixed;
  rest_nodes_ = parts.body->node_count, surface_nodes_ = parts.surface_nodes, first_new_ = parts.first_reserve;
  if (!compliance_.create(memory, *parts.body, *parts.pairs, parts.capacity, parts.supports) ||
      !create_supports(memory, parts))
    return false;
  layout_ = follower_->follow_mesh(this);
  most_new_ = parts.capacity.new_nodes;
  const auto slots = static_cast<std::size_t>(compliance_.most_slots()), vectors = std::size_t{kMostVectors},
             made = static_cast<std::size_t>(most_new_);
  stride_ = compliance_.stride(), field_stride_ = static_cast<std::size_t>(padded_row(compliance_.most_slots() * 3));
  origin_ = memory.array<std::int32_t>(made);
  tetrahedra_ = memory.array<std::int32_t>(static_cast<std::size_t>(parts.body->tetrahedron_count));
  force_ = memory.array<float>(vectors * layout_.length), on_new_ = memory.array<Vec3>(vectors * made);
  field_ = memory.array<double>(vectors * field_stride_);
  weighed_ =
      memory.array<double>(CutBasis::scratch_of_weigh(compliance_.most_slots(), static_cast<std::int32_t>(stride_)));
  x_ = memory.array<double>(vectors * stride_), w_ = memory.array<double>(vectors * stride_);
  pseudo_ = memory.array<Vec3>(slots);
  loads_ = memory.array<MeshFollower::DividedLoad>(made + slots);
  for (std::int32_t k = 0; k < most_new_ && origin_; ++k) origin_[k] = first_new_ + k;
  if (touch) touch->offset.change_body(this);
  return !memory.failed();
}

// ---- the mesh --------------------------------------------------------------------------------------------------------

// The k-th new node has its tetrahedra.
void CutLarge::follow_split(std::int32_t k, bool replayed) {
  const CutTissue& tissue = compliance_.tissue();
  const std::int32_t node = first_new_ + k, from = surface_node(tissue.parent(rest_nodes_ + k));
  origin_[k] = at_rest(from);
  if (touch_) touch_->surface.column_of_node[node] = touch_->surface.column_of_node[origin_[k]];
  std::int32_t count = 0;
  tissue.for_each_at(rest_nodes_ + k, [&](std::int32_t e, int) { tetrahedra_[count++] = e; });
  follower_->split({node, from, tetrahedra_, count}, replayed);
}

CutResult CutLarge::take_change(const CutChange& change, bool replayed) {
  const CutResult result = compliance_.apply(change);
  for (; followed_ < new_nodes(); ++followed_) follow_split(followed_, replayed);
  for (std::int32_t i = 0; i < result.removed; ++i) follower_->remove(change.removed[i]);
  changed_ = true;
  return result;
}

CutOutcome CutLarge::ground(std::int32_t node, double stiffness, bool) {
  const CutOutcome outcome = compliance_.ground(node, stiffness);
  changed_ = true;
  if (outcome != CutOutcome::made) return outcome;
  const std::int32_t own = surface_node(node);
  MeshFollower::Support *hold = supports_.grounded, *const end = hold + supports_.grounded_count;
  while (hold < end && hold->node != own) ++hold;
  if (hold == end) *hold = {own, own, {}}, ++supports_.grounded_count;
  for (int i = 0; i < 3; ++i) hold->block.m[i][i] += stiffness;
  return outcome;
}

void CutLarge::end_changes(bool replayed) {
  if (changed_) follow_supports(), follow_loads(), follower_->changed(replayed);
  changed_ = false;
}

// ---- supports --------------------------------------------------------------------------------------------------------

bool CutLarge::create_supports(SceneMemory& memory, const Parts& parts) {
  constexpr std::size_t of_face = 6;
  // The node at rest of one that is grounded has a slot of the compliance.
  const std::size_t new_nodes = static_cast<std::size_t>(parts.capacity.new_nodes),
                    grounded = static_cast<std::size_t>(parts.capacity.nodes) + new_nodes;
  std::size_t most = grounded;
  if (compliance_.supports().exist())
    most += of_face * static_cast<std::size_t>(parts.supports.count) +
            static_cast<std::size_t>(parts.body->support_count) +
            static_cast<std::size_t>(compliance_.supports().most_pairs_of_new()) * new_nodes;
  supports_.grounded = memory.array<MeshFollower::Support>(grounded);
  supports_.list = memory.array<MeshFollower::Support>(most);
  return !memory.failed();
}

void CutLarge::add_support(std::int32_t a, std::int32_t b, double factor, const Mat3& block) {
  MeshFollower::Support& support = supports_.list[supports_.count++];
  support = {surface_node(a), surface_node(b), {}};
  add_scaled(support.block, factor, block);
}

// As CutCompliance has them.
void CutLarge::follow_supports() {
  const CutSupports& supports = compliance_.supports();
  const CutTissue& tissue = compliance_.tissue();
  supports_.count = 0;
  for (std::int32_t e = 0; e < tissue.tetrahedra() && supports.exist(); ++e)
    for (int opposite = 0; opposite < 4 && tissue.is_left(e); ++opposite) {
      const CutSupports::Face* const face = supports.face(e, opposite);
      if (!face || !face->founded) continue;
      for (int a = 0; a < 4; ++a)
        for (int b = a; b < 4; ++b)
          if (a != opposite && b != opposite)
            add_support(tissue.corners(e)[a], tissue.corners(e)[b], a == b ? 2 : 1, face->block);
    }
  for (std::int32_t n = 0; n < tissue.nodes() && supports.exist(); ++n) {
    const std::int32_t origin = tissue.origin(n);
    if (!supports.has_springs(origin) || supports.held(n) == 0) continue;
    supports.for_each_spring(origin, [&](std::int32_t other, const Mat3& block) {
      if (other == origin) add_support(n, n, supports.held(n), block);
      for (std::int32_t m = other; other > origin && m < tissue.nodes(); m = std::max(m + 1, tissue.rest_nodes()))
        if (tissue.origin(m) == other && supports.held(m) > 0)
          add_support(n, m, supports.held(n) * supports.held(m), block);
    });
  }
  std::copy_n(supports_.grounded, supports_.grounded_count, supports_.list + supports_.count);
  supports_.count += supports_.grounded_count;
  follower_->take_supports(supports_.list, supports_.count);
}

// New nodes first: each takes its part of what the node at rest had.
void CutLarge::follow_loads() {
  const CutTissue& tissue = compliance_.tissue();
  std::int32_t count = 0;
  for (std::int32_t k = 0; k < followed_; ++k)
    loads_[count++] = {first_new_ + k, origin_[k], tissue.loads(rest_nodes_ + k)};
  for (std::int32_t n = 0; n < rest_nodes_; ++n) {
    const LoadShare& share = tissue.loads(n);
    if (share.in_volume != 1 || share.on_surface != 1) loads_[count++] = {n, n, share};
  }
  follower_->take_loads(loads_, count);
}

void CutLarge::forget_changes(bool) {
  for (std::int32_t k = 0; k < followed_; ++k) {
    origin_[k] = first_new_ + k;
    if (touch_) touch_->surface.column_of_node[first_new_ + k] = -1;
  }
  followed_ = supports_.grounded_count = 0;
  compliance_.forget();
  follower_->forget_changes();
}

// ---- the metric ------------------------------------------------------------------------------------------------------

float* CutLarge::at(float* x, std::int32_t node) const {
  const std::int32_t place = layout_.place[surface_node(node)];
  return place < layout_.rows ? x + 3 * static_cast<std::size_t>(place) : nullptr;
}

// New nodes, the last one first, so that each has the forces of those that come from it.
void CutLarge::begin(float* const* x, int count) {
  for (int c = 0; c < count; ++c) {
    Vec3* const on_new = on_new_ + c * most_new_;
    std::fill_n(on_new, new_nodes(), Vec3{});
    for (std::int32_t k = new_nodes() - 1; k >= 0; --k) {
      float* const own = x[c] + 3 * static_cast<std::size_t>(layout_.place[first_new_ + k]);
      for (int i = 0; i < 3; ++i) on_new[k][i] += static_cast<double>(own[i]), own[i] = 0;
      const std::int32_t parent = new_parent(k);
      if (parent >= 0) {
        on_new[parent] += on_new[k];
      } else if (float* const at_origin = at(x[c], compliance_.tissue().parent(rest_nodes_ + k))) {
        for (int i = 0; i < 3; ++i) at_origin[i] += static_cast<float>(on_new[k][i]);
      }
    }
    std::copy_n(x[c], layout_.length, force_ + static_cast<std::size_t>(c) * layout_.length);
  }
}

void CutLarge::go_on(float* const* x, int count) {
  const CutBasis& basis = compliance_.basis();
  const std::int32_t slots = compliance_.slots(), rank = compliance_.rank(), padded = padded_row(rank);
  for (int c = 0; c < count; ++c) {
    double* const field = field_ + static_cast<std::size_t>(c) * field_stride_;
    for (std::int32_t s = 0; s < slots; ++s) {
      const float* const u = at(x[c], compliance_.node_of_slot(s));
      for (int i = 0; i < 3; ++i) field[3 * s + i] = u ? static_cast<double>(u[i]) : 0;
    }
  }
  basis.weigh(field_, field_stride_, count, slots, x_, stride_, weighed_);
  for (int c = 0; c < count; ++c) {
    double* const of = x_ + static_cast<std::size_t>(c) * stride_;
    for (std::int32_t p = 0; p < rank; ++p)
      if (const std::int32_t jump = basis.jump(p); jump >= 0) of[p] += on_new_[c * most_new_ + jump / 3][jump % 3];
    std::fill(of + rank, of + padded, 0.0);
  }
  compliance_.multiply(x_, count, w_);
  for (int c = 0; c < count; ++c) {
    const double* const w = w_ + static_cast<std::size_t>(c) * stride_;
    std::fill_n(pseudo_, slots, Vec3{});
    Vec3* const jump_of = on_new_ + c * most_new_;
    std::fill_n(jump_of, new_nodes(), Vec3{});
    for (std::int32_t p = 0; p < rank; ++p) {
      basis.for_each_force(p, [&](std::int32_t slot, Vec3 force) { pseudo_[slot] += w[p] * force; });
      if (const std::int32_t jump = basis.jump(p); jump >= 0) jump_of[jump / 3][jump % 3] += w[p];
    }
    std::copy_n(force_ + static_cast<std::size_t>(c) * layout_.length, layout_.length, x[c]);
    for (std::int32_t s = 0; s < slots; ++s) {
      const std::int32_t node = compliance_.node_of_slot(s);
      float* const f = at(x[c], node);
      for (int i = 0; f && i < 3; ++i)
        if (!fixed_[3 * static_cast<std::size_t>(node) + static_cast<std::size_t>(i)])
          f[i] += static_cast<float>(pseudo_[s][i]);
    }
  }
}

// The first one first, so that each has the jumps of those that it comes from.
void CutLarge::end(float* const* x, int count) {
  for (int c = 0; c < count; ++c) {
    Vec3* const jump = on_new_ + c * most_new_;
    for (std::int32_t k = 0; k < new_nodes(); ++k) {
      if (const std::int32_t parent = new_parent(k); parent >= 0) jump[k] += jump[parent];
      const float* const at_origin = at(x[c], compliance_.tissue().origin(rest_nodes_ + k));
      float* const own = x[c] + 3 * static_cast<std::size_t>(layout_.place[first_new_ + k]);
      for (int i = 0; i < 3; ++i) own[i] = (at_origin ? at_origin[i] : 0.0f) + static_cast<float>(jump[k][i]);
    }
  }
}

}  // namespace palpate
