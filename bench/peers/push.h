// The one problem that every system of peers_bench solves: a node of the organ's surface is moved, all others are free.
#pragma once

#include <Eigen/Dense>
#include <Eigen/SparseCore>
#include <cstdint>
#include <vector>

#include "precompute/elements/elastic_body.h"
#include "precompute/elements/linear_tetrahedra.h"

namespace palpate::bench {

// Quasi-static: at every tick the held dofs are zero, the pushed node has the tick's displacement (all three dofs) and
// no other node carries a force.
struct Push {
  ElasticBody body;
  BlockMatrix stiffness;                       // of body, nothing held
  std::int32_t node = 0;                       // the pushed one
  Eigen::Vector3d place;                       // on a triangle of the node's, m; a tool that enters here holds the node
  Eigen::Vector3d outward;                     // of that triangle
  std::vector<Eigen::Vector3d> displacements;  // per tick of 1 ms, m
};
constexpr double kTick = 1e-3;  // s

// From 2.5 to 5 mm deep at 10 mm/s while going round a circle of 1 mm radius twice a second. The node is the touchable
// one whose distance to the nearest held node is the median.
// Errors: InputError for an element that adds nodes to the mesh's.
Push make_push(ElasticBody body, Element element);

// What a system answers at one tick: the surface's displacement and the force that holds the node there.
struct Answer {
  Eigen::VectorXd surface;  // [3 Ns] m
  Eigen::Vector3d force;    // N, on the organ
};

// The exact answers, from a direct solve with the pushed node's dofs held as well (Dirichlet's problem itself, which no
// peer solves this way). Linear in the displacement, so three solves give every tick's.
class Exact {
 public:
  explicit Exact(const Push& push);
  Answer at(const Eigen::Vector3d& displacement) const;

 private:
  Eigen::MatrixX3d surface_;
  Eigen::Matrix3d force_;
};

// The stiffness on the rows of its free nodes.
using SparseMatrix = Eigen::SparseMatrix<double>;
SparseMatrix sparse(const BlockMatrix& matrix);

}  // namespace palpate::bench
