#include "studies/accuracy/sites.h"

#include <algorithm>
#include <cmath>

#include "formats/errors.h"

namespace palpate::accuracy {
namespace {

Vec3 at(const ElasticBody& body, std::int32_t n) {
  return load3(body.nodes[static_cast<std::size_t>(n)].data());
}

// Twice the area of each triangle, along its outward normal.
Vec3 twice_area(const ElasticBody& body, const std::array<std::int32_t, 3>& t) {
  return cross(at(body, t[1]) - at(body, t[0]), at(body, t[2]) - at(body, t[0]));
}

std::vector<double> node_areas(const ElasticBody& body) {
  std::vector<double> area(static_cast<std::size_t>(body.surface_count), 0);
  for (const auto& t : body.triangles)
    for (const auto n : t) area[static_cast<std::size_t>(n)] += length(twice_area(body, t)) / 6;
  return area;
}

std::size_t nearest(const ElasticBody& body, const std::vector<std::int32_t>& nodes, Vec3 p) {
  std::size_t best = 0;
  for (std::size_t i = 1; i < nodes.size(); ++i)
    if (length(at(body, nodes[i]) - p) < length(at(body, nodes[best]) - p)) best = i;
  return best;
}

// Nodes far from one another: each is the farthest from all before it.
std::vector<std::int32_t> spread(const ElasticBody& body, const std::vector<std::int32_t>& from, int count) {
  std::vector<std::int32_t> chosen;
  std::vector<double> distance(from.size(), INFINITY);
  for (std::size_t next = 0; static_cast<int>(chosen.size()) < count && distance[next] > 0;) {
    chosen.push_back(from[next]);
    for (std::size_t i = 0; i < from.size(); ++i)
      distance[i] = std::min(distance[i], length(at(body, from[i]) - at(body, chosen.back())));
    next = static_cast<std::size_t>(std::max_element(distance.begin(), distance.end()) - distance.begin());
  }
  return chosen;
}

// The farthest points lie on an organ's tips. A few rounds of Lloyd's algorithm move each to the middle of its share.
std::vector<std::int32_t> spread_in_the_middle(const ElasticBody& body, const std::vector<std::int32_t>& from,
                                               int count) {
  const auto area = node_areas(body);
  auto chosen = spread(body, from, count);
  for (int round = 0; round < 10; ++round) {
    std::vector<Vec3> sum(chosen.size());
    std::vector<double> weight(chosen.size(), 0);
    for (const auto n : from) {
      const std::size_t cell = nearest(body, chosen, at(body, n));
      sum[cell] += area[static_cast<std::size_t>(n)] * at(body, n);
      weight[cell] += area[static_cast<std::size_t>(n)];
    }
    for (std::size_t c = 0; c < chosen.size(); ++c)
      if (weight[c] > 0) chosen[c] = from[nearest(body, from, (1 / weight[c]) * sum[c])];
  }
  std::sort(chosen.begin(), chosen.end());
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  return chosen;
}

// Touchable nodes at least that far from every held one.
std::vector<std::int32_t> free_nodes(const ElasticBody& body, double distance) {
  std::vector<std::int32_t> held, found;
  for (std::int32_t n = 0; n < body.surface_count; ++n) {
    const auto& fixed = body.fixed[static_cast<std::size_t>(n)];
    if (fixed[0] || fixed[1] || fixed[2]) held.push_back(n);
  }
  for (const auto n : body.touchable)
    if (held.empty() || length(at(body, held[nearest(body, held, at(body, n))]) - at(body, n)) >= distance)
      found.push_back(n);
  return found;
}

// The middle of a triangle at the node. At a vertex, the finest mesh would meet the disc in a special way that no other
// mesh has.
Vec3 beside(const ElasticBody& body, std::int32_t node) {
  for (const auto& t : body.triangles)
    if (std::find(t.begin(), t.end(), node) != t.end())
      return (1.0 / 3) * (at(body, t[0]) + at(body, t[1]) + at(body, t[2]));
  return at(body, node);
}

nlohmann::json json_of(Vec3 v) {
  return {v.x, v.y, v.z};
}
Vec3 vector_of(const nlohmann::json& json) {
  return {json.at(0), json.at(1), json.at(2)};
}
nlohmann::json json_of(const std::vector<TouchSite>& sites) {
  nlohmann::json list = nlohmann::json::array();
  for (const auto& p : sites)
    list.push_back({{"at", json_of(p.at)}, {"inward", json_of(p.inward)}, {"across", json_of(p.across)}});
  return list;
}
std::vector<TouchSite> touch_sites_of(const nlohmann::json& json) {
  std::vector<TouchSite> sites;
  for (const auto& p : json)
    sites.push_back({vector_of(p.at("at")), vector_of(p.at("inward")), vector_of(p.at("across"))});
  return sites;
}

}  // namespace

TouchSite site_at(const ElasticBody& body, Vec3 p, double radius) {
  Vec3 outward;
  const Vec3 own = [&] {
    std::size_t best = 0;
    double least = INFINITY, k[3];
    for (std::size_t t = 0; t < body.triangles.size(); ++t) {
      const auto& c = body.triangles[t];
      const double d = closest_on_triangle(p, at(body, c[0]), at(body, c[1]), at(body, c[2]), k);
      if (d < least) least = d, best = t;
    }
    return twice_area(body, body.triangles[best]);
  }();
  for (const auto& t : body.triangles) {
    const Vec3 middle = (1.0 / 3) * (at(body, t[0]) + at(body, t[1]) + at(body, t[2]));
    const Vec3 normal = twice_area(body, t);
    if (length(middle - p) <= radius && dot(normal, own) > 0) outward += normal;
  }
  if (length(outward) == 0) outward = own;
  outward = unit_or_zero(outward);
  const Vec3 axis = std::fabs(outward.x) < 0.7 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  return {p, -1 * outward, unit_or_zero(cross(outward, axis))};
}

namespace {

// Touchable nodes at least three radii from held nodes, or closer if that leaves fewer than count.
std::vector<std::int32_t> nodes_to_touch(const ElasticBody& body, double radius, int count) {
  std::vector<std::int32_t> free;
  for (double distance = 3 * radius; static_cast<int>(free.size()) < count && distance > 0.01 * radius; distance /= 2)
    free = free_nodes(body, distance);
  if (free.empty()) throw InputError("the boundary set leaves nothing that can be touched; see its [touchable]");
  return free;
}

}  // namespace

StudySites choose_crowd(const ElasticBody& body, double radius, int most, const std::vector<Vec3>& samples) {
  StudySites crowd;
  crowd.radius = radius, crowd.samples = samples;
  for (const auto n : spread(body, nodes_to_touch(body, radius, most), most)) {
    const Vec3 next = beside(body, n);
    if (std::any_of(crowd.touch.begin(), crowd.touch.end(),
                    [&](const TouchSite& p) { return length(p.at - next) < kCrowdDistance * radius; }))
      break;
    crowd.touch.push_back(site_at(body, next, radius));
  }
  return crowd;
}

StudySites choose_sites(const ElasticBody& body, double radius, int touch_count, int sample_count) {
  StudySites sites;
  sites.radius = radius;
  for (const auto n : spread_in_the_middle(body, nodes_to_touch(body, radius, touch_count), touch_count))
    sites.touch.push_back(site_at(body, beside(body, n), radius));
  const SurfaceView surface = {body.nodes[0].data(), {body.triangles[0].data(), 3 * body.triangles.size()}};
  for (std::size_t p = 0; p < std::min<std::size_t>(2, sites.touch.size()); ++p) {
    const Vec3 next = sites.touch[p].at + kNeighbourDistance * radius * sites.touch[p].across;
    sites.neighbour.push_back(site_at(body, closest_point(surface, next).at, radius));
  }
  std::vector<std::int32_t> all;
  for (std::int32_t n = 0; n < body.surface_count; ++n) all.push_back(n);
  for (const auto n : spread(body, all, sample_count)) sites.samples.push_back(at(body, n));
  return sites;
}

nlohmann::json json_of(const StudySites& sites) {
  nlohmann::json samples = nlohmann::json::array();
  for (const Vec3 p : sites.samples) samples.push_back(json_of(p));
  return {{"radius_m", sites.radius},
          {"touch", json_of(sites.touch)},
          {"neighbour", json_of(sites.neighbour)},
          {"samples", samples}};
}

StudySites sites_of(const nlohmann::json& json) {
  StudySites sites;
  sites.radius = json.at("radius_m");
  sites.touch = touch_sites_of(json.at("touch"));
  sites.neighbour = touch_sites_of(json.at("neighbour"));
  for (const auto& p : json.at("samples")) sites.samples.push_back(vector_of(p));
  return sites;
}

StudySurface surface_of(const ElasticBody& body) {
  StudySurface surface;
  for (std::int32_t n = 0; n < body.surface_count; ++n)
    surface.nodes.insert(surface.nodes.end(), body.nodes[static_cast<std::size_t>(n)].begin(),
                         body.nodes[static_cast<std::size_t>(n)].end());
  for (const auto& t : body.triangles) surface.triangles.insert(surface.triangles.end(), t.begin(), t.end());
  return surface;
}

FoundPoint closest_point(const SurfaceView& surface, Vec3 p) {
  FoundPoint best;
  double least = INFINITY;
  for (std::size_t t = 0; 3 * t < surface.triangles.size(); ++t) {
    const auto corner = [&](std::size_t v) {
      return load3(surface.nodes + 3 * static_cast<std::size_t>(surface.triangles[3 * t + v]));
    };
    double k[3];
    const double distance = closest_on_triangle(p, corner(0), corner(1), corner(2), k);
    if (distance >= least) continue;
    least = distance;
    best.on.triangle = static_cast<std::int32_t>(t);
    std::copy(k, k + 3, best.on.barycentric);
    best.at = k[0] * corner(0) + k[1] * corner(1) + k[2] * corner(2);
  }
  return best;
}

}  // namespace palpate::accuracy
