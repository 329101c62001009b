// What holds a body softly while it is cut: foundations below triangles of its surface, and springs at nodes.
//
// A foundation belongs to its triangle: its stiffness is at the corners that the triangle has now, and goes with the tetrahedron below it.
// A spring belongs to a node. Where the node splits, each part takes the share of the spring that it has of the area of the node's triangles:
// of those whose three corners have springs, or, where the node has none of these, of all triangles of the surface at rest. Removal leaves springs
// as they are.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/base/vec3.h"
#include "runtime/cut/cut_tissue.h"

namespace palpate {

// Of the body at rest; borrowed.
struct SupportedSurface {
  const std::int32_t* triangles = nullptr;  // [count][3]
  const double* foundation = nullptr;       // [count][2] N/m^3, along the normal and along the surface; nullptr: none
  std::int32_t count = 0;
};

class CutSupports {
 public:
  // body: its support_stiffness is that of the foundations and the springs. tissue: of the same body, uncut. False where memory ends.
  bool create(SceneMemory& memory, const HyperelasticBody& body, const SupportedSurface& surface,
              const CutTissue& tissue);
  void forget();
  // Of the same body and surface: with the springs that `now` has.
  void begin_from(const CutSupports& now);

  // A face of the surface at rest.
  struct Face {
    Mat3 block;            // N/m, of its foundation between two corners; that of a corner with itself is twice as much
    double area = 0;       // m^2
    bool founded = false;  // it has a foundation
    bool has_springs = false;  // at each of its corners
  };
  // The face of tetrahedron e that is opposite to a corner; nullptr: it is none of the surface.
  const Face* face(std::int32_t e, int opposite) const {
    const std::int32_t at = face_at_ ? face_at_[4 * static_cast<std::int64_t>(e) + opposite] : -1;
    return at < 0 ? nullptr : faces_ + at;
  }
  const Face* face_of_triangle(std::int32_t triangle) const { return faces_ ? faces_ + triangle : nullptr; }
  bool exist() const { return exist_; }
  // Of a tetrahedron; of any, at most.
  int foundations_of(std::int32_t e) const;
  int most_foundations() const { return most_foundations_; }
  // N/m: with how much springs hold the corners of a triangle whose corners all have some; zero of another one.
  Mat3 springs_of(std::int32_t triangle) const;

  // The share of a node's springs that goes with some of its tetrahedra: of those where goes[tetrahedron] is not 0.
  double share_of(const CutTissue& tissue, std::int32_t node, const std::uint8_t* goes) const;
  // Of the forces on the surface at a node: as foundations divide there, or springs, so that supports which move pull each part by its own; else as the
  // area of the node's triangles. -1: it has none.
  double share_of_forces(const CutTissue& tissue, std::int32_t node, const std::uint8_t* goes) const;
  // The same where these tetrahedra are removed: springs stay.
  double share_of_triangles(const CutTissue& tissue, std::int32_t node, const std::uint8_t* goes) const;
  // Springs of a node: calls visit(node at rest, block, N/m, in the rows of the node and the columns of the other one), the node itself among them.
  template <class Visit>
  void for_each_spring(std::int32_t at_rest, Visit visit) const {
    if (!first_) return;
    for (std::int32_t at = first_[at_rest]; at < first_[at_rest + 1]; ++at)
      visit(springs_[at].other, springs_[at].block);
  }
  bool has_springs(std::int32_t at_rest) const { return first_ && first_[at_rest + 1] > first_[at_rest]; }
  // Pairs of nodes with a spring between them that a new node adds, at most: the parts of a node that have some of its springs are no more than its
  // triangles.
  std::int32_t most_pairs_of_new() const { return most_pairs_of_new_; }
  // Of its springs at rest, that a node still has; of a new node since split().
  double held(std::int32_t node) const { return held_[node]; }
  void split(std::int32_t from, std::int32_t node, double share) {
    if (!held_) return;
    held_[node] = share * held_[from], held_[from] -= held_[node];
  }

 private:
  enum class Weight { foundation, area_with_springs, area };
  static double weight_of(const Face& face, Weight weight);
  double share_by(const CutTissue& tissue, std::int32_t node, const std::uint8_t* goes, Weight weight) const;
  struct Spring {
    std::int32_t other, unused;
    Mat3 block;
  };
  bool make_faces(SceneMemory& memory, const HyperelasticBody& body, const SupportedSurface& surface,
                  const CutTissue& tissue);
  bool make_springs(SceneMemory& memory, const HyperelasticBody& body, const SupportedSurface& surface);
  void count_pairs(const SupportedSurface& surface, std::int32_t nodes, std::int32_t* triangles_at);

  std::int32_t* face_at_ = nullptr;  // [tetrahedra][4]; nullptr: the surface is not known
  Face* faces_ = nullptr;            // [triangles]
  const std::int32_t* triangles_ = nullptr;
  std::int32_t* first_ = nullptr;  // [nodes at rest + 1] into springs_; nullptr: there are none
  Spring* springs_ = nullptr;
  double* held_ = nullptr;  // [nodes at rest + new ones]
  std::int32_t all_nodes_ = 0, most_pairs_of_new_ = 0;
  int most_foundations_ = 0;
  bool exist_ = false;
};

}  // namespace palpate
