#include "runtime/cut/blade_search.h"

#include <algorithm>
#include <limits>

#include "runtime/surface/exact_signs.h"

namespace palpate {
namespace {

// Every third bit: those of 0 .. 2^21 - 1.
std::uint64_t spread(std::uint64_t x) {
  x = (x | x << 32) & 0x1f00000000ffffull;
  x = (x | x << 16) & 0x1f0000ff0000ffull;
  x = (x | x << 8) & 0x100f00f00f00f00full;
  x = (x | x << 4) & 0x10c30c30c30c30c3ull;
  return (x | x << 2) & 0x1249249249249249ull;
}

// Exact for the given doubles, and consistent: two triangles that share an edge neither both miss nor both hit a segment through it.
bool segment_crosses(Vec3 p, Vec3 q, Vec3 a, Vec3 b, Vec3 c) {
  const int side = side_of_plane(a, b, c, p);
  if (side == 0 || side == side_of_plane(a, b, c, q)) return false;
  const auto sense = [&](Vec3 from, Vec3 to) { return side_of_edge(from, to, p, q); };
  const int first = sense(a, b);
  return first != 0 && first == sense(b, c) && first == sense(c, a);
}

}  // namespace

void BladeSearch::Box::add(Vec3 p) {
  low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
  high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
}

bool BladeSearch::Box::meets(const Box& other) const {
  return low.x <= other.high.x && other.low.x <= high.x && low.y <= other.high.y && other.low.y <= high.y &&
         low.z <= other.high.z && other.low.z <= high.z;
}

BladeSearch::Strip::Strip(const BladeSweep& sweep, std::int32_t segment) {
  for (std::int32_t end = 0; end < 2; ++end)
    from[end] = load3(sweep.from + 3 * (segment + end)), to[end] = load3(sweep.to + 3 * (segment + end));
  box = {to[0], to[0]};
  for (const Vec3 p : {from[0], from[1], to[1]}) box.add(p);
  middle = 0.5 * (to[0] + to[1]), half = 0.5 * (to[1] - to[0]);
  for (int d = 0; d < 3; ++d) moved[d] = std::max(std::fabs(to[0][d] - from[0][d]), std::fabs(to[1][d] - from[1][d]));
  normal = cross(to[1] - from[0], to[0] - from[1]);
  double low = dot(normal, from[0]), high = low;
  for (const Vec3 p : {from[1], to[0], to[1]})
    low = std::min(low, dot(normal, p)), high = std::max(high, dot(normal, p));
  level = 0.5 * (low + high), half_level = 0.5 * (high - low);
}

// The box is apart from the strip if a plane divides them: one across an axis, one along the strip, or one along the segment and an axis. A
// margin of 1e-9 stands for rounding.
bool BladeSearch::Strip::meets(const Box& other) const {
  if (!box.meets(other)) return false;
  const Vec3 centre = 0.5 * (other.low + other.high), size = 0.5 * (other.high - other.low);
  const auto extent = [](Vec3 a, Vec3 b) { return std::fabs(a.x) * b.x + std::fabs(a.y) * b.y + std::fabs(a.z) * b.z; };
  const double scale = largest_of(centre) + largest_of(middle);
  if (std::fabs(dot(normal, centre) - level) > half_level + extent(normal, size) + 1e-9 * scale * largest_of(normal))
    return false;
  const Vec3 away = middle - centre, reach = size + moved;
  for (int d = 0; d < 3; ++d) {
    const int e = (d + 1) % 3, f = (d + 2) % 3;
    if (std::fabs(away[e] * half[f] - away[f] * half[e]) >
        reach[e] * std::fabs(half[f]) + reach[f] * std::fabs(half[e]) + 1e-9 * scale * largest_of(half))
      return false;
  }
  return true;
}

bool BladeSearch::Strip::crosses(Vec3 p, Vec3 q) const {
  Box segment{p, p};
  segment.add(q);
  return meets(segment) &&
         (segment_crosses(p, q, from[0], from[1], to[1]) || segment_crosses(p, q, from[0], to[1], to[0]));
}

Vec3 BladeSearch::centroid(std::int32_t tetrahedron, const double* positions) const {
  const std::int32_t* const nodes = nodes_ + 4 * tetrahedron;
  return 0.25 * (load3(positions + 3 * nodes[0]) + load3(positions + 3 * nodes[1]) + load3(positions + 3 * nodes[2]) +
                 load3(positions + 3 * nodes[3]));
}

bool BladeSearch::reaches(const BladeSweep& sweep, std::int32_t face, const double* positions,
                          const std::int32_t* split_from, std::int32_t known) const {
  const auto place = [&](std::int32_t node) {
    while (node >= known) node = split_from[node];
    return load3(positions + 3 * node);
  };
  Box box{place(nodes_[face]), place(nodes_[face])};
  for (const std::int32_t tetrahedron : {face / 4, state_->rest().neighbour(face)})
    for (int c = 0; c < 4; ++c) box.add(place(nodes_[4 * tetrahedron + c]));
  for (std::int32_t i = 0; i + 1 < sweep.count; ++i)
    if (Strip(sweep, i).meets(box)) return true;
  return false;
}

bool BladeSearch::create(SceneMemory& memory, const CutState& state, const std::int32_t* nodes,
                         std::int32_t most_nodes) {
  state_ = &state, nodes_ = nodes;
  const auto tetrahedra = static_cast<std::size_t>(state.rest().tetrahedra());
  clusters_ = (state.rest().tetrahedra() + kCluster - 1) / kCluster;
  const auto clusters = static_cast<std::size_t>(clusters_);
  order_ = memory.array<std::int32_t>(tetrahedra);
  cluster_of_ = memory.array<std::int32_t>(tetrahedra);
  stale_ = memory.array<std::uint64_t>(clusters / 64 + 1);
  listed_ = memory.array<std::int32_t>(clusters * kMostNodes);
  listed_count_ = memory.array<std::int32_t>(clusters);
  seen_ = memory.array<std::uint32_t>(static_cast<std::size_t>(most_nodes));
  SceneMemory scratch = memory.of_same_host();
  std::uint64_t* const keys = scratch.array<std::uint64_t>(tetrahedra);
  const bool made = !memory.failed() && !scratch.failed();
  if (made) {
    sort_tetrahedra(keys);
    for (std::int32_t cluster = 0; cluster < clusters_; ++cluster) list_nodes(cluster);
    memory.keep_array(stale_, clusters / 64 + 1);
    memory.keep_array(listed_, clusters * kMostNodes);
    memory.keep_array(listed_count_, clusters);
  }
  scratch.release_all();
  return made;
}

void BladeSearch::forget() {
  std::fill(stale_, stale_ + static_cast<std::size_t>(clusters_) / 64 + 1, ~std::uint64_t{0});
}

void BladeSearch::sort_tetrahedra(std::uint64_t* keys) {
  const std::int32_t count = state_->rest().tetrahedra();
  const double* const rest = state_->rest().body().nodes;
  Box all{centroid(0, rest), centroid(0, rest)};
  for (std::int32_t t = 0; t < count; ++t) all.add(centroid(t, rest));
  const Vec3 size = all.high - all.low;
  const double largest = std::max({size.x, size.y, size.z, std::numeric_limits<double>::min()});
  for (std::int32_t t = 0; t < count; ++t) {
    const Vec3 at = (0x1fffff / largest) * (centroid(t, rest) - all.low);
    keys[t] = spread(static_cast<std::uint64_t>(at.x)) | spread(static_cast<std::uint64_t>(at.y)) << 1 |
              spread(static_cast<std::uint64_t>(at.z)) << 2;
    order_[t] = t;
  }
  std::sort(order_, order_ + count,
            [&](std::int32_t a, std::int32_t b) { return keys[a] != keys[b] ? keys[a] < keys[b] : a < b; });
  for (std::int32_t i = 0; i < count; ++i) cluster_of_[order_[i]] = i / kCluster;
}

void BladeSearch::changed(std::int32_t tetrahedron) {
  const auto mark = [&](std::int32_t t) { stale_[cluster_of_[t] >> 6] |= std::uint64_t{1} << (cluster_of_[t] & 63); };
  mark(tetrahedron);
  for (std::int32_t face = 4 * tetrahedron; face < 4 * tetrahedron + 4; ++face)
    if (state_->rest().neighbour(face) >= 0) mark(state_->rest().neighbour(face));
}

void BladeSearch::list_nodes(std::int32_t cluster) {
  const std::int32_t first = kCluster * cluster, end = std::min(first + kCluster, state_->rest().tetrahedra());
  std::int32_t* const list = listed_ + static_cast<std::size_t>(cluster) * kMostNodes;
  std::int32_t count = 0;
  ++lists_;
  const auto add = [&](std::int32_t node) {
    if (seen_[node] == lists_) return;
    seen_[node] = lists_;
    list[count++] = node;
  };
  for (std::int32_t i = first; i < end; ++i)
    for (std::int32_t c = 4 * order_[i]; c < 4 * order_[i] + 4; ++c) {
      add(nodes_[c]);
      // The segment between the centroids may leave the two tetrahedra, but not their box.
      const std::int32_t other = state_->rest().other_side(c);
      if (other > c) add(nodes_[other]);
    }
  listed_count_[cluster] = count;
}

BladeSearch::Box BladeSearch::box_of_cluster(std::int32_t cluster, const double* positions) {
  if (const std::uint64_t bit = std::uint64_t{1} << (cluster & 63); stale_[cluster >> 6] & bit) {
    list_nodes(cluster);
    stale_[cluster >> 6] &= ~bit;
  }
  const std::int32_t* const list = listed_ + static_cast<std::size_t>(cluster) * kMostNodes;
  Box box{load3(positions + 3 * list[0]), load3(positions + 3 * list[0])};
  for (std::int32_t i = 1; i < listed_count_[cluster]; ++i) box.add(load3(positions + 3 * list[i]));
  return box;
}

}  // namespace palpate
