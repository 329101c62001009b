// A valid bundle of a small box, solved with dense matrices: P1 elements, one fixed face, all other surface nodes touchable.
// Its numbers obey the laws (reciprocity, zero on fixed nodes), so that readers and checks can be tested without the solver.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <numeric>

#include "studies/bodies/box_mesh.h"
#include "tests/support/bundle_parts.h"

namespace palpate::tests {

struct TinyBox {
  std::array<int, 3> cells = {3, 3, 3};
  std::array<double, 3> size = {0.06, 0.05, 0.04};  // m
  double young = 5400, poisson = 0.45;              // Pa
  bool interior = true;                             // store displacement_interior
  bool single_dof = false;                          // the last surface node is held in x alone
};

// box_mesh with its nodes renumbered, surface first.
struct SurfaceFirst {
  TetrahedralMesh mesh;
  std::vector<std::array<std::int32_t, 3>> triangles;
  std::int32_t surface_nodes = 0;
};

SurfaceFirst surface_first(const TetrahedralMesh& mesh);

// Dense stiffness of linear tetrahedra, K = sum V B^T D B.
Eigen::MatrixXd dense_stiffness(const TetrahedralMesh& mesh, double young, double poisson);

// A body whose bundle is solved densely.
struct DenseBody {
  SurfaceFirst body;
  double young = 5400, poisson = 0.45;  // Pa
  bool interior = true;                 // store displacement_interior
  std::vector<std::uint8_t> fixed;      // [nodes][3]
  Eigen::MatrixXd stiffness = {};       // of a body of several materials; empty: of the one above
};

// Fixed: the face x = 0.
DenseBody dense_box(const TinyBox& box);

// What a scene that deforms largely needs. stiffening: of each region.
inline void add_large_deformation(BundleParts& parts, const std::vector<double>& stiffening = {0}) {
  const auto fixed = parts.get<std::uint8_t>(formats::SectionId::fixed);
  std::vector<std::int32_t> order;
  for (std::size_t n = 0; n < fixed.size() / 3; ++n)
    if (!fixed[3 * n] || !fixed[3 * n + 1] || !fixed[3 * n + 2]) order.push_back(static_cast<std::int32_t>(n));
  parts.set(formats::SectionId::large_order, {order.size()}, order);
  parts.set(formats::SectionId::large_stiffening, {stiffening.size()}, stiffening);
}

// T^u_nk = C_nk C_kk^-1 and T^f_k = C_kk^-1, C_kk inverted on its free dofs.
BundleParts dense_bundle(const DenseBody& dense);

inline BundleParts tiny_bundle(const TinyBox& box = {}) {
  return dense_bundle(dense_box(box));
}

}  // namespace palpate::tests
