#include "meshing/tetrahedra/tetrahedra_from_surfaces.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

#include "formats/errors.h"
#include "formats/processor_limit.h"
#include "formats/program.h"
#include "meshing/surface/extract_surface.h"
#include "meshing/surface/remesh.h"
#include "meshing/surface/surface_checks.h"
#include "meshing/surface/surface_report.h"
#include "meshing/tetrahedra/in_child_process.h"
#include "meshing/tetrahedra/mesh_bytes.h"

namespace palpate {
namespace {

constexpr double kFewest = 2000, kMost = 40'000;  // triangles of remeshed surfaces
// The surface's own triangles get one quick try where their worst radius ratio is below the first number (even remeshing gives
// 0.5 and more), or where their edges are longer than the second number of edges inside.
constexpr double kHopeful = 0.2, kLongEdges = 3;
constexpr double kPromising = 0.9;  // of the angle that the gate asks for
constexpr double kAttainable = 20;  // degrees; even triangles, however many, seldom give a larger smallest angle
// The smallest dihedral angle of a part thinner than the edges is in proportion to one over their length. From one try to the
// next, triangles grow in number for 1.5 times the angle that the gate asks for, within these factors.
constexpr double kAngleWanted = 1.5, kLeastGrowth = 3, kMostGrowth = 10;
// Processor time: a step that hangs leaves time for another way.
constexpr double kHurriedSeconds = 5, kShareOfOwn = 0.5, kShareOfRemeshing = 0.6, kLeastSeconds = 1, kShortest = 0.1;
constexpr double kRemeshingSeconds = 1.2e-3;  // for each triangle made: twice that of an EPYC at 2.4 GHz
constexpr double kShareOfTries = 0.9;         // of the limit; the rest is for checks
constexpr double kPatience = 1e6;             // seconds by the clock, which other programs may take most of
constexpr int kRounds = 4;

std::string at(const Point& p) {
  return fmt::format("({:.6g}, {:.6g}, {:.6g})", p[0], p[1], p[2]);
}

// Refuses inputs that touch each other; each surface alone has been checked before.
void refuse_contact(const std::vector<ShellInput>& inputs) {
  std::vector<TriangleSurface> surfaces;
  for (const ShellInput& input : inputs) surfaces.push_back(input.surface);
  const SelfIntersections crossings = find_self_intersections(join_shells(surfaces));
  if (crossings.pairs > 0)
    throw InputError(
        fmt::format("the inputs cross or touch one another: {} pairs of triangles, the first near {}; expected "
                    "surfaces apart or one "
                    "inside another; mesh touching tissues from their label image with --labels",
                    crossings.pairs, at(crossings.place)));
}

std::size_t triangles_of(const std::vector<ShellInput>& inputs) {
  std::size_t count = 0;
  for (const ShellInput& input : inputs) count += input.surface.triangles.size();
  return count;
}

MeshReport fill(const std::vector<ShellInput>& inputs, const SurfaceFillOptions& options) {
  const VolumeBoundary boundary = regions_of_shells(inputs, options.nested_regions, options.names);
  MeshReport report;
  for (const auto& patch : boundary.patches) report.surface_triangles += patch.triangles.size();
  note(fmt::format("filling {} region{} inside {} triangles", boundary.region_names.size(),
                   boundary.region_names.size() == 1 ? "" : "s", report.surface_triangles));
  report.mesh = fill_with_tetrahedra(boundary, options.fill, &report.improvement);
  report.kept_triangles = verify_boundary_kept(boundary, report.mesh);
  report.region_volume_of_surface = enclosed_volumes(boundary);
  return report;
}

// The tries, and the best mesh of them.
class Tries {
 public:
  explicit Tries(const SurfaceFillOptions& options) : options_(options) {}

  enum class Effort {
    full,       // search for a better mesh with other settings
    promising,  // only where the first mesh is near the gate
    least       // never
  };
  // Returns whether the mesh meets the gate. Otherwise why() says what is wrong. seconds: of processor time.
  bool run(const std::vector<ShellInput>& inputs, bool remeshed, double seconds, Effort effort) {
    last_dihedral_ = 0;
    SurfaceFillOptions tried = options_;
    tried.fill.processor_limit = seconds;
    if (effort == Effort::promising) tried.fill.hopeless = kPromising * options_.gate.min_dihedral;
    if (effort == Effort::least) tried.fill.goal = 0;
    try {
      MeshReport report = fill(inputs, tried);
      report.remeshed = remeshed;
      const MeshQuality quality = measure_quality(report.mesh);
      last_dihedral_ = quality.dihedral.value;
      try {
        pass_gate(report.mesh, quality, options_.gate);
        why_.clear();
      } catch (const VerificationError& missed) {
        why_ = missed.what();
      }
      if (!best_ || why_.empty() || quality.dihedral.value > best_dihedral_) {
        best_dihedral_ = quality.dihedral.value;
        best_ = std::move(report);
      }
      return why_.empty();
    } catch (const OperationError& failed) {
      why_ = failed.what();
    } catch (const VerificationError& failed) {
      why_ = failed.what();
    }
    return false;
  }

  const std::string& why() const { return why_; }
  double last_dihedral() const { return last_dihedral_; }  // degrees; 0 where the last try gave no mesh
  std::optional<MeshReport>& best() { return best_; }

 private:
  const SurfaceFillOptions& options_;
  std::optional<MeshReport> best_;
  double best_dihedral_ = 0, last_dihedral_ = 0;
  std::string why_;
};

// What make gives for every input and its share of all triangles. what: as in run_in_child. seconds: of processor time. Errors: those of
// make, OutOfTime.
template <typename Make>
std::vector<ShellInput> with_other_triangles(const std::vector<ShellInput>& inputs, const std::string& what,
                                             double seconds, const Make& make) {
  const double own = static_cast<double>(triangles_of(inputs));
  std::vector<ShellInput> result = inputs;
  for (ShellInput& input : result) {
    const double share = static_cast<double>(input.surface.triangles.size()) / own;
    input.surface = surface_from_bytes(run_in_child(
        what, kPatience, [&] { return to_bytes(make(input, share)); }, std::max(kLeastSeconds / 2, seconds * share)));
  }
  return result;
}

void tell(const std::vector<ShellInput>& before, const std::vector<ShellInput>& after, const char* how) {
  for (std::size_t i = 0; i < before.size(); ++i) {
    const TriangleSurface &own = before[i].surface, &made = after[i].surface;
    const SurfaceDistance there = measure_distance(own, made), back = measure_distance(made, own);
    warn(fmt::format(
        "{}: remeshed {}, {} triangles in place of {}; the surfaces are up to {:.3g} apart; "
        "--keep-surface forbids this",
        before[i].file, how, made.triangles.size(), own.triangles.size(), std::max(there.most_mm, back.most_mm)));
  }
}

// Remeshes every input with edges of about this size between its sharp edges. Errors: InputError where a surface then crosses itself,
// OutOfTime.
std::vector<ShellInput> remeshed_between_edges(const std::vector<ShellInput>& inputs, double size, double seconds) {
  const auto result = with_other_triangles(
      inputs, fmt::format("remeshing with edges of {:g}", size), seconds, [&](const ShellInput& input, double) {
        const TriangleSurface made = remesh_between_edges(input.surface, size);
        if (const std::string defect = first_defect(made); !defect.empty())
          throw InputError(fmt::format("{}: remeshed between its sharp edges, {}", input.file, defect));
        return made;
      });
  tell(inputs, result, "between its sharp edges");
  if (result.size() > 1) refuse_contact(result);
  return result;
}

// Remeshes every input evenly with its share of the triangles. seconds: of processor time, for all inputs. Errors:
// InputError where no valid surface is found, OutOfTime.
std::vector<ShellInput> remeshed(const std::vector<ShellInput>& inputs, double triangles, double seconds) {
  const auto result = with_other_triangles(inputs, fmt::format("remeshing with {:.0f} triangles", triangles), seconds,
                                           [&](const ShellInput& input, double share) {
                                             SurfaceTarget target;
                                             target.triangles =
                                                 static_cast<std::size_t>(std::max(40.0, triangles * share));
                                             int attempts = 0;
                                             return remesh_surface(input.surface, target, input.file, &attempts);
                                           });
  tell(inputs, result, "evenly");
  if (result.size() > 1) refuse_contact(result);
  return result;
}

// finest: the most even triangles that were filled; limit: the seconds that ran out, or 0.
std::string what_was_tried(double finest, double limit) {
  const std::string more_time = limit > 0 ? fmt::format("; --time-limit {:.6g} lets it try more", 4 * limit) : "";
  if (finest == 0) return fmt::format("no even triangles were made in {:.6g} s of processor time{}", limit, more_time);
  return fmt::format("even triangles, up to {:.0f} of them, gave no better mesh: thin parts or sharp edges are there{}",
                     finest, more_time);
}

}  // namespace

double default_processor_limit(const std::vector<ShellInput>& inputs, double size) {
  double vertices = 0;
  for (const ShellInput& input : inputs)
    if (size > 0) vertices += 1.4 * std::abs(enclosed_volume(input.surface)) / (size * size * size);
  return std::max(20.0, 2e-4 * static_cast<double>(triangles_of(inputs)) + 5e-4 * vertices);
}

WorstInput worst_input(const std::vector<ShellInput>& inputs) {
  WorstInput worst;
  for (const ShellInput& input : inputs)
    if (const WorstTriangle triangle = worst_triangle(input.surface);
        triangle.radius_ratio < worst.triangle.radius_ratio)
      worst = {triangle, input.file};
  return worst;
}

GateObstacle gate_obstacle(const TriangleSurface& surface, const QualityGate& gate) {
  const auto normal = [&](const Triangle& t) {
    return cross(surface.points[t[1]] - surface.points[t[0]], surface.points[t[2]] - surface.points[t[0]]);
  };
  std::map<std::pair<std::int32_t, std::int32_t>, std::size_t> triangle_at;  // by directed edge
  double least_ratio = 1;
  GateObstacle obstacle;
  for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
    const Triangle& t = surface.triangles[i];
    for (int c = 0; c < 3; ++c) triangle_at[{t[c], t[(c + 1) % 3]}] = i;
    const Point &p = surface.points[t[0]], &q = surface.points[t[1]], &r = surface.points[t[2]];
    const double ratio = radius_ratio(p, q, r);
    if (ratio >= least_ratio) continue;
    least_ratio = ratio;
    obstacle.place = (1.0 / 3) * (p + q + r);
  }
  if (1.5 * least_ratio < gate.min_radius_ratio) {
    obstacle.found = fmt::format(
        "a triangle of radius ratio {:.2g} (no element on it has more than {:.2g}, and --min-radius-ratio is {:g})",
        least_ratio, 1.5 * least_ratio, gate.min_radius_ratio);
    return obstacle;
  }
  double least_angle = 360;
  for (const auto& [edge, i] : triangle_at) {
    const auto other = triangle_at.find({edge.second, edge.first});
    if (other == triangle_at.end() || edge.first > edge.second) continue;
    const Point along = surface.points[edge.second] - surface.points[edge.first];
    const Point n = normal(surface.triangles[i]), m = normal(surface.triangles[other->second]);
    const double turn = std::atan2(dot(cross(n, m), along) / std::sqrt(dot(along, along)), dot(n, m));
    const double inner = 180 - turn * 180 / std::numbers::pi;
    if (inner >= least_angle) continue;
    least_angle = inner;
    obstacle.place = 0.5 * (surface.points[edge.first] + surface.points[edge.second]);
  }
  if (least_angle < gate.min_dihedral)
    obstacle.found = fmt::format("an edge with an inner angle of {:.2g} degrees (--min-dihedral is {:g})", least_angle,
                                 gate.min_dihedral);
  return obstacle;
}

MeshReport tetrahedra_from_surfaces(std::vector<ShellInput> inputs, const SurfaceFillOptions& options) {
  const double limit =
      options.processor_limit > 0 ? options.processor_limit : default_processor_limit(inputs, options.fill.size);
  const double end = processor_seconds() - options.processor_used + kShareOfTries * limit;
  const auto left = [&] { return std::max(kShortest, end - processor_seconds()); };
  if (inputs.size() > 1) refuse_contact(inputs);
  regions_of_shells(inputs, options.nested_regions, options.names);  // refuses names and nesting before any try
  std::string file, why;
  for (const ShellInput& input : inputs) {
    const GateObstacle obstacle = gate_obstacle(input.surface, options.gate);
    if (obstacle.found.empty() || !why.empty()) continue;
    why = fmt::format("{} near {}", obstacle.found, at(obstacle.place));
    file = input.file;
  }
  const WorstInput worst = worst_input(inputs);
  bool too_long = false;
  const auto refuse = [&](const std::string& found, const std::string& other_way) {
    throw OperationError(fmt::format(
        "{}: no tetrahedra were found {}; {}; {}{}{}", worst.file, found, text_of(worst.triangle), other_way,
        wrap_advice(worst.file),
        too_long || left() < kLeastSeconds ? fmt::format(", or give it longer: --time-limit {:.6g}", 4 * limit) : ""));
  };
  Tries tries(options);
  if (options.keep_surface) {
    if (!why.empty()) warn(fmt::format("{}: the surface's own triangles cannot meet the gate: {}", file, why));
    if (!tries.run(inputs, false, left(), Tries::Effort::full) && !tries.best())
      refuse("(" + tries.why() + ")", "leave out --keep-surface, or ");
    return std::move(*tries.best());
  }
  // How many even triangles have edges as long as those asked for inside.
  double of_size = 0;
  for (const ShellInput& input : inputs)
    if (options.fill.size > 0) of_size += triangles_for_edge(area(input.surface), options.fill.size);
  const double own = static_cast<double>(triangles_of(inputs));
  const bool needles = worst.triangle.radius_ratio < kHopeful,
             hurried = needles || of_size > kLongEdges * kLongEdges * own;
  const double for_own = hurried ? std::min(kHurriedSeconds, left() / 4) : kShareOfOwn * left();
  const Tries::Effort effort = needles   ? Tries::Effort::least
                               : hurried ? Tries::Effort::promising
                                         : Tries::Effort::full;
  if (why.empty() && tries.run(inputs, false, for_own, effort)) return std::move(*tries.best());
  if (tries.last_dihedral() >= kAttainable) return std::move(*tries.best());
  if (why.empty())
    warn(fmt::format("{}: the surface's own triangles do not meet the gate: {}", inputs.front().file, tries.why()));
  else
    warn(fmt::format("{}: the surface's own triangles cannot meet the gate: {}", file, why));
  if (why.empty() && hurried && !needles && of_size <= kMost) {
    try {
      const auto shorter = remeshed_between_edges(inputs, options.fill.size, left() / 4);
      if (tries.run(shorter, true, left() / 4, Tries::Effort::promising)) return std::move(*tries.best());
      note(fmt::format("{}: {}", worst.file, tries.why()));
    } catch (const OutOfTime& stopped) {
      note(fmt::format("{}: {}", worst.file, stopped.what()));
    } catch (const InputError& failed) {
      note(failed.what());
    }
  }
  // No more than can be made in the time that is left for certain, so that the number does not depend on the time that was taken.
  const double for_remeshing = kShareOfRemeshing * kShareOfTries * limit * (why.empty() ? 1 - kShareOfOwn : 1);
  const double most = std::clamp(for_remeshing / kRemeshingSeconds, kFewest, kMost);
  double triangles = std::clamp(std::max(own, of_size), kFewest, most), finest = 0;
  std::string last;
  for (int round = 0; round < kRounds && left() > kLeastSeconds; ++round) {
    bool fewer = false;
    const double seconds = kShareOfRemeshing * left();
    try {
      const auto even = remeshed(inputs, triangles, seconds);
      finest = std::max(finest, triangles);
      if (tries.run(even, true, left(), Tries::Effort::promising)) return std::move(*tries.best());
      last = tries.why();
      if (tries.last_dihedral() >= kAttainable) break;
    } catch (const OutOfTime& stopped) {
      last = stopped.what();
      fewer = too_long = true;
      note(fmt::format("{}: {}", worst.file, last));
    } catch (const OperationError& failed) {
      last = failed.what();
    } catch (const InputError& failed) {
      last = failed.what();
    }
    const double angle_grows =
        tries.last_dihedral() > 0 ? kAngleWanted * options.gate.min_dihedral / tries.last_dihedral() : 0;
    const double growth = std::clamp(angle_grows * angle_grows, kLeastGrowth, kMostGrowth);
    const double next = fewer ? std::max(kFewest, triangles / 4) : std::min(kMost, growth * triangles);
    if (next == triangles) break;
    triangles = next;
  }
  if (tries.best())
    tries.best()->tried = what_was_tried(finest, left() < kLeastSeconds ? limit : 0);
  else
    refuse(fmt::format(
               "within {:.6g} s of processor time, neither with the surface's own triangles nor with even ones ({})",
               limit, last.empty() ? tries.why() : last),
           "");
  return std::move(*tries.best());
}

}  // namespace palpate
