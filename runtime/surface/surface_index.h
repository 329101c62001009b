// The closed rest surface in buckets: where a segment crosses it, whether a point is inside, which triangles are near.
//
// Source: Cotin, Delingette and Ayache 1999, section 5: buckets over the bounding box in a hash table. Completed:
// triangles (not only nodes) are entered in every bucket they touch and segments walk the buckets, so that large
// triangles and fast tools are not missed; and the tests are decided by exact signs, so that a hit on an edge or vertex
// counts once and a motion within the plane of a face contradicts nothing.
#pragma once

#include <cstddef>
#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/base/vec3.h"

namespace palpate {

// A material place of the surface.
struct SurfacePlace {
  std::int32_t triangle = -1;
  double barycentric[3] = {};
};

struct Crossing {
  SurfacePlace place;
  double time = 0;  // along the segment, 0 .. 1
  bool entering = false;
};

// The place of the triangle a b c closest to p; barycentric sums to 1. Returns the squared distance.
double closest_on_triangle(Vec3 p, Vec3 a, Vec3 b, Vec3 c, double barycentric[3]);

class SurfaceIndex {
 public:
  static constexpr int kMaxCrossings = 32;

  // position: [nodes][3] m, triangles: [triangle_count][3] checked indices, outward. Both are borrowed. False without
  // memory. Cost: proportional to the triangles, whatever their sizes.
  bool build(SceneMemory& memory, const double* position, const std::int32_t* triangles, std::int32_t triangle_count);

  // Parity along a ray; decided by exact signs, so it never contradicts itself. A point exactly on the surface is
  // judged as if it stood infinitely little towards +x (then +y, +z) of it. Cost: the buckets above p.
  bool inside(Vec3 p);

  // The crossings of the segment from a to b, in order of time, each once; returns how many (more than kMaxCrossings
  // are counted but not stored): an odd number exactly when one of inside(a) and inside(b) holds, both ends judged as
  // inside() does. Cost: the buckets along the segment.
  int crossings(Vec3 a, Vec3 b, Crossing* found);

  // Calls visit(triangle) once for every triangle entered in a bucket within `reach` buckets of p's.
  template <class Visit>
  void near(Vec3 p, int reach, Visit visit);

  // The place of the surface nearest to p, wherever p is; its triangle is -1 where there is none. Not for a step: for a p
  // that is far from the surface it goes through all buckets.
  SurfacePlace nearest(Vec3 p);

  Vec3 corner(std::int32_t triangle, int v) const { return load3(position_ + 3 * triangles_[3 * triangle + v]); }
  Vec3 at(const SurfacePlace& place) const;
  Vec3 outward(std::int32_t triangle) const;  // unit normal, or zero for a degenerate triangle
  double bucket_size() const { return cell_; }
  std::int32_t triangle_count() const { return triangle_count_; }

 private:
  struct Bucket {
    std::uint64_t key;  // 0: empty
    std::uint32_t begin, count;
  };
  static constexpr int kMaxCells = 256;  // per axis: bounds the length of any walk

  int cell_of(double x, int axis) const;
  static std::uint64_t key(int i, int j, int k);
  Bucket* slot(std::uint64_t key) const;
  template <class Visit>
  void cells_of_triangle(std::int32_t triangle, Visit visit) const;
  template <class Visit>
  void visit_bucket(int i, int j, int k, Visit visit);
  template <class Visit>
  void walk(Vec3 a, Vec3 b, Visit visit);
  void next_stamp();
  void choose_cells();
  bool make_table(SceneMemory& memory, std::uint64_t entries);
  void lay_out_entries();

  const double* position_ = nullptr;
  const std::int32_t* triangles_ = nullptr;
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
    // A point outside the box still meets the buckets within reach of it.
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
