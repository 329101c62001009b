#include "studies/large/moves.h"

#include <algorithm>
#include <optional>

namespace palpate::large {
namespace {

using accuracy::StudySites;
using accuracy::TouchSite;

Vec3 unit(Vec3 v) {
  return (1 / length(v)) * v;
}

// No node within two radii is held.
bool is_free(const ElasticBody& body, Vec3 at, double radius) {
  for (std::size_t n = 0; n < body.nodes.size(); ++n) {
    const auto& fixed = body.fixed[n];
    if ((fixed[0] || fixed[1] || fixed[2]) && length(load3(body.nodes[n].data()) - at) < 2 * radius) return false;
  }
  return true;
}

// A place kPairDistance radii along the surface, in one of four directions.
std::optional<TouchSite> beside(const ElasticBody& body, const TouchSite& site, double radius) {
  const accuracy::SurfaceView surface = {body.nodes[0].data(), {body.triangles[0].data(), 3 * body.triangles.size()}};
  const Vec3 other = cross(site.inward, site.across);
  for (const Vec3 way : {site.across, other, -1 * site.across, -1 * other}) {
    const Vec3 at = accuracy::closest_point(surface, site.at + kPairDistance * radius * way).at;
    if (length(at - site.at) > 2.5 * radius && is_free(body, at, radius)) return accuracy::site_at(body, at, radius);
  }
  return {};
}

// The place on the other side of the body, straight below the site.
std::optional<TouchSite> opposite(const ElasticBody& body, const TouchSite& site, double radius) {
  const accuracy::SurfaceView surface = {body.nodes[0].data(), {body.triangles[0].data(), 3 * body.triangles.size()}};
  for (double depth = 0.008; depth <= kThickest; depth += 0.002) {
    const Vec3 below = site.at + depth * site.inward;
    const TouchSite other = accuracy::site_at(body, accuracy::closest_point(surface, below).at, radius);
    if (length(other.at - below) < 0.004 && dot(other.inward, site.inward) < -0.5 && is_free(body, other.at, radius))
      return other;
  }
  return {};
}

}  // namespace

std::vector<Move> plan_moves(const ElasticBody& finest, const StudySites& sites) {
  std::vector<Move> moves;
  for (std::size_t place = 0; place < sites.touch.size(); ++place) {
    const TouchSite& site = sites.touch[place];
    const auto alone = [&](const char* name, Vec3 way) { moves.push_back({name, place, {{site.at, way}}}); };
    alone("push", site.inward);
    alone("pull", -1 * site.inward);
    alone("drag", site.across);
    alone("oblique", unit(site.inward + 0.8 * site.across));
    if (const auto second = beside(finest, site, sites.radius))
      moves.push_back({"pair", place, {{site.at, site.inward}, {second->at, second->inward}}});
    if (const auto other = opposite(finest, site, sites.radius)) {
      const double share = std::min(1.0, 0.3 * length(other->at - site.at) / kPinchDepth);
      moves.push_back({"pinch", place, {{site.at, share * site.inward}, {other->at, share * other->inward}}});
    }
  }
  return moves;
}

}  // namespace palpate::large
