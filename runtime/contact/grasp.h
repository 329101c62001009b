// A tool that grasps: one or two patches of the surface follow the rigid motion of the tool since it closed. A patch is three constraints
// of three rows each: the weighted mean of its nodes' displacements, and their gradients along two directions e1 and e2 of the patch,
//     sum_n w_n u_n,      sum_n v_n u_n with (v1_n, v2_n) = M^-1 (w_n x1_n, w_n x2_n),   M = sum_n w_n x x^T,
// x the nodes' places along e1 and e2 from their mean, w the pressure below a rigid disc (contact_patch.h). w x is the traction below a
// disc that tilts or twists, so that force and torque are those of a disc all of whose nodes are held. Under a turn R the targets are
// those of R (y - p) + p + way, for any angle.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/contact/contact_rows.h"
#include "runtime/contact/contact_solver.h"
#include "runtime/contact/motions.h"
#include "runtime/contact/tool_input.h"
#include "runtime/contact/touchable_disc.h"
#include "runtime/pose/pose.h"

namespace palpate {

// What a closed grasp has kept of one patch.
struct GraspPatch {
  static constexpr int kMostNodes = 32;
  std::int32_t count = 0, has_gradients = 0;
  std::int32_t node[kMostNodes] = {};
  double weight[3][kMostNodes] = {};      // of the mean and the two gradients
  Mat3 local[3];                          // m/N, and 1/(N m): compliance that the mesh does not resolve
  Vec3 place[3];                          // sum_n weight y_n, y the nodes' places when the grasp closed
  Vec3 before[3];                         // sum_n weight u_n, the same of their displacements
  Vec3 along[2];                          // unit: e1, e2
  std::int32_t rows_of = -1, unused = 0;  // its first constraint in this step
};

// What the steps have left of a tool's grasp; a saved state holds all of it.
struct Grasp {
  std::int32_t closed = 0;  // 1: it holds, slips, or has let go
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

class Grasps {
 public:
  // motions: move the organ beside the contacts, or nullptr; borrowed.
  bool create(SceneMemory& memory, const DiscSource& source, std::int32_t max_tools, const Motions* motions);
  void forget(std::int32_t t);

  // Patches of the tool in place t that will ask for rows. Closes, opens and moves its grasp. Cost of a closing: some 20 us, and the
  // tensors' entries between the patches' nodes and those of the last step's contacts.
  std::int32_t begin(std::int32_t t, const Tool& tool, const OrganPose& organ, const Tensors& tensors,
                     const ContactSolver& solver);
  // Its rows: point `first` and the next one. Returns step flags. made: contacts.
  std::uint32_t request(std::int32_t t, const Tool& tool, std::int32_t first, ContactRows& rows, std::int32_t* made);
  // After a solve: whether the grasp of a tool pulls beyond its friction. Its targets are then those after it has slipped, and the step
  // is to be solved again.
  bool slips(std::int32_t t, const Tool& tool, const ContactSolver& solver, ContactRows& rows);
  // After the last solve: the force on the organ, and the torque about `reference`, in the organ's frame.
  void finish(std::int32_t t, const Tool& tool, const ContactSolver& solver, const OrganPose& organ, Vec3* torque);

  const palpate_grasp_state& state(std::int32_t t) const { return grasps_[t].state; }

 private:
  void close(Grasp& grasp, const Tool& tool, const Tensors& tensors, const ContactSolver& solver);
  void find_patch(const SurfacePoint& place, double radius, const Tensors& tensors, const ContactSolver& solver,
                  GraspPatch* to);
  static void find_gradients(const Vec3* x, GraspPatch* patch);
  Vec3 target(const Grasp& grasp, const Tool& tool, int patch, int part) const;
  static double limit_of(const Grasp& grasp, const Tool& tool, const ContactSolver& solver);
  static Vec3 force_of(const Grasp& grasp, const ContactSolver& solver);

  DiscSource source_ = {};
  const Motions* motions_ = nullptr;
  Grasp* grasps_ = nullptr;  // [max_tools]
};

}  // namespace palpate
