#include "meshing/tetrahedra/fill_with_tetrahedra.h"

#include <fmt/format.h>
#include <gmsh.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "formats/errors.h"
#include "formats/processor_limit.h"
#include "meshing/tetrahedra/connected_volumes.h"
#include "meshing/tetrahedra/gmsh_session.h"
#include "meshing/tetrahedra/in_child_process.h"
#include "meshing/tetrahedra/mesh_bytes.h"
#include "meshing/tetrahedra/mesh_quality.h"

namespace palpate {
namespace {

using Point = std::array<double, 3>;
using Triangle = std::array<std::int32_t, 3>;

// gmsh has absolute tolerances, so it gets coordinates of about one around zero. The scale is a power of two, so that
// scaling back is exact.
struct Frame {
  Point center{};
  double unit = 1;
  Point to(const Point& p) const {
    return {(p[0] - center[0]) / unit, (p[1] - center[1]) / unit, (p[2] - center[2]) / unit};
  }
  Point back(const Point& p) const {
    return {p[0] * unit + center[0], p[1] * unit + center[1], p[2] * unit + center[2]};
  }
};

Frame unit_frame(const std::vector<Point>& points) {
  Point low = points.front(), high = low;
  for (const Point& p : points)
    for (int d = 0; d < 3; ++d) {
      low[d] = std::min(low[d], p[d]);
      high[d] = std::max(high[d], p[d]);
    }
  Frame frame;
  double span = 0;
  for (int d = 0; d < 3; ++d) {
    frame.center[d] = low[d] + (high[d] - low[d]) / 2;
    span = std::max(span, high[d] - low[d]);
  }
  frame.unit = std::exp2(std::ceil(std::log2(span)));
  return frame;
}

void describe_to_gmsh(const VolumeBoundary& boundary, const ConnectedVolumes& parts, const Frame& frame) {
  // In gmsh each point belongs to one entity: here the first surface that uses it.
  std::vector<bool> given(boundary.points.size(), false);
  for (int s = 0; s < static_cast<int>(parts.surfaces.size()); ++s) {
    std::vector<std::size_t> tags, corners;
    std::vector<double> coordinates;
    for (const Triangle& t : parts.surfaces[s])
      for (const std::int32_t v : t) {
        corners.push_back(v + 1);
        if (given[v]) continue;
        given[v] = true;
        tags.push_back(v + 1);
        for (const double x : frame.to(boundary.points[v])) coordinates.push_back(x);
      }
    gmsh::model::addDiscreteEntity(2, s + 1);
    gmsh::model::mesh::addNodes(2, s + 1, tags, coordinates);
    gmsh::model::mesh::addElementsByType(s + 1, 2, {}, corners);
  }
  int loop_tag = 0, volume_tag = 0;
  for (const auto& volume : parts.volumes) {
    std::vector<int> loop_tags;
    for (std::vector<int> surfaces : volume.loops) {
      for (int& tag : surfaces) ++tag;
      gmsh::model::geo::addSurfaceLoop(surfaces, ++loop_tag);
      loop_tags.push_back(loop_tag);
    }
    gmsh::model::geo::addVolume(loop_tags, ++volume_tag);
  }
  gmsh::model::geo::synchronize();
}

// The work of the child process: all calls of gmsh. Nodes of the boundary keep their index.
std::string fill_in_gmsh(const VolumeBoundary& boundary, const FillOptions& options) {
  const Frame frame = unit_frame(boundary.points);
  const ConnectedVolumes parts = connected_volumes(boundary);
  GmshSession session;
  session.use_hxt(options.size / frame.unit, options.optimize_below);
  describe_to_gmsh(boundary, parts, frame);
  try {
    session.generate(3);
  } catch (const GmshFailure& failed) {
    if (failed.nodes.empty() || failed.nodes.front() > boundary.points.size()) throw;
    const Point& p = boundary.points[failed.nodes.front() - 1];
    throw OperationError(fmt::format("{} near ({:.6g}, {:.6g}, {:.6g})", failed.what(), p[0], p[1], p[2]));
  }

  TetrahedralMesh mesh;
  mesh.nodes = boundary.points;
  std::unordered_map<std::size_t, std::int32_t> index;
  for (std::size_t v = 0; v < boundary.points.size(); ++v) index[v + 1] = static_cast<std::int32_t>(v);
  std::vector<std::size_t> tags, corners;
  std::vector<double> xyz, unused;
  for (int v = 0; v < static_cast<int>(parts.volumes.size()); ++v) {
    gmsh::model::mesh::getNodes(tags, xyz, unused, 3, v + 1, false, false);
    for (std::size_t i = 0; i < tags.size(); ++i) {
      index[tags[i]] = static_cast<std::int32_t>(mesh.nodes.size());
      mesh.nodes.push_back(frame.back({xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]}));
    }
  }
  for (int v = 0; v < static_cast<int>(parts.volumes.size()); ++v) {
    tags.clear();  // gmsh takes a vector that is not empty as preallocated
    corners.clear();
    gmsh::model::mesh::getElementsByType(4, tags, corners, v + 1);
    for (std::size_t i = 0; i + 3 < corners.size(); i += 4) {
      mesh.tetrahedra.push_back(
          {index.at(corners[i]), index.at(corners[i + 1]), index.at(corners[i + 2]), index.at(corners[i + 3])});
      mesh.region.push_back(parts.volumes[v].region);
    }
  }
  return to_bytes(mesh);
}

// One side of a face, as its tetrahedron sees it. For a boundary triangle it is the side behind the triangle. odd:
// the cyclic order of the corners is the reverse of the sorted key. The two elements at a face have opposite values
// of odd.
struct FaceUse {
  Triangle key;
  bool odd;
  std::int32_t region;
};

FaceUse face_use(Triangle t, std::int32_t region) {
  bool odd = false;
  for (const auto& [i, j] : {std::pair{0, 1}, {1, 2}, {0, 1}})
    if (t[i] > t[j]) {
      std::swap(t[i], t[j]);
      odd = !odd;
    }
  return {t, odd, region};
}

std::vector<FaceUse> faces_of_elements(const TetrahedralMesh& mesh) {
  constexpr int kFaces[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};  // counter-clockwise from outside
  std::vector<FaceUse> faces;
  faces.reserve(4 * mesh.tetrahedra.size());
  for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e)
    for (const auto& f : kFaces) {
      const auto& t = mesh.tetrahedra[e];
      faces.push_back(face_use({t[f[0]], t[f[1]], t[f[2]]}, mesh.region[e]));
    }
  std::sort(faces.begin(), faces.end(), [](const FaceUse& a, const FaceUse& b) { return a.key < b.key; });
  return faces;
}

std::string corners_text(const VolumeBoundary& boundary, const Triangle& t) {
  std::string text;
  for (const std::int32_t v : t)
    text += fmt::format("{}({:.6g}, {:.6g}, {:.6g})", text.empty() ? "" : " ", boundary.points[v][0],
                        boundary.points[v][1], boundary.points[v][2]);
  return text;
}

}  // namespace

double mean_edge(const VolumeBoundary& boundary) {
  double sum = 0;
  std::size_t count = 0;
  for (const auto& patch : boundary.patches)
    for (const Triangle& t : patch.triangles)
      for (int i = 0; i < 3; ++i) {
        const Point &a = boundary.points[t[i]], &b = boundary.points[t[(i + 1) % 3]];
        sum += std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
        ++count;
      }
  return count == 0 ? 0 : sum / static_cast<double>(count);
}

namespace {

TetrahedralMesh fill_once(const VolumeBoundary& boundary, const FillOptions& options) {
  TetrahedralMesh mesh = from_bytes(run_in_child(
      "gmsh", options.time_limit, [&] { return fill_in_gmsh(boundary, options); }, options.processor_limit));
  mesh.region_names = boundary.region_names;
  for (const auto& patch : boundary.patches) mesh.patches.push_back({patch_name(boundary, patch), patch.triangles});
  verify_boundary_kept(boundary, mesh);
  return mesh;
}

}  // namespace

TetrahedralMesh best_of_tries(const std::vector<FillOptions>& tries, const FillOnce& fill, Improvement* improvement) {
  TetrahedralMesh best;
  double best_dihedral = -1;
  const bool limited = tries.front().processor_limit > 0;
  const double end = processor_seconds() + tries.front().processor_limit;
  const auto left = [&] { return limited ? end - processor_seconds() : std::numeric_limits<double>::infinity(); };
  for (std::size_t t = 0; t < tries.size() && left() > 0; ++t) {
    try {
      FillOptions tried = tries[t];
      if (limited) tried.processor_limit = left();
      TetrahedralMesh mesh = fill(tried);
      const Improvement tried_improvement = improve_worst_elements(mesh, tries[t].goal, left());
      const double dihedral = measure_quality(mesh).dihedral.value;
      if (dihedral > best_dihedral) {
        best_dihedral = dihedral;
        best = std::move(mesh);
        if (improvement) *improvement = tried_improvement;
      }
    } catch (const std::exception&) {
      if (t == 0) throw;  // a later try only looks for a better mesh, so its failure is ignored
    }
    if (best_dihedral >= tries[t].goal || best_dihedral < tries[t].hopeless) break;
  }
  return best;
}

TetrahedralMesh fill_with_tetrahedra(const VolumeBoundary& boundary, const FillOptions& options,
                                     Improvement* improvement) {
  std::vector<FillOptions> tries = {options};
  if (options.optimize_below > 0) {
    FillOptions gentler = options, finer = options;
    gentler.optimize_below = 0.8 * options.optimize_below;
    finer.size = 0.97 * (options.size > 0 ? options.size : mean_edge(boundary));
    tries.insert(tries.end(), {gentler, finer});
  }
  return best_of_tries(
      tries, [&](const FillOptions& tried) { return fill_once(boundary, tried); }, improvement);
}

std::size_t verify_boundary_kept(const VolumeBoundary& boundary, const TetrahedralMesh& mesh) {
  struct Expected {
    FaceUse use;  // the side behind the triangle
    std::int32_t ahead;
    Triangle triangle;
  };
  std::vector<Expected> expected;
  for (const auto& patch : boundary.patches)
    for (const Triangle& t : patch.triangles) expected.push_back({face_use(t, patch.behind), patch.ahead, t});
  std::sort(expected.begin(), expected.end(),
            [](const Expected& a, const Expected& b) { return a.use.key < b.use.key; });

  const auto lost = [&](const Expected& e, const std::string& found) {
    throw VerificationError(
        fmt::format("surface triangle with corners {} should be a face of region \"{}\", but {}; the "
                    "mesh is not written; remesh the surface evenly there or change --size",
                    corners_text(boundary, e.triangle), boundary.region_names[e.use.region], found));
  };
  const std::vector<FaceUse> faces = faces_of_elements(mesh);
  auto next = expected.begin();
  for (std::size_t first = 0, end = 0; first < faces.size(); first = end) {
    while (end < faces.size() && faces[end].key == faces[first].key) ++end;
    if (next != expected.end() && next->use.key < faces[first].key) lost(*next, "no element has it");
    // the regions behind and ahead of the face, according to its elements
    std::int32_t even = VolumeBoundary::kOutside, odd = VolumeBoundary::kOutside;
    for (std::size_t f = first; f < end; ++f) (faces[f].odd ? odd : even) = faces[f].region;
    const bool overlap = end - first > 2 || (end - first == 2 && faces[first].odd == faces[first + 1].odd);
    if (overlap) throw VerificationError("the mesher returned elements that overlap; change --size");
    if (next != expected.end() && next->use.key == faces[first].key) {
      const std::int32_t behind = next->use.odd ? odd : even, ahead = next->use.odd ? even : odd;
      if (behind != next->use.region) lost(*next, "another region lies behind it");
      if (ahead != std::max(next->ahead, VolumeBoundary::kOutside)) lost(*next, "another region lies ahead of it");
      ++next;
    } else if (even != odd) {
      throw VerificationError(
          fmt::format("the mesher put a boundary where the surface has none (face of nodes {} {} {}); "
                      "change --size",
                      faces[first].key[0], faces[first].key[1], faces[first].key[2]));
    }
  }
  if (next != expected.end()) lost(*next, "no element has it");
  return expected.size();
}

}  // namespace palpate
