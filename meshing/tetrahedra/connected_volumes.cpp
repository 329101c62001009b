#include "meshing/tetrahedra/connected_volumes.h"

#include <fmt/format.h>

#include <algorithm>

#include "formats/errors.h"
#include "meshing/surface/triangle_surface.h"
#include "meshing/tetrahedra/shells.h"

namespace palpate {
namespace {

// A connected surface and the regions on its two sides.
struct Side {
  std::int32_t behind, ahead;
};

std::vector<Side> split_patches(const VolumeBoundary& boundary, ConnectedVolumes& result) {
  std::vector<Side> sides;
  for (const auto& patch : boundary.patches) {
    std::int32_t count = 0;
    const auto piece = shell_of_triangle({boundary.points, patch.triangles}, &count);
    const std::size_t first = result.surfaces.size();
    result.surfaces.resize(first + count);
    sides.resize(first + count, {patch.behind, patch.ahead});
    for (std::size_t t = 0; t < piece.size(); ++t) result.surfaces[first + piece[t]].push_back(patch.triangles[t]);
  }
  return sides;
}

// Makes one loop for each connected, closed set of surfaces. Surfaces that share a point belong to the same loop.
std::vector<std::vector<int>> loops_around(const VolumeBoundary& boundary, const ConnectedVolumes& parts,
                                           const std::vector<Side>& sides, std::int32_t region) {
  std::vector<std::vector<int>> loops;
  std::vector<std::int32_t> loop_of_point(boundary.points.size(), -1);
  for (int s = 0; s < static_cast<int>(sides.size()); ++s) {
    if (sides[s].behind != region && sides[s].ahead != region) continue;
    const auto mine = static_cast<std::int32_t>(loops.size());
    loops.push_back({s});
    for (const Triangle& t : parts.surfaces[s])
      for (const std::int32_t v : t) {
        const std::int32_t other = loop_of_point[v];
        if (other >= 0 && other != mine) {  // the surface joins two loops: merge them
          loops[mine].insert(loops[mine].end(), loops[other].begin(), loops[other].end());
          loops[other].clear();
          std::replace(loop_of_point.begin(), loop_of_point.end(), other, mine);
        }
        loop_of_point[v] = mine;
      }
  }
  std::erase_if(loops, [](const auto& loop) { return loop.empty(); });
  for (auto& loop : loops) std::sort(loop.begin(), loop.end());
  return loops;
}

// Returns the triangles of the loop, turned so that they point out of the region.
TriangleSurface surface_of(const VolumeBoundary& boundary, const ConnectedVolumes& parts,
                           const std::vector<Side>& sides, std::int32_t region, const std::vector<int>& loop) {
  TriangleSurface whole{boundary.points, {}};
  for (const int s : loop)
    for (Triangle t : parts.surfaces[s]) {
      if (sides[s].behind != region) std::swap(t[1], t[2]);
      whole.triangles.push_back(t);
    }
  return subset(whole, std::vector<bool>(whole.triangles.size(), true));
}

struct Loop {
  std::vector<int> surfaces;
  TriangleSurface outward;
  double volume;  // negative for a loop around a hole of the region
};

// Gives each hole to the smallest volume that encloses it.
std::vector<ConnectedVolumes::Volume> volumes_of(const std::vector<Loop>& loops, std::int32_t region,
                                                 const std::string& name) {
  std::vector<ConnectedVolumes::Volume> volumes;
  std::vector<const Loop*> outer;
  for (const Loop& loop : loops)
    if (loop.volume > 0) {
      outer.push_back(&loop);
      volumes.push_back({region, {loop.surfaces}});
    }
  for (const Loop& hole : loops) {
    if (hole.volume > 0) continue;
    std::size_t around = outer.size();
    for (std::size_t o = 0; o < outer.size(); ++o)
      if ((around == outer.size() || outer[o]->volume < outer[around]->volume) &&
          (outer.size() == 1 || winding_number(outer[o]->outward, hole.outward.points.front()) != 0))
        around = o;
    if (around == outer.size())
      throw VerificationError(
          fmt::format("region \"{}\" has a hole that no surface of it is around; remesh its surface", name));
    volumes[around].loops.push_back(hole.surfaces);
  }
  return volumes;
}

}  // namespace

ConnectedVolumes connected_volumes(const VolumeBoundary& boundary) {
  ConnectedVolumes result;
  const std::vector<Side> sides = split_patches(boundary, result);
  for (std::int32_t region = 0; region < static_cast<std::int32_t>(boundary.region_names.size()); ++region) {
    std::vector<Loop> loops;
    for (const auto& surfaces : loops_around(boundary, result, sides, region)) {
      TriangleSurface outward = surface_of(boundary, result, sides, region, surfaces);
      const double volume = enclosed_volume(outward);
      loops.push_back({surfaces, std::move(outward), volume});
    }
    for (auto& volume : volumes_of(loops, region, boundary.region_names[region]))
      result.volumes.push_back(std::move(volume));
  }
  return result;
}

}  // namespace palpate
