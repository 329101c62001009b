// Corridor columns of the box of tests/support, from a dense solve.
#pragma once

#include "tests/support/tiny_bundle.h"

namespace palpate::tests {

// The compliance K^-1 on the free dofs, zero on the held ones, [3 N][3 N] m/N.
Eigen::MatrixXd dense_compliance(const DenseBody& dense);

// The displacement with the imposed dofs as they are in u, and K u the load on all others.
Eigen::VectorXd solve_imposed(const Eigen::MatrixXd& k, const std::vector<bool>& imposed, Eigen::VectorXd u,
                              const Eigen::VectorXd& load);

// Adds the corridor's sections to a bundle of the body. nodes: inside it, ascending. The interior is added where the body has one.
void add_corridor(BundleParts& parts, const DenseBody& dense, const std::vector<std::int32_t>& nodes);

// Adds the sections of a cut's region. nodes: ascending.
void add_cut(BundleParts& parts, const DenseBody& dense, const std::vector<std::int32_t>& nodes);
// A box, all of which may be cut: no node is inside, and the last ones of the surface are in reserve. They wait at the first node.
DenseBody box_that_can_be_cut(std::int32_t reserve, const TinyBox& form = {});
// That region, with its reserve.
void add_cut_region(BundleParts& parts, const DenseBody& dense, std::int32_t reserve);

// A box that may be cut everywhere: all nodes inside it are nodes of the surface with columns, and so are the last `reserve` ones, in no tetrahedron.
BundleParts cut_box(const TinyBox& box, std::int32_t reserve);

// Through every node inside the body.
void add_whole_corridor(BundleParts& parts, const DenseBody& dense);

}  // namespace palpate::tests
