#include "programs/player/tool_places.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "formats/errors.h"

namespace palpate {
namespace {

using Vector = SceneConfig::Vector;
using Triangle = std::array<std::int32_t, 3>;
using At = SceneConfig::Place::At;

Vector minus(const Vector& a, const Vector& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
double dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
Vector weighted(const std::array<Vector, 3>& v, const Vector& weights) {
  Vector sum{};
  for (int c = 0; c < 3; ++c)
    for (int d = 0; d < 3; ++d) sum[d] += weights[c] * v[c][d];
  return sum;
}

// The surface of a bundle with its normals.
struct Surface {
  std::vector<Vector> nodes, normals;   // of the surface nodes; normals as long as twice the area around
  std::vector<char> touchable;          // [surface nodes]
  std::vector<Triangle> triangles;      // that are searched
  std::vector<std::int32_t> numbers;    // of these triangles, in the bundle
  std::vector<char> away_from_the_end;  // [surface nodes] touchable, as all nodes around
  Vector low{}, high{};
};

Surface surface_of(const palpate_bundle* bundle, PlaceFinder::Where where) {
  const palpate_bundle_info info = palpate_bundle_describe(bundle);
  const double* nodes = palpate_bundle_nodes(bundle);
  const std::int32_t *triangles = palpate_bundle_triangles(bundle), *touchable = palpate_bundle_touchable(bundle);
  Surface surface;
  const auto count = static_cast<std::size_t>(info.surface_node_count);
  surface.nodes.resize(count), surface.normals.resize(count), surface.touchable.resize(count);
  surface.low.fill(std::numeric_limits<double>::infinity()), surface.high = surface.low;
  for (double& x : surface.high) x = -x;
  for (std::size_t n = 0; n < count; ++n)
    for (int d = 0; d < 3; ++d) {
      surface.nodes[n][d] = nodes[3 * n + static_cast<std::size_t>(d)];
      surface.low[d] = std::min(surface.low[d], surface.nodes[n][d]);
      surface.high[d] = std::max(surface.high[d], surface.nodes[n][d]);
    }
  for (std::int32_t t = 0; t < info.touchable_count; ++t) surface.touchable[touchable[t]] = 1;
  surface.away_from_the_end = surface.touchable;
  for (std::int32_t t = 0; t < info.triangle_count; ++t) {
    const std::int32_t* n = triangles + 3 * static_cast<std::size_t>(t);
    const Vector normal =
        cross(minus(surface.nodes[n[1]], surface.nodes[n[0]]), minus(surface.nodes[n[2]], surface.nodes[n[0]]));
    const bool whole = surface.touchable[n[0]] && surface.touchable[n[1]] && surface.touchable[n[2]];
    for (int c = 0; c < 3; ++c) {
      for (int d = 0; d < 3; ++d) surface.normals[n[c]][d] += normal[d];
      if (!whole) surface.away_from_the_end[n[c]] = 0;
    }
    if (whole || where == PlaceFinder::Where::surface)
      surface.triangles.push_back({n[0], n[1], n[2]}), surface.numbers.push_back(t);
  }
  return surface;
}

// The direction in the frame's axes; LPS: x to the left, y to the back, z to the head. RAS: x to the right, y to the front.
Vector direction_of(At at, const std::string& frame) {
  const double turned = frame == "RAS" ? -1 : 1;
  switch (at) {
    case At::foremost:
      return {0, -turned, 0};
    case At::hindmost:
      return {0, turned, 0};
    case At::leftmost:
      return {turned, 0, 0};
    case At::rightmost:
      return {-turned, 0, 0};
    case At::uppermost:
      return {0, 0, 1};
    case At::lowest:
      return {0, 0, -1};
  }
  return {};
}

std::string frame_of(const palpate_bundle* bundle) {
  std::size_t bytes = 0;
  const char* text = palpate_bundle_provenance(bundle, &bytes);
  const nlohmann::json json = text ? nlohmann::json::parse(text, text + bytes, nullptr, false) : nlohmann::json();
  return json.is_object() && json.contains("frame") && json["frame"].is_string() ? json["frame"].get<std::string>()
                                                                                 : "";
}

// The barycentric coordinates of the point of a triangle that is nearest to p: Ericson 2005, Real-Time Collision Detection,
// section 5.1.5.
Vector nearest_in_triangle(const Vector& p, const Vector& a, const Vector& b, const Vector& c) {
  const Vector ab = minus(b, a), ac = minus(c, a), ap = minus(p, a), bp = minus(p, b), cp = minus(p, c);
  const double d1 = dot(ab, ap), d2 = dot(ac, ap), d3 = dot(ab, bp), d4 = dot(ac, bp), d5 = dot(ab, cp),
               d6 = dot(ac, cp);
  if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
  if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
  if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
  const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return {1 - d1 / (d1 - d3), d1 / (d1 - d3), 0};
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return {1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)};
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0, 1 - w, w};
  }
  const double sum = va + vb + vc;
  return {va / sum, vb / sum, vc / sum};
}

SurfacePlace with_unit_normal(const Vector& point, Vector normal) {
  const double length = std::sqrt(dot(normal, normal));
  for (double& x : normal) x /= length > 0 ? length : 1;
  return {point, normal, -1, {}};
}

// Of nodes that lie equally far, as on a flat face, the one whose normal points best along the direction: not a corner.
SurfacePlace farthest(const Surface& surface, const Vector& direction) {
  const Vector diagonal = minus(surface.high, surface.low);
  const double level = 1e-6 * std::sqrt(dot(diagonal, diagonal));
  for (const std::vector<char>* allowed : {&surface.away_from_the_end, &surface.touchable}) {
    double most = -std::numeric_limits<double>::infinity();
    for (std::size_t n = 0; n < surface.nodes.size(); ++n)
      if ((*allowed)[n]) most = std::max(most, dot(surface.nodes[n], direction));
    std::optional<SurfacePlace> best;
    for (std::size_t n = 0; n < surface.nodes.size(); ++n) {
      if (!(*allowed)[n] || dot(surface.nodes[n], direction) < most - level) continue;
      const SurfacePlace place = with_unit_normal(surface.nodes[n], surface.normals[n]);
      if (!best || dot(place.normal, direction) > dot(best->normal, direction)) best = place;
    }
    if (best) return *best;
  }
  return {};  // a surface with touchable triangles has touchable nodes
}

SurfacePlace nearest_on(const Surface& surface, const Vector& p, double* distance) {
  std::size_t best = 0;
  Vector at{};
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
    const Triangle& t = surface.triangles[i];
    const std::array<Vector, 3> corners = {surface.nodes[t[0]], surface.nodes[t[1]], surface.nodes[t[2]]};
    const Vector weights = nearest_in_triangle(p, corners[0], corners[1], corners[2]);
    const Vector away = minus(weighted(corners, weights), p);
    if (dot(away, away) < least) least = dot(away, away), best = i, at = weights;
  }
  *distance = std::sqrt(least);
  const Triangle& t = surface.triangles[best];
  SurfacePlace place =
      with_unit_normal(weighted({surface.nodes[t[0]], surface.nodes[t[1]], surface.nodes[t[2]]}, at),
                       weighted({surface.normals[t[0]], surface.normals[t[1]], surface.normals[t[2]]}, at));
  place.triangle = surface.numbers[best], place.barycentric = at;
  return place;
}

}  // namespace

struct PlaceFinder::Searched {
  Surface surface;
  Where where;
  std::optional<Surface> whole;  // where only touchable triangles are searched

  void refuse_another_part(const Vector& near, const SurfacePlace& found, const std::string& who) const;
};

PlaceFinder::PlaceFinder(const palpate_bundle* bundle, Where where)
    : searched_(std::make_unique<Searched>(Searched{surface_of(bundle, where), where, {}})) {
  if (where == Where::touchable) searched_->whole = surface_of(bundle, Where::surface);
}
PlaceFinder::~PlaceFinder() = default;

// Refuses a place that is another part of the organ than the one that was meant. Beside a held part the last triangles are not touchable,
// so that a place may be off by the longest edge there.
void PlaceFinder::Searched::refuse_another_part(const Vector& near, const SurfacePlace& found,
                                                const std::string& who) const {
  double ignored = 0;
  const SurfacePlace meant = nearest_on(*whole, near, &ignored);
  const Triangle& t = whole->triangles[meant.triangle];
  double edge = 0;
  for (int c = 0; c < 3; ++c) {
    const Vector side = minus(whole->nodes[t[c]], whole->nodes[t[(c + 1) % 3]]);
    edge = std::max(edge, std::sqrt(dot(side, side)));
  }
  const Vector away = minus(found.point, meant.point);
  const double distance = std::sqrt(dot(away, away));
  if (distance <= edge) return;
  const auto text = [](const Vector& p) {
    return fmt::format("[{:.4g}, {:.4g}, {:.4g}] mm", 1e3 * p[0], 1e3 * p[1], 1e3 * p[2]);
  };
  throw InputError(fmt::format(
      "{}: expected a place that can be touched, found {}, which is held or outside [touchable]; the nearest one "
      "that can be touched is {:.4g} mm away, at {}",
      who, text(meant.point), 1e3 * distance, text(found.point)));
}

SurfacePlace PlaceFinder::nearest(const Vector& near, const std::string& who) const {
  const Surface& surface = searched_->surface;
  if (surface.triangles.empty())
    throw InputError(
        fmt::format("{}: expected a {} to find a place on, found no triangle{}; compare with \"palpate-bundle info\"",
                    who, searched_->where == Where::surface ? "surface" : "touchable surface",
                    searched_->where == Where::surface ? "" : " of three touchable nodes"));
  double distance = 0;
  const SurfacePlace place = nearest_on(surface, near, &distance);
  const Vector diagonal = minus(surface.high, surface.low);
  if (!(distance <= std::sqrt(dot(diagonal, diagonal))))
    throw InputError(
        fmt::format("{}: expected a point near the organ, whose box is x {:.4g} .. {:.4g}, y {:.4g} .. {:.4g}, z "
                    "{:.4g} .. {:.4g} mm, found one {:.4g} mm away; check the numbers and unit",
                    who, 1e3 * surface.low[0], 1e3 * surface.high[0], 1e3 * surface.low[1], 1e3 * surface.high[1],
                    1e3 * surface.low[2], 1e3 * surface.high[2], 1e3 * distance));
  if (searched_->whole) searched_->refuse_another_part(near, place, who);
  return place;
}

namespace {

// near: where `at` is not given.
SurfacePlace find_place(const std::string& who, std::optional<At> at, const std::optional<Vector>& near,
                        const palpate_bundle* bundle) {
  if (!at) return PlaceFinder(bundle, PlaceFinder::Where::touchable).nearest(*near, who + "near");
  const Surface surface = surface_of(bundle, PlaceFinder::Where::touchable);
  if (surface.triangles.empty())
    throw InputError(who +
                     "expected a touchable surface to find a place on, found no triangle of three touchable "
                     "nodes; compare with \"palpate-bundle info\"");
  const std::string frame = frame_of(bundle);
  if (frame != "LPS" && frame != "RAS")
    throw InputError(
        fmt::format("{}at: expected a bundle of frame LPS or RAS, which says where the patient's front is, found frame "
                    "\"{}\"; give near = [x, y, z], or set frame in organ.toml",
                    who, frame));
  return farthest(surface, direction_of(*at, frame));
}

}  // namespace

SurfacePlace find_place(const SceneConfig::Tool& tool, const palpate_bundle* bundle,
                        const std::filesystem::path& scene) {
  const std::string who = fmt::format("{}:{}: tool \"{}\": ", scene.string(), tool.line, tool.name);
  return find_place(who, tool.place->at, tool.place->near, bundle);
}

SurfacePlace find_place(const SceneConfig::Load& load, const palpate_bundle* bundle,
                        const std::filesystem::path& scene) {
  const std::string who = fmt::format("{}:{}: load \"{}\": ", scene.string(), load.line, load.name);
  return find_place(who, load.at, load.near, bundle);
}

Vector direction_at(const SceneConfig::Tool& tool, const SurfacePlace& place) {
  Vector direction{};
  if (!tool.needle || !tool.needle->direction) {
    for (int d = 0; d < 3; ++d) direction[d] = -place.normal[d];
    return direction;
  }
  direction = *tool.needle->direction;
  const double length = std::sqrt(dot(direction, direction));
  for (double& x : direction) x /= length;
  return direction;
}

void resolve_places(SceneConfig& scene, const palpate_bundle* bundle) {
  for (SceneConfig::Tool& tool : scene.tools) {
    if (!tool.place) continue;
    const SurfacePlace place = find_place(tool, bundle, scene.file);
    const Vector direction = direction_at(tool, place);
    for (std::size_t i = 0; i < tool.path.size(); ++i)
      for (int d = 0; d < 3; ++d) tool.path[i].position[d] = place.point[d] + tool.place->depth[i][1] * direction[d];
  }
}

}  // namespace palpate
