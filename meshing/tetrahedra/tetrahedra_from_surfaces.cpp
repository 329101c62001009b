#include "meshing/tetrahedra/tetrahedra_from_surfaces.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

#include "formats/errors.h"
#include "formats/program.h"
#include "meshing/surface/extract_surface.h"
#include "meshing/surface/surface_checks.h"
#include "meshing/surface/surface_report.h"

namespace palpate {
namespace {

constexpr double kFewest = 2000, kMost = 20'000;  // triangles of remeshed surfaces
// Radius ratios of triangles: below the first, the surface's own triangles get one quick try; from the second on, even
// triangles would not be much better. Even remeshing gives 0.5 and more.
constexpr double kHopeful = 0.2, kWellShaped = 0.5;
constexpr double kMostSeconds = 20;  // of processor time; no further remeshing begins after it

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

// Processor seconds of this program and its finished children.
double processor_seconds() {
  double sum = 0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    getrusage(who, &usage);
    sum += static_cast<double>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
           1e-6 * static_cast<double>(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
  }
  return sum;
}

// Processor seconds that a try may take.
double allowance(const std::vector<ShellInput>& inputs, double size) {
  double vertices = static_cast<double>(triangles_of(inputs));
  for (const ShellInput& input : inputs)
    if (size > 0) vertices += 1.4 * std::abs(enclosed_volume(input.surface)) / (size * size * size);
  return 10 + 1e-3 * vertices;
}

// The tries, and the best mesh of them.
class Tries {
 public:
  explicit Tries(const SurfaceFillOptions& options) : options_(options) {}

  // Returns whether the mesh meets the gate. Otherwise why() says what is wrong. hurried: one quick try, because the
  // surface's own triangles give little hope.
  bool run(const std::vector<ShellInput>& inputs, bool remeshed, bool hurried = false) {
    SurfaceFillOptions tried = options_;
    if (!options_.keep_surface) tried.fill.processor_limit = allowance(inputs, options_.fill.size);
    if (hurried) {
      tried.fill.processor_limit = 5;
      tried.fill.goal = 0;
    }
    try {
      MeshReport report = fill(inputs, tried);
      report.remeshed = remeshed;
      const MeshQuality quality = measure_quality(report.mesh);
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
  std::optional<MeshReport>& best() { return best_; }

 private:
  const SurfaceFillOptions& options_;
  std::optional<MeshReport> best_;
  double best_dihedral_ = 0;
  std::string why_;
};

// The least radius ratio of the inputs' triangles.
double worst_triangle(const std::vector<ShellInput>& inputs) {
  double least = 1;
  for (const auto& [surface, file, name] : inputs)
    for (const auto& [a, b, c] : surface.triangles)
      least = std::min(least, radius_ratio(surface.points[a], surface.points[b], surface.points[c]));
  return least;
}

// Remeshes every input evenly with its share of the triangles.
std::vector<ShellInput> remeshed(const std::vector<ShellInput>& inputs, double triangles) {
  const double own = static_cast<double>(triangles_of(inputs));
  std::vector<ShellInput> result = inputs;
  for (ShellInput& input : result) {
    const TriangleSurface before = input.surface;
    const double share = static_cast<double>(before.triangles.size()) / own;
    SurfaceTarget target;
    target.triangles = static_cast<std::size_t>(std::max(40.0, triangles * share));
    int attempts = 0;
    input.surface = remesh_surface(before, target, input.file, &attempts);
    const SurfaceDistance there = measure_distance(before, input.surface),
                          back = measure_distance(input.surface, before);
    warn(fmt::format(
        "{}: remeshed evenly, {} triangles in place of {}; the surfaces are up to {:.3g} apart; "
        "--keep-surface forbids this",
        input.file, input.surface.triangles.size(), before.triangles.size(), std::max(there.most_mm, back.most_mm)));
  }
  if (result.size() > 1) refuse_contact(result);
  return result;
}

std::string cure(const std::vector<ShellInput>& inputs) {
  return fmt::format("make a cleaner surface: palpate-surface {} --wrap -o NEW.ply", inputs.front().file);
}

}  // namespace

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
  if (inputs.size() > 1) refuse_contact(inputs);
  std::string file, why;
  for (const ShellInput& input : inputs) {
    const GateObstacle obstacle = gate_obstacle(input.surface, options.gate);
    if (obstacle.found.empty() || !why.empty()) continue;
    why = fmt::format("{} near {}", obstacle.found, at(obstacle.place));
    file = input.file;
  }
  Tries tries(options);
  if (options.keep_surface) {
    if (!why.empty()) warn(fmt::format("{}: the surface's own triangles cannot meet the gate: {}", file, why));
    if (!tries.run(inputs, false) && !tries.best())
      throw OperationError(
          fmt::format("{}: {}; leave out --keep-surface, or {}", inputs.front().file, tries.why(), cure(inputs)));
    return std::move(*tries.best());
  }
  const double worst = worst_triangle(inputs);
  if (why.empty() && tries.run(inputs, false, worst < kHopeful)) return std::move(*tries.best());
  if (why.empty() && tries.best() && worst >= kWellShaped) return std::move(*tries.best());
  if (why.empty())
    warn(fmt::format("{}: the surface's own triangles do not meet the gate: {}", inputs.front().file, tries.why()));
  else
    warn(fmt::format("{}: the surface's own triangles cannot meet the gate: {}", file, why));
  double triangles = std::clamp(static_cast<double>(triangles_of(inputs)), kFewest, kMost);
  std::string last;
  for (int round = 0; round < 3; ++round) {
    try {
      if (tries.run(remeshed(inputs, triangles), true)) return std::move(*tries.best());
      last = tries.why();
    } catch (const InputError& failed) {
      last = failed.what();
    }
    if (triangles == kMost || processor_seconds() > kMostSeconds) break;
    triangles = std::min(kMost, 3 * triangles);
  }
  if (tries.best()) return std::move(*tries.best());
  throw OperationError(
      fmt::format("{}: no tetrahedra were found, neither with the surface's own triangles nor with up to {} even "
                  "ones: {}; {}",
                  inputs.front().file, kMost, last, cure(inputs)));
}

}  // namespace palpate
