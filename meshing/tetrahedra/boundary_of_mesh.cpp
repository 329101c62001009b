// Finds the faces that bound the regions by sorting all faces of all elements.
#include "meshing/tetrahedra/boundary_of_mesh.h"

#include <algorithm>
#include <map>
#include <utility>

#include "meshing/surface/triangle_surface.h"

namespace palpate {
namespace {

struct Face {
  Triangle key;  // corners in ascending order
  Triangle outward;
  std::int32_t region;
};

std::vector<Face> faces_of(const TetrahedralMesh& mesh) {
  constexpr int kFaces[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
  std::vector<Face> faces;
  for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e)
    for (const auto& f : kFaces) {
      const auto& t = mesh.tetrahedra[e];
      const Triangle outward = {t[f[0]], t[f[1]], t[f[2]]};
      Triangle key = outward;
      std::sort(key.begin(), key.end());
      faces.push_back({key, outward, mesh.region[e]});
    }
  std::stable_sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) { return a.key < b.key; });
  return faces;
}

// Splits the triangles next to empty space: connected shells that enclose a negative volume become cavities.
void find_cavities(VolumeBoundary& boundary) {
  TriangleSurface skin{boundary.points, {}};
  for (const auto& patch : boundary.patches)
    if (patch.ahead < 0) skin.triangles.insert(skin.triangles.end(), patch.triangles.begin(), patch.triangles.end());
  std::int32_t shells = 0;
  const auto shell_of = shell_of_triangle(skin, &shells);
  std::vector<double> volume(shells, 0.0);
  const Point origin = boundary.points.front();
  for (std::size_t t = 0; t < shell_of.size(); ++t) {
    const auto& [a, b, c] = skin.triangles[t];
    volume[shell_of[t]] += dot(skin.points[a] - origin, cross(skin.points[b] - origin, skin.points[c] - origin));
  }
  std::size_t next = 0;
  std::vector<VolumeBoundary::Patch> cavities;
  for (auto& patch : boundary.patches) {
    if (patch.ahead >= 0) continue;
    VolumeBoundary::Patch outside{patch.behind, VolumeBoundary::kOutside, {}},
        cavity{patch.behind, VolumeBoundary::kCavity, {}};
    for (const Triangle& t : patch.triangles) (volume[shell_of[next++]] < 0 ? cavity : outside).triangles.push_back(t);
    patch = outside;
    if (!cavity.triangles.empty()) cavities.push_back(cavity);
  }
  boundary.patches.insert(boundary.patches.end(), cavities.begin(), cavities.end());
  std::erase_if(boundary.patches, [](const auto& patch) { return patch.triangles.empty(); });
}

}  // namespace

VolumeBoundary boundary_of(const TetrahedralMesh& mesh) {
  VolumeBoundary boundary;
  boundary.region_names = mesh.region_names;
  std::map<std::pair<std::int32_t, std::int32_t>, std::vector<Triangle>> triangles;  // by the regions behind and ahead
  const std::vector<Face> faces = faces_of(mesh);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const bool paired = f + 1 < faces.size() && faces[f + 1].key == faces[f].key;
    const Face& mine = faces[f];
    if (!paired) {
      triangles[{mine.region, VolumeBoundary::kOutside}].push_back(mine.outward);
      continue;
    }
    const Face& other = faces[++f];
    if (mine.region < other.region) triangles[{mine.region, other.region}].push_back(mine.outward);
    if (other.region < mine.region) triangles[{other.region, mine.region}].push_back(other.outward);
  }
  boundary.points = mesh.nodes;
  for (const auto& [sides, of_patch] : triangles) boundary.patches.push_back({sides.first, sides.second, of_patch});
  find_cavities(boundary);
  return boundary;
}

VolumeBoundary without_unused_points(const VolumeBoundary& boundary) {
  VolumeBoundary compact = boundary;
  compact.points.clear();
  std::vector<std::int32_t> number(boundary.points.size(), -1);
  for (auto& patch : compact.patches)
    for (Triangle& t : patch.triangles)
      for (std::int32_t& v : t) {
        if (number[v] < 0) {
          number[v] = static_cast<std::int32_t>(compact.points.size());
          compact.points.push_back(boundary.points[v]);
        }
        v = number[v];
      }
  return compact;
}

NonManifoldEdges non_manifold_edges(const VolumeBoundary& boundary) {
  std::map<std::pair<std::int32_t, std::int32_t>, std::vector<std::int32_t>> regions_at;  // one for each triangle
  for (const auto& patch : boundary.patches)
    if (patch.ahead < 0)
      for (const Triangle& t : patch.triangles)
        for (int i = 0; i < 3; ++i) regions_at[std::minmax(t[i], t[(i + 1) % 3])].push_back(patch.behind);
  NonManifoldEdges edges;
  for (const auto& [edge, regions] : regions_at)
    if (regions.size() != 2) {
      edges.places.push_back(0.5 * (boundary.points[edge.first] + boundary.points[edge.second]));
      edges.regions.push_back(regions);
    }
  return edges;
}

}  // namespace palpate
