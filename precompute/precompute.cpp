#include "precompute/precompute.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "formats/atomic_file.h"
#include "formats/errors.h"
#include "formats/program.h"
#include "precompute/bundle_output.h"
#include "precompute/petsc_session.h"
#include "precompute/preload.h"
#include "precompute/run_inputs.h"
#include "precompute/solve_columns.h"
#include "precompute/solver_choice.h"
#include "precompute/stopwatch.h"

namespace palpate {
namespace {

// Longest text a number of the certificate takes in JSON; the provenance is laid out with room for all of them.
constexpr std::size_t kRoomForNumbers = 8 * 32;

std::vector<std::array<double, 3>> row_coordinates(const ElasticBody& body, const HeldStiffness& held) {
  std::vector<std::array<double, 3>> result;
  for (const auto n : held.node_of_row) result.push_back(body.nodes[n]);
  return result;
}

struct Seconds {
  double read = 0, assemble = 0, factor = 0, preload = 0, seal = 0;
  SolveSeconds columns;
};

// The steps of a run, in the order of operator().
class Run {
 public:
  Run(const PrecomputeOptions& options, Ranks& ranks) : options_(options), ranks_(ranks) {}

  void operator()() {
    ranks_.together([this] { read(); });
    ranks_.together([this] { assemble(); });
    choose_and_factor();
    ranks_.together([this] { block_columns(); });
    ranks_.together([this] {
      if (ranks_.rank() == 0) preload(), lay_out();
    });
    share_layout();
    ranks_.together([this] { solve(); });
    gather_records();
    ranks_.together([this] {
      if (ranks_.rank() == 0) certify_and_seal();
    });
    report();
  }

 private:
  void read() {
    const Stopwatch watch(&seconds_.read);
    // What would fail after minutes fails now.
    if (ranks_.rank() == 0) file_ = std::make_unique<AtomicFile>(options_.bundle);
    inputs_ = read_run_inputs(options_);
  }

  void assemble() {
    const Stopwatch watch(&seconds_.assemble);
    held_ = eliminate_held(assemble_stiffness(inputs_.body), inputs_.body.fixed);
  }

  void choose_and_factor() {
    const auto columns = 3 * static_cast<std::int64_t>(inputs_.body.touchable.size());
    const int widest = static_cast<int>(std::min<std::int64_t>(96, columns));
    const double memory = options_.memory_gigabytes > 0 ? 1e9 * options_.memory_gigabytes / ranks_.here()
                                                        : available_memory_bytes(ranks_.here());
    const auto prediction =
        predict_solver(held_.matrix.rows, static_cast<std::int64_t>(held_.matrix.column.size()), columns,
                       options_.columns_at_a_time > 0 ? options_.columns_at_a_time : widest);
    // The rank with the least memory decides for all, so that every column is solved alike.
    const SolverChoice choice = choose_solver(prediction, ranks_.least(memory), ranks_.count());
    note(fmt::format("{} nodes ({} surface, {} touchable), {} tetrahedra, {} columns; {}", inputs_.body.nodes.size(),
                     inputs_.body.surface_count, inputs_.body.touchable.size(), inputs_.body.tetrahedra.size(), columns,
                     choice.sentence));
    ranks_.together([&] {
      const Stopwatch watch(&seconds_.factor);
      ColumnSolverOptions solver;
      solver.tolerance = options_.tolerance;
      solver.cholesky = choice.cholesky;
      solver.width =
          options_.columns_at_a_time > 0 ? options_.columns_at_a_time : std::min(widest, choice.cholesky ? 96 : 32);
      solver_ = std::make_unique<ColumnSolver>(held_.matrix, row_coordinates(inputs_.body, held_), solver);
    });
  }

  void block_columns() {
    const ElasticBody& body = inputs_.body;
    std::vector<std::int32_t> order;
    if (const auto order_of_row = solver_->row_order(); !order_of_row.empty())
      for (const auto node : body.touchable) order.push_back(order_of_row[held_.row_of_node[node]]);
    blocks_ = column_blocks(body.touchable, order, static_cast<std::size_t>(TensorBlock::nodes_per_solve(*solver_)));
    sample_.emplace(body);
    records_.resize(blocks_.size());
  }

  void preload() {
    if (!inputs_.boundary.gravity) return;
    const Stopwatch watch(&seconds_.preload);
    preload_ = solve_preload(inputs_.body, held_, *inputs_.boundary.gravity, *solver_);
  }

  void lay_out() {
    const Stopwatch watch(&seconds_.columns.write);
    const BundleContent content{inputs_.body, inputs_.store_interior, preload_.displacement, inputs_.fit};
    provenance_ = provenance_of(options_, inputs_.organ, inputs_.boundary, content, solver_->description(),
                                petsc_options_in_force(), solver_->width());
    const std::string text = provenance_text(provenance_, Certificate{});
    entries_ = lay_out_bundle(file_->part(), section_shapes(content), text + std::string(kRoomForNumbers, ' '));
    SectionWriter writer(file_->part());
    write_body_sections(writer, entries_, content);
  }

  void share_layout() {
    int count = static_cast<int>(entries_.size());
    MPI_Bcast(&count, 1, MPI_INT, 0, ranks_.communicator());
    entries_.resize(static_cast<std::size_t>(count));
    MPI_Bcast(entries_.data(), static_cast<int>(count * sizeof(formats::SectionEntry)), MPI_BYTE, 0,
              ranks_.communicator());
  }

  void solve() {
    auto part = options_.bundle;
    part += ".part";
    const auto sections = displacement_sections(entries_, inputs_.body);
    const ColumnJob job{held_, inputs_.body, blocks_, *sample_, sections, part};
    for (auto& [b, record] : solve_columns(job, ranks_, *solver_, &seconds_.columns)) records_[b] = std::move(record);
  }

  // Collective: every record to rank 0.
  void gather_records() {
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      const int owner = static_cast<int>(b) % ranks_.count(),
                bytes = static_cast<int>(record_bytes(blocks_[b], *sample_));
      if (owner == 0) continue;
      if (ranks_.rank() == owner) MPI_Send(to_bytes(records_[b]).data(), bytes, MPI_BYTE, 0, 0, ranks_.communicator());
      if (ranks_.rank() != 0) continue;
      std::vector<std::byte> received(static_cast<std::size_t>(bytes));
      MPI_Recv(received.data(), bytes, MPI_BYTE, owner, 0, ranks_.communicator(), MPI_STATUS_IGNORE);
      records_[b] = from_bytes(received, blocks_[b]);
    }
  }

  void certify_and_seal() {
    const Stopwatch watch(&seconds_.seal);
    certificate_ = certify(blocks_, records_, *sample_);
    certificate_.preload_residual = preload_.residual;
    SectionWriter writer(file_->part());
    write_column_sections(writer, entries_, blocks_, records_);
    finish_provenance(file_->part(), entries_, provenance_text(provenance_, certificate_));
    seal_bundle(file_->part(), entries_);
    file_->commit();
  }

  void report() const {
    const auto& c = certificate_;
    note(
        fmt::format("{}; worst column: node {} dof {}, true relative residual {:.2g} (tolerance {:.2g}); at most {} "
                    "iterations; reciprocity of far pairs {:.2g} ({} pairs); cast to f32 {:.2g}",
                    solver_->description(), c.worst_node, "xyz"[c.worst_dof], c.worst_residual, options_.tolerance,
                    c.most_iterations, c.reciprocity_error, c.reciprocity_pairs, c.cast_error));
    if (inputs_.fit) {
      const auto line = [](const char* name, const ResponsePolynomial& p) {
        return fmt::format("{} fitted to {:.2g} rms, {:.2g} at most, of the largest datum{}", name, p.rms, p.largest,
                           p.note.empty() ? "" : " (" + p.note + ")");
      };
      note(line("Q", inputs_.fit->force) +
           (inputs_.fit->radial.coefficient.empty() ? "" : "; " + line("P", inputs_.fit->radial)));
    }
    note(fmt::format("seconds: read {:.2f}, assemble {:.2f}, factor {:.2f}, solve {:.2f}, write {:.2f}, seal {:.2f}",
                     seconds_.read, seconds_.assemble, seconds_.factor, seconds_.preload + seconds_.columns.solve,
                     seconds_.columns.write, seconds_.seal));
  }

  const PrecomputeOptions& options_;
  Ranks& ranks_;
  RunInputs inputs_;
  HeldStiffness held_;
  std::unique_ptr<ColumnSolver> solver_;
  std::vector<ColumnBlock> blocks_;
  std::optional<ReciprocitySample> sample_;
  Preload preload_;
  std::unique_ptr<AtomicFile> file_;
  nlohmann::json provenance_;
  std::vector<formats::SectionEntry> entries_;
  std::vector<BlockRecord> records_;
  Certificate certificate_;
  Seconds seconds_;
};

}  // namespace

void precompute(const PrecomputeOptions& options, Ranks& ranks) {
  Run(options, ranks)();
}

std::vector<NodeTensor> solve_node_tensors(const ElasticBody& body, std::span<const std::int32_t> nodes,
                                           double tolerance) {
  for (const auto n : nodes)
    if (n < 0 || static_cast<std::size_t>(n) >= body.nodes.size() ||
        (body.fixed[n][0] && body.fixed[n][1] && body.fixed[n][2]))
      throw InputError(
          fmt::format("node {}: expected one of the {} nodes with a free degree of freedom", n, body.nodes.size()));
  const HeldStiffness held = eliminate_held(assemble_stiffness(body), body.fixed);
  ColumnSolverOptions options;
  options.tolerance = tolerance;
  options.width = static_cast<int>(std::min<std::size_t>(96, 3 * nodes.size()));
  const auto prediction = predict_solver(held.matrix.rows, static_cast<std::int64_t>(held.matrix.column.size()),
                                         3 * static_cast<std::int64_t>(nodes.size()), options.width);
  options.cholesky = choose_solver(prediction, available_memory_bytes(1), 1).cholesky;
  ColumnSolver solver(held.matrix, row_coordinates(body, held), options);
  TensorBlock block(solver);
  const auto per_block = static_cast<std::size_t>(TensorBlock::nodes_per_solve(solver));
  const auto all = static_cast<std::int32_t>(body.nodes.size());
  std::vector<NodeTensor> result;
  for (std::size_t at = 0; at < nodes.size(); at += per_block) {
    const auto some = nodes.subspan(at, std::min(per_block, nodes.size() - at));
    block.solve(held, body.fixed, some);
    std::vector<double> rows(some.size() * 9 * body.nodes.size());
    block.displacement(0, all, rows.data());
    for (std::size_t i = 0; i < some.size(); ++i) {
      const auto from = rows.begin() + static_cast<std::ptrdiff_t>(9 * body.nodes.size() * i);
      NodeTensor tensor{some[i], block.force(i), {from, from + static_cast<std::ptrdiff_t>(9 * body.nodes.size())}, 0};
      for (int j = 0; j < 3; ++j) tensor.residual = std::max(tensor.residual, block.report(i, j).residual);
      result.push_back(std::move(tensor));
    }
  }
  return result;
}

}  // namespace palpate
