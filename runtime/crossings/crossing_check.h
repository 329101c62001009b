// A surface against itself: which of its triangles cross, in slices of counted work.
//
// A check copies the positions of one shape, refits a tree over the triangles to them, and then walks for each leaf over the leaves behind it
// whose boxes meet its own. The tree is a complete binary one: the children of box k are 2 k + 1 and 2 k + 2, so a walk has no stack and may stop
// at each box. Which triangles a leaf has follows from the surface at rest, since triangles that are near one another there mostly stay so.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/base/step_work.h"
#include "runtime/base/vec3.h"
#include "runtime/include/palpate/palpate_crossings.h"
#include "runtime/shape/shape.h"

namespace palpate {

// Whether the triangles cross, and where an edge of one passes through the other. Corners that are the same node have the same number in
// node_a and node_b.
struct CrossedEdge {
  bool of_a;         // the edge belongs to a
  int from, to;      // its corners
  double along;      // 0 .. 1, from the first to the second
  double weight[3];  // of the other triangle's corners, which sum to 1
};
bool triangles_cross(const Vec3 a[3], const std::int32_t node_a[3], const Vec3 b[3], const std::int32_t node_b[3],
                     CrossedEdge* edge);

class CrossingCheck {
 public:
  static constexpr std::int32_t kMostKept = 64;

  // rest: [nodes][3] m; surface: its triangles. Both are borrowed. False where there is no memory.
  bool create(SceneMemory& memory, const double* rest, std::int32_t nodes, const ShapedSurface& surface,
              const palpate_crossings_def& def);

  std::int32_t nodes() const { return nodes_; }
  std::int32_t operations() const { return def_.crossings_operations; }
  // One call. positions: [nodes][3] m. False where a check was due and a position is not finite.
  bool go_on(const float* positions);

  // Of the last finished check.
  std::uint64_t checks() const { return checks_; }
  std::int32_t pairs() const { return pairs_; }
  const palpate_crossing* kept() const { return kept_; }

 private:
  static constexpr std::int32_t kLeaf = 4;  // triangles of a leaf, at most
  struct Box {
    float low[3], high[3];
  };
  std::int32_t first_of(std::int32_t leaf) const {
    return static_cast<std::int32_t>(std::int64_t{triangle_count_} * leaf / leaves_);
  }
  bool begin(const float* positions);
  Operations refit();
  Operations search();
  Operations compare(std::int32_t leaf, std::int32_t other);
  void add(std::int32_t a, std::int32_t b, const CrossedEdge& edge);
  void end();
  void grow(Box* box, std::int32_t triangle) const;
  void corners(std::int32_t triangle, Vec3 corner[3]) const;
  bool is_active(std::int32_t triangle) const { return !active_ || active_[triangle] != 0; }

  palpate_crossings_def def_ = {};
  const double* rest_ = nullptr;
  const std::int32_t* triangles_ = nullptr;
  const std::uint8_t* active_ = nullptr;
  std::int32_t nodes_ = 0, triangle_count_ = 0, leaves_ = 1;
  std::int32_t* order_ = nullptr;  // [triangles] leaf by leaf
  Box* boxes_ = nullptr;           // [2 leaves - 1]; the leaves are the last ones
  float* positions_ = nullptr;     // [nodes][3] m, of the shape that is checked
  std::int32_t calls_ = 0;         // since the check began
  bool runs_ = false;
  std::int32_t unfitted_ = 0;           // boxes that are not refitted yet: the first ones
  std::int32_t leaf_ = 0, other_ = 0;   // boxes that come next in the search
  std::int32_t found_ = 0, pairs_ = 0;  // of this check; of the last finished one
  std::uint64_t checks_ = 0;
  palpate_crossing* finding_ = nullptr;  // [kMostKept] of this check
  palpate_crossing* kept_ = nullptr;     // [kMostKept] of the last finished one
};

}  // namespace palpate
