// The compliance that the mesh does not resolve, between two discs. contact_patch.h has that of one disc, which stands in its own block
// of the contact system; this is the block beside it. Without it two discs at one place would press up to twice as hard as one.
//
// Disc i has the radius a_i, and the mesh shows it as one of radius w_i. With a = max(a_i, a_j), w = min(w_i, w_j), the distance d of
// the places, the outward normals n and the compliance c_i of a disc of radius 1,
//     g = 1 / sqrt(a^2 + (pi d / 2)^2) - 1 / sqrt(w^2 + (pi d / 2)^2), or 0 where a >= w,
//     L_ij = ((1 + n_i . n_j) / 2)^2 sqrt(c_i c_j) (g_n n_i n_j^T + g_t S_i S_j).
// Each term of g is the answer of a half-space at one place to a force at the other, both spread over the radius; for d = 0 it is the
// compliance of the disc. S_i is the root of the disc's own tangential compliance over that on a plane, so that the surface's curvature
// counts. For like discs L_ij goes from L_ii at d = 0 to zero, with the third power of d. Discs on opposite faces do not share.
//
// L is positive semidefinite for any discs: -d/da of 1 / sqrt(a^2 + (pi d / 2)^2) is completely monotone in d^2, and therefore positive
// definite in space (Schoenberg 1938); L_ij integrates it over what the intervals [a_i, w_i] and [a_j, w_j] have in common; the other
// factors are one matrix for each disc, and powers of the Gram matrix of (1, n) (Schur's product).
//
// Constraints that hold the gradients of the displacement under a disc share with one another. In place of the
// term t = (a^2 + rho^2)^(-1/2) of g, rho = pi / 2 (x_i - x_j), two gradients along e_i and e_j have
//     t^3 (e_i . e_j - 3 t^2 (e_i . rho) (e_j . rho)),
// the slope of t along both: 1 / a^3 for d = 0, as what the disc's own gradients lack, and positive definite as t is. A gradient and a mean
// share nothing: that keeps L semidefinite, and two such discs at nearly one place free of conflict.
//
// A share of kOwn of the disc's whole compliance c / a stays its own: in place of L_ii the others see L_ii - kOwn c / a. So k discs at
// one place press up to kOwn harder than one, and the system stays definite: without it, discs at nearly one place would feel the noise
// of the mesh between their places, and their forces would be of both signs.
#pragma once

#include "runtime/base/step_work.h"
#include "runtime/base/vec3.h"

namespace palpate {

// Of two discs: four roots and some 60 multiply-adds.
constexpr Operations kOfTwoDiscs = 25;

constexpr double kOwn = 0.008;
// Of what a disc of radius a that the mesh shows as one of radius `wide` has beyond the mesh: the part that others share.
inline double shared_part(double a, double wide) {
  return (1 - kOwn) * wide > a ? 1 - kOwn * wide / (wide - a) : 0;
}
// The same of a turn, whose compliance goes with the cube of the radius.
inline double shared_part_of_turn(double a, double wide) {
  return shared_part(a * a * a, wide * wide * wide);
}

struct ContactDisc {
  double radius = 0;    // m, a; 0: there is no disc
  double wide[2] = {};  // m, w: along the normal and across it
  Vec3 place, outward;  // m, unit; of the surface at rest
  Vec3 gradient;        // unit, e; zero: of the mean displacement
  Vec3 normal_root;     // m / sqrt(N), sqrt(c_n) n, in the frame of its constraint
  Mat3 tangent_root;    // m / sqrt(N), sqrt(c_t) S, its rows in the frame of its constraint
};

inline bool is_gradient(const ContactDisc& disc) {
  return (disc.gradient.x != 0) | (disc.gradient.y != 0) | (disc.gradient.z != 0);
}

// The disc with its roots in another frame, whose rows are unit vectors.
ContactDisc in_frame(const ContactDisc& disc, const Mat3& frame);
// The disc whose displacement counts against that of another one.
ContactDisc opposite(const ContactDisc& disc);

// m/N: displacement of a, along its frame, for a force on b, along that of b. Its transpose is compliance_between(b, a).
Mat3 compliance_between(const ContactDisc& a, const ContactDisc& b);

}  // namespace palpate
