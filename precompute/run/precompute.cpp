#include "precompute/run/precompute.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "formats/atomic_file.h"
#include "formats/errors.h"
#include "formats/program.h"
#include "precompute/journal/resumable_part.h"
#include "precompute/ranks/distributed_solver.h"
#include "precompute/ranks/group_size.h"
#include "precompute/run/bundle_output.h"
#include "precompute/run/run_inputs.h"
#include "precompute/run/run_report.h"
#include "precompute/run/run_summary.h"
#include "precompute/run/solve_columns.h"
#include "precompute/solver/petsc_session.h"
#include "precompute/solver/solver_plan.h"
#include "precompute/tensors/locking_estimate.h"
#include "precompute/tensors/preload.h"

namespace palpate {
namespace {

// Longest text a number of the certificate takes in JSON; the provenance is laid out with room for all of them.
constexpr std::size_t kRoomForNumbers = 16 * 32;

// In the fingerprint: which of the two preconditioners solves.
constexpr const char *kPreconditioner = "preconditioner", *kFactor = "factor", *kMultigrid = "multigrid";

// The steps of a run, in the order of operator().
class Run {
 public:
  Run(const PrecomputeOptions& options, Ranks& ranks, StopSignals& signals)
      : options_(options), ranks_(ranks), signals_(signals), report_(ranks) {}
  ~Run() { signals_.on_stop({}); }

  void operator()() {
    try {
      stage("read", [this] { read(); });
      const auto memory = [this] { return ranks_.least(memory_left_bytes(options_.memory_gigabytes, ranks_.here())); };
      form_groups(memory());
      stage("assemble", [this] { assemble(); });
      const double left = memory();
      stage("plan", [&] { plan(left); });
      keep_earlier_choice();
      tell_plan();
      if (options_.plan_only) return;
      stage("locking", [&] { measure_locking(left); });
      stage("factor", [this] { factor(); });
      if (inputs_.boundary.gravity) stage("preload", [this] { preload(); });
      stage("lay out", [this] { begin_part(); });
      share_layout();
      stage("look for what is done", [this] { find_safe(); });
      agree_on_what_is_left();
      stage("columns", [this] { solve(); });
      stage("seal", [this] { certify_and_seal(); });
    } catch (const OperationError& error) {
      const std::string kept = part_ ? part_->leave() : "";
      throw OperationError(error.what() + (kept.empty() ? "" : "; " + kept));
    }
    if (!options_.plan_only) summarise();
  }

 private:
  void stage(const char* name, const std::function<void()>& work) {
    report_.stage(name, [&] { ranks_.together(work); });
  }
  bool is_first() const { return ranks_.rank() == 0; }

  void read() {
    // What would fail after minutes fails now.
    if (is_first() && !options_.plan_only) claim_output();
    inputs_ = read_run_inputs(options_);
  }

  void claim_output() {
    if (!options_.json.empty() && options_.json != "-") check_target(options_.json);
    part_.emplace(options_.bundle);
    signals_.on_stop([this](const std::string& signal) {
      const std::string kept = part_->leave();
      say_failure("palpate-precompute",
                  fmt::format("stopped by {}; {}", signal, kept.empty() ? "nothing was begun that is left" : kept));
    });
  }

  // Collective. memory: what each rank may take, of the one with the least: all decide alike.
  void form_groups(double memory) {
    group_choice_ =
        choose_group(inputs_.body, inputs_.organ.element, memory, ranks_.count(), options_.ranks_per_operator);
    group_.emplace(ranks_, group_choice_.ranks_per_operator);
  }

  void assemble() {
    if (group_->size() > 1) return assemble_own();
    discretisation_ = discretise(inputs_.body, inputs_.organ.element);
    held_ = eliminate_held(discretisation_.stiffness, discretisation_.fixed);
    discretisation_.stiffness = {};
  }

  void assemble_own() {
    discretisation_ = place_vertices(inputs_.body);
    partition_ = partition_rows(inputs_.body.nodes, inputs_.body.fixed, group_->size());
    own_rows_ = assemble_own_rows(inputs_.body, partition_, group_->rank(), [this](const ElasticBody& part) {
      return discretise(part, inputs_.organ.element).stiffness;
    });
    held_.row_of_node = partition_.row_of_node;
    held_.node_of_row = partition_.node_of_row;
  }

  // memory: that of the rank with the least, which decides for all, so that every column is solved alike.
  void plan(double memory) {
    const ElasticBody& body = inputs_.body;
    std::vector<std::int32_t> column_rows;
    for (const auto node : body.touchable) column_rows.push_back(held_.row_of_node[node]);
    const auto stored = inputs_.store_interior ? static_cast<std::int64_t>(body.nodes.size()) : body.surface_count;
    const double row_bytes = 9.0 * static_cast<double>(stored * formats::element_bytes(options_.store));
    resident_at_plan_ = resident_bytes();
    const double bundle_bytes = row_bytes * static_cast<double>(body.touchable.size());
    if (group_->size() > 1) {
      plan_ = plan_of_group(group_choice_, 3 * static_cast<std::int64_t>(body.touchable.size()), memory, bundle_bytes);
      return;
    }
    plan_ = make_plan(
        {held_.matrix, column_rows, stored, options_.columns_at_a_time, memory, bundle_bytes, ranks_.count()});
    plan_.elimination = put_in_order(held_, *plan_.elimination);
  }

  // Collective. What is free now does not decide over columns of the same input that are solved already; --memory does.
  void keep_earlier_choice() {
    double earlier = -1;
    if (part_ && part_->earlier() && part_->earlier()->contains(kPreconditioner) && options_.memory_gigabytes == 0) {
      bool same = part_->earlier()->value("tolerance", 0.0) == options_.tolerance;
      for (const auto& [key, hash] : inputs_.hashes.items()) same = same && part_->earlier()->value(key, "") == hash;
      if (same) earlier = (*part_->earlier())[kPreconditioner] == kFactor ? 1 : 0;
    }
    earlier = ranks_.most(earlier);
    if (earlier < 0 || plan_.cholesky == (earlier == 1)) return;
    plan_.cholesky = earlier == 1;
    plan_.why += fmt::format("; but {} was begun with the {} and keeps it (--memory decides anew)",
                             part_of(options_.bundle).string(), plan_.cholesky ? kFactor : kMultigrid);
  }

  void tell_plan() const {
    const ElasticBody& body = inputs_.body;
    const std::string text =
        fmt::format("mesh    {} nodes ({} surface, {} touchable), {} tetrahedra\n{}", body.nodes.size(),
                    body.surface_count, body.touchable.size(), body.tetrahedra.size(), plan_text(plan_));
    if (!options_.plan_only) return say(text);
    if (options_.json != "-" && is_first()) fmt::print("{}\n", text);
    if (!options_.json.empty() && is_first()) write_json(plan_json(plan_), options_.json);
  }

  void measure_locking(double memory) {
    if (!is_first()) return;
    LockingRequest request;
    request.probes = options_.locking_probes.value_or(request.probes);
    request.at_any_cost = options_.locking_probes.has_value();
    request.most_bytes = request.at_any_cost ? memory : locking_bytes(options_.memory_gigabytes);
    request.most_operations = locking_operations(operations_of(plan_));
    if (plan_.elimination) request.own_factor_operations = plan_.elimination->factor_flops();
    locking_ = estimate_locking(inputs_.body, inputs_.organ.element, request);
  }

  void factor() {
    ColumnSolverOptions solver;
    solver.tolerance = options_.tolerance;
    solver.cholesky = plan_.cholesky;
    solver.width = options_.columns_at_a_time > 0 ? options_.columns_at_a_time : plan_.width();
    solver.elimination = plan_.elimination;
    if (group_->size() == 1)
      solver_ = std::make_unique<ColumnSolver>(held_.matrix, row_coordinates(discretisation_, held_), solver);
    else if (!factor_together(solver))
      return;
    warn_of_condition();
    block_columns();
  }

  // The residuals hold all the same, but a small residual then allows a large error: at 1e-12 four digits are sure.
  void warn_of_condition() const {
    const double bound = solver_->reciprocal_condition();
    if (is_first() && bound > 0 && bound < 1e-12)
      warn(
          fmt::format("the stiffness matrix has a condition of at least {:.1g}: displacements may be off by {:.1g} of "
                      "themselves; look for slivers, barely held parts and extreme contrasts of stiffness",
                      1 / bound, 2.2e-16 / bound));
  }

  bool factor_together(const ColumnSolverOptions& options) {
    return group_->together([&] {
      solver_ = std::make_unique<DistributedSolver>(group_->communicator(), std::move(own_rows_), partition_,
                                                    inputs_.body.nodes, inputs_.body.fixed, options);
    });
  }

  void block_columns() {
    const ElasticBody& body = inputs_.body;
    std::vector<std::int32_t> order;
    if (const auto order_of_row = solver_->row_order(); !order_of_row.empty())
      for (const auto node : body.touchable) order.push_back(order_of_row[held_.row_of_node[node]]);
    blocks_ = column_blocks(body.touchable, order, static_cast<std::size_t>(TensorBlock::nodes_per_solve(*solver_)));
    sample_.emplace(body);
  }

  void preload() {
    if (group_->index() > 0) return;
    group_->together([this] { preload_ = solve_preload(discretisation_, held_, *inputs_.boundary.gravity, *solver_); });
  }

  // Rank 0 alone writes what is known before the columns.
  void begin_part() {
    if (!is_first()) return;
    const BundleContent content{inputs_.body, inputs_.store_interior, preload_.displacement, inputs_.fit,
                                options_.store};
    provenance_ = provenance_of(options_, inputs_, content, solver_->description(), petsc_options_in_force(),
                                solver_->width(), locking_);
    const auto shapes = section_shapes(content);
    Fingerprint fingerprint = fingerprint_of(provenance_, shapes, blocks_);
    fingerprint[kPreconditioner] = plan_.cholesky ? kFactor : kMultigrid;
    const std::string text = provenance_text(provenance_, Certificate{}) + std::string(kRoomForNumbers, ' ');
    entries_ = part_->begin(
        fingerprint,
        {shapes, text, [&](SectionWriter& writer, const auto& at) { write_body_sections(writer, at, content); }},
        blocks_, *sample_);
  }

  // Collective.
  void share_layout() {
    int count = static_cast<int>(entries_.size());
    MPI_Bcast(&count, 1, MPI_INT, 0, ranks_.communicator());
    entries_.resize(static_cast<std::size_t>(count));
    MPI_Bcast(entries_.data(), static_cast<int>(count * sizeof(formats::SectionEntry)), MPI_BYTE, 0,
              ranks_.communicator());
    sections_ = displacement_sections(entries_, inputs_.body);
  }

  ColumnJob job() const {
    return {
        discretisation_, held_, blocks_, *sample_, sections_, part_of(options_.bundle), journal_of(options_.bundle)};
  }

  void find_safe() {
    if (!is_first()) rank_lock_.emplace(RunLock::of_rank(journal_of(options_.bundle), ranks_.rank()));
    safe_ = find_safe_blocks(job(), ranks_);
  }

  // Collective.
  void agree_on_what_is_left() {
    MPI_Allreduce(MPI_IN_PLACE, safe_.data(), static_cast<int>(safe_.size()), MPI_CHAR, MPI_MAX, ranks_.communicator());
    blocks_found_ = static_cast<std::size_t>(std::count(safe_.begin(), safe_.end(), 1));
    if (part_ && part_->resumes())
      note(fmt::format("{} is resumed: {} of {} blocks of columns are done", part_of(options_.bundle).string(),
                       blocks_found_, blocks_.size()));
  }

  void solve() { solve_columns(job(), safe_, ranks_, *group_, *solver_, &seconds_); }

  void certify_and_seal() {
    if (!is_first()) return;
    const auto part = part_of(options_.bundle);
    const std::vector<BlockRecord> records = all_records();
    certificate_ = certify(blocks_, records, *sample_);
    certificate_.preload_residual = preload_.residual;
    certificate_.locking_estimate = locking_.ratio;
    certificate_.reciprocal_condition = solver_->reciprocal_condition();
    SectionWriter writer(part);
    write_column_sections(writer, entries_, blocks_, records);
    finish_provenance(part, entries_, provenance_text(provenance_, certificate_));
    seal_bundle(part, entries_, check_rows(sections_, blocks_, records, part));
    part_->commit();
  }

  // Opened anew, so that a network file system shows what the other ranks have written.
  std::vector<BlockRecord> all_records() const {
    const ColumnJournal journal(journal_of(options_.bundle), blocks_, *sample_);
    std::vector<BlockRecord> records;
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      auto record = journal.read(b);
      if (!record)
        throw OperationError(
            fmt::format("{}: what was written of block {} is not there", journal_of(options_.bundle).string(), b));
      records.push_back(std::move(*record));
    }
    return records;
  }

  // Collective.
  void summarise() const {
    PlanOutcome took;
    took.seconds = report_.seconds_of("factor") + report_.seconds_of("columns");
    took.bytes = ranks_.most(peak_resident_bytes() - resident_at_plan_);
    took.locking_bytes = ranks_.most(locking_.bytes);
    const SolveSeconds columns{ranks_.most(seconds_.solve), ranks_.most(seconds_.wait)};
    if (!is_first()) return;
    took.bundle_bytes = static_cast<double>(std::filesystem::file_size(options_.bundle));
    const RunOutcome outcome{options_, inputs_, certificate_, locking_,       solver_->description(),
                             plan_,    took,    columns,      blocks_.size(), blocks_found_};
    tell(outcome, report_);
    if (!options_.json.empty()) write_json(json_of(outcome, report_), options_.json);
  }

  const PrecomputeOptions& options_;
  Ranks& ranks_;
  StopSignals& signals_;
  RunReport report_;
  RunInputs inputs_;
  GroupChoice group_choice_;
  std::optional<RankGroup> group_;
  RowPartition partition_;  // where a group has several ranks
  BlockMatrix own_rows_;
  Discretisation discretisation_;
  HeldStiffness held_;
  SolverPlan plan_;
  double resident_at_plan_ = 0;
  std::unique_ptr<BlockSolver> solver_;
  std::vector<ColumnBlock> blocks_;
  std::optional<ReciprocitySample> sample_;
  LockingEstimate locking_;  // of rank 0
  Preload preload_;
  nlohmann::json provenance_;
  std::optional<ResumablePart> part_;  // of rank 0
  std::optional<RunLock> rank_lock_;   // of the others
  std::vector<formats::SectionEntry> entries_;
  std::vector<DisplacementSection> sections_;
  std::vector<char> safe_;  // by block: solved before this run
  std::size_t blocks_found_ = 0;
  SolveSeconds seconds_;
  Certificate certificate_;
};

}  // namespace

void precompute(const PrecomputeOptions& options, Ranks& ranks, StopSignals& signals) {
  Run(options, ranks, signals)();
}

}  // namespace palpate
