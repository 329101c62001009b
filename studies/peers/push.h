// The problem that every system solves: a tool moves one node of the organ's surface; no force acts on the other nodes.
#pragma once

#include <Eigen/Dense>
#include <Eigen/SparseCore>
#include <cstdint>
#include <vector>

#include "precompute/elements/elastic_body.h"
#include "precompute/elements/linear_tetrahedra.h"

namespace palpate::studies {

// Quasi-static. At every tick the held dofs are zero, the pushed node has the tick's displacement in all three dofs, and no
// force acts on any other node.
struct Push {
  ElasticBody body;
  BlockMatrix stiffness;                       // of body, nothing held
  std::int32_t node = 0;                       // the pushed one
  Eigen::Vector3d entry;                       // m; a tool that enters the surface here takes hold of the node
  Eigen::Vector3d outward;                     // unit normal of the triangle that contains entry
  std::vector<Eigen::Vector3d> displacements;  // per tick of 1 ms, m
};
constexpr double kTick = 1e-3;  // s

// The depth grows from 2.5 to 5 mm at 10 mm/s; at the same time the node goes round a circle of 1 mm radius twice a second.
// The pushed node is the touchable node with the median distance to the nearest held node.
// Errors: InputError if the element adds nodes to those of the mesh.
Push make_push(ElasticBody body, Element element);

// A system's answer at one tick: the surface's displacement and the force that holds the node at its displacement.
struct Answer {
  Eigen::VectorXd surface;  // [3 Ns] m
  Eigen::Vector3d force;    // N, on the organ
};

// The exact answers: a direct solve in which the pushed node's dofs are held as well. No compared system solves the problem
// in this way. The answer is linear in the displacement, so three solves give the answers of all ticks.
class Exact {
 public:
  explicit Exact(const Push& push);
  Answer at(const Eigen::Vector3d& displacement) const;

 private:
  Eigen::MatrixX3d surface_;
  Eigen::Matrix3d force_;
};

// The matrix in Eigen's form, zeros left out.
using SparseMatrix = Eigen::SparseMatrix<double>;
SparseMatrix sparse(const BlockMatrix& matrix);

}  // namespace palpate::studies
