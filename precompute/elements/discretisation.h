// A body and an element -> the numbers that are solved with: stiffness, and how the vertices are touched.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/organ_config.h"
#include "precompute/elements/elastic_body.h"
#include "precompute/elements/stiffness.h"

namespace palpate {

// Vertex v is touched, and its displacement read, through the sum over its nodes of weight * displacement. Weights sum to
// one. Empty: vertex v is node v.
struct TouchFunctionals {
  Lists nodes;
  std::vector<double> weight;  // beside nodes.item
};

// Nodes: the body's vertices, then those the element adds.
struct Discretisation {
  BlockMatrix stiffness;                           // over all nodes, nothing held
  std::vector<std::array<double, 3>> coordinates;  // m
  std::vector<std::array<std::uint8_t, 3>> fixed;  // 1 where x, y or z is held at zero
  std::vector<double> mass;                        // density times the integral of the node's shape function; kg
  std::int32_t vertices = 0;                       // of the body
  TouchFunctionals touch;
  std::size_t curved_edges = 0, straightened_edges = 0;  // of the surface, where the element has curved ones
};

// Everything but the stiffness, of the elements that add no nodes.
Discretisation place_vertices(const ElasticBody& body);

// Deterministic: same input, same bits. Seconds at 100,000 vertices.
Discretisation discretise(const ElasticBody& body, Element element);

// Of the node of each block row; m.
std::vector<std::array<double, 3>> row_coordinates(const Discretisation& discretisation, const HeldStiffness& held);

// Displacements of the vertices, [3 vertices], from those of all nodes, [3 nodes]; zero where a vertex is held.
std::vector<double> read_vertices(const Discretisation& discretisation, std::span<const double> nodes);

}  // namespace palpate
