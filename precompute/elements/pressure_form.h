// A larger but sparser system with the solutions of K x = b, for the element p1-anp.
#pragma once

#include "precompute/elements/elastic_body.h"
#include "precompute/elements/stiffness.h"

namespace palpate {

// p1-anp averages the dilatation over nodes, so K = A + B^T B couples the neighbours of neighbours: each row of B is the average
// around one node. The same x solves
//   [ A  B^T ] [ x ]   [ b ]
//   [ B  -I  ] [ p ] = [ 0 ]
// where A couples neighbours only. p holds one scaled pressure for each block row of K. Each 4 x 4 block has the rows u_x, u_y,
// u_z, p. A is positive definite on each part of the body whose neighbouring nodes are held. So the matrix has a factor L S L^T
// with S = diag(1, 1, 1, -1, ...) in every order of the block rows.
using PressureForm = BlockMatrixOf<4>;

// The pressure form of a body under p1-anp. held: its K without held dofs, as remove_held_dofs() gives it; the block rows are those
// of held. Where several regions meet at a node, the node has one average for each region. The largest average gets the pressure.
// The other averages, and those around nodes without a row of K, are part of A; they add blocks along the interface alone.
// Foundations and springs are part of A. The matrix is symmetric to the last bit. Cost: about that of assembling K; 132 bytes a
// block.
PressureForm pressure_form(const ElasticBody& body, const HeldStiffness& held);

}  // namespace palpate
