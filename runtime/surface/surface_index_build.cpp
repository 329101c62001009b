// Fills the buckets, and holds the queries of scene creation; the queries of a step are in surface_index.cpp.
#include <algorithm>

#include "runtime/surface/surface_index.h"
#include "runtime/surface/surface_index_cells.h"

namespace palpate {

// Buckets are about one mean edge wide, with at most kMaxCells along an axis. They are wider where some edges are so much longer
// than the mean that the triangles would have more than about fifty entries each on average.
void SurfaceIndex::choose_cells() {
  double edges = 0, squares = 0, corners = 0;
  low_ = high_ = corner(0, 0);
  for (std::int32_t t = 0; t < triangle_count_; ++t)
    for (int v = 0; v < 3 && is_active(t); ++v) {
      ++corners;
      const Vec3 p = corner(t, v);
      const double edge = length(corner(t, (v + 1) % 3) - p);
      edges += edge, squares += edge * edge;
      for (int d = 0; d < 3; ++d) low_[d] = std::min(low_[d], p[d]), high_[d] = std::max(high_[d], p[d]);
    }
  const Vec3 size = high_ - low_;
  const double largest = std::max({size.x, size.y, size.z});
  const double count = std::max(1.0, corners), mean = edges / count, root_mean_square = std::sqrt(squares / count);
  cell_ = std::max({mean, root_mean_square / 4, largest / (kMaxCells - 2), 1e-12});
  for (int d = 0; d < 3; ++d) {
    low_[d] -= 1e-3 * cell_, high_[d] += 1e-3 * cell_;
    cells_[d] = std::min(kMaxCells, 1 + static_cast<int>((high_[d] - low_[d]) / cell_));
  }
}

bool SurfaceIndex::build(SceneMemory& memory, const double* position, const std::int32_t* triangles,
                         std::int32_t triangle_count, const std::uint8_t* active) {
  position_ = position, triangles_ = triangles, triangle_count_ = triangle_count, active_ = active;
  seen_ = memory.array<std::uint32_t>(static_cast<std::size_t>(triangle_count));
  if (triangle_count > 0) choose_cells();

  // Three passes: count all entries, count the entries of each bucket, write the entries. Each bucket has room for those of all triangles.
  enum Pass { kTotal, kCounts, kEntries };
  std::uint64_t total = 0;
  for (const Pass pass : {kTotal, kCounts, kEntries}) {
    if (pass == kCounts && !make_table(memory, total)) return false;
    if (pass == kEntries) lay_out_entries();
    for (std::int32_t t = 0; t < triangle_count; ++t) {
      if (pass == kEntries && !is_active(t)) continue;
      cells_of_triangle(t, [&](int i, int j, int k) {
        ++total;
        if (pass == kTotal) return;
        Bucket* bucket = slot(key(i, j, k));
        if (pass == kEntries) entries_[bucket->begin + bucket->count] = t;
        bucket->key = key(i, j, k);
        ++bucket->count;
      });
    }
  }
  return true;
}

bool SurfaceIndex::make_table(SceneMemory& memory, std::uint64_t entries) {
  const std::uint64_t cells = static_cast<std::uint64_t>(cells_[0]) * cells_[1] * cells_[2];
  std::uint64_t slots = 16;
  while (slots < 2 * std::min(entries, cells)) slots *= 2;
  table_ = memory.array<Bucket>(slots);
  entries_ = memory.array<std::int32_t>(entries);
  table_mask_ = slots - 1;
  return !memory.failed() && entries <= 0xffffffffull;
}

// Gives each bucket its range of entries_ and sets the counts to zero for the next pass.
void SurfaceIndex::lay_out_entries() {
  std::uint32_t begin = 0;
  for (std::uint64_t s = 0; s <= table_mask_; ++s) {
    table_[s].begin = begin;
    begin += table_[s].count;
    table_[s].count = 0;
  }
}

SurfacePoint SurfaceIndex::nearest(Vec3 p) {
  SurfacePoint surface_point;
  double best = INFINITY;
  for (int reach = 0; reach <= 8 * kMaxCells; reach = reach ? 2 * reach : 1) {
    near(p, reach, [&](std::int32_t t) {
      double k[3];
      const double distance = closest_on_triangle(p, corner(t, 0), corner(t, 1), corner(t, 2), k);
      if (!(distance < best)) return;
      best = distance;
      surface_point.triangle = t;
      std::copy(k, k + 3, surface_point.barycentric);
    });
    // Triangles outside of these buckets are farther away than `reach` buckets.
    if (best <= reach * cell_ * reach * cell_) break;
  }
  return surface_point;
}

}  // namespace palpate
