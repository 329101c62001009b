#include "precompute/precompute.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "formats/atomic_file.h"
#include "formats/bundle_writer.h"
#include "formats/errors.h"
#include "formats/program.h"
#include "precompute/bundle_output.h"
#include "precompute/column_solver.h"
#include "precompute/petsc_session.h"
#include "precompute/solver_choice.h"
#include "precompute/stiffness.h"
#include "precompute/support_check.h"
#include "precompute/tensors.h"

namespace palpate {
namespace {

using formats::SectionId;

// Longest text a number of the certificate takes in JSON; the provenance is laid out with room for all of them.
constexpr std::size_t kRoomForNumbers = 8 * 32;

std::vector<std::array<double, 3>> row_coordinates(const ElasticBody& body, const HeldStiffness& held) {
  std::vector<std::array<double, 3>> result;
  for (const auto n : held.node_of_row) result.push_back(body.nodes[n]);
  return result;
}

// Nodes spread over the touchable ones, whose mutual compliances are compared at the end.
class ReciprocitySample {
 public:
  explicit ReciprocitySample(const ElasticBody& body) : body_(body) {
    const std::size_t count = std::min<std::size_t>(48, body.touchable.size());
    for (std::size_t i = 0; i < count; ++i) nodes_.push_back(body.touchable[i * body.touchable.size() / count]);
    compliance_.assign(9 * count * count, 0.0);
  }

  // Keeps C_nk for the sampled k among the nodes of a solved block.
  void take(const TensorBlock& block, std::span<const std::int32_t> nodes) {
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const auto at = std::lower_bound(nodes_.begin(), nodes_.end(), nodes[i]);
      if (at == nodes_.end() || *at != nodes[i]) continue;
      for (std::size_t n = 0; n < nodes_.size(); ++n) {
        const auto c = block.compliance(nodes_[n], i);
        std::copy(c.begin(), c.end(), entry(n, static_cast<std::size_t>(at - nodes_.begin())));
      }
    }
  }

  // Collective. Far: farther apart than half the largest distance in the sample.
  void finish(const Ranks& ranks, Certificate* certificate) {
    MPI_Allreduce(MPI_IN_PLACE, compliance_.data(), static_cast<int>(compliance_.size()), MPI_DOUBLE, MPI_SUM,
                  ranks.communicator());
    double farthest = 0;
    for (std::size_t a = 0; a < nodes_.size(); ++a)
      for (std::size_t b = 0; b < a; ++b) farthest = std::max(farthest, distance(a, b));
    for (std::size_t a = 0; a < nodes_.size(); ++a)
      for (std::size_t b = 0; b < a; ++b) {
        if (distance(a, b) < 0.5 * farthest) continue;
        double difference = 0, size = 0;
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j) {
            // C_ab(i, j) = C_ba(j, i) where both dofs are free
            if (body_.fixed[nodes_[a]][i] || body_.fixed[nodes_[b]][j]) continue;
            const double ab = entry(a, b)[3 * i + j], ba = entry(b, a)[3 * j + i];
            difference += (ab - ba) * (ab - ba), size += ab * ab;
          }
        if (size > 0)
          certificate->reciprocity_error = std::max(certificate->reciprocity_error, std::sqrt(difference / size));
        ++certificate->reciprocity_pairs;
      }
  }

 private:
  double* entry(std::size_t n, std::size_t k) { return &compliance_[9 * (n * nodes_.size() + k)]; }
  double distance(std::size_t a, std::size_t b) const {
    const auto &p = body_.nodes[nodes_[a]], &q = body_.nodes[nodes_[b]];
    return std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
  }

  const ElasticBody& body_;
  std::vector<std::int32_t> nodes_;
  std::vector<double> compliance_;  // [n][k][9]
};

struct Seconds {
  double read = 0, assemble = 0, factor = 0, solve = 0, write = 0, seal = 0;
};

class Stopwatch {
 public:
  explicit Stopwatch(double* into) : into_(into), begun_(MPI_Wtime()) {}
  ~Stopwatch() { *into_ += MPI_Wtime() - begun_; }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  double* into_;
  double begun_;
};

class Run {
 public:
  Run(const PrecomputeOptions& options, Ranks& ranks) : options_(options), ranks_(ranks) {}

  void operator()() {
    ranks_.together([this] { read(); });
    ranks_.together([this] { assemble(); });
    choose_and_factor();
    ranks_.together([this] {
      if (ranks_.rank() == 0) solve_preload(), lay_out();
    });
    share_layout();
    ranks_.together([this] { solve_columns(); });
    reduce_certificate();
    ranks_.together([this] {
      if (ranks_.rank() == 0) seal();
    });
    report();
  }

 private:
  void read() {
    const Stopwatch watch(&seconds_.read);
    // What would fail after minutes fails now.
    if (ranks_.rank() == 0) file_ = std::make_unique<AtomicFile>(options_.bundle);
    if (!options_.image.empty() && !std::filesystem::is_regular_file(options_.image))
      throw InputError(fmt::format("{}: expected the image file, found none", options_.image.string()));
    organ_ = read_organ_config(options_.organ);
    if (organ_.element != "p1")
      throw InputError(fmt::format("{}: element: expected \"p1\", the only one this version builds, found \"{}\"",
                                   options_.organ.string(), organ_.element));
    boundary_ = read_boundary_config(options_.boundary);
    if (organ_.response && ranks_.rank() == 0) fit_ = fit_responses(*organ_.response);
    const TetrahedralMesh mesh = read_mesh(options_.mesh);
    body_ = make_elastic_body(mesh, organ_, boundary_, {options_.mesh, options_.organ, options_.boundary});
    if (boundary_.gravity)
      for (std::size_t r = 0; r < body_.materials.size(); ++r)
        if (body_.materials[r].density <= 0)
          throw InputError(
              fmt::format("{}: [preload] gravity needs the density of every region; [[region]] \"{}\" of {} has "
                          "none",
                          options_.boundary.string(), body_.region_names[r], options_.organ.string()));
    check_support(body_, options_.boundary);
    sample_.emplace(body_);
  }

  void assemble() {
    const Stopwatch watch(&seconds_.assemble);
    held_ = eliminate_held(assemble_stiffness(body_), body_.fixed);
  }

  void choose_and_factor() {
    const auto columns = 3 * static_cast<std::int64_t>(body_.touchable.size());
    const int widest = static_cast<int>(std::min<std::int64_t>(96, columns));
    const double memory = options_.memory_gigabytes > 0 ? 1e9 * options_.memory_gigabytes / ranks_.here()
                                                        : available_memory_bytes(ranks_.here());
    const auto prediction =
        predict_solver(held_.matrix.rows, static_cast<std::int64_t>(held_.matrix.column.size()), columns,
                       options_.columns_at_a_time > 0 ? options_.columns_at_a_time : widest);
    // The rank with the least memory decides for all, so that every column is solved alike.
    const SolverChoice choice = choose_solver(prediction, ranks_.least(memory), ranks_.count());
    note(fmt::format("{} nodes ({} surface, {} touchable), {} tetrahedra, {} columns; {}", body_.nodes.size(),
                     body_.surface_count, body_.touchable.size(), body_.tetrahedra.size(), columns, choice.sentence));
    ranks_.together([&] {
      const Stopwatch watch(&seconds_.factor);
      ColumnSolverOptions solver;
      solver.tolerance = options_.tolerance;
      solver.cholesky = choice.cholesky;
      solver.width =
          options_.columns_at_a_time > 0 ? options_.columns_at_a_time : std::min(widest, choice.cholesky ? 96 : 24);
      solver_ = std::make_unique<ColumnSolver>(held_.matrix, row_coordinates(body_, held_), solver);
    });
  }

  // K u = f of the body force; rank 0 alone.
  void solve_preload() {
    if (!boundary_.gravity) return;
    const Stopwatch watch(&seconds_.solve);
    const std::vector<double> load = gravity_load(body_, *boundary_.gravity);
    const int width = solver_->width();
    std::vector<double> b(static_cast<std::size_t>(solver_->dofs()) * width, 0.0), x(b.size());
    for (std::size_t row = 0; row < held_.node_of_row.size(); ++row)
      for (int d = 0; d < 3; ++d) {
        const auto n = static_cast<std::size_t>(held_.node_of_row[row]);
        if (!body_.fixed[n][d]) b[(3 * row + d) * width] = load[3 * n + d];
      }
    std::vector<ColumnReport> reports(width);
    try {
      solver_->solve(b.data(), x.data(), reports);
    } catch (const NotConverged& worst) {
      throw OperationError(
          fmt::format("the preload did not converge: true relative residual {:.2g} (PETSc: {}); double "
                      "precision allows about {:.1g} here",
                      worst.residual, worst.reason, worst.floor));
    }
    certificate_.preload_residual = reports[0].residual;
    preload_.assign(3 * body_.nodes.size(), 0.0);
    for (std::size_t row = 0; row < held_.node_of_row.size(); ++row)
      for (int d = 0; d < 3; ++d) preload_[3 * held_.node_of_row[row] + d] = x[(3 * row + d) * width];
  }

  void lay_out() {
    const Stopwatch watch(&seconds_.write);
    const bool has_interior = body_.surface_count < static_cast<std::int32_t>(body_.nodes.size());
    if (boundary_.store_interior && !has_interior)
      warn("the mesh has no interior nodes; [store] interior has no effect");
    const BundleContent content{body_, boundary_.store_interior && has_interior, preload_, fit_};
    provenance_ = provenance_of(options_, organ_, boundary_, content, solver_->description(), petsc_options_in_force(),
                                solver_->width());
    const std::string text = provenance_text(provenance_, certificate_);
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

  // Blocks of nodes are the same for any number of ranks; rank r takes blocks r, r + count, ...
  void solve_columns() {
    auto part = options_.bundle;
    part += ".part";
    SectionWriter writer(part);
    TensorBlock block(*solver_);
    const auto per_block = static_cast<std::size_t>(TensorBlock::nodes_per_solve(*solver_));
    const auto stride = per_block * static_cast<std::size_t>(ranks_.count());
    const std::size_t begin = per_block * static_cast<std::size_t>(ranks_.rank());
    std::size_t mine = 0;
    for (std::size_t at = begin; at < body_.touchable.size(); at += stride)
      mine += std::min(per_block, body_.touchable.size() - at);
    Progress progress("columns", 3 * mine);
    for (std::size_t at = begin; at < body_.touchable.size(); at += stride) {
      if (ranks_.someone_failed()) return;
      const std::span<const std::int32_t> nodes(&body_.touchable[at], std::min(per_block, body_.touchable.size() - at));
      {
        const Stopwatch watch(&seconds_.solve);
        block.solve(held_, body_.fixed, nodes);
      }
      if (at == begin) refuse_unused_options();
      {
        const Stopwatch watch(&seconds_.write);
        write_block(writer, block, at, nodes);
      }
      sample_->take(block, nodes);
      progress.advance(3 * nodes.size());
    }
    const Stopwatch watch(&seconds_.write);
    writer.sync();
  }

  static void refuse_unused_options() {
    const std::string unused = unused_petsc_options();
    if (!unused.empty())
      throw InputError(
          fmt::format("PETSc did not use the options after \"--\": {}; check their spelling and whether the "
                      "chosen solver reads them",
                      unused));
  }

  void write_block(SectionWriter& writer, const TensorBlock& block, std::size_t at,
                   std::span<const std::int32_t> nodes) {
    const auto all = static_cast<std::int32_t>(body_.nodes.size());
    write_displacements(writer, SectionId::displacement_surface, block, at, nodes.size(), 0, body_.surface_count);
    if (has(SectionId::displacement_interior))
      write_displacements(writer, SectionId::displacement_interior, block, at, nodes.size(), body_.surface_count,
                          all - body_.surface_count);
    std::vector<double> force, residual;
    std::vector<std::int32_t> iterations;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      force.insert(force.end(), block.force(i).begin(), block.force(i).end());
      for (int j = 0; j < 3; ++j) {
        const ColumnReport report = block.report(i, j);
        residual.push_back(report.residual);
        iterations.push_back(report.iterations);
        certificate_.most_iterations = std::max<std::int64_t>(certificate_.most_iterations, report.iterations);
        if (report.residual > certificate_.worst_residual) {
          certificate_.worst_residual = report.residual;
          certificate_.worst_node = nodes[i];
          certificate_.worst_dof = j;
        }
      }
    }
    writer.write(entry_of(entries_, SectionId::force), at * 72, force.data(), force.size() * 8);
    writer.write(entry_of(entries_, SectionId::residual), at * 24, residual.data(), residual.size() * 8);
    writer.write(entry_of(entries_, SectionId::iterations), at * 12, iterations.data(), iterations.size() * 4);
    certificate_.cast_error =
        std::max(certificate_.cast_error,
                 block.cast_error(0, has(SectionId::displacement_interior) ? all : body_.surface_count));
  }

  void write_displacements(SectionWriter& writer, SectionId id, const TensorBlock& block, std::size_t at,
                           std::size_t nodes, std::int32_t first, std::int32_t count) {
    rows_.resize(nodes * 9 * static_cast<std::size_t>(count));
    block.displacement(first, count, rows_.data());
    const std::uint64_t node_bytes = 36 * static_cast<std::uint64_t>(count);
    writer.write(entry_of(entries_, id), at * node_bytes, rows_.data(), nodes * node_bytes);
  }

  bool has(SectionId id) const {
    return std::any_of(entries_.begin(), entries_.end(),
                       [id](const auto& e) { return e.id == static_cast<std::uint32_t>(id); });
  }

  // Collective.
  void reduce_certificate() {
    sample_->finish(ranks_, &certificate_);
    double numbers[2] = {static_cast<double>(certificate_.most_iterations), certificate_.cast_error};
    MPI_Allreduce(MPI_IN_PLACE, numbers, 2, MPI_DOUBLE, MPI_MAX, ranks_.communicator());
    certificate_.most_iterations = static_cast<std::int64_t>(numbers[0]);
    certificate_.cast_error = numbers[1];
    // Of equal residuals, the first node: the same answer for any number of ranks.
    double worst = certificate_.worst_residual;
    MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPI_DOUBLE, MPI_MAX, ranks_.communicator());
    long long place = certificate_.worst_residual == worst && certificate_.worst_node >= 0
                          ? 3 * certificate_.worst_node + certificate_.worst_dof
                          : std::numeric_limits<long long>::max();
    MPI_Allreduce(MPI_IN_PLACE, &place, 1, MPI_LONG_LONG, MPI_MIN, ranks_.communicator());
    certificate_.worst_residual = worst;
    certificate_.worst_node = worst > 0 ? place / 3 : -1;
    certificate_.worst_dof = worst > 0 ? place % 3 : 0;
  }

  void seal() {
    const Stopwatch watch(&seconds_.seal);
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
    if (fit_) {
      const auto line = [](const char* name, const ResponsePolynomial& p) {
        return fmt::format("{} fitted to {:.2g} rms, {:.2g} at most, of the largest datum{}", name, p.rms, p.largest,
                           p.note.empty() ? "" : " (" + p.note + ")");
      };
      note(line("Q", fit_->force) + (fit_->radial.coefficient.empty() ? "" : "; " + line("P", fit_->radial)));
    }
    note(fmt::format("seconds: read {:.2f}, assemble {:.2f}, factor {:.2f}, solve {:.2f}, write {:.2f}, seal {:.2f}",
                     seconds_.read, seconds_.assemble, seconds_.factor, seconds_.solve, seconds_.write, seconds_.seal));
  }

  const PrecomputeOptions& options_;
  Ranks& ranks_;
  OrganConfig organ_;
  BoundaryConfig boundary_;
  ElasticBody body_;
  HeldStiffness held_;
  std::unique_ptr<ColumnSolver> solver_;
  std::optional<ResponseFit> fit_;
  std::vector<double> preload_;
  std::unique_ptr<AtomicFile> file_;
  std::vector<formats::SectionEntry> entries_;
  nlohmann::json provenance_;
  std::optional<ReciprocitySample> sample_;
  std::vector<float> rows_;
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
