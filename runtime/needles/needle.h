// Needles in the tissue. A needle holds places of the tissue on its axis: a constraint of three rows each, one along the axis, whose reaction
// has the limit of the friction along the shaft, and two across it. Its tip has the two rows across, and one along that pushes with at most
// the cutting force. Where that is reached, the place of the tip moves on in the tissue:
//     X <- X + F^-1 a (how far the tip is ahead),     F: deformation gradient of the tetrahedron of the tip, a: the axis.
// A place is a point of a tetrahedron at rest whose four nodes have columns: those inside the bundle's corridor, those on the surface.
//
// Beside what the mesh moves, each place gives way by what the mesh does not resolve, as a thin shaft of radius r does in an infinite
// solid (Kelvin's solution, integrated along a line of length L), of which the mesh has what lies beyond R:
//     across: (3 - 4 nu) / (8 pi (1 - nu) G L) ln(R / r),     along: ln(R / r) / (2 pi G L),     R: kResolved edges.
// Friction with a limit that does not depend on a pressure: Tresca's law (contact_constraints.h).
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/contact/contact_rows.h"
#include "runtime/contact/contact_solver.h"
#include "runtime/contact/displacement_field.h"
#include "runtime/contact/row_source.h"
#include "runtime/contact/tool_input.h"
#include "runtime/include/palpate/palpate_needles.h"
#include "runtime/inside/tetrahedron_tree.h"
#include "runtime/pose/pose.h"

namespace palpate {

// point: 0, the tip, or behind it a place.
constexpr ContactSource kNeedleSource{PALPATE_SOURCE_NEEDLE};

inline constexpr int kNeedlePart = 1;
inline bool has_needle(const Tool& tool) {
  return tool.has_part[kNeedlePart];
}
// The last one that the tool had.
inline const palpate_needle& needle_of(const Tool& tool) {
  return *reinterpret_cast<const palpate_needle*>(tool.part[kNeedlePart]);
}

// A place of the tissue on the axis of a needle.
struct NeedlePlace {
  Vec3 rest;                    // m
  Vec3 aside;                   // m, across the axis: where it is held off it (slide_energy.h)
  std::int32_t node[4] = {};    // mesh nodes of its tetrahedron
  std::int32_t column[4] = {};  // tensor columns
  double weight[4] = {};
  double along = 0, across = 0;          // m^2/N: the compliances above times L, without their logarithm
  double resolved = 0;                   // m: R
  double held = 0;                       // m, along the axis from the tip: where it sticks
  double length = 0;                     // m, of the shaft that it stands for
  double depth = 0;                      // m, of the way in the tissue
  std::int32_t row_of = -1, unused = 0;  // its constraint in this step
};

// What the steps have left of a tool's needle; a saved state holds all of it.
struct NeedleInTissue {
  static constexpr std::int32_t kMostPlaces = 64;
  std::int32_t is_known = 0;              // 1: it is the needle `id`, and its tip has a place
  std::int32_t id = 0, count = 0;         // places held
  std::int32_t pierced = 0, is_out = 0;   // is_out: it was drawn out, and needs another id to enter again
  std::int32_t touches = 0;               // its tip has a row in this step, or it is inside
  std::int32_t tip_row = -1, unused = 0;  // the constraint along the axis at the tip
  Vec3 position, axis, tangent;           // in the organ's frame; axis, tangent: unit
  NeedlePlace tip;
  NeedlePlace place[kMostPlaces];
  palpate_needle_state state = {};
};

class Needles final : public RowSource {
 public:
  // All borrowed.
  struct Source {
    TetrahedronGeometry geometry;                       // nodes: at rest, preload included
    const std::int32_t* triangles = nullptr;            // [F][3]
    const std::int32_t* column_of_node = nullptr;       // [Ns] or -1
    const std::int32_t* region = nullptr;               // [E]
    const double *young = nullptr, *poisson = nullptr;  // [R]
    const Tensors* tensors = nullptr;                   // with a corridor
    const DisplacementField* field = nullptr;
    std::int32_t most_places = 0, max_tools = 0;
    Pass pass = Pass::contact;
  };
  bool create(SceneMemory& memory, const Source& source);

  std::int32_t begin(TouchStep& step) override;
  void request(TouchStep& step) override;
  void take_reactions(TouchStep& step, bool solved) override;
  void correct_forces(TouchStep& step) override;
  bool note_sliding(const TouchStep& step, const ContactConstraints& set, const ContactConstraint& constraint,
                    SlideEnergy::Sliding* sliding) override;
  Pass pass() const override { return source_.pass; }
  void forget_tool(std::int32_t t) override;

  const palpate_needle_state& state(std::int32_t t) const { return needles_[t].state; }
  // m, of a node that a needle may hold.
  static std::int32_t constraints_of_one(std::int32_t most_places) { return most_places + 2; }
  // What a needle takes beside its rows in a step with so many contact nodes, at most: where the tissue at the tip and at its places is,
  // and the search for the tetrahedron into which the tip goes.
  static Operations operations(std::int32_t places, std::int32_t contact_nodes) {
    constexpr Operations entry = 15, search = 3000;
    return 4 * contact_nodes * (entry + (1 + Operations{places}) * 9 / kDense) + search;
  }
  static std::int32_t nodes_of_one(std::int32_t most_places) { return 4 * (most_places + 2); }

 private:
  // Constraints that the needle of the tool in place t will ask for.
  std::int32_t begin_tool(std::int32_t t, const Tool& tool, const OrganPose& organ);
  // Its rows. Returns step flags.
  std::uint32_t add_rows(std::int32_t t, const Tool& tool, ContactRows& rows);
  // After the solve: the force on the organ and the torque about the tool's reference, in the organ's frame; places slide, the tip cuts.
  // Returns step flags. Cost: a search for a tetrahedron where the tip moves in the tissue.
  std::uint32_t end_tool(const TouchStep& step, std::int32_t t, bool solved, Vec3* sum, Vec3* torque);
  bool find_place(Vec3 x, NeedlePlace* place) const;
  void enter(NeedleInTissue& needle, const Tool& tool) const;
  Vec3 displacement(const NeedlePlace& place) const;
  // The rows of a place: the axis and two directions across it.
  RowWish wish_of(const NeedleInTissue& needle, const Tool& tool, const NeedlePlace& place, double length,
                  const ConstraintId& id) const;
  static void let_go_passed(NeedleInTissue& needle);
  Vec3 moved(const TouchStep& step, const NeedlePlace& place, int c, std::int32_t p) const;
  void slide(const TouchStep& step, NeedleInTissue& needle) const;
  std::uint32_t move_tip(const TouchStep& step, NeedleInTissue& needle, const Tool& tool) const;
  bool may_take_place(const NeedleInTissue& needle, const Tool& tool) const;
  void take_place(NeedleInTissue& needle, Vec3 now) const;

  Source source_;
  TetrahedronTree tree_;
  NeedleInTissue* needles_ = nullptr;  // [max_tools]
};

}  // namespace palpate
