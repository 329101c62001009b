// The reference for large deformation: Newton's method with a line search on the whole mesh in double precision, with the tangent of
// the laws and a sparse direct solver. It meets its constraints exactly and stops where the residual force vanishes. The energy is
// the runtime's own (element_lanes.h), in double precision.
#pragma once

#include <Eigen/Dense>
#include <Eigen/Sparse>
#include <memory>
#include <vector>

#include "runtime/base/scene_memory.h"
#include "runtime/large/element_lanes.h"

namespace palpate {

// The work of a solution, processor time of all threads.
struct NewtonWork {
  int steps = 0;
  double assembly_seconds = 0, factor_seconds = 0, solve_seconds = 0;  // tangent; numerical factor; back-substitutions
};

class LargeReference {
 public:
  using Sparse = Eigen::SparseMatrix<double>;

  // A factor of a tangent that several references share, whose meshes and held dofs are the same. A solution goes on with the factor that the
  // last one left, of any of them, and factors its own tangent only where a step divides the residual force by too little.
  struct Factor;
  static std::shared_ptr<Factor> shared_factor();

  // body is kept. Without a shared factor each step of Newton's method factors its own tangent. Errors: std::runtime_error where memory ends.
  explicit LargeReference(const HyperelasticBody& body, const std::shared_ptr<Factor>& shared = nullptr);
  ~LargeReference();
  LargeReference(const LargeReference&) = delete;
  LargeReference& operator=(const LargeReference&) = delete;

  Eigen::Index dofs() const { return 3 * static_cast<Eigen::Index>(body_.node_count); }

  // J. force: dE/du, N. Infinite where a tetrahedron is nearly flat or inverted.
  double energy(const Eigen::VectorXd& u, Eigen::VectorXd* force, double* least_volume = nullptr) const;

  // d force / du over all dofs, nothing held.
  Sparse tangent(const Eigen::VectorXd& u) const;

  // Least energy with rows u + compliance lambda = target, from u on. rows: [rows][dofs]; compliance: [rows][rows] m/N, none where
  // it is empty. Held dofs keep their values in u. tolerance: of the residual force, against the inner force of all dofs, held
  // ones too. Returns lambda, the
  // force of each row on the body, N. load: [dofs] N, which does not turn with the body; empty: none. Errors: std::runtime_error where it does not converge.
  Eigen::VectorXd solve(const Eigen::MatrixXd& rows, const Eigen::VectorXd& target, Eigen::VectorXd* u,
                        double tolerance = 1e-9, const Eigen::MatrixXd& compliance = {}, NewtonWork* work = nullptr,
                        const Eigen::VectorXd& load = {}) const;
  // The same without rows.
  void balance(const Eigen::VectorXd& load, Eigen::VectorXd* u, double tolerance = 1e-9) const;

 private:
  struct Problem;
  Eigen::VectorXd newton(const Problem& problem, Eigen::VectorXd* u, NewtonWork* work) const;
  void factor_definite(const Sparse& k, NewtonWork* work) const;
  void analyse(const Sparse& pattern) const;
  Eigen::MatrixXd stiffness_of_rows(const Eigen::MatrixXd& w, const Eigen::MatrixXd& compliance) const;
  Eigen::Index node(std::size_t e, int a) const { return body_.tetrahedra[4 * e + static_cast<std::size_t>(a)]; }
  std::size_t site(std::size_t e, int a) const {
    return static_cast<std::size_t>(sites_.of_corner[4 * e + static_cast<std::size_t>(a)]);
  }
  Sparse support_matrix() const;
  const Sparse& of_free_dofs(const Sparse& k) const;
  Sparse averaged_tangent(const std::vector<Deformation<double>>& d, const std::vector<double>& volume,
                          const std::vector<Eigen::Matrix<double, 4, 3>>& gradient) const;

  HyperelasticBody body_;
  mutable SceneMemory memory_;
  ElementLanes<double> elements_;
  DilatationSites sites_;
  std::vector<std::int32_t> place_;
  Sparse free_;      // [dofs that are not held][dofs]: takes them out of all, and its transpose puts them back
  Sparse supports_;  // the part of foundations and springs
  Sparse rest_;      // the tangent at rest: what an indefinite one is shifted by
  // What of_free_dofs() takes of a tangent: the tangents of a body have one pattern.
  struct Taken {
    Sparse pattern, result;
    std::vector<Eigen::Index> from;  // [number of the result] the tangent's
  };
  mutable Taken taken_;
  std::shared_ptr<Factor> factor_;
  bool shares_ = false;
};

}  // namespace palpate
