// The patch of the surface that a jaw holds: three constraints of three rows each, the weighted mean of its nodes' displacements, and their
// gradients along two directions e1 and e2 of the patch,
//     sum_n w_n u_n,      sum_n v_n u_n with (v1_n, v2_n) = M^-1 (m1_n, m2_n),   M_ij = sum_n mi_n xj_n,
// w the pressure below a rigid disc (contact_patch.h), m its first moments along e1 and e2, x the nodes' places along them. Pressure times
// place is the traction below a disc that tilts or twists, so that force and torque are those of a rigid disc.
#pragma once

#include <cstdint>

#include "runtime/contact/touchable_disc.h"

namespace palpate {

// What a closed grasp has kept of one patch.
struct GraspPatch {
  static constexpr int kMostNodes = 64, kFewNodes = 32;
  // The gradients are those of a disc of this many node spacings at least: below that the torque depends on where it lies between the nodes.
  static constexpr double kResolved = 1;
  std::int32_t count = 0, has_gradients = 0;
  SurfacePoint middle = {};  // of the disc, when it closed
  double radius = 0;         // m
  std::int32_t node[kMostNodes] = {};
  double weight[3][kMostNodes] = {};      // of the mean and the two gradients
  Mat3 local[3];                          // m/N, and 1/(N m): compliance that the mesh does not resolve
  ContactDisc discs[3];                   // in x, y, z: what each part shares with the discs of other contacts
  Vec3 place[3];                          // sum_n weight y_n, y the nodes' places when the grasp closed
  Vec3 before[3];                         // sum_n weight u_n, the same of their displacements
  Vec3 along[2];                          // unit: e1, e2
  std::int32_t rows_of = -1, unused = 0;  // its first constraint in this step
};

// What holds the disc of that radius, m, around a place: nodes, at most `most`, weights, local and along; no nodes where none may be touched.
void find_grasp_patch(const DiscSource& source, const SurfacePoint& place, double radius, int most, GraspPatch* patch);

}  // namespace palpate
