#include "programs/player/scene_warnings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>

#include "formats/errors.h"
#include "formats/plausible_size.h"
#include "programs/player/scene_clock.h"
#include "programs/player/summary.h"
#include "programs/player/tool_points.h"
#include "programs/player/tool_turn.h"

namespace palpate {
namespace {

using Vector = SceneConfig::Vector;

constexpr double kNearEnough = 1e-6;   // m: a place that is nearer by less does not matter
constexpr double kShareInside = 1e-6;  // of the organ's diagonal: less deep is the rounding of a point on the surface

double distance(const Vector& a, const Vector& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

struct Box {
  Vector low, high;
};

// Of the organ's surface at rest.
Box box_of_organ(const palpate_bundle* bundle) {
  Box box;
  box.low.fill(std::numeric_limits<double>::infinity()), box.high.fill(-std::numeric_limits<double>::infinity());
  const double* nodes = palpate_bundle_nodes(bundle);
  const std::ptrdiff_t count = nodes ? palpate_bundle_describe(bundle).surface_node_count : 0;
  for (std::ptrdiff_t n = 0; n < count; ++n)
    for (int d = 0; d < 3; ++d) {
      box.low[d] = std::min(box.low[d], nodes[3 * n + d]);
      box.high[d] = std::max(box.high[d], nodes[3 * n + d]);
    }
  return box;
}

std::string millimetres(const Vector& p) {
  return fmt::format("[{:.4g}, {:.4g}, {:.4g}] mm", 1e3 * p[0], 1e3 * p[1], 1e3 * p[2]);
}

// The surface that tools meet, at rest under the scene's preload.
class RestSurface {
 public:
  explicit RestSurface(const NamedOrgan& of) : bundle_(of.organ->bundle()), name_(of.name), pose_(of.pose) {
    SceneDef def;
    def.collision = PALPATE_COLLISION_OFF, def.contact = PALPATE_CONTACT_NODE, def.law = PALPATE_LAW_STICKING;
    def.force = PALPATE_FORCE_OFF, def.shape = PALPATE_SHAPE_OFF, def.queries.queries = PALPATE_QUERIES_ON;
    def.preload = of.organ->scene().def.preload;
    def.fine_surface = of.organ->met_surface();
    palpate_error error{};
    if (palpate_scene_create(bundle_, &def, &scene_, &error) != PALPATE_OK)
      throw OperationError(fmt::format("{}: {}", of.organ->scene().file.string(), error.text));
  }
  ~RestSurface() { palpate_scene_destroy(scene_); }
  RestSurface(const RestSurface&) = delete;
  RestSurface& operator=(const RestSurface&) = delete;

  // Points in the world.
  double signed_distance(const Vector& point) const {
    double found = 0;
    palpate_scene_signed_distance(scene_, nullptr, in_organ(point).data(), &found);
    return found;
  }
  Vector nearest(const Vector& point) const {
    palpate_surface_hit hit = palpate_default_surface_hit();
    palpate_scene_closest_point(scene_, nullptr, in_organ(point).data(), std::numeric_limits<double>::infinity(), &hit);
    Vector in_world{};
    palpate_point_to_world(pose_.position, pose_.orientation, hit.point, in_world.data());
    return in_world;
  }
  // "the organ", or "organ \"liver\"".
  std::string name() const { return name_.empty() ? "the organ" : fmt::format("organ \"{}\"", name_); }
  double diagonal() const {
    const Box box = box_of_organ(bundle_);
    return distance(box.low, box.high);
  }

 private:
  Vector in_organ(const Vector& point) const {
    Vector moved{};
    palpate_point_to_organ(pose_.position, pose_.orientation, point.data(), moved.data());
    return moved;
  }

  palpate_bundle* bundle_;
  std::string name_;
  palpate_pose pose_;
  palpate_scene* scene_ = nullptr;
};
using RestSurfaces = std::vector<std::unique_ptr<const RestSurface>>;

// Where the points of a tool are, m. local: in the tool's frame.
std::vector<Vector> points_at(const SceneConfig::Tool& tool, const std::vector<Vector>& local, double time) {
  const Vector position = position_at(tool.path, time);
  const Rotation turn = turn_at(tool.turn, time);
  std::vector<Vector> points = local;
  for (Vector& p : points) {
    if (!tool.turn.empty()) p = turned(turn, p);
    for (int d = 0; d < 3; ++d) p[d] += position[d];
  }
  return points;
}

struct Place {
  double distance = std::numeric_limits<double>::infinity();  // m from the surface, below zero inside
  double time = 0;
  std::size_t point = 0;
  Vector at{};
  const RestSurface* surface = nullptr;  // the nearest
};

// The surface that a point is nearest to, or deepest in.
Place place_of(const Vector& at, double time, std::size_t point, const RestSurfaces& surfaces) {
  Place found;
  for (const auto& surface : surfaces)
    if (const double d = surface->signed_distance(at); d < found.distance || !found.surface)
      found = {d, time, point, at, surface.get()};
  return found;
}

// Where a tool's points are nearest to a surface, or deepest. A point is asked for again once it has moved so far that it may
// be nearer than the nearest place so far.
Place nearest_place(const SceneConfig& scene, const SceneConfig::Tool& tool, const RestSurfaces& surfaces) {
  const std::vector<Vector> points = tool_points(tool);
  std::vector<double> least(points.size(),
                            -std::numeric_limits<double>::infinity());  // lower bound of the distance now
  std::vector<Vector> before = points_at(tool, points, 0), now;
  Place found;
  const std::uint64_t steps = touch_count_of(scene);
  for (std::uint64_t step = 0; step < steps; ++step) {
    const double time = static_cast<double>(step) / scene.touch_hz;
    if (is_away(tool, time)) continue;
    now = points_at(tool, points, time);
    for (std::size_t p = 0; p < points.size(); ++p) {
      least[p] -= distance(now[p], before[p]);
      if (least[p] >= found.distance - kNearEnough) continue;
      const Place place = place_of(now[p], time, p, surfaces);
      least[p] = place.distance;
      if (least[p] < found.distance) found = place;
    }
    before = now;
  }
  return found;
}

// Where the tool first is there: the deepest point.
Place deepest_start(const SceneConfig::Tool& tool, const RestSurfaces& surfaces) {
  const double start = tool.away.empty() || tool.away[0][0] > 0 ? 0 : tool.away[0][1];
  const std::vector<Vector> points = points_at(tool, tool_points(tool), start);
  Place found;
  for (std::size_t p = 0; p < points.size(); ++p) {
    const Place place = place_of(points[p], start, p, surfaces);
    if (place.distance < found.distance) found = place;
  }
  return found;
}

std::string never_touched(const SceneConfig::Tool& tool, const Place& nearest, const RestSurfaces& surfaces) {
  const std::string begin =
      fmt::format("tool \"{}\" never touched {}: ", tool.name, surfaces.size() == 1 ? surfaces[0]->name() : "an organ");
  if (!std::isfinite(nearest.distance))
    return begin + "its points were too far away at every step to find a distance; is `unit` of the scene right?";
  if (nearest.distance <= 0)
    return begin +
           fmt::format(
               "its point {} was up to {:.3g} mm inside{}, at {:.4g} s and {}, and had no contact; its flags say why",
               nearest.point, -1e3 * nearest.distance, surfaces.size() == 1 ? "" : " " + nearest.surface->name(),
               nearest.time, millimetres(nearest.at));
  return begin +
         fmt::format(
             "its point {} came nearest, {:.4g} mm from the surface{}, at {:.4g} s and {}, where the surface is "
             "at {}{}",
             nearest.point, 1e3 * nearest.distance, surfaces.size() == 1 ? "" : " of " + nearest.surface->name(),
             nearest.time, millimetres(nearest.at), millimetres(nearest.surface->nearest(nearest.at)),
             nearest.distance > nearest.surface->diagonal() ? "; is `unit` of the scene right?" : "");
}

std::string began_inside(const SceneConfig::Tool& tool, const Place& start, bool touched) {
  return fmt::format(
      "tool \"{}\" began inside {}: its point {} begins {:.3g} mm deep, at {}; a point touches nothing until it has "
      "been outside{}; begin its path outside",
      tool.name, start.surface->name(), start.point, -1e3 * start.distance, millimetres(start.at),
      touched ? "" : ", and none of this tool's did");
}

// Of the surface's edges at a node.
double longest_edge(const palpate_bundle* bundle, std::int32_t node) {
  const double* nodes = palpate_bundle_nodes(bundle);
  const std::int32_t* triangles = palpate_bundle_triangles(bundle);
  const auto position = [nodes](std::int32_t n) { return Vector{nodes[3 * n], nodes[3 * n + 1], nodes[3 * n + 2]}; };
  double longest = 0;
  for (std::ptrdiff_t f = 0; f < palpate_bundle_describe(bundle).triangle_count; ++f) {
    const std::int32_t* t = triangles + 3 * f;
    if (std::find(t, t + 3, node) == t + 3) continue;
    for (int i = 0; i < 3; ++i) longest = std::max(longest, distance(position(t[i]), position(node)));
  }
  return longest;
}

void add_far_grips(const PlayedOrgan& organ, const SceneConfig::Tool& tool, std::vector<std::string>& sentences) {
  for (const SceneConfig::Grip& grip : tool.grips) {
    if (!grip.nearest) continue;
    const std::int32_t node = gripped_nodes(grip, organ.bundle(), organ.scene().file).front();
    const double* p = palpate_bundle_nodes(organ.bundle()) + 3 * static_cast<std::size_t>(node);
    const Vector held = {p[0], p[1], p[2]};
    const double edge = longest_edge(organ.bundle(), node);
    if (distance(held, *grip.nearest) <= edge) continue;
    sentences.push_back(
        fmt::format("{}:{}: the grip of tool \"{}\" is {:.4g} mm from {}: the nearest touchable node is at {}, farther "
                    "than its longest edge of {:.3g} mm; give a place on the touchable surface, in the scene's `unit`",
                    organ.scene().file.string(), grip.line, tool.name, 1e3 * distance(held, *grip.nearest),
                    millimetres(*grip.nearest), millimetres(held), 1e3 * edge));
  }
}

}  // namespace

std::vector<std::string> placement_warnings(const SceneConfig& scene, const std::vector<NamedOrgan>& organs,
                                            const std::vector<bool>& touched) {
  std::vector<std::string> sentences;
  RestSurfaces surfaces;  // that tools may touch
  for (const NamedOrgan& of : organs)
    if (of.organ->scene().def.collision != PALPATE_COLLISION_OFF)
      surfaces.push_back(std::make_unique<const RestSurface>(of));
  for (std::size_t t = 0; t < scene.tools.size(); ++t) {
    const SceneConfig::Tool& tool = scene.tools[t];
    // Of the organ's own scene, whose other tools have no grips.
    for (const NamedOrgan& of : organs) add_far_grips(*of.organ, of.organ->scene().tools[t], sentences);
    if (tool.points.empty() && !tool.capsule) continue;
    if (surfaces.empty()) {
      sentences.push_back(fmt::format(
          "tool \"{}\" never touched the organ: its points touch only where collision is \"rest\" or \"deformed\"",
          tool.name));
      continue;
    }
    const Place start = deepest_start(tool, surfaces);
    if (start.surface && start.distance < -kShareInside * start.surface->diagonal())
      sentences.push_back(began_inside(tool, start, touched[t]));
    else if (!touched[t])
      sentences.push_back(never_touched(tool, nearest_place(scene, tool, surfaces), surfaces));
  }
  return sentences;
}

std::vector<std::string> size_warnings(const NamedOrgan& of) {
  const Box box = box_of_organ(of.organ->bundle());
  double longest = 0;
  for (int d = 0; d < 3; ++d) longest = std::max(longest, box.high[d] - box.low[d]);
  if (longest >= kSmallestOrgan && longest <= kLargestOrgan) return {};
  return {fmt::format(
      "the organ of {} bundle is {:.3g} m long, expected 1 cm to 1 m; was mesh_unit right when the bundle was "
      "computed, and before it the unit of the surface or the voxel size of the image?",
      of.name.empty() ? "this" : fmt::format("{}'s", of.name), longest)};
}

std::vector<std::string> displacement_warnings(const NamedOrgan& of, const BundleFields& fields,
                                               const LargestDisplacement& largest) {
  std::string begin = fmt::format("{} moved by {:.3g} mm (node {}, at {:.4g} s), beyond the ",
                                  of.name.empty() ? "the organ" : fmt::format("organ \"{}\"", of.name),
                                  1e3 * largest.length, largest.node, largest.time);
  if (const auto& limit = of.organ->scene().displacement) {
    if (largest.length <= *limit) return {};
    return {begin + fmt::format("{:.3g} mm that `displacement` in the scene's [limits] allows", 1e3 * *limit)};
  }
  if (of.organ->scene().def.large.deformation != PALPATE_DEFORMATION_LINEAR) return {};  // right at any depth
  const auto provenance = nlohmann::json::parse(fields.provenance, nullptr, false);
  const auto stated = provenance.is_object() ? provenance.find("accuracy_linear_limit_mm") : provenance.end();
  const bool measured = stated != provenance.end() && stated->is_number();
  const double linear = measured ? 1e-3 * stated->get<double>() : kLinearLimit;
  const Box box = box_of_organ(of.organ->bundle());
  double smallest = std::numeric_limits<double>::infinity();
  for (int d = 0; d < 3; ++d) smallest = std::min(smallest, box.high[d] - box.low[d]);
  if (largest.length <= std::min(linear, kLargestShare * smallest)) return {};
  std::string limit = linear <= kLargestShare * smallest
                          ? fmt::format("{:.3g} mm up to which linear elasticity is good {}", 1e3 * linear,
                                        measured ? "(measured: accuracy_linear_limit_mm of the bundle)"
                                                 : "(the default liver's figure; this bundle has none of its own)")
                          : fmt::format(
                                "{:.3g} mm that are a tenth of its smallest extent ({:.3g} mm), up to which linear "
                                "elasticity is good",
                                1e3 * kLargestShare * smallest, 1e3 * smallest);
  return {begin + limit + "; press less deep, or say in [limits] which `displacement` you accept"};
}

void LostDeformation::add(double time, const palpate_contacts& contacts) {
  ++touches_;
  if (!(contacts.flags & PALPATE_STEP_DEFORMATION_BEHIND) || !(contacts.body_residual > kUndone)) return;
  if (undone_++ == 0) first_ = time;
}

std::vector<std::string> LostDeformation::warnings() const {
  if (undone_ == 0) return {};
  return {
      fmt::format("large deformation diverged at {:.4g} s: {} of {} touches were undone, in which the organ stayed as "
                  "it was in the touch before; "
                  "move more slowly, press less deep, raise `operations` in [limits], or take a coarser mesh",
                  first_, undone_, touches_)};
}

void FlagCounts::add(palpate_step_flags flags) {
  ++steps_;
  for (std::size_t bit = 0; bit < steps_with_.size(); ++bit) steps_with_[bit] += flags >> bit & 1;
}

std::vector<std::string> FlagCounts::warnings(const std::string& steps) const {
  std::vector<std::string> sentences;
  for (std::size_t bit = 0; bit < steps_with_.size(); ++bit) {
    if (steps_with_[bit] == 0) continue;
    const auto names = flag_names(palpate_step_flags{1} << bit);
    sentences.push_back(fmt::format("{} of {} {} raised {}: docs/troubleshooting.md says what that means",
                                    steps_with_[bit], steps_, steps,
                                    names.empty() ? "an unknown flag" : names.front()));
  }
  return sentences;
}

}  // namespace palpate
