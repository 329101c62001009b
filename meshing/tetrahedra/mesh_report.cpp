#include "meshing/tetrahedra/mesh_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "formats/program.h"
#include "meshing/surface/triangle_surface.h"

namespace palpate {
namespace {

std::size_t surface_vertices(const TetrahedralMesh& mesh) {
  std::set<std::int32_t> vertices;
  for (const Triangle& t : boundary_triangles(mesh)) vertices.insert(t.begin(), t.end());
  return vertices.size();
}

// Returns the box of the mesh, "x 15.2 .. 201, y ...". Users need it to write boundary files and scenes.
std::string extent_of(const TetrahedralMesh& mesh) {
  std::string text;
  for (int d = 0; d < 3; ++d) {
    const auto [low, high] = std::minmax_element(mesh.nodes.begin(), mesh.nodes.end(),
                                                 [d](const auto& a, const auto& b) { return a[d] < b[d]; });
    text += fmt::format("{}{} {:.4g} .. {:.4g}", d ? ", " : "", "xyz"[d], (*low)[d], (*high)[d]);
  }
  return text;
}

std::size_t elements_of(const TetrahedralMesh& mesh, std::size_t region) {
  std::size_t count = 0;
  for (const std::int32_t r : mesh.region) count += r == static_cast<std::int32_t>(region);
  return count;
}

// "(voxels 8983, +0.00 %; smoothing -1.2 %, triangles of 5.2 mm -6.3 %, moved outward by 0.31 mm)"
std::string tissue_text(const TissueVolume& v, double volume) {
  return fmt::format(
      " (voxels {:.6g}, {:+.2f} %; smoothing {:+.1f} %, triangles of {:.3g} mm {:+.1f} %, moved outward by {:.2g} mm)",
      v.voxels, 100 * (volume / v.voxels - 1), 100 * (v.smoothed / v.voxels - 1), v.edge,
      100 * (v.meshed - v.smoothed) / v.voxels, v.moved_mm);
}

std::size_t improved(const MeshReport& r) {
  return r.improvement.below_before - std::min(r.improvement.below_before, r.improvement.below_after);
}

}  // namespace

std::vector<double> enclosed_volumes(const VolumeBoundary& boundary) {
  std::vector<double> volumes(boundary.region_names.size(), 0.0);
  const Point origin = boundary.points.front();
  for (const auto& patch : boundary.patches)
    for (const Triangle& t : patch.triangles) {
      const double v =
          dot(boundary.points[t[0]] - origin, cross(boundary.points[t[1]] - origin, boundary.points[t[2]] - origin)) /
          6;
      volumes[patch.behind] += v;
      if (patch.ahead >= 0) volumes[patch.ahead] -= v;
    }
  return volumes;
}

std::string text_of(const MeshReport& r) {
  const TetrahedralMesh& mesh = r.mesh;
  const MeshQuality& q = r.quality;
  std::string text =
      fmt::format("vertices          {} ({} on the outer surface)\n", mesh.nodes.size(), surface_vertices(mesh));
  text += fmt::format("tetrahedra        {}\n", mesh.tetrahedra.size());
  text += fmt::format("extent            {}\n", extent_of(mesh));
  for (std::size_t i = 0; i < mesh.region_names.size(); ++i) {
    text += fmt::format("region            \"{}\": {} tetrahedra, volume {:.6g}", mesh.region_names[i],
                        elements_of(mesh, i), q.region_volume[i]);
    if (!r.region_volume_of_surface.empty())
      text += fmt::format(" (surface {:.6g}, difference {:.1e})", r.region_volume_of_surface[i],
                          q.region_volume[i] / r.region_volume_of_surface[i] - 1);
    if (!r.tissue_volumes.empty()) text += tissue_text(r.tissue_volumes[i], q.region_volume[i]);
    text += '\n';
  }
  for (const auto& patch : mesh.patches)
    text += fmt::format("patch             \"{}\": {} triangles\n", patch.name, patch.triangles.size());
  if (r.surface_triangles > 0)
    text += fmt::format("surface triangles {} kept of {}{}\n", r.kept_triangles, r.surface_triangles,
                        r.remeshed ? ", remeshed" : "");
  text += fmt::format("dihedral angle    min {:.2f}, mean of smallest {:.2f}, max {:.2f} degrees\n", q.dihedral.value,
                      q.mean_smallest_dihedral, q.largest_dihedral.value);
  if (r.improvement.below_before > 0)
    text += fmt::format("improved          {} of {} elements below {:g} degrees, by moving {} interior vertices\n",
                        improved(r), r.improvement.below_before, r.goal, r.improvement.vertices_moved);
  if (r.improvement.out_of_reach > 0)
    text += fmt::format("out of reach      {} elements below {:g} degrees have all their corners on surfaces\n",
                        r.improvement.out_of_reach, r.goal);
  text += fmt::format("radius ratio      mean {:.3f}, min {:.3f}\n", q.mean_radius_ratio, q.radius_ratio.value);
  text += fmt::format("smallest volume   {:.3g}\n", q.volume.value);
  return text;
}

std::string json_of(const MeshReport& r) {
  using nlohmann::ordered_json;
  const MeshQuality& q = r.quality;
  ordered_json json;
  json["inputs"] = r.inputs;
  json["warnings"] = warnings();
  json["vertices"] = r.mesh.nodes.size();
  json["surface_vertices"] = surface_vertices(r.mesh);
  json["tetrahedra"] = r.mesh.tetrahedra.size();
  json["regions"] = ordered_json::array();
  for (std::size_t i = 0; i < r.mesh.region_names.size(); ++i) {
    ordered_json region = {
        {"name", r.mesh.region_names[i]}, {"tetrahedra", elements_of(r.mesh, i)}, {"volume", q.region_volume[i]}};
    if (!r.region_volume_of_surface.empty()) region["surface_volume"] = r.region_volume_of_surface[i];
    if (!r.tissue_volumes.empty()) {
      const TissueVolume& v = r.tissue_volumes[i];
      region["voxel_volume"] = v.voxels, region["smoothed_volume"] = v.smoothed, region["meshed_volume"] = v.meshed;
      region["moved_mm"] = v.moved_mm, region["edge_mm"] = v.edge;
    }
    json["regions"].push_back(region);
  }
  json["patches"] = ordered_json::array();
  for (const auto& patch : r.mesh.patches)
    json["patches"].push_back({{"name", patch.name}, {"triangles", patch.triangles.size()}});
  if (r.surface_triangles > 0) {
    json["surface_triangles"] = {{"given", r.surface_triangles}, {"kept", r.kept_triangles}};
    json["remeshed"] = r.remeshed;
  }
  const auto worst = [](const MeshQuality::Worst& w) {
    return ordered_json{{"value", w.value}, {"tetrahedron", w.tetrahedron}};
  };
  json["min_dihedral_degrees"] = worst(q.dihedral);
  json["max_dihedral_degrees"] = worst(q.largest_dihedral);
  json["mean_smallest_dihedral_degrees"] = q.mean_smallest_dihedral;
  json["improvement"] = {{"goal_degrees", r.goal},
                         {"below_before", r.improvement.below_before},
                         {"below_after", r.improvement.below_after},
                         {"out_of_reach", r.improvement.out_of_reach},
                         {"vertices_moved", r.improvement.vertices_moved}};
  json["min_radius_ratio"] = worst(q.radius_ratio);
  json["mean_radius_ratio"] = q.mean_radius_ratio;
  json["min_volume"] = worst(q.volume);
  return json.dump(2) + "\n";
}

}  // namespace palpate
