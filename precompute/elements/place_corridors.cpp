#include "precompute/elements/place_corridors.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "formats/errors.h"
#include "precompute/elements/segment_distance.h"

namespace palpate {
namespace {

using Point = std::array<double, 3>;

Corners corners_of(const ElasticBody& body, const std::array<std::int32_t, 4>& tetrahedron) {
  Corners corners;
  for (std::size_t i = 0; i < 4; ++i) corners[i] = body.nodes[tetrahedron[i]];
  return corners;
}

// False where the ball around all corners is too far away: the exact distance need not be computed.
bool may_be_near(const Corners& corners, const PlacedCorridor& corridor) {
  Point centre{};
  for (const Point& p : corners)
    for (std::size_t d = 0; d < 3; ++d) centre[d] += p[d] / 4;
  double reach = 0;
  for (const Point& p : corners) reach = std::max(reach, segment_distance(p, centre, centre));
  const double away = segment_distance(centre, corridor.from, corridor.to);
  return !(away > (corridor.radius + reach) * (1 + 1e-9) + 1e-9 * away);
}

struct Met {
  std::size_t tetrahedra = 0;
  std::vector<std::int32_t> nodes;  // inside the body, ascending
};

Met meet(const ElasticBody& body, const PlacedCorridor& corridor) {
  Met met;
  for (const auto& tetrahedron : body.tetrahedra) {
    const Corners corners = corners_of(body, tetrahedron);
    if (!may_be_near(corners, corridor)) continue;
    if (!(segment_distance(corners, corridor.from, corridor.to) <= corridor.radius)) continue;
    ++met.tetrahedra;
    std::copy_if(tetrahedron.begin(), tetrahedron.end(), std::back_inserter(met.nodes),
                 [&](std::int32_t n) { return n >= body.surface_count; });
  }
  std::sort(met.nodes.begin(), met.nodes.end());
  met.nodes.erase(std::unique(met.nodes.begin(), met.nodes.end()), met.nodes.end());
  return met;
}

Point scaled(const Point& p, double metres) {
  return {p[0] * metres, p[1] * metres, p[2] * metres};
}

std::string place(const Point& p) {
  return fmt::format("({:.4g}, {:.4g}, {:.4g})", p[0], p[1], p[2]);
}

}  // namespace

void place_corridors(const BoundaryConfig& boundary, double metres, const std::filesystem::path& file,
                     ElasticBody& body) {
  for (const auto& config : boundary.corridors) {
    const auto refuse = [&](const std::string& what) {
      throw InputError(fmt::format("{}:{}: [[corridor]] \"{}\": {}", file.string(), config.line, config.name, what));
    };
    PlacedCorridor corridor{
        config.name, scaled(config.from, metres), scaled(config.to, metres), config.radius * metres, {}};
    Met met = meet(body, corridor);
    if (met.tetrahedra == 0)
      refuse(
          fmt::format("expected tetrahedra within {:.3g} m of the segment from {} to {} m, found none; move it into "
                      "the organ, or check its unit (mesh_unit)",
                      corridor.radius, place(corridor.from), place(corridor.to)));
    if (met.nodes.empty())
      refuse(
          fmt::format("expected nodes inside the organ, found that its {} tetrahedra have all corners on the "
                      "surface; take a larger radius, or a finer mesh",
                      met.tetrahedra));
    corridor.nodes = std::move(met.nodes);
    std::vector<std::int32_t> all;
    std::set_union(body.corridor_nodes.begin(), body.corridor_nodes.end(), corridor.nodes.begin(), corridor.nodes.end(),
                   std::back_inserter(all));
    if (all.size() > static_cast<std::size_t>(formats::kMostCorridorNodes))
      refuse(
          fmt::format("expected at most {} nodes in all corridors together, found {} up to this one; take a "
                      "smaller radius, a shorter corridor or a coarser mesh",
                      formats::kMostCorridorNodes, all.size()));
    body.corridor_nodes = std::move(all);
    body.corridors.push_back(std::move(corridor));
  }
}

}  // namespace palpate
