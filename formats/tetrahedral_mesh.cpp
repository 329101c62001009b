#include "formats/tetrahedral_mesh.h"

#include <fmt/format.h>

#include <algorithm>

#include "formats/errors.h"

namespace palpate {

namespace {

// The faces of a tetrahedron of positive volume, counter-clockwise from outside.
constexpr int kFaces[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};

struct Face {
  std::array<std::int32_t, 3> sorted;
  std::uint64_t at;  // 4 * tetrahedron + face
};

std::array<std::int32_t, 3> corners(const TetrahedralMesh& mesh, std::uint64_t at) {
  const auto& tetrahedron = mesh.tetrahedra[at / 4];
  const int* face = kFaces[at % 4];
  return {tetrahedron[face[0]], tetrahedron[face[1]], tetrahedron[face[2]]};
}

}  // namespace

std::vector<std::array<std::int32_t, 3>> boundary_triangles(const TetrahedralMesh& mesh) {
  std::vector<Face> faces;
  faces.reserve(4 * mesh.tetrahedra.size());
  for (std::uint64_t at = 0; at < 4 * mesh.tetrahedra.size(); ++at) {
    auto sorted = corners(mesh, at);
    std::sort(sorted.begin(), sorted.end());
    faces.push_back({sorted, at});
  }
  std::sort(faces.begin(), faces.end(),
            [](const Face& a, const Face& b) { return a.sorted != b.sorted ? a.sorted < b.sorted : a.at < b.at; });

  // A face of one tetrahedron is on the surface, a face of two is inside; a face of three or more is refused.
  std::vector<std::uint64_t> alone;
  for (std::size_t first = 0, last; first < faces.size(); first = last) {
    for (last = first + 1; last < faces.size() && faces[last].sorted == faces[first].sorted;) ++last;
    if (last - first == 1) alone.push_back(faces[first].at);
    if (last - first > 2)
      throw InputError(fmt::format(
          "the face of nodes {}, {} and {} (counted from 0) belongs to {} tetrahedra, expected one or two; remove "
          "overlapping tetrahedra, for example by meshing again",
          faces[first].sorted[0], faces[first].sorted[1], faces[first].sorted[2], last - first));
  }
  std::sort(alone.begin(), alone.end());
  std::vector<std::array<std::int32_t, 3>> triangles;
  triangles.reserve(alone.size());
  for (const std::uint64_t at : alone) triangles.push_back(corners(mesh, at));
  return triangles;
}

}  // namespace palpate
