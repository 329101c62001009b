#include "precompute/solver/batch_multigrid.h"

#include <fmt/format.h>
#include <petscksp.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "formats/errors.h"
#include "precompute/solver/petsc_matrix.h"
#include "precompute/solver/petsc_session.h"
#include "precompute/solver/sparse_blocks.h"
#include "precompute/solver/vector_registers.h"

namespace palpate {
namespace {

// The Chebyshev polynomial of a smoother, as steps for smooth(): it damps the eigenvalues of D^-1 A from
// largest / ratio to largest (Saad, Iterative Methods for Sparse Linear Systems, algorithm 12.1).
std::vector<SmootherStep> chebyshev_steps(double largest, double ratio, int degree) {
  const double low = largest / ratio, centre = 0.5 * (largest + low), half = 0.5 * (largest - low);
  std::vector<SmootherStep> steps = {{0, static_cast<float>(1 / centre)}};
  double rho = half / centre;
  for (int k = 1; k < degree; ++k) {
    const double next = 1 / (2 * centre / half - rho);
    steps.push_back({static_cast<float>(next * rho), static_cast<float>(2 * next / half)});
    rho = next;
  }
  return steps;
}

struct Level {
  SparseBlocks a;
  std::vector<float> inverse_diagonal;
  std::vector<SmootherStep> steps;
  SparseBlocks prolong, restrict_;     // from and to the next coarser level; empty on the coarsest
  std::vector<float> b, x, x_next, d;  // [dofs][width]
  std::int64_t dofs() const { return static_cast<std::int64_t>(a.rows) * a.height; }
};

// A copy of a PETSc matrix times scale, in blocks of height x width; of 1 x 1 where these do not divide its size.
SparseBlocks blocks_of(Mat matrix, int height, int width, double scale) {
  PetscInt rows = 0, columns = 0;
  check(MatGetSize(matrix, &rows, &columns));
  if (rows % height != 0 || columns % width != 0) height = width = 1;
  SparseBlocks result{height, width, rows / height, columns / width, {}, {}, {}};
  result.first.assign(1, 0);
  std::vector<std::int64_t> place(static_cast<std::size_t>(result.columns), -1);
  std::vector<std::int32_t> found;
  for (std::int32_t row = 0; row < result.rows; ++row) {
    found.clear();
    for (int pass = 0; pass < 2; ++pass) {
      for (int i = 0; i < height; ++i) {
        PetscInt count = 0;
        const PetscInt* column = nullptr;
        const PetscScalar* value = nullptr;
        check(MatGetRow(matrix, row * height + i, &count, &column, &value));
        for (PetscInt k = 0; k < count; ++k) {
          auto& to = place[column[k] / width];
          if (pass == 0 && to < 0) to = 0, found.push_back(column[k] / width);
          if (pass == 1)
            result.value[(to * height + i) * width + column[k] % width] = static_cast<float>(scale * value[k]);
        }
        check(MatRestoreRow(matrix, row * height + i, &count, &column, &value));
      }
      if (pass == 1) break;
      std::sort(found.begin(), found.end());
      for (const auto c : found) {
        place[c] = static_cast<std::int64_t>(result.column.size());
        result.column.push_back(c);
      }
      result.value.resize(result.column.size() * static_cast<std::size_t>(height * width), 0.0f);
    }
    for (const auto c : found) place[c] = -1;
    result.first.push_back(static_cast<std::int64_t>(result.column.size()));
  }
  return result;
}

// An estimate from below of the largest eigenvalue of D^-1 A: twelve steps of Lanczos, written as conjugate gradients, from
// each of eight fixed pseudo-random starts.
double largest_eigenvalue(const SparseBlocks& a, const std::vector<float>& inverse_diagonal) {
  constexpr int kStarts = 8, kSteps = 12;
  const std::size_t size = static_cast<std::size_t>(a.rows) * a.height * kStarts;
  std::vector<float> r(size), z(size), p(size, 0.0f), ap(size), unused(size);
  std::uint32_t state = 12345;
  for (float& value : r) {
    state = state * 1664525u + 1013904223u;
    value = static_cast<float>(state >> 8) / 8388608.0f - 1.0f;
  }
  const auto dot = [&](const std::vector<float>& u, const std::vector<float>& v) {
    std::array<double, kStarts> sum{};
    for (std::size_t i = 0; i < size; i += kStarts)
      for (int c = 0; c < kStarts; ++c) sum[c] += static_cast<double>(u[i + c]) * v[i + c];
    return sum;
  };
  Eigen::MatrixXd lanczos[kStarts];
  for (auto& t : lanczos) t = Eigen::MatrixXd::Zero(kSteps, kSteps);
  std::array<double, kStarts> rz_before{}, alpha_before{};
  int steps = 0;
  for (; steps < kSteps; ++steps) {
    smooth_zero(a, inverse_diagonal, 1.0f, r.data(), unused.data(), z.data(), kStarts);
    const auto rz = dot(r, z);
    if (*std::min_element(rz.begin(), rz.end()) <= 1e-10 * std::max(rz_before[0], 1e-30))
      break;  // the Krylov space is exhausted
    std::array<float, kStarts> beta{}, alpha{};
    for (int c = 0; c < kStarts; ++c) beta[c] = steps ? static_cast<float>(rz[c] / rz_before[c]) : 0.0f;
    for (std::size_t i = 0; i < size; ++i) p[i] = z[i] + beta[i % kStarts] * p[i];
    multiply(a, p.data(), ap.data(), kStarts);
    const auto pap = dot(p, ap);
    if (*std::min_element(pap.begin(), pap.end()) <= 0) break;
    for (int c = 0; c < kStarts; ++c) {
      const double step = rz[c] / pap[c];
      alpha[c] = static_cast<float>(step);
      lanczos[c](steps, steps) = 1 / step + (steps ? beta[c] / alpha_before[c] : 0.0);
      if (steps)
        lanczos[c](steps, steps - 1) = lanczos[c](steps - 1, steps) =
            std::sqrt(static_cast<double>(beta[c])) / alpha_before[c];
      alpha_before[c] = step;
    }
    for (std::size_t i = 0; i < size; ++i) r[i] -= alpha[i % kStarts] * ap[i];
    rz_before = rz;
  }
  double largest = 0;
  for (const auto& t : lanczos)
    if (steps > 0)
      largest = std::max(
          largest, Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(t.topLeftCorner(steps, steps), Eigen::EigenvaluesOnly)
                       .eigenvalues()
                       .maxCoeff());
  return largest > 0 ? largest : 1;
}

constexpr double kDampedRatio = 10;  // largest over smallest eigenvalue that the smoother damps; 4 to 20 work as well

int polynomial_degree() {
  PetscInt degree = 2;  // 1 to 4 take the same time within a fifth
  check(PetscOptionsGetInt(nullptr, nullptr, "-column_multigrid_degree", &degree, nullptr));
  if (degree < 1 || degree > 16)
    throw InputError(fmt::format("-column_multigrid_degree: expected 1 to 16, found {}", degree));
  return degree;
}

// to = scale from; returns the largest |from|.
PALPATE_VECTOR_VERSIONS double to_f32(const double* from, double scale, float* to, std::size_t size) {
  double largest = 0;
  for (std::size_t i = 0; i < size; ++i) {
    to[i] = static_cast<float>(scale * from[i]);
    largest = std::abs(from[i]) > largest ? std::abs(from[i]) : largest;
  }
  return largest;
}

PALPATE_VECTOR_VERSIONS void to_f64(const float* from, double scale, double* to, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i) to[i] = scale * static_cast<double>(from[i]);
}

// A power of two near the mean of the diagonal: with it divided out, f32 holds K in whatever units and size.
double power_of_two_scale(const BlockMatrix& matrix) {
  double sum = 0;
  for (std::int32_t row = 0; row < matrix.rows; ++row)
    for (auto at = matrix.first[row]; at < matrix.first[row + 1]; ++at)
      if (matrix.column[at] == row) sum += matrix.block[at][0] + matrix.block[at][4] + matrix.block[at][8];
  return std::exp2(-std::round(std::log2(sum / (3.0 * matrix.rows))));
}

}  // namespace

struct BatchMultigrid::State {
  int width = 0, degree = 0;
  double scale = 1;           // by which K was multiplied
  std::vector<Level> levels;  // the finest first
  Eigen::LLT<Eigen::MatrixXf> coarsest;

  void build(const BlockMatrix& matrix, std::span<const std::array<double, 3>> coordinates);
  void take_levels(PC pc);
  void prepare();
  void cycle(std::size_t at);
  void smooth_from(std::size_t step, Level& level);
};

void BatchMultigrid::State::build(const BlockMatrix& matrix, std::span<const std::array<double, 3>> coordinates) {
  Mat scalar = create_petsc_matrix(matrix, true);
  PC pc = nullptr;
  try {
    set_rigid_near_nullspace(scalar, coordinates);
    check(PCCreate(PETSC_COMM_SELF, &pc));
    check(PCSetOptionsPrefix(pc, "column_multigrid_"));
    check(PCSetOperators(pc, scalar, scalar));
    check(PCSetType(pc, PCGAMG));
    check(PCSetFromOptions(pc));
    check(PCSetUp(pc));
    take_levels(pc);
  } catch (...) {
    PCDestroy(&pc);
    MatDestroy(&scalar);
    throw;
  }
  check(PCDestroy(&pc));
  check(MatDestroy(&scalar));
}

void BatchMultigrid::State::take_levels(PC pc) {
  PetscInt count = 0;
  check(PCMGGetLevels(pc, &count));
  levels.resize(static_cast<std::size_t>(count));
  for (PetscInt l = 0; l < count; ++l) {
    Level& level = levels[static_cast<std::size_t>(count - 1 - l)];  // PETSc's level 0 is the coarsest
    const int size = l == count - 1 ? 3 : 6;
    KSP smoother = nullptr;
    Mat a = nullptr, p = nullptr;
    check(PCMGGetSmoother(pc, l, &smoother));
    check(KSPGetOperators(smoother, &a, nullptr));
    level.a = blocks_of(a, size, size, scale);
    if (l == 0) continue;
    check(PCMGGetInterpolation(pc, l, &p));
    level.prolong = blocks_of(p, size, 6, 1.0);
    level.restrict_ = transposed(level.prolong);
  }
}

void BatchMultigrid::State::prepare() {
  for (Level& level : levels) {
    const std::size_t size = static_cast<std::size_t>(level.dofs()) * width;
    level.b.resize(size);
    level.x.resize(size);
    if (&level == &levels.back()) continue;
    level.x_next.resize(size);
    level.d.resize(size);
    level.inverse_diagonal = inverse_diagonal_blocks(level.a);
    // The estimate is a lower bound; the largest eigenvalue is at most a tenth above it.
    level.steps = chebyshev_steps(1.1 * largest_eigenvalue(level.a, level.inverse_diagonal), kDampedRatio, degree);
  }
  const SparseBlocks& a = levels.back().a;
  const auto n = static_cast<Eigen::Index>(levels.back().dofs());
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(n, n);
  for (std::int32_t row = 0; row < a.rows; ++row)
    for (auto at = a.first[row]; at < a.first[row + 1]; ++at)
      for (int i = 0; i < a.height; ++i)
        for (int j = 0; j < a.height; ++j)
          dense(row * a.height + i, a.column[at] * a.height + j) = a.value[(at * a.height + i) * a.height + j];
  dense = (0.5 * (dense + dense.transpose())).eval();
  // A coarse dof to which no fine dof contributes has a zero diagonal. In f32 an eigenvalue is wrong by up to 1e-7 of the
  // largest one, so the diagonal is raised by 1e-6 to keep the matrix positive definite.
  const double largest = dense.diagonal().maxCoeff();
  for (Eigen::Index i = 0; i < n; ++i) {
    if (dense(i, i) <= 0) dense(i, i) = largest;
    dense(i, i) *= 1 + 1e-6;
  }
  coarsest.compute(dense.cast<float>());
  if (coarsest.info() != Eigen::Success)
    throw OperationError("the multigrid's coarsest matrix is not positive definite; is the body held?");
}

// Performs the steps of the smoother's polynomial, from the given step to the last.
void BatchMultigrid::State::smooth_from(std::size_t step, Level& level) {
  for (; step < level.steps.size(); ++step) {
    smooth(level.a, level.inverse_diagonal, level.steps[step], level.b.data(), level.x.data(), level.d.data(),
           level.x_next.data(), width);
    level.x.swap(level.x_next);
  }
}

// x = M^-1 b on this level, where M^-1 is the V-cycle over this level and the coarser ones.
void BatchMultigrid::State::cycle(std::size_t at) {
  Level& level = levels[at];
  if (at + 1 == levels.size()) {
    using Block = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    Eigen::Map<Block> x(level.x.data(), level.dofs(), width);
    x = Eigen::Map<const Block>(level.b.data(), level.dofs(), width);
    coarsest.solveInPlace(x);
    return;
  }
  Level& coarser = levels[at + 1];
  smooth_zero(level.a, level.inverse_diagonal, level.steps[0].take, level.b.data(), level.d.data(), level.x.data(),
              width);
  smooth_from(1, level);
  residual(level.a, level.b.data(), level.x.data(), level.x_next.data(), width);
  multiply(level.restrict_, level.x_next.data(), coarser.b.data(), width);
  cycle(at + 1);
  multiply_add(level.prolong, coarser.x.data(), level.x.data(), width);
  smooth_from(0, level);
}

BatchMultigrid::BatchMultigrid(const BlockMatrix& matrix, std::span<const std::array<double, 3>> coordinates, int width)
    : state_(std::make_unique<State>()) {
  state_->width = width;
  state_->degree = polynomial_degree();
  state_->scale = power_of_two_scale(matrix);
  state_->build(matrix, coordinates);
  state_->prepare();
}

BatchMultigrid::~BatchMultigrid() = default;

void BatchMultigrid::apply(const double* r, double* z) {
  State& state = *state_;
  Level& finest = state.levels.front();
  const std::size_t size = finest.b.size();
  double scale = 1;
  const double largest = to_f32(r, scale, finest.b.data(), size);
  if (largest > 0 && (largest < 1e-20 || largest > 1e20)) {  // f32 would overflow, or lose small numbers
    scale = std::exp2(-std::clamp(std::ilogb(largest), -1000, 1000));
    to_f32(r, scale, finest.b.data(), size);
  }
  state.cycle(0);
  to_f64(finest.x.data(), state.scale / scale, z, size);
}

std::string BatchMultigrid::description() const {
  return fmt::format("multigrid ({} levels, Chebyshev {} in f32)", levels(), state_->degree);
}

std::int64_t BatchMultigrid::bytes() const {
  std::int64_t sum = static_cast<std::int64_t>(sizeof(float)) * state_->coarsest.matrixLLT().size();
  for (const Level& level : state_->levels)
    sum += level.a.bytes() + level.prolong.bytes() + level.restrict_.bytes() +
           static_cast<std::int64_t>(sizeof(float) * (level.inverse_diagonal.size() + level.b.size() + level.x.size() +
                                                      level.x_next.size() + level.d.size()));
  return sum;
}

int BatchMultigrid::levels() const {
  return static_cast<int>(state_->levels.size());
}

}  // namespace palpate
