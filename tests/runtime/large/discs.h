// Discs that hold a body of the tests of large deformation, and its solver.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <Eigen/Sparse>

#include "runtime/large/large_solver.h"
#include "studies/bodies/bodies.h"
#include "studies/hyperelastic/large_body.h"

namespace palpate::tests {

// An order of elimination: Eigen's, of the graph of nodes.
std::vector<std::int32_t> elimination_order(const HyperelasticBody& body);

// Discs whose mean displacement is held in three directions.
struct Discs {
  std::vector<LargeRow> rows;
  std::vector<std::int32_t> nodes;
  std::vector<double> weights;

  void add(const HyperelasticBody& body, const Eigen::Vector3d& centre, double radius, double compliance = 0);
  void set(std::size_t disc, const Eigen::Vector3d& target);
  LargeContacts contacts() const;
  Eigen::MatrixXd dense(Eigen::Index dofs) const;
  Eigen::VectorXd targets() const;
};

class Solved {
 public:
  explicit Solved(const HyperelasticBody& body, bool renews = false, bool roughly = false);
  ~Solved() { memory_.release_all(); }
  Eigen::VectorXd force;
  LargeOutcome step(const Discs& discs, int steps = LargeSolver::kMostSteps);
  Eigen::VectorXd field() const;
  LargeSolver solver;

 private:
  HyperelasticBody body_;
  SceneMemory memory_;
};

ElasticBody block(double poisson);
ElasticBody beam();

}  // namespace palpate::tests
