// A tool that grasps: one or two patches of the surface (grasp_patch.h) follow the rigid motion of the tool since it closed. Under a turn R the
// targets of a patch are those of R (y - p) + p + way, for any angle, y its nodes' places and p the tool's when the jaws closed.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/contact/contact_rows.h"
#include "runtime/contact/displacement_field.h"
#include "runtime/contact/row_source.h"
#include "runtime/contact/tool_input.h"
#include "runtime/grasps/grasp_patch.h"
#include "runtime/include/palpate/palpate_grasps.h"
#include "runtime/pose/pose.h"

namespace palpate {

inline constexpr int kGraspPart = 0;
inline bool has_grasp(const Tool& tool) {
  return tool.has_part[kGraspPart];
}
// The last one that the tool had.
inline const palpate_grasp& grasp_of(const Tool& tool) {
  return *reinterpret_cast<const palpate_grasp*>(tool.part[kGraspPart]);
}

// What the steps have left of a tool's grasp; a saved state holds all of it.
struct Grasp {
  std::int32_t closed = 0;  // 1: it holds, slips, or has let go; kClosesAnew
  // It closes anew while it held tissue. In this step it has no rows, so that the tissue goes where it is without the grasp; the next
  // step closes the jaws there.
  static constexpr std::int32_t kClosesAnew = 2;
  std::int32_t id = 0;
  GraspPatch patches[2];
  Vec3 axis;             // unit, from the first patch to the second one
  Vec3 closed_position;  // m, of the tool in the organ's frame when it closed
  Mat3 closed_axes;
  Vec3 position;  // m, now
  Mat3 turn;      // since then
  Vec3 slipped;   // m, by how much the tissue has stayed behind
  palpate_grasp_state state = {};
};

struct TouchState;
struct TouchedSurface;

class Grasps final : public RowSource {
 public:
  // most_nodes: of a disc. field: borrowed.
  bool create(SceneMemory& memory, const DiscSource& source, std::int32_t max_tools, std::int32_t most_nodes,
              const DisplacementField* field, Pass pass);

  std::int32_t begin(TouchStep& step) override;
  void forget_rest() override { seen_ = 0; }
  void request_of_tool(TouchStep& step, std::int32_t t) override;
  bool asks_again(TouchStep& step) override;
  void take_reactions(TouchStep& step, bool solved) override;
  void tell(TouchStep& step, EventSink& to) override;
  Pass pass() const override { return pass_; }
  void forget_tool(std::int32_t t) override;

  // Of a closing of two discs among so many contact nodes, at most.
  static Operations operations_to_close(std::int32_t contact_nodes) {
    constexpr Operations entry = 15, disc = 20'000;
    return 2 * (disc + GraspPatch::kMostNodes * entry * contact_nodes);
  }
  const palpate_grasp_state& state(std::int32_t t) const { return grasps_[t].state; }

 private:
  // Patches of the tool in place t that will ask for rows. Closes, opens and moves its grasp. Cost of a closing: some 20 us, more for discs of some hundred nodes, and the
  // tensors' entries between the patches' nodes and those of the last step's contacts.
  // work: takes the operations of a closing.
  std::int32_t begin_tool(std::int32_t t, const Tool& tool, const OrganPose& organ, Operations* work);
  // Its rows: point `first` and the next one. Returns step flags. made: contacts.
  std::uint32_t add_rows(std::int32_t t, const Tool& tool, std::int32_t first, ContactRows& rows, std::int32_t* made);
  // After a solve: whether grasps pull beyond their friction. Their targets are then those after they have slipped, all together with those that
  // have slipped in this step before, and the step is to be solved again.
  bool slip(TouchState& state);
  // After the last solve: the torque of its forces on the organ about the tool's reference, N m, and that of the parts of the forces along
  // `unit`, both in the organ's frame. Returns step flags.
  std::uint32_t tell_forces(std::int32_t t, const Tool& tool, const TouchState& state, Vec3 unit, Vec3* torque,
                            Vec3* torque_along);

  void follow_surface(const TouchedSurface& surface);
  void close(Grasp& grasp, const Tool& tool);
  void find_patch(const SurfacePoint& place, double radius, GraspPatch* to);
  Vec3 target(const Grasp& grasp, const Tool& tool, int patch, int part) const;
  static double limit_of(const Grasp& grasp, const Tool& tool, const TouchState& state);
  static Vec3 force_of(const Grasp& grasp, const TouchState& state);
  static Vec3 excess_of(const Grasp& grasp, const Tool& tool, const TouchState& state);

  DiscSource source_ = {};
  const DisplacementField* field_ = nullptr;
  Pass pass_ = Pass::contact;
  std::int32_t most_nodes_ = 0, most_tools_ = 0;
  std::int32_t seen_ = 0;    // divided nodes that the grasps have followed
  Grasp* grasps_ = nullptr;  // [max_tools]
  // What the slips of a step have shown.
  struct Slip {
    Vec3 force, wanted;  // N, before the last one; what that was to take away
    double share = 1;    // of what the stiffness asks for
    bool has_slipped = false;

    void learn(Vec3 now, Vec3 excess);
  };
  Slip slips_[PALPATE_MAX_TOOLS];
};

}  // namespace palpate
