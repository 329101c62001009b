#include "precompute/run/precompute.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "formats/atomic_file.h"
#include "formats/errors.h"
#include "formats/program.h"
#include "precompute/bundle_tool/bundle_commands.h"
#include "precompute/journal/resumable_part.h"
#include "precompute/ranks/divided_operator.h"
#include "precompute/ranks/group_size.h"
#include "precompute/run/bundle_output.h"
#include "precompute/run/run_inputs.h"
#include "precompute/run/run_report.h"
#include "precompute/run/run_summary.h"
#include "precompute/run/solve_columns.h"
#include "precompute/run/stopwatch.h"
#include "precompute/solver/batch_pc.h"
#include "precompute/solver/machine_memory.h"
#include "precompute/solver/petsc_session.h"
#include "precompute/solver/solver_plan.h"
#include "precompute/tensors/corridor_columns.h"
#include "precompute/tensors/element_excess.h"
#include "precompute/tensors/motions.h"
#include "precompute/tensors/preload.h"

namespace palpate {
namespace {

// The provenance is laid out before its numbers are known. Each of at most 16 numbers takes at most 32 characters as
// JSON.
constexpr std::size_t kRoomForNumbers = 16 * 32;

// Key and values in the fingerprint: which preconditioner solves the columns.
constexpr const char* kPreconditioner = "preconditioner";
constexpr std::array<const char*, 3> kPreconditioners = {"multigrid", "factor", "factor in single precision"};
int preconditioner_of(const SolverPlan& plan) {
  return !plan.cholesky ? 0 : plan.single ? 2 : 1;
}

// The output of a run. Rank 0 owns the unfinished bundle ("part") and its journal; every other rank locks the journal.
class Output {
 public:
  explicit Output(StopSignals& signals) : signals_(signals) {}
  ~Output() { signals_.on_stop({}); }  // before part_ is destroyed: the thread that waits for signals uses it
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  // Rank 0. From here on, a stop signal leaves what a rerun resumes from. Errors: those of ResumablePart.
  void claim(const std::filesystem::path& bundle) {
    part_.emplace(bundle);
    signals_.on_stop([this](const std::string& signal) {
      const std::string kept = part_->leave();
      say_failure("palpate-precompute",
                  fmt::format("stopped by {}; {}", signal, kept.empty() ? "nothing was begun that is left" : kept));
    });
  }

  // Every other rank, once rank 0 has begun the journal.
  void lock(const std::filesystem::path& bundle, int rank) {
    lock_.emplace(RunLock::of_rank(journal_of(bundle), rank));
  }

  // Rank 0's; null on the other ranks, and before claim().
  ResumablePart* part() { return part_ ? &*part_ : nullptr; }

 private:
  StopSignals& signals_;
  std::optional<ResumablePart> part_;
  std::optional<RunLock> lock_;
};

// This rank's share of the stiffness matrix. Where one rank has its own copy: held. Where the ranks of a group divide
// it: partition and own_rows; held then has the numbering of the rows but no matrix.
struct Assembled {
  Discretisation discretisation;  // without its stiffness
  HeldStiffness held;
  std::shared_ptr<PressureForm> form;  // of held.matrix, where the element has one and one rank has all of K; else null
  RowPartition partition;
  BlockMatrix own_rows;
  std::vector<MotionLoad> motions;
};

Assembled assemble_whole(const RunInputs& inputs) {
  Assembled assembled;
  assembled.discretisation = discretise(inputs.body, inputs.organ.element);
  assembled.held = remove_held_dofs(assembled.discretisation.stiffness, assembled.discretisation.fixed);
  assembled.motions = motion_loads(inputs.body, assembled.discretisation);
  assembled.discretisation.stiffness = {};
  if (inputs.organ.element == Element::p1_anp)
    assembled.form = std::make_shared<PressureForm>(pressure_form(inputs.body, assembled.held));
  return assembled;
}

Assembled assemble_divided(const RunInputs& inputs, const RankGroup& group) {
  Assembled assembled;
  assembled.discretisation = discretise_vertices(inputs.body);
  assembled.motions = motion_loads(inputs.body, assembled.discretisation);
  assembled.partition = partition_rows(inputs.body.nodes, inputs.body.fixed, group.size());
  assembled.own_rows = assemble_own_rows(inputs.body, assembled.partition, group.rank(), [&](const ElasticBody& part) {
    return discretise(part, inputs.organ.element).stiffness;
  });
  assembled.held.row_of_node = assembled.partition.row_of_node;
  assembled.held.node_of_row = assembled.partition.node_of_row;
  return assembled;
}

bool packs(const PrecomputeOptions& options) {
  return options.low_rank || options.store == formats::ElementType::f16;
}

// Of the rows in the part: halves are made from them when they are packed.
formats::ElementType solved_type(const PrecomputeOptions& options) {
  return options.store == formats::ElementType::f64 ? options.store : formats::ElementType::f32;
}

// Of which a column has a displacement in the bundle.
std::int64_t stored_nodes(const RunInputs& inputs) {
  return inputs.store_interior ? static_cast<std::int64_t>(inputs.body.nodes.size()) : inputs.body.surface_count;
}

// Corridors and the region of a cut: the first rank holds them until they are written; so much of the bundle are they, too.
double corridor_bytes_of(const RunInputs& inputs) {
  return corridor_bytes(inputs.body.corridor_nodes.size(), static_cast<std::size_t>(stored_nodes(inputs))) +
         cut_bytes(inputs.body.cut_nodes.size());
}

// memory, sharable: bytes, of the rank with the least, so that all ranks make the same plan and solve every column alike.
SolverPlan plan_of(const RunInputs& inputs, const Assembled& assembled, const GroupChoice& choice, const Ranks& ranks,
                   double memory, double sharable, const PrecomputeOptions& options) {
  const ElasticBody& body = inputs.body;
  const std::int64_t stored = stored_nodes(inputs);
  // Those that are solved beside the touchable ones' columns, for corridors and the region of a cut.
  std::vector<std::int32_t> others;
  std::ranges::set_union(body.corridor_nodes, body.cut_nodes, std::back_inserter(others));
  const double row_bytes = 9.0 * static_cast<double>(stored * formats::element_bytes(solved_type(options)));
  const double bundle_bytes = row_bytes * static_cast<double>(body.touchable.size()) + corridor_bytes_of(inputs);
  if (choice.ranks_per_operator > 1)
    return plan_of_group(choice, 3 * static_cast<std::int64_t>(body.touchable.size() + others.size()), memory,
                         bundle_bytes);
  std::vector<std::int32_t> column_rows;
  for (const auto node : body.touchable) column_rows.push_back(assembled.held.row_of_node[node]);
  for (const auto node : others)
    if (const auto row = assembled.held.row_of_node[node]; row >= 0) column_rows.push_back(row);
  return make_plan({.matrix = assembled.held.matrix,
                    .column_rows = column_rows,
                    .stored_rows = stored,
                    .columns_at_a_time = options.columns_at_a_time,
                    .available_bytes = memory,
                    .bundle_bytes = bundle_bytes,
                    .ranks = ranks.count(),
                    .cores = usable_cores(),
                    .all_available_bytes = memory * ranks.here(),
                    .form = assembled.form.get(),
                    .ranks_here = ranks.here(),
                    .sharable_bytes = sharable});
}

// On rank 0: which preconditioner an earlier run with the same input and tolerance used, of kPreconditioners; nothing where there
// is no such run.
std::optional<int> preconditioner_of_earlier_run(const RunInputs& inputs, const PrecomputeOptions& options,
                                                 const ResumablePart* part) {
  if (!part || !part->earlier() || !part->earlier()->contains(kPreconditioner)) return {};
  const Fingerprint& earlier = *part->earlier();
  bool same = earlier.value("tolerance", 0.0) == options.tolerance;
  for (const auto& [key, hash] : inputs.hashes) same = same && earlier.value(key, "") == hash;
  if (!same) return {};
  for (int i = 0; i < static_cast<int>(kPreconditioners.size()); ++i)
    if (earlier[kPreconditioner] == kPreconditioners[i]) return i;
  return {};
}

// Collective. The memory that is free now must not throw away columns that an earlier run solved in another way;
// --memory may.
SolverPlan with_earlier_choice(SolverPlan plan, std::optional<int> of_earlier_run, const PrecomputeOptions& options,
                               const Ranks& ranks) {
  if (options.memory_gigabytes != 0) of_earlier_run.reset();
  const int earlier = static_cast<int>(ranks.most(of_earlier_run.value_or(-1)));
  if (earlier < 0 || preconditioner_of(plan) == earlier) return plan;
  plan.cholesky = earlier > 0;
  plan.single = earlier == 2;
  plan.shares_factor = plan.cholesky && plan.can_share(plan.chosen(), plan.ranks_here);
  plan.why += fmt::format("; but {} was begun with the {} and keeps it (--memory decides anew)",
                          part_of(options.bundle).string(), kPreconditioners[earlier]);
  return plan;
}

// The first line of the run; what the memory allows is not known yet.
void tell_solver(const Ranks& ranks) {
  say(fmt::format(
      "PETSc CG on {} rank{}, preconditioner: {}", ranks.count(), ranks.count() > 1 ? "s" : "",
      petsc_option_or("-column_pc_type",
                      "a factor where it fits into the memory (then one in single precision), else multigrid")));
}

void tell_plan(const SolverPlan& plan, const ElasticBody& body, const PrecomputeOptions& options, bool is_first) {
  std::string corridors =
      body.corridor_nodes.empty() ? "" : fmt::format(", {} in corridors", body.corridor_nodes.size());
  if (!body.cut_nodes.empty())
    corridors += fmt::format(", {} of a cut's region, {:.3g} MB", body.cut_nodes.size(),
                             1e-6 * cut_bytes(body.cut_nodes.size()));
  const std::string text =
      fmt::format("mesh    {} nodes ({} surface, {} touchable{}), {} tetrahedra\n{}", body.nodes.size(),
                  body.surface_count, body.touchable.size(), corridors, body.tetrahedra.size(), plan_text(plan));
  if (!options.plan_only) return say(text);
  if (options.json != "-" && is_first) fmt::print("{}\n", text);
  if (!options.json.empty() && is_first) write_json(plan_json(plan), options.json);
}

// Sets up the preconditioner of every column. Takes assembled.own_rows. Null where another rank of the group has
// failed.
std::unique_ptr<ColumnSolver> make_solver(Assembled& assembled, const RunInputs& inputs, const SolverPlan& plan,
                                          const Ranks& ranks, const RankGroup& group, const PrecomputeOptions& options,
                                          OwnPeak& peak) {
  ColumnSolverOptions solver;
  solver.tolerance = options.tolerance;
  solver.cholesky = plan.cholesky;
  solver.single = plan.single;
  solver.width = options.columns_at_a_time > 0 ? options.columns_at_a_time : plan.width();
  solver.form = assembled.form;
  solver.elimination = plan.elimination;
  solver.node_of_row = assembled.held.node_of_row;
  // Collective. A rank whose user took another preconditioner would not come to share the factor.
  const std::string ours = plan.single ? kPcSingle : kPcSupernodal;
  const bool takes_plan = petsc_option_or("-column_pc_type", ours.c_str()) == ours;
  if (plan.shares_factor && ranks.least(takes_plan ? 1 : 0) > 0)
    solver.machine = std::make_shared<MachineMemory>(
        ranks.communicator(), [&] { return ranks.someone_failed(); }, &peak);
  if (group.size() == 1)
    return std::make_unique<ColumnSolver>(assembled.held.matrix,
                                          row_coordinates(assembled.discretisation, assembled.held), solver);
  std::unique_ptr<ColumnSolver> divided;
  const bool fine = group.together([&] {
    divided = divided_column_solver(group.communicator(), std::move(assembled.own_rows), assembled.partition,
                                    inputs.body.nodes, inputs.body.fixed, solver);
  });
  return fine ? std::move(divided) : nullptr;
}

// Where the condition number of K is large, a column with a small residual may have a large error: at 1e12 only four digits are
// certain.
void warn_of_condition(const ColumnSolver& solver) {
  const double reciprocal = solver.reciprocal_condition();
  if (reciprocal > 0 && reciprocal < 1e-12)
    warn(
        fmt::format("the stiffness matrix has a condition of about {:.1g}: displacements may be off by {:.1g} of "
                    "themselves; look for slivers, barely held parts and extreme contrasts of stiffness",
                    1 / reciprocal, 2.2e-16 / reciprocal));
}

std::vector<ColumnBatch> batches_of(const ElasticBody& body, const HeldStiffness& held, const ColumnSolver& solver) {
  std::vector<std::int32_t> order;
  if (const auto order_of_row = solver.row_order(); !order_of_row.empty())
    for (const auto node : body.touchable) order.push_back(order_of_row[held.row_of_node[node]]);
  return column_batches(body.touchable, order, static_cast<std::size_t>(BatchTensors::nodes_per_solve(solver)));
}

// What rank 0 writes before the columns.
struct BegunPart {
  nlohmann::json provenance;  // the numbers of the certificate are still zero
  std::vector<formats::SectionEntry> entries;
};

// The nodes of the rows of K in an order that keeps the factor of K itself sparse, which the runtime makes; empty where the run
// does not store it. The order of the pressure form does not: its separators divide K's graph less well.
std::vector<std::int32_t> elimination_order_of(const HeldStiffness& held, const SolverPlan& plan,
                                               const RunInputs& inputs) {
  if (!inputs.large_deformation) return {};
  if (plan.elimination && !plan.form_blocks)
    return held.node_of_row;  // put_in_order() has brought the rows into that order
  std::vector<std::int32_t> order;
  for (const auto row : analyse_elimination(held.matrix).order) order.push_back(held.node_of_row[row]);
  return order;
}

// What is solved before the columns, and what they are solved with.
struct BeforeColumns {
  const HeldStiffness& held;
  const SolverPlan& plan;
  const ColumnSolver& solver;
  const std::vector<ColumnBatch>& batches;
  const ReciprocitySample& sample;
  const Preload& preload;
  const SolvedMotions& motions;
  const SolvedCorridor& corridor;
};

BegunPart begin_part(ResumablePart& part, const RunInputs& inputs, const PrecomputeOptions& options,
                     const BeforeColumns& before) {
  const BundleContent content{.body = inputs.body,
                              .interior = inputs.store_interior,
                              .preload = before.preload.displacement,
                              .motions = before.motions,
                              .corridor = before.corridor,
                              .response = inputs.fit,
                              .store = solved_type(options),
                              .elimination_order = elimination_order_of(before.held, before.plan, inputs),
                              .laws = laws_of(inputs.body, inputs.organ),
                              .supports = inputs.large_deformation || !inputs.body.cut_nodes.empty()
                                              ? support_stiffness(inputs.body)
                                              : SupportStiffness{}};
  BegunPart begun;
  begun.provenance = provenance_of(options, inputs, content, before.solver.description(), petsc_options_in_force(),
                                   before.solver.width());
  const auto shapes = section_shapes(content);
  Fingerprint fingerprint = fingerprint_of(begun.provenance, shapes, before.batches);
  fingerprint[kPreconditioner] = kPreconditioners[preconditioner_of(before.plan)];
  const std::string text = provenance_text(begun.provenance, Certificate{}) + std::string(kRoomForNumbers, ' ');
  begun.entries = part.begin(
      fingerprint,
      {shapes, text, [&](SectionWriter& writer, const auto& at) { write_body_sections(writer, at, content); }},
      before.batches, before.sample);
  return begun;
}

// Collective: rank 0's, to all ranks.
std::vector<formats::SectionEntry> shared(std::vector<formats::SectionEntry> entries, const Ranks& ranks) {
  int count = static_cast<int>(entries.size());
  MPI_Bcast(&count, 1, MPI_INT, 0, ranks.communicator());
  entries.resize(static_cast<std::size_t>(count));
  MPI_Bcast(entries.data(), static_cast<int>(count * sizeof(formats::SectionEntry)), MPI_BYTE, 0, ranks.communicator());
  return entries;
}

// The journal is opened anew, so that a network file system shows what the other ranks have written.
std::vector<BatchRecord> all_records(const ColumnJob& job) {
  const ColumnJournal journal(job.journal, job.batches, job.sample);
  std::vector<BatchRecord> records;
  for (std::size_t b = 0; b < job.batches.size(); ++b) {
    auto record = journal.read(b);
    if (!record)
      throw OperationError(fmt::format("{}: what was written of batch {} is not there", job.journal.string(), b));
    records.push_back(std::move(*record));
  }
  return records;
}

// On the ranks of the first group. batches: of columns, in the whole run. What is measured depends on their number alone, not on a time, so that
// the same input makes the same bundle.
ElementExcess element_excess_of(const RunInputs& inputs, const Assembled& assembled, ColumnSolver& solver,
                                std::size_t batches, const PrecomputeOptions& options) {
  constexpr double kMostShare = 0.1;  // of all batches
  if (!options.element_stiffness && kBatchesOfElementExcess > kMostShare * static_cast<double>(batches)) {
    note(
        "the element's own stiffness is not measured, which would take over a tenth of this run; --element-stiffness "
        "asks for it");
    return {};
  }
  try {
    return measure_element_excess(inputs.body, inputs.organ.element, assembled.discretisation, assembled.held, solver);
  } catch (const NotConverged&) {
    note("the element's own stiffness is not measured: its loads did not converge");
  }
  return {};
}

// Rank 0: the part is a whole bundle then.
Certificate certify_and_seal(const ColumnJob& job, const BegunPart& begun, const Preload& preload,
                             const ElementExcess& element, double corridor_floor, const ColumnSolver& solver) {
  const std::vector<BatchRecord> records = all_records(job);
  Certificate certificate = certify(job.batches, records, job.sample);
  certificate.preload_residual = preload.residual, certificate.element = element;
  certificate.residual_floor = std::max(certificate.residual_floor, corridor_floor);
  certificate.reciprocal_condition = solver.reciprocal_condition();
  SectionWriter writer(job.part);
  write_column_sections(writer, begun.entries, job.batches, records);
  finish_provenance(job.part, begun.entries, provenance_text(begun.provenance, certificate));
  seal_bundle(job.part, begun.entries, check_rows(job.sections, job.batches, records, job.part));
  return certificate;
}

// Rank 0: the sealed part becomes the bundle, or is packed into it.
void commit(ResumablePart& part, const PrecomputeOptions& options) {
  if (!packs(options)) return part.commit();
  part.commit_packed([&](const std::filesystem::path& from, const std::filesystem::path& to) {
    PackOptions pack;
    pack.bundle = from;
    pack.output = options.bundle;
    if (options.store == formats::ElementType::f16) pack.precision = options.store;
    pack.low_rank = options.low_rank;
    pack_bundle_into(pack, to);
  });
}

// Collective.
PlanOutcome outcome_of(const RunReport& report, double resident_at_plan, const Ranks& ranks) {
  PlanOutcome took;
  took.seconds = report.seconds_of("factor") + report.seconds_of("corridors") + report.seconds_of("columns");
  took.bytes = ranks.most(peak_resident_bytes() - resident_at_plan);
  return took;
}

// The held nodes' part of K, which moves the others, is in no rank's rows.
void refuse_motions_of_supports(const RunInputs& inputs, const PrecomputeOptions& options, const GroupChoice& choice) {
  for (const Motion& motion : inputs.body.motions)
    if (!motion.moves.empty())
      throw InputError(
          fmt::format("{}: [[motion]] \"{}\": expected a mesh whose stiffness one rank holds, found one that {} ranks "
                      "divide; take a coarser mesh, or leave motions of supports out",
                      options.boundary.string(), motion.name, choice.ranks_per_operator));
}

// Every step in turn: what a step needs is in its call, what it gives is its value.
void run_steps(const PrecomputeOptions& options, Ranks& ranks, Output& output) {
  RunReport report(ranks);
  const bool is_first = ranks.rank() == 0;
  // Collective: what each rank may still take, of the one with the least, so that all ranks decide alike.
  const auto memory = [&] { return ranks.least(memory_left_bytes(options.memory_gigabytes, ranks.here())); };

  const RunInputs inputs = report.stage("read", [&] {
    if (is_first && !options.plan_only) {  // first: an output that cannot be written must not fail after hours
      if (!options.json.empty() && options.json != "-") check_target(options.json);
      output.claim(options.bundle);
    }
    if (options.low_rank) check_low_rank(*options.low_rank);
    tell_solver(ranks);
    return read_run_inputs(options);
  });
  const GroupChoice choice =
      choose_group(inputs.body, inputs.organ.element, memory(), ranks.count(), options.ranks_per_operator);
  if (inputs.large_deformation && choice.ranks_per_operator > 1)
    throw InputError(fmt::format(
        "--large-deformation: expected a mesh whose stiffness one rank holds, found one that {} ranks divide; "
        "take a coarser mesh, or leave out the option and large_deformation in [store]",
        choice.ranks_per_operator));
  if (choice.ranks_per_operator > 1) refuse_motions_of_supports(inputs, options, choice);
  const RankGroup group(ranks, choice.ranks_per_operator);
  Assembled assembled = report.stage(
      "assemble", [&] { return group.size() == 1 ? assemble_whole(inputs) : assemble_divided(inputs, group); });
  const double left = std::max(memory() - corridor_bytes_of(inputs), 0.0), sharable = ranks.least(sharable_bytes());
  const double resident_at_plan = resident_bytes();
  SolverPlan plan = report.stage("plan", [&] {
    SolverPlan made = plan_of(inputs, assembled, choice, ranks, left, sharable, options);
    if (made.elimination) made.elimination = put_in_order(assembled.held, *made.elimination, assembled.form.get());
    return made;
  });
  plan = with_earlier_choice(std::move(plan), preconditioner_of_earlier_run(inputs, options, output.part()), options,
                             ranks);
  tell_plan(plan, inputs.body, options, is_first);
  if (options.plan_only) return;

  std::unique_ptr<ColumnSolver> solver = report.stage("factor", [&] {
    auto made = make_solver(assembled, inputs, plan, ranks, group, options, report.own_peak());
    assembled.form.reset();  // its memory: the factor is all that is needed of it
    if (made && is_first) warn_of_condition(*made);
    return made;
  });
  std::vector<ColumnBatch> batches;
  ranks.together([&] { batches = batches_of(inputs.body, assembled.held, *solver); });
  Preload preload;
  if (inputs.boundary.gravity)
    preload = report.stage("preload", [&] {
      Preload solved;
      if (group.index() == 0)
        group.together([&] {
          solved = solve_preload(assembled.discretisation, assembled.held, *inputs.boundary.gravity, *solver);
        });
      return solved;
    });
  ElementExcess element;
  const bool compares = inputs.organ.element == Element::p1 || inputs.organ.element == Element::p1_anp;
  if (group.size() == 1 && compares)
    element = report.stage("element", [&] {
      ElementExcess found;
      if (group.index() == 0)
        group.together([&] { found = element_excess_of(inputs, assembled, *solver, batches.size(), options); });
      return found;
    });
  else if (is_first && compares)
    note("the element's own stiffness is not measured where ranks divide the mesh");
  SolvedMotions motions;
  if (!assembled.motions.empty())
    motions = report.stage("motions", [&] {
      SolvedMotions solved;
      if (group.index() == 0)
        group.together(
            [&] { solved = solve_motions(assembled.discretisation, assembled.held, assembled.motions, *solver); });
      return solved;
    });

  SolvedCorridor corridor;
  if (!inputs.body.corridor_nodes.empty() || !inputs.body.cut_nodes.empty())
    corridor = report.stage("corridors", [&] {
      const CorridorRequest request{inputs.body.corridor_nodes, inputs.body.surface_count, inputs.store_interior,
                                    inputs.body.cut_nodes};
      SolvedCorridor solved;
      if (group.index() == 0)
        group.together([&] { solved = solve_corridor(assembled.discretisation, assembled.held, request, *solver); });
      return solved;
    });

  ReciprocitySample sample(inputs.body);
  const BegunPart begun = report.stage("lay out", [&] {
    if (!is_first) return BegunPart{};
    return begin_part(*output.part(), inputs, options,
                      {assembled.held, plan, *solver, batches, sample, preload, motions, corridor});
  });
  const double corridor_floor = corridor.floor;
  corridor = {};  // its memory: the part has it
  const auto entries = shared(begun.entries, ranks);
  const auto sections = displacement_sections(entries, inputs.body);
  const ColumnJob job{assembled.discretisation,  assembled.held, batches, sample, sections, part_of(options.bundle),
                      journal_of(options.bundle)};
  const auto found = report.stage("look for what is done", [&] {
    if (!is_first) output.lock(options.bundle, ranks.rank());
    return find_safe_batches(job, ranks);
  });
  const auto safe = agree_on_safe_batches(found, ranks);
  const auto resumed = static_cast<std::size_t>(std::count(safe.begin(), safe.end(), 1));
  if (is_first && output.part()->resumes())
    note(
        fmt::format("{} is resumed: {} of {} batches of columns are done", job.part.string(), resumed, batches.size()));
  const SolveSeconds seconds = report.stage("columns", [&] { return solve_columns(job, safe, ranks, group, *solver); });
  double solved_bytes = 0;  // of the bundle before it is packed
  const Certificate certificate = report.stage("seal", [&] {
    if (!is_first) return Certificate{};
    const Certificate made = certify_and_seal(job, begun, preload, element, corridor_floor, *solver);
    solved_bytes = static_cast<double>(std::filesystem::file_size(job.part));
    return made;
  });
  PlanOutcome took = outcome_of(report, resident_at_plan, ranks);
  took.bundle_bytes = solved_bytes;
  const std::string solver_name = solver->description();
  solver.reset();  // packing may need the memory of the factor
  report.stage(packs(options) ? "pack" : "rename", [&] {
    if (is_first) commit(*output.part(), options);
    return true;
  });
  const SolveSeconds slowest{ranks.most(seconds.solve), ranks.most(seconds.wait)};
  if (!is_first) return;
  const RunOutcome outcome{options, inputs, certificate, solver_name, plan, took, slowest, batches.size(), resumed};
  tell(outcome, report);
  if (!options.json.empty()) write_json(json_of(outcome, report), options.json);
}

}  // namespace

void precompute(const PrecomputeOptions& options, Ranks& ranks, StopSignals& signals) {
  Output output(signals);
  try {
    run_steps(options, ranks, output);
  } catch (const OperationError& error) {
    const std::string kept = output.part() ? output.part()->leave() : "";
    throw OperationError(error.what() + (kept.empty() ? "" : "; " + kept));
  }
}

}  // namespace palpate
