// The compliance that the mesh does not resolve, between two discs. contact_patch.h has that of one disc, which stands in its own block
// of the contact system; this is the block beside it. Without it two discs at one place would press twice as hard as one.
//
// Disc i has the radius a_i, and the mesh shows it as one of radius w_i (a_i <= w_i). With a = max(a_i, a_j), w = min(w_i, w_j), the
// distance d of the places, the outward normals n and the compliances c of a disc of radius 1,
//     g = 1 / sqrt(a^2 + (pi d / 2)^2) - 1 / sqrt(w^2 + (pi d / 2)^2),   0 where a >= w,
//     L_ij = ((1 + n_i . n_j) / 2)^2 sqrt(c_i c_j) (g_n n_i n_j^T + g_t S_i S_j).
// 1 / sqrt(a^2 + (pi d / 2)^2) / a disc's 1 / a is the answer of a half-space at one place to a force at the other, both blurred to the
// radius a. S_i is the root of the disc's own tangential compliance over the one that it has on a plane, so that L_ij is the disc's own
// compliance for d = 0 and like discs, curvature included. It falls with the third power of d. Discs on opposite faces do not couple.
//
// L is positive semidefinite for any discs: -d/dt of the term in t is t (t^2 + (pi d / 2)^2)^(-3/2), which is completely monotone in
// d^2 and therefore positive definite in space (Schoenberg 1938); L_ij integrates it over what [a_i, w_i] and [a_j, w_j] have in common,
// and the other factors are products of one matrix for each disc or powers of a Gram matrix (Schur).
#pragma once

#include "runtime/base/step_work.h"
#include "runtime/base/vec3.h"

namespace palpate {

// Of two discs: four roots and some 60 multiply-adds.
constexpr Operations kOfTwoDiscs = 50;

struct ContactDisc {
  double radius = 0;    // m, a; 0: there is no disc
  double wide[2] = {};  // m, w: along the normal and across it
  Vec3 place, outward;  // m, unit; of the surface at rest
  Vec3 normal_root;     // m / sqrt(N), sqrt(c_n) n, in the frame of its constraint
  Mat3 tangent_root;    // m / sqrt(N), sqrt(c_t) S, its rows in the frame of its constraint
};

// The disc with its roots in another frame, whose rows are unit vectors.
ContactDisc in_frame(const ContactDisc& disc, const Mat3& frame);
// The disc whose displacement counts against that of another one.
ContactDisc opposite(const ContactDisc& disc);

// m/N: displacement of a, along its frame, for a force on b, along that of b. Its transpose is compliance_between(b, a).
Mat3 compliance_between(const ContactDisc& a, const ContactDisc& b);

}  // namespace palpate
