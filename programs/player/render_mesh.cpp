#include "programs/player/render_mesh.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <fstream>
#include <iterator>

#include "formats/errors.h"
#include "formats/ply_reader.h"

namespace palpate {

// The z axis for a vertex without a normal: glTF does not allow a zero vector.
std::vector<float> smooth_normals(const std::vector<float>& positions, const std::vector<std::uint32_t>& indices) {
  using Vector = std::array<double, 3>;
  const auto at = [&](std::uint32_t n) { return Vector{positions[3 * n], positions[3 * n + 1], positions[3 * n + 2]}; };
  std::vector<Vector> sums(positions.size() / 3);
  for (std::size_t t = 0; t < indices.size(); t += 3) {
    const Vector a = at(indices[t]), b = at(indices[t + 1]), c = at(indices[t + 2]);
    for (int d = 0, e = 1, f = 2; d < 3; e = f, f = d++) {
      const double area = (b[e] - a[e]) * (c[f] - a[f]) - (b[f] - a[f]) * (c[e] - a[e]);
      for (int corner = 0; corner < 3; ++corner) sums[indices[t + corner]][d] += area;
    }
  }
  std::vector<float> normals(positions.size());
  for (std::size_t n = 0; n < sums.size(); ++n) {
    const double length = std::hypot(sums[n][0], sums[n][1], sums[n][2]);
    for (int d = 0; d < 3; ++d)
      normals[3 * n + d] = static_cast<float>(length > 0 ? sums[n][d] / length : d == 2 ? 1 : 0);
  }
  return normals;
}

RenderMesh read_render_mesh(const std::filesystem::path& file, double metres_per_unit) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw InputError(fmt::format("{}: expected a render mesh (.ply), found no file", file.string()));
  const PlyTriangles ply = read_ply(file, {std::istreambuf_iterator<char>(stream), {}});
  if (ply.triangles.empty()) throw InputError(fmt::format("{}: expected triangles, found none", file.string()));
  RenderMesh mesh;
  for (const auto& point : ply.points)
    for (const double c : point) mesh.positions.push_back(static_cast<float>(metres_per_unit * c));
  for (const auto& triangle : ply.triangles) mesh.indices.insert(mesh.indices.end(), triangle.begin(), triangle.end());
  mesh.normals = smooth_normals(mesh.positions, mesh.indices);
  return mesh;
}

}  // namespace palpate
