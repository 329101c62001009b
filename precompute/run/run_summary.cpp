#include "precompute/run/run_summary.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "formats/atomic_file.h"
#include "formats/program.h"

namespace palpate {
namespace {

std::string fitted(const char* name, const ResponsePolynomial& p) {
  return fmt::format("{} misses the measured curve by {:.2g} rms and at most {:.2g} of its largest value{}", name,
                     p.rms, p.largest, p.note.empty() ? "" : " (" + p.note + ")");
}

// Of the file that is there now; outcome.took has those of the rows that were solved.
std::uintmax_t bundle_bytes(const RunOutcome& outcome) {
  return std::filesystem::file_size(outcome.options.bundle);
}

}  // namespace

void tell(const RunOutcome& outcome, const RunReport& report) {
  const Certificate& c = outcome.certificate;
  if (const auto& fit = outcome.inputs.fit)
    note(fitted("Q", fit->force) + (fit->radial.coefficient.empty() ? "" : "; " + fitted("P", fit->radial)));
  note(
      fmt::format("{}; worst column: node {} dof {}, true relative residual {:.2g} (tolerance {:.2g}); at most {} "
                  "iterations; reciprocity error of far pairs {:.2g} ({} pairs); rounding to the stored type changed a "
                  "column by at "
                  "most {:.2g}",
                  outcome.solver, c.worst_node, "xyz"[c.worst_dof], c.worst_residual, outcome.options.tolerance,
                  c.most_iterations, c.reciprocity_error, c.reciprocity_pairs, c.cast_error));
  if (const ElementExcess& own = c.element; own.probes > 0)
    note(fmt::format(
        "the element {} makes this mesh too stiff by about {:.2g} % (median of {} loads; the largest {:.2g} %)",
        name_of(outcome.inputs.organ.element), 100 * own.median, own.probes, 100 * own.largest));
  if (c.worst_residual > outcome.options.tolerance)
    warn(fmt::format(
        "double precision cannot solve some columns to the tolerance of {:.2g}: it allows {:.2g} for the worst "
        "of them, and their true relative residuals are at most {:.2g}",
        outcome.options.tolerance, c.residual_floor, c.worst_residual));
  if (const std::size_t count = warnings().size(); count > 0)
    say(fmt::format("{} warning{} above", count, count > 1 ? "s" : ""));
  say(outcome_text(outcome.plan, outcome.took));
  say(fmt::format("{}: {} columns, {:.4g} MB, in {}; peak memory {:.2g} GB", outcome.options.bundle.string(),
                  3 * outcome.inputs.body.touchable.size(), 1e-6 * static_cast<double>(bundle_bytes(outcome)),
                  duration_text(report.seconds()), report.peak_bytes() / 1e9));
}

nlohmann::ordered_json json_of(const RunOutcome& outcome, const RunReport& report) {
  const Certificate& c = outcome.certificate;
  const ElasticBody& body = outcome.inputs.body;
  nlohmann::ordered_json json;
  json["program"] = "palpate-precompute";
  json["program_version"] = PALPATE_VERSION;
  json["bundle"] = outcome.options.bundle.string();
  json["warnings"] = warnings();
  json["bundle_bytes"] = bundle_bytes(outcome);
  json["nodes"] = body.nodes.size();
  json["surface_nodes"] = body.surface_count;
  json["touchable_nodes"] = body.touchable.size();
  json["tetrahedra"] = body.tetrahedra.size();
  json["columns"] = 3 * body.touchable.size();
  json["column_batches"] = outcome.batches;
  json["column_batches_of_earlier_runs"] = outcome.resumed;
  json["solver"] = outcome.solver;
  json["plan"] = plan_json(outcome.plan);
  json["predicted_and_took"] = outcome_json(outcome.plan, outcome.took);
  json["columns_seconds"] = {{"solve", outcome.columns.solve}, {"wait_for_disk", outcome.columns.wait}};
  json["tolerance"] = outcome.options.tolerance;
  json["certificate"] = {{"worst_residual", c.worst_residual},
                         {"worst_column_node", c.worst_node},
                         {"worst_column_dof", c.worst_dof},
                         {"most_iterations", c.most_iterations},
                         {"reciprocity_error", c.reciprocity_error},
                         {"reciprocity_pairs", c.reciprocity_pairs},
                         {"cast_error", c.cast_error},
                         {"element_probes", c.element.probes},
                         {"element_excess", c.element.largest},
                         {"element_excess_median", c.element.median}};
  json.update(report.json());
  return json;
}

void write_json(const nlohmann::ordered_json& report, const std::string& where) {
  const std::string text = report.dump(2) + "\n";
  if (where == "-")
    fmt::print("{}", text);
  else
    write_text_atomically(where, text);
}

}  // namespace palpate
