// The stiffness of p2-p0: ten-node (quadratic) tetrahedra with one mean dilatation in each. Edges on the surface are
// curved.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "precompute/elements/elastic_body.h"
#include "precompute/elements/stiffness.h"

namespace palpate {

// Nodes: first the vertices of the body, then a middle node for each edge, the edges ascending by their two ends.
struct QuadraticMesh {
  std::vector<std::array<double, 3>> nodes;  // m
  // Vertices 0 1 2 3, then the middles of edges 01 12 20 03 13 23.
  std::vector<std::array<std::int32_t, 10>> cells;
  // A middle node is held where both ends of its edge are, but not on an edge that runs through the inside of the body
  // from one surface vertex to another.
  std::vector<std::array<std::uint8_t, 3>> fixed;
  std::vector<std::array<std::int32_t, 6>> triangles;  // of the surface: vertices a b c, middles ab bc ca
  std::vector<std::uint8_t> curved;                    // per cell: 1 where an edge is not straight
  std::size_t curved_edges = 0, straightened_edges = 0;
};

// The middle nodes of surface edges lie on the smooth surface (curved_edges.h). A tetrahedron counts as sound where its
// volume element is at least a fifth of that of the straight tetrahedron at all nodes and quadrature points. Around a
// tetrahedron that is not sound, the offsets of the edges are halved until it is; those edges are counted as
// straightened.
QuadraticMesh quadratic_mesh(const ElasticBody& body);

// K = the part without the bulk modulus, integrated over each cell with 4 points (14 where it is curved), plus kappa /
// V D^T D, where D is the integral of the divergence over the cell and V its volume. Nothing held. Symmetric to the
// last bit. The cells are added in their order.
BlockMatrix quadratic_stiffness(const QuadraticMesh& mesh, const ElasticBody& body);

// Density times the integral of the shape function of each node; [nodes] kg. Negative at vertices.
std::vector<double> quadratic_mass(const QuadraticMesh& mesh, const ElasticBody& body);

}  // namespace palpate
