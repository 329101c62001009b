// Processor time of everything that a column takes, measured in turns in one run: PETSc's KSPSolve as the program calls it,
// the factor alone, and CHOLMOD on batches of 64 dense columns.
//   precompute_bench MESH.msh organ.toml boundary.toml [p1|p1-anp|p1-anp-k] [batches to sample; all]
// p1-anp factors the pressure form, as the program does; p1-anp-k factors K itself.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "precompute/elements/column_buffer.h"
#include "precompute/elements/discretisation.h"
#include "precompute/solver/batch_product.h"
#include "precompute/solver/cholmod_session.h"
#include "precompute/solver/column_solver.h"
#include "precompute/solver/petsc_session.h"
#include "precompute/solver/supernodal_factor.h"
#include "precompute/tensors/displacement_rows.h"
#include "studies/timing/timing.h"

namespace palpate {
namespace {

using studies::processor_seconds;

constexpr int kWidth = 96, kReferenceWidth = 64;

// A body's held stiffness, what is factored, and the block rows of its touchable vertices.
struct Problem {
  ElasticBody body;
  HeldStiffness held;
  std::shared_ptr<PressureForm> form;  // null: K is factored
  std::vector<std::int32_t> column_rows;

  Problem(ElasticBody b, const std::string& name) : body(std::move(b)) {
    const Discretisation discretisation = discretise(body, name == "p1" ? Element::p1 : Element::p1_anp);
    held = remove_held_dofs(discretisation.stiffness, discretisation.fixed);
    if (name == "p1-anp") form = std::make_shared<PressureForm>(pressure_form(body, held));
    for (const auto node : body.touchable) column_rows.push_back(held.row_of_node[node]);
  }
  std::int64_t dofs() const { return 3 * static_cast<std::int64_t>(held.matrix.rows); }
  Elimination analyse() const { return form ? analyse_elimination(*form) : analyse_elimination(held.matrix); }
  std::unique_ptr<BatchPreconditioner> factor(std::shared_ptr<const Elimination> elimination) const {
    if (form) return std::make_unique<PressureFactor>(*form, std::move(elimination), kWidth);
    return std::make_unique<SupernodalFactor>(held.matrix, std::move(elimination), kWidth);
  }
};

// The reference, what a user would write: METIS on the dofs, supernodal factor, cholmod_l_solve2.
class Reference {
 public:
  explicit Reference(const BlockMatrix& k) : n_(3 * static_cast<std::size_t>(k.rows)) {
    session_.common.nmethods = 1;
    session_.common.method[0].ordering = CHOLMOD_METIS;
    session_.common.supernodal = CHOLMOD_SUPERNODAL;
    session_.sparse = cholmod_l_allocate_sparse(n_, n_, (9 * k.column.size() + n_) / 2, true, true, 1, CHOLMOD_REAL,
                                                &session_.common);
    fill(k);
    const double begun = processor_seconds();
    session_.factor = cholmod_l_analyze(session_.sparse, &session_.common);
    const double ordered = processor_seconds();
    cholmod_l_factorize(session_.sparse, session_.factor, &session_.common);
    order_seconds = ordered - begun, factor_seconds = processor_seconds() - ordered;
    numbers = session_.common.lnz;
    b_ = cholmod_l_zeros(n_, kReferenceWidth, CHOLMOD_REAL, &session_.common);
  }
  ~Reference() {
    for (auto* dense : {&b_, &x_, &y_, &e_}) cholmod_l_free_dense(dense, &session_.common);
  }

  // Seconds to solve some columns of unit forces; filling the right-hand side is not counted.
  double solve(const std::vector<std::int64_t>& dofs) {
    auto* values = static_cast<double*>(b_->x);
    std::fill_n(values, n_ * kReferenceWidth, 0.0);
    for (std::size_t c = 0; c < kReferenceWidth; ++c)
      values[c * n_ + static_cast<std::size_t>(dofs[c % dofs.size()])] = 1;
    const double begun = processor_seconds();
    cholmod_l_solve2(CHOLMOD_A, session_.factor, b_, nullptr, &x_, nullptr, &y_, &e_, &session_.common);
    return processor_seconds() - begun;
  }

  double order_seconds = 0, factor_seconds = 0, numbers = 0;

 private:
  void fill(const BlockMatrix& k) {  // the upper triangle
    auto* first = static_cast<SuiteSparse_long*>(session_.sparse->p);
    auto* row = static_cast<SuiteSparse_long*>(session_.sparse->i);
    auto* value = static_cast<double*>(session_.sparse->x);
    SuiteSparse_long count = 0;
    for (std::int32_t j = 0; j < k.rows; ++j)
      for (int c = 0; c < 3; ++c) {
        first[3 * j + c] = count;
        for (auto at = k.first[j]; at < k.first[j + 1]; ++at)
          for (int r = 0; r < 3; ++r)
            if (3 * k.column[at] + r <= 3 * j + c) {
              row[count] = 3 * static_cast<SuiteSparse_long>(k.column[at]) + r;
              value[count++] = k.block[at][3 * c + r];
            }
      }
    first[n_] = count;
  }

  CholmodSession session_;
  std::size_t n_;
  cholmod_dense *b_ = nullptr, *x_ = nullptr, *y_ = nullptr, *e_ = nullptr;
};

// The unit forces that palpate-precompute would solve together: neighbours in the elimination order.
std::vector<std::vector<std::int32_t>> batches_of(const Problem& problem, const Elimination& elimination) {
  std::vector<std::int32_t> rows = problem.column_rows;
  std::sort(rows.begin(), rows.end(), [&](auto a, auto b) { return elimination.place[a] < elimination.place[b]; });
  std::vector<std::vector<std::int32_t>> batches;
  for (std::size_t at = 0; at < rows.size(); at += kWidth / 3)
    batches.emplace_back(rows.begin() + static_cast<std::ptrdiff_t>(at),
                         rows.begin() + static_cast<std::ptrdiff_t>(std::min(at + kWidth / 3, rows.size())));
  return batches;
}

// Seconds, and the number of columns that they were spent on.
struct Shares {
  double solve = 0, certify = 0, rows = 0, write = 0, columns = 0, worst_residual = 0;
  double all() const { return solve + certify + rows + write; }
};

std::vector<Load> unit_loads(const std::vector<std::int32_t>& nodes) {
  std::vector<Load> loads;
  for (std::size_t i = 0; i < nodes.size(); ++i)
    for (int j = 0; j < 3; ++j)
      loads.push_back({3 * static_cast<std::int64_t>(nodes[i]) + j, static_cast<std::int32_t>(3 * i) + j, 1.0});
  std::sort(loads.begin(), loads.end(), [](const Load& a, const Load& b) { return a.dof < b.dof; });
  return loads;
}

// Solves a batch with the factor, measures its residuals, turns it into rows of T^u and writes them, as the program does.
class Ours {
 public:
  Ours(const Problem& problem, BatchPreconditioner& factor)
      : problem_(problem), factor_(factor), x_(make_column_buffer(problem.dofs(), kWidth)), file_(std::tmpfile()) {
    const auto stored = static_cast<std::size_t>(problem.body.surface_count);
    for (std::size_t v = 0; v < stored; ++v) vertex_rows_.push_back(problem.held.row_of_node[v]);
    rows_.resize(3 * stored * kWidth);
  }
  ~Ours() { std::fclose(file_); }

  // Of the last batch that ksp() solved.
  int most_iterations = 0;
  double worst_residual = 0;

  // Seconds of a batch through KSPSolve: solution and certificate.
  double ksp(ColumnSolver& solver, const std::vector<std::int32_t>& nodes) {
    const std::vector<Load> loads = unit_loads(nodes);
    std::vector<ColumnReport> reports(kWidth);
    const double begun = processor_seconds();
    solver.solve(loads, x_.get(), reports);
    const double taken = processor_seconds() - begun;
    most_iterations = 0, worst_residual = 0;
    for (const auto& report : reports) {
      most_iterations = std::max(most_iterations, report.iterations);
      worst_residual = std::max(worst_residual, report.residual);
    }
    return taken;
  }

  void batch(const std::vector<std::int32_t>& nodes, Shares& shares) {
    const std::vector<Load> loads = unit_loads(nodes);
    const double begun = processor_seconds();
    factor_.apply_to_loads(loads, x_.get());
    const double solved = processor_seconds();
    const auto norms = residual_norms(problem_.held.matrix, loads, x_.get(), kWidth);
    const double certified = processor_seconds();
    std::vector<std::array<double, 9>> force(nodes.size(), {1, 2, 3, 4, 5, 6, 7, 8, 9});  // any numbers take as long
    CastLoss loss;
    displacement_rows(x_.get(), kWidth, vertex_rows_, force, rows_.data(), &loss);
    const double converted = processor_seconds();
    const std::size_t bytes = 9 * nodes.size() * vertex_rows_.size() * sizeof(float);
    if (pwrite(fileno(file_), rows_.data(), bytes, 0) != static_cast<ssize_t>(bytes)) throw std::bad_alloc();
    shares.write += processor_seconds() - converted;
    shares.rows += converted - certified, shares.certify += certified - solved, shares.solve += solved - begun;
    shares.columns += 3.0 * static_cast<double>(nodes.size());
    shares.worst_residual = std::max(shares.worst_residual, *std::max_element(norms.begin(), norms.end()));
  }

 private:
  const Problem& problem_;
  BatchPreconditioner& factor_;
  ColumnBuffer x_;
  std::FILE* file_;
  std::vector<std::int32_t> vertex_rows_;
  std::vector<float> rows_;
};

// KSPSolve with the factor in single precision, on the same batches. in_double: ms a column with the other factor.
void compare_single(const Problem& problem, const std::shared_ptr<const Elimination>& elimination,
                    const std::vector<std::vector<std::int32_t>>& batches, std::size_t sampled, Ours& ours,
                    double in_double) {
  double begun = processor_seconds();
  ColumnSolver solver(problem.held.matrix, {},
                      {.width = kWidth, .single = true, .form = problem.form, .elimination = elimination});
  const double set_up = processor_seconds() - begun;
  ours.ksp(solver, batches[0]);
  double seconds = 0, columns = 0;
  for (std::size_t i = 0; i < sampled; ++i) {
    const auto& batch = batches[i * batches.size() / sampled];
    seconds += ours.ksp(solver, batch);
    columns += 3.0 * static_cast<double>(batch.size());
  }
  fmt::print(
      "in single precision: factor {:.3f} s, KSPSolve {:.3f} ms a column, {:.2f} of double's; {} iterations, {:.2g}\n",
      set_up, 1e3 * seconds / columns, 1e3 * seconds / columns / in_double, ours.most_iterations, ours.worst_residual);
}

void compare(Problem problem, const char* element, std::size_t most_batches) {
  auto reference = std::make_unique<Reference>(problem.held.matrix);
  double begun = processor_seconds();
  std::shared_ptr<const Elimination> elimination = std::make_shared<const Elimination>(problem.analyse());
  const double order_seconds = processor_seconds() - begun;
  const auto batches_before = batches_of(problem, *elimination);
  const auto old_place = elimination->place;
  const double numbers = static_cast<double>(elimination->numbers());
  elimination = put_in_order(problem.held, *elimination, problem.form.get());
  for (auto& row : problem.column_rows) row = old_place[row];
  begun = processor_seconds();
  const auto factor = problem.factor(elimination);
  const double factor_seconds = processor_seconds() - begun;

  ColumnSolver solver(problem.held.matrix, {}, {.width = kWidth, .form = problem.form, .elimination = elimination});
  Ours ours(problem, *factor);
  const auto batches = batches_of(problem, *elimination);
  const std::size_t sampled = std::min(most_batches, batches.size());
  Shares shares, warm_up;
  ours.batch(batches[0], warm_up);
  ours.ksp(solver, batches[0]);
  double ksp_seconds = 0;
  double reference_seconds = 0, reference_columns = 0;
  for (std::size_t i = 0; i < sampled; ++i) {
    const std::size_t b = i * batches.size() / sampled;
    if (i % 2 == 0) ksp_seconds += ours.ksp(solver, batches[b]);
    ours.batch(batches[b], shares);
    if (i % 2 == 1) ksp_seconds += ours.ksp(solver, batches[b]);
    std::vector<std::int64_t> dofs;
    for (const auto row : batches_before[b])
      for (int j = 0; j < 3; ++j) dofs.push_back(3 * static_cast<std::int64_t>(row) + j);
    if (i == 0) reference->solve(dofs);
    reference_seconds += reference->solve(dofs);
    reference_columns += kReferenceWidth;
  }
  const double columns = 3.0 * static_cast<double>(problem.column_rows.size());
  const double ms = 1e3 / shares.columns, reference_ms = 1e3 * reference_seconds / reference_columns;
  fmt::print("{} vertices, {} stored, {}, {} columns, {} of {} batches of {} sampled\n", problem.body.nodes.size(),
             problem.body.surface_count, element, columns, sampled, batches.size(), kWidth);
  const auto line = [](const char* what, double mine, double theirs) {
    fmt::print("{:34} {:10.3f} {:10.3f} {:8.2f}\n", what, mine, theirs, mine / theirs);
  };
  fmt::print("{:34} {:>10} {:>10} {:>8}\n", "processor time", "ours", "CHOLMOD", "ratio");
  line("order, s", order_seconds, reference->order_seconds);
  line("factor, s", factor_seconds, reference->factor_seconds);
  line("numbers of the factor, 1e6", 1e-6 * numbers, 1e-6 * reference->numbers);
  line("solve, ms a column", shares.solve * ms, reference_ms);
  fmt::print("{:34} {:10.3f}   {:.0f} % of our solve\n", "product and certificate, ms", shares.certify * ms,
             100 * shares.certify / shares.solve);
  fmt::print("{:34} {:10.3f}\n{:34} {:10.3f}\n", "rows of T^u and their error, ms", shares.rows * ms, "write, ms",
             shares.write * ms);
  line("column certified and written, ms", shares.all() * ms, reference_ms);
  fmt::print("{:34} {:>10} {:>10} {:>8}\n", "", "KSPSolve", "factor", "ratio");
  const double direct = shares.solve + shares.certify, rest = shares.rows + shares.write;
  line("solve and certificate, ms a column", ksp_seconds * ms, direct * ms);
  line("column certified and written, ms", (ksp_seconds + rest) * ms, (direct + rest) * ms);
  fmt::print("{:34} {:>10} {:>10} {:>8}\n", "", "ours", "CHOLMOD", "ratio");
  line("all columns against its solve, s", 1e-3 * shares.all() * ms * columns, 1e-3 * reference_ms * columns);
  fmt::print("largest residual of a unit force {:.2g}\n", shares.worst_residual);
  reference.reset();
  compare_single(problem, elimination, batches, sampled, ours, ksp_seconds * ms);
}

}  // namespace
}  // namespace palpate

int main(int count, char** arguments) {
  using namespace palpate;
  if (count < 4) {
    fmt::print(stderr, "usage: precompute_bench MESH.msh organ.toml boundary.toml [p1|p1-anp|p1-anp-k] [batches]\n");
    return 2;
  }
  const PetscSession session({});
  const std::string mesh = arguments[1], organ = arguments[2], boundary = arguments[3];
  const char* element = count > 4 ? arguments[4] : "p1";
  compare(Problem(make_elastic_body(read_mesh(mesh), read_organ_config(organ), read_boundary_config(boundary),
                                    {mesh, organ, boundary}),
                  element),
          element, count > 5 ? std::stoul(arguments[5]) : static_cast<std::size_t>(-1));
}
