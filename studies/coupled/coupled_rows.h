// Rows that hold or press elastic bodies, solved together with the whole of these bodies in double precision: what the runtime's answers are
// compared with, by the study of scenes and by the tests.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numbers>
#include <stdexcept>
#include <vector>

namespace palpate::studies {

// A body: what forces on its nodes ([dofs][columns] N) move all its nodes by ([dofs][columns] m), and where supports and loads have moved
// it without them ([dofs] m, or empty: nowhere).
struct CoupledBody {
  std::function<Eigen::MatrixXd(const Eigen::MatrixXd&)> under;
  Eigen::Index dofs = 0;
  Eigen::VectorXd moved = {};
};

// One equation: the sum of weight times displacement is target less softness times the row's force.
struct Row {
  struct Term {
    std::size_t body;
    Eigen::Index dof;
    double weight;
  };
  std::vector<Term> terms;
  double target = 0;         // m
  double softness = 0;       // m/N
  bool only_pushes = false;  // the force is 0 or more; where it is 0, the sum may be larger than the target

  void add(std::size_t body, std::int32_t node, const Eigen::Vector3d& weight);
};

struct CoupledAnswer {
  Eigen::VectorXd force;           // N, of each row
  std::vector<Eigen::VectorXd> u;  // m, of each body
};

// Forces r with c r = d; of rows that only push r >= 0 and, where r = 0, c r >= d. Single rows join and leave until all hold.
Eigen::VectorXd solve_rows(const Eigen::MatrixXd& c, const Eigen::VectorXd& d, const std::vector<bool>& only_pushes);

CoupledAnswer solve_coupled(const std::vector<Row>& rows, const std::vector<CoupledBody>& bodies);

// ---- a needle ----------------------------------------------------------------------------------------------------------

// A place inside a tetrahedron.
struct PlaceInside {
  std::array<std::int32_t, 4> node{};
  Eigen::Vector4d weight = Eigen::Vector4d::Zero();
  double edge = 0;  // m, the mean of the tetrahedron's
  std::size_t tetrahedron = 0;
};

// Of all tetrahedra the one that x is farthest inside of. nodes, tetrahedra: as of a mesh.
template <class Nodes, class Tetrahedra>
PlaceInside place_inside(const Nodes& nodes, const Tetrahedra& tetrahedra, const Eigen::Vector3d& x) {
  PlaceInside best;
  double most = -1e300;
  for (std::size_t e = 0; e < tetrahedra.size(); ++e) {
    Eigen::Matrix4d corners = Eigen::Matrix4d::Ones();
    for (int c = 0; c < 4; ++c)
      corners.block<3, 1>(0, c) = Eigen::Vector3d(nodes[static_cast<std::size_t>(tetrahedra[e][c])].data());
    const Eigen::Vector4d k = corners.partialPivLu().solve(Eigen::Vector4d(x[0], x[1], x[2], 1));
    if (!(k.minCoeff() > most)) continue;
    most = k.minCoeff();
    best = {{tetrahedra[e][0], tetrahedra[e][1], tetrahedra[e][2], tetrahedra[e][3]}, k, 0, e};
    for (int a = 0; a < 4; ++a)
      for (int b = a + 1; b < 4; ++b) best.edge += (corners.block<3, 1>(0, a) - corners.block<3, 1>(0, b)).norm() / 6;
  }
  return best;
}

// What the tissue gives way by around a thin shaft that the mesh does not resolve, for a piece of the length (docs/method.md, section 21): the
// logarithm, and m/N across the shaft and along it.
double unresolved_by_mesh(double edge, double radius);
double softness_across_shaft(double young, double poisson, double edge, double radius, double length);
double softness_along_shaft(double young, double poisson, double edge, double radius, double length);

}  // namespace palpate::studies
