#include "precompute/bundle_tool/independent_solve.h"

#include <fmt/format.h>
#include <petscksp.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "formats/errors.h"
#include "precompute/elements/motion_loads.h"
#include "precompute/solver/petsc_matrix.h"
#include "precompute/solver/petsc_session.h"

namespace palpate {
namespace {

using Matrix3 = Eigen::Matrix3d;

// Solves one right-hand side at a time with PETSc's CG. The preconditioner is GAMG until a column does not converge with it
// (Poisson's ratio near 0.5, slivers), from then on a Cholesky factor by MUMPS. None of this is the precompute's own code.
class PetscSolver {
 public:
  PetscSolver(const HeldStiffness& held, std::span<const std::array<double, 3>> coordinates, double tolerance)
      : tolerance_(tolerance), matrix_(create_petsc_matrix(held.matrix, true)) {
    set_rigid_near_nullspace(matrix_, coordinates);
    check(MatNorm(matrix_, NORM_INFINITY, &norm_));
    check(MatCreateVecs(matrix_, &x_, &b_));
    check(VecDuplicate(b_, &r_));
    check(KSPCreate(PETSC_COMM_SELF, &ksp_));
    check(KSPSetOptionsPrefix(ksp_, "verify_"));
    check(KSPSetOperators(ksp_, matrix_, matrix_));
    check(KSPSetType(ksp_, KSPCG));
    check(KSPSetNormType(ksp_, KSP_NORM_UNPRECONDITIONED));
    check(KSPSetTolerances(ksp_, 0.5 * tolerance, 1e-300, PETSC_DEFAULT, kMostIterations));
    PC pc = nullptr;
    check(KSPGetPC(ksp_, &pc));
    check(PCSetType(pc, PCGAMG));
    // With GAMG's default smoother (sor) CG has diverged.
    set_default_petsc_option("-verify_mg_levels_pc_type", PCJACOBI);
    check(KSPSetFromOptions(ksp_));
    check(KSPSetUp(ksp_));
  }
  ~PetscSolver() {
    KSPDestroy(&ksp_);
    MatDestroy(&matrix_);
    for (Vec* v : {&b_, &x_, &r_}) VecDestroy(v);
  }
  PetscSolver(const PetscSolver&) = delete;
  PetscSolver& operator=(const PetscSolver&) = delete;

  // Solves K x = b to the tolerance or, as the precompute does, to what double precision allows. Returns the true relative
  // residual.
  double solve(const std::vector<double>& b, std::vector<double>& x) {
    copy(b, b_);
    PetscReal size = 0, left = 0;
    check(VecNorm(b_, NORM_2, &size));
    if (!factored_) {
      left = run_ksp(false);
      if (!(left <= tolerance_ * size)) factor();
    }
    if (factored_) left = solve_with_factor(size);
    const PetscScalar* values = nullptr;
    check(VecGetArrayRead(x_, &values));
    std::copy_n(values, x.size(), x.begin());
    check(VecRestoreArrayRead(x_, &values));
    return left / size;
  }

 private:
  static constexpr int kRuns = 6;                    // of CG with the factor, after the first
  static constexpr PetscInt kMostIterations = 1000;  // of a column with GAMG, before MUMPS takes over

  // Runs CG from x_, or from zero. Returns the true residual ||b - K x||.
  PetscReal run_ksp(bool from_x) {
    PetscReal left = 0;
    check(KSPSetInitialGuessNonzero(ksp_, from_x ? PETSC_TRUE : PETSC_FALSE));
    check(KSPSolve(ksp_, b_, x_));
    check(MatMult(matrix_, x_, r_));
    check(VecAYPX(r_, -1, b_));
    check(VecNorm(r_, NORM_2, &left));
    return left;
  }

  // Runs CG with the factor again and again, until the true residual meets the tolerance or is what rounding of x leaves.
  PetscReal solve_with_factor(PetscReal size) {
    for (int run = 0;; ++run) {
      const PetscReal left = run_ksp(run > 0);
      PetscReal length = 0;
      check(VecNorm(x_, NORM_2, &length));
      const PetscReal floor = std::numeric_limits<double>::epsilon() * norm_ * length;
      if (left <= tolerance_ * size || (run > 0 && left <= floor)) return left;
      if (run == kRuns || !std::isfinite(left))
        throw OperationError(fmt::format(
            "verify's own solver (PETSc's CG with GAMG, then MUMPS) left a relative residual of {:.2g} where {:.2g} is "
            "asked for; the columns cannot be checked in this way",
            left / size, tolerance_));
    }
  }

  void factor() {
    PC pc = nullptr;
    check(KSPGetPC(ksp_, &pc));
    check(PCSetType(pc, PCCHOLESKY));
    check(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
    check(KSPSetUp(ksp_));
    factored_ = true;
  }

  static void copy(const std::vector<double>& from, Vec to) {
    PetscScalar* values = nullptr;
    check(VecGetArrayWrite(to, &values));
    std::copy(from.begin(), from.end(), values);
    check(VecRestoreArrayWrite(to, &values));
  }

  double tolerance_;
  bool factored_ = false;
  PetscReal norm_ = 0;  // largest row sum of |K|
  Mat matrix_ = nullptr;
  KSP ksp_ = nullptr;
  Vec b_ = nullptr, x_ = nullptr, r_ = nullptr;
};

// The nodes through which a vertex is touched, with their weights: the node itself or, with quadratic elements, several.
std::vector<std::pair<std::int32_t, double>> functional_of(const Discretisation& d, std::int32_t vertex) {
  if (d.touch.weight.empty()) return {{vertex, 1.0}};
  std::vector<std::pair<std::int32_t, double>> sum;
  for (auto at = d.touch.nodes.first[vertex]; at < d.touch.nodes.first[vertex + 1]; ++at)
    sum.emplace_back(d.touch.nodes.item[at], d.touch.weight[at]);
  return sum;
}

// The compliance column of a unit force on dof j of the vertex: the displacement of every vertex.
std::vector<double> column(const Discretisation& d, const HeldStiffness& held, PetscSolver& solver, std::int32_t vertex,
                           int j, double* residual) {
  std::vector<double> b(3 * static_cast<std::size_t>(held.matrix.rows), 0.0), x(b.size());
  for (const auto& [node, weight] : functional_of(d, vertex))
    if (!d.fixed[node][j])
      b[3 * static_cast<std::size_t>(held.row_of_node[node]) + static_cast<std::size_t>(j)] += weight;
  *residual = std::max(*residual, solver.solve(b, x));
  std::vector<double> result(3 * static_cast<std::size_t>(d.vertices), 0.0);
  for (std::int32_t v = 0; v < d.vertices; ++v)
    for (const auto& [node, weight] : functional_of(d, v))
      for (std::size_t i = 0; i < 3; ++i)
        if (held.row_of_node[node] >= 0 && !d.fixed[v][i])
          result[3 * static_cast<std::size_t>(v) + i] +=
              weight * x[3 * static_cast<std::size_t>(held.row_of_node[node]) + i];
  return result;
}

NodeTensor tensor_of(const Discretisation& d, const HeldStiffness& held, PetscSolver& solver, std::int32_t vertex) {
  NodeTensor tensor{vertex, {}, {}, 0};
  std::vector<int> free;
  std::vector<std::vector<double>> columns;
  for (int j = 0; j < 3; ++j)
    if (!d.fixed[vertex][j]) {
      free.push_back(j);
      columns.push_back(column(d, held, solver, vertex, j, &tensor.residual));
    }
  const auto n = static_cast<Eigen::Index>(free.size());
  Eigen::MatrixXd own(n, n);  // C_kk on the free dofs
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j) own(i, j) = columns[j][3 * static_cast<std::size_t>(vertex) + free[i]];
  const Eigen::MatrixXd force = own.fullPivLu().inverse();
  const std::size_t run = 3 * static_cast<std::size_t>(d.vertices);
  tensor.displacement.assign(3 * run, 0.0);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j) {
      tensor.stiffness[static_cast<std::size_t>(3 * free[i] + free[j])] = force(i, j);
      for (std::size_t at = 0; at < run; ++at)
        tensor.displacement[static_cast<std::size_t>(free[j]) * run + at] += columns[i][at] * force(i, j);
    }
  return tensor;
}

}  // namespace

std::vector<std::vector<double>> solve_motions_independently(const ElasticBody& body, Element element,
                                                             double tolerance) {
  const Discretisation d = discretise(body, element);
  const HeldStiffness held = remove_held_dofs(d.stiffness, d.fixed);
  PetscSolver solver(held, row_coordinates(d, held), tolerance);
  std::vector<std::vector<double>> result;
  for (const MotionLoad& load : motion_loads(body, d)) {
    std::vector<double> b(3 * static_cast<std::size_t>(held.matrix.rows)), x(b.size());
    for (std::size_t i = 0; i < b.size(); ++i)
      b[i] = load.force[3 * static_cast<std::size_t>(held.node_of_row[i / 3]) + i % 3];
    if (std::any_of(b.begin(), b.end(), [](double f) { return f != 0; })) solver.solve(b, x);
    std::vector<double> u(3 * static_cast<std::size_t>(d.vertices), 0.0);
    for (std::int32_t v = 0; v < d.vertices; ++v)
      for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t at = 3 * static_cast<std::size_t>(v) + i;
        if (d.fixed[v][i]) {
          u[at] = load.imposed.empty() ? 0 : load.imposed[at];
          continue;
        }
        for (const auto& [node, weight] : functional_of(d, v)) {
          const std::size_t dof = 3 * static_cast<std::size_t>(node) + i;
          const double moved = d.fixed[node][i] || held.row_of_node[node] < 0
                                   ? (load.imposed.empty() ? 0 : load.imposed[dof])
                                   : x[3 * static_cast<std::size_t>(held.row_of_node[node]) + i];
          u[at] += weight * moved;
        }
      }
    result.push_back(std::move(u));
  }
  return result;
}

std::vector<std::vector<double>> solve_columns_independently(const ElasticBody& body, Element element,
                                                             std::span<const std::int32_t> nodes, double tolerance) {
  const Discretisation d = discretise(body, element);
  const HeldStiffness held = remove_held_dofs(d.stiffness, d.fixed);
  PetscSolver solver(held, row_coordinates(d, held), tolerance);
  std::vector<std::vector<double>> result;
  double residual = 0;
  for (const auto node : nodes)
    for (int j = 0; j < 3; ++j)
      result.push_back(d.fixed[node][j] ? std::vector<double>(3 * static_cast<std::size_t>(d.vertices), 0.0)
                                        : column(d, held, solver, node, j, &residual));
  return result;
}

std::vector<NodeTensor> solve_independently(const ElasticBody& body, Element element,
                                            std::span<const std::int32_t> nodes, double tolerance) {
  const Discretisation discretisation = discretise(body, element);
  const HeldStiffness held = remove_held_dofs(discretisation.stiffness, discretisation.fixed);
  PetscSolver solver(held, row_coordinates(discretisation, held), tolerance);
  std::vector<NodeTensor> result;
  for (const auto node : nodes) result.push_back(tensor_of(discretisation, held, solver, node));
  return result;
}

}  // namespace palpate
