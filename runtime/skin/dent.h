// What a disc dents into a render mesh beyond what the coarse mesh below shows: the drawn part of the sub-grid compliance (contact_patch.h).
//
// A rigid disc of radius a that the force F presses on a half-space takes the surface to D P_a(rho), with D = c(a) F and
//     P_r(rho) = 1 for rho <= r,  (2 / pi) asin(r / rho) outside                    (Sneddon 1965; Johnson 1985, section 3.8),
// rho the distance from the disc's axis. A mesh of node spacing s shows the same force as a disc of radius b', the one that the touch
// reckons with: b' = b + blur s, b = max(a, 0.75 s). Its share is x = a / b'. So the mesh lacks, along the disc's normal,
//     M(rho) = D (P_a(rho) - x Q(rho)),
// with Q the mean of P_r over the radii b' -+ 0.75 s: the nodes smear the rim of the disc over their spacing. At the axis M is D (1 - x),
// which is F times the compliance that the contact adds to its row. From afar M vanishes. P_a is drawn with its rim rounded over a / 4,
// as the mean of P_r over a .. 1.25 a: so its slope is at most 1.6 D / a.
//
// What is then left between the surface and the disc's plane is the organ's own unevenness and the mesh's own error. Under the disc
// it is taken away, up to 2 D where it stands out: a disc on a dome touches all of it at an indentation of twice the dome's height
// (Hertz). In a hollow M is left out, and the surface rises by up to x D / 2, half of what the mesh shows of the dent. So the surface
// sinks with the tool there too, and nothing jumps where a contact begins.
// Beside the disc this part fades out.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/base/vec3.h"
#include "runtime/include/palpate/palpate.h"
#include "runtime/surface/surface_measure.h"

namespace palpate {

// One disc in a step, in the organ's frame.
struct DentDisc {
  Vec3 centre;              // m, where the tool holds its middle
  Vec3 normal;              // outward unit normal, turned with the surface
  double indentation = 0;   // D, m: below zero where the tool pulls
  double radius = 0;        // a, m
  double share = 0;         // x
  double wide = 0;          // b', m
  double smeared_from = 0;  // m, the smallest radius that Q takes the mean over
  double fade = 0;          // m, width of the ring beside the disc in which the plane fades out
  double reach = 0;         // m: beyond this distance from the axis the disc changes nothing
};

// Fills in the disc's lengths. spacing: s, m; blur: along the normal, in units of s (surface_measure.h).
void measure_disc(double radius, double spacing, double blur, DentDisc* disc);

// How far a disc moves a place against its normal, m, and how that changes with the place.
struct DentAt {
  double sunk = 0;
  Vec3 gradient;
};
// position: m; normal: of the surface there, of unit length, before any dent. Away from discs: zero.
DentAt dent_at(const DentDisc& disc, Vec3 position, Vec3 normal);

// The discs of one step.
class Dents {
 public:
  bool create(SceneMemory& memory, std::int32_t most);
  void begin();
  void add(const DentDisc& disc);
  std::int32_t count() const { return count_; }

  // Whether any disc may move this place; a box around all of them, then one box each.
  bool may_reach(const float* position) const;
  // Moves a place and, where `normal` is not nullptr, turns its normal. facing: outward unit normal of the surface there. Where several
  // discs move it, it takes the mean of their moves, weighted by the fourth power of each: the deepest dent decides, without a seam.
  void apply(Vec3 facing, float* position, float* normal) const;

 private:
  DentDisc* discs_ = nullptr;  // [most]
  std::int32_t most_ = 0, count_ = 0;
  Vec3 low_, high_;  // m, of the box around all discs' reach
};

}  // namespace palpate
