// The whole organ with a direct factor of its stiffness: displacements of all vertices under any forces and motions, in double precision.
#pragma once

#include <memory>
#include <vector>

#include "precompute/elements/discretisation.h"
#include "studies/coupled/coupled_rows.h"
#include "studies/peers/cholmod_factor.h"
#include "studies/peers/push.h"

namespace palpate::scenes {

class FullBody {
 public:
  FullBody(ElasticBody body, Element element);

  const ElasticBody& body() const { return body_; }
  Eigen::Vector3d vertex(std::int32_t v) const {
    return Eigen::Vector3d(body_.nodes[static_cast<std::size_t>(v)].data());
  }
  // As solve_coupled takes it; moved: from moved_by, or empty.
  studies::CoupledBody coupled(Eigen::VectorXd moved = {}) const;

  // [3 vertices] m, by amounts of all motions of the body, nothing else acting.
  Eigen::VectorXd moved_by(const std::vector<double>& amounts) const;
  // m^3, that the surface of a pressure sweeps under displacements of linear elements. Meaningless for quadratic ones.
  double swept(std::size_t motion, const Eigen::VectorXd& u) const;
  bool is_linear() const { return static_cast<std::size_t>(discretisation_.vertices) == discretisation_.fixed.size(); }

 private:
  Eigen::MatrixXd under(const Eigen::MatrixXd& vertex_forces) const;
  // The free dofs of vectors over all nodes of the discretisation, and back.
  Eigen::MatrixXd solved(const Eigen::MatrixXd& node_forces) const;
  Eigen::VectorXd vertices_of(const Eigen::VectorXd& nodes) const;

  ElasticBody body_;
  Discretisation discretisation_;
  studies::SparseMatrix free_;  // [free dofs][dofs of all nodes]
  std::unique_ptr<studies::CholmodFactor> factor_;
};

}  // namespace palpate::scenes
