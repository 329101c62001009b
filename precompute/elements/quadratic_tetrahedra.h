// Ten-node tetrahedra with one mean dilatation each, their surface edges curved.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "precompute/elements/elastic_body.h"
#include "precompute/elements/stiffness.h"

namespace palpate {

// Nodes: the body's vertices, then one in the middle of every edge, edges in ascending order of their ends.
struct QuadraticMesh {
  std::vector<std::array<double, 3>> nodes;  // m
  // Vertices 0 1 2 3, then the middles of edges 01 12 20 03 13 23.
  std::vector<std::array<std::int32_t, 10>> cells;
  std::vector<std::array<std::uint8_t, 3>>
      fixed;  // a middle where both ends are held, unless its edge joins two places
              // of the surface through the inside
  std::vector<std::array<std::int32_t, 6>> triangles;  // of the surface: vertices a b c, middles ab bc ca
  std::vector<std::uint8_t> curved;                    // per cell: an edge is not straight
  std::size_t curved_edges = 0, straightened_edges = 0;
};

// Middles of surface edges lie on the smooth surface (curved_edges.h). Where that would leave a tetrahedron less than a
// fifth of its straight volume element at any of its nodes or quadrature points, the offsets of its edges are halved
// until it is sound; those edges are counted as straightened.
QuadraticMesh quadratic_mesh(const ElasticBody& body);

// K = the deviatoric part, integrated over each cell (four points; fourteen where it is curved), plus kappa / V D^T D with
// D the integral of the divergence over the cell, V its volume. Nothing held; symmetric to the last bit; the sum runs over
// the cells in their order.
BlockMatrix quadratic_stiffness(const QuadraticMesh& mesh, const ElasticBody& body);

// Density times the integral of each node's shape function; [nodes] kg. Negative at vertices.
std::vector<double> quadratic_mass(const QuadraticMesh& mesh, const ElasticBody& body);

}  // namespace palpate
