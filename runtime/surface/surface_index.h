// The rest surface in hashed buckets: which triangles are near a place.
//
// Source: Cotin, Delingette and Ayache 1999, section 5: buckets over the bounding box, in a hash table. The paper enters nodes;
// here every bucket lists all triangles that touch it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/base/vec3.h"

namespace palpate {

// A point of the surface that belongs to the tissue: it moves with the three nodes of its triangle.
struct SurfacePoint {
  std::int32_t triangle = -1;
  std::int32_t unused = 0;  // in the place of padding, which a saved state would hold
  double barycentric[3] = {};
};
inline SurfacePoint surface_point_of(std::int32_t triangle, const double* barycentric) {
  return {triangle, 0, {barycentric[0], barycentric[1], barycentric[2]}};
}

// The point of the triangle a b c that is closest to p, as barycentric weights that sum to 1. Returns the squared distance.
double closest_on_triangle(Vec3 p, Vec3 a, Vec3 b, Vec3 c, double barycentric[3]);

class SurfaceIndex {
 public:
  // position: [nodes][3] m; triangles: [triangle_count][3] node indices, checked, outward. active: [triangle_count], 0: the triangle is in no
  // answer; nullptr: all are active, for good. All are borrowed. False where there is no memory. Cost: proportional to the number of triangles,
  // whatever their sizes. Buckets are as wide as the triangles that are active now ask for, and stay so.
  bool build(SceneMemory& memory, const double* position, const std::int32_t* triangles, std::int32_t triangle_count,
             const std::uint8_t* active = nullptr);
  // As NodeFans::change (node_fans.h). Cost: the buckets of these triangles.
  void change(const std::int32_t* triangles, std::int32_t count);

  // Calls visit(triangle) once for every triangle that touches a bucket within `reach` buckets of p's bucket.
  template <class Visit>
  void near(Vec3 p, int reach, Visit visit);

  // The surface point nearest to p, wherever p is; triangle is -1 where the surface has no triangles. Not for a step: for a p far
  // from the surface it visits all buckets.
  SurfacePoint nearest(Vec3 p);

  Vec3 node(std::int32_t n) const { return load3(position_ + 3 * static_cast<std::size_t>(n)); }
  Vec3 corner(std::int32_t triangle, int v) const { return load3(position_ + 3 * triangles_[3 * triangle + v]); }
  Vec3 position(const SurfacePoint& surface_point) const;
  Vec3 outward(std::int32_t triangle) const;  // unit normal, or zero for a degenerate triangle
  double bucket_size() const { return cell_; }
  std::int32_t triangle_count() const { return triangle_count_; }  // inactive ones included
  bool is_active(std::int32_t triangle) const { return !active_ || active_[triangle] != 0; }

 private:
  struct Bucket {
    std::uint64_t key;           // 0: empty
    std::uint32_t begin, count;  // of its active triangles, in ascending order
  };
  static constexpr int kMaxCells = 256;  // per axis

  int cell_of(double x, int axis) const;
  static std::uint64_t key(int i, int j, int k);
  Bucket* slot(std::uint64_t key) const;
  template <class Visit>
  void cells_of_triangle(std::int32_t triangle, Visit visit) const;
  template <class Visit>
  void visit_bucket(int i, int j, int k, Visit visit);
  void next_stamp();
  void choose_cells();
  bool make_table(SceneMemory& memory, std::uint64_t entries);
  void lay_out_entries();

  const double* position_ = nullptr;
  const std::int32_t* triangles_ = nullptr;
  const std::uint8_t* active_ = nullptr;
  std::int32_t triangle_count_ = 0;
  Vec3 low_, high_;
  double cell_ = 1;
  int cells_[3] = {1, 1, 1};
  Bucket* table_ = nullptr;
  std::uint64_t table_mask_ = 0;
  std::int32_t* entries_ = nullptr;
  std::uint32_t* seen_ = nullptr;  // [triangles] stamp of the last query that met it
  std::uint32_t stamp_ = 0;
};

template <class Visit>
void SurfaceIndex::visit_bucket(int i, int j, int k, Visit visit) {
  const Bucket* bucket = slot(key(i, j, k));
  if (bucket->key == 0) return;
  for (std::uint32_t e = bucket->begin; e < bucket->begin + bucket->count; ++e) {
    const std::int32_t triangle = entries_[e];
    if (seen_[triangle] == stamp_) continue;
    seen_[triangle] = stamp_;
    visit(triangle);
  }
}

template <class Visit>
void SurfaceIndex::near(Vec3 p, int reach, Visit visit) {
  next_stamp();
  int first[3], last[3];
  for (int d = 0; d < 3; ++d) {
    // A point outside the box still visits the buckets within reach of it.
    const double at = (p[d] - low_[d]) / cell_;
    if (!(at >= -reach - 1.0 && at <= cells_[d] + reach + 1.0)) return;
    const int centre = static_cast<int>(std::floor(at));
    first[d] = centre - reach < 0 ? 0 : centre - reach;
    last[d] = centre + reach > cells_[d] - 1 ? cells_[d] - 1 : centre + reach;
  }
  for (int k = first[2]; k <= last[2]; ++k)
    for (int j = first[1]; j <= last[1]; ++j)
      for (int i = first[0]; i <= last[0]; ++i) visit_bucket(i, j, k, visit);
}

}  // namespace palpate
