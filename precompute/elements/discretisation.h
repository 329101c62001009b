// Body and element -> what the solver works with: the stiffness matrix, and the loads by which vertices are touched.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/organ_config.h"
#include "precompute/elements/elastic_body.h"
#include "precompute/elements/stiffness.h"

namespace palpate {

// How a vertex of a quadratic mesh is touched: a unit force at vertex v is spread over its nodes by the weights, and
// the displacement of v is the sum of weight * displacement over the same nodes, so that the compliance stays
// symmetric. The weights of a vertex sum to 1. Empty for linear elements: there vertex v is node v.
struct TouchFunctionals {
  Lists nodes;
  std::vector<double> weight;  // one for each of nodes.item
};

// Nodes: first the vertices of the body, then the nodes that the element adds.
struct Discretisation {
  BlockMatrix stiffness;                           // over all nodes, soft supports included, nothing held
  std::vector<std::array<double, 3>> coordinates;  // m
  std::vector<std::array<std::uint8_t, 3>> fixed;  // 1 where x, y or z is held at zero
  std::vector<double> mass;                        // kg, density times the integral of the shape function of the node
  std::int32_t vertices = 0;                       // of the body
  TouchFunctionals touch;
  // Of quadratic elements: the surface's triangles (vertices a b c, middles ab bc ca), and of each node behind the vertices the
  // ends of its edge. Empty for linear elements.
  std::vector<std::array<std::int32_t, 6>> triangles;
  std::vector<std::array<std::int32_t, 2>> ends;
  std::size_t curved_edges = 0,
              straightened_edges =
                  0;  // edges of the surface that p2-p0 curves; of them, those it had to make straighter
};

// The share of the shear that follows a gradient averaged at the nodes: 0 but for p1-ang.
double averaged_shear_of(Element element);

// Everything but the stiffness, for elements that add no nodes.
Discretisation discretise_vertices(const ElasticBody& body);

// The same input gives the same bits. Takes seconds at 100,000 vertices.
Discretisation discretise(const ElasticBody& body, Element element);

// The coordinates of the node of each row of blocks; m.
std::vector<std::array<double, 3>> row_coordinates(const Discretisation& discretisation, const HeldStiffness& held);

// The displacements of the vertices, [3 vertices], from those of all nodes, [3 nodes]; zero where a vertex is held.
std::vector<double> read_vertices(const Discretisation& discretisation, std::span<const double> nodes);

}  // namespace palpate
