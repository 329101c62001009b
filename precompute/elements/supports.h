// Soft supports: elastic foundations under pieces of the surface, and springs. They are in the stiffness matrix: each adds a
// symmetric positive semi-definite part to K, whatever the element.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "precompute/elements/stiffness.h"

namespace palpate {

struct ElasticBody;
struct QuadraticMesh;

// Pushes back on the surface with -normal u_n - tangential u_t, Pa, where u_n and u_t are the parts of the displacement along
// the surface's normal and along the surface.
struct Foundation {
  std::string name;
  double normal = 0, tangential = 0;    // N/m^3
  std::vector<std::int32_t> triangles;  // of ElasticBody::triangles, ascending
};

// Ties node a to node b, or to the world, with the energy stiffness / 2 (axis . (u_a - u_b))^2.
struct Spring {
  static constexpr std::int32_t kWorld = -1;
  std::int32_t a = 0, b = kWorld;
  double stiffness = 0;                    // N/m
  std::array<double, 3> axis = {0, 0, 0};  // of length 1, or zero: the spring acts along x, y and z alike
};

// The springs of one [[spring]].
struct SpringSet {
  std::string name;
  std::vector<Spring> springs;
  std::optional<std::array<double, 3>> anchor = {};  // m, the point of the world to which they all lead; nothing: none
};

// Of a foundation's triangles, m^2.
double area_of(const ElasticBody& body, const Foundation& foundation);

// Of each triangle the normal and the tangential stiffness of all its foundations, N/m^3; empty where the body has none.
std::vector<std::array<double, 2>> foundation_of_triangles(const ElasticBody& body);

// The part of K that foundations and springs add, for linear elements: of each pair of nodes that they couple, the first one not
// above the second, ascending, the 3 x 3 block in the first node's rows and the second one's columns, N/m.
struct SupportStiffness {
  std::vector<std::array<std::int32_t, 2>> nodes;
  std::vector<std::array<double, 9>> block;
};
SupportStiffness support_stiffness(const ElasticBody& body);

// The part of K by which a support pulls the organ along when the support itself moves: foundations, and springs to the world. Over
// the nodes of linear elements or, with a mesh, of quadratic ones; of that mesh nodes and triangles alone are read.
BlockMatrix base_stiffness(const ElasticBody& body, const QuadraticMesh* mesh = nullptr);

// Adds foundations and springs to K over all nodes of linear elements. The foundation is integrated exactly. Springs between
// nodes that no element couples add blocks to the matrix.
void add_supports(const ElasticBody& body, BlockMatrix& matrix);

// The same for quadratic elements: the foundation acts on the curved triangles and is integrated with twelve points, exactly
// where a triangle is straight; springs act on vertices.
void add_supports(const ElasticBody& body, const QuadraticMesh& mesh, BlockMatrix& matrix);

}  // namespace palpate
