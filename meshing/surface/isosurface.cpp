#include "meshing/surface/isosurface.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "formats/errors.h"

namespace palpate {
namespace {

constexpr std::size_t kMostTriangles = 40'000'000;

// Averages of a Gaussian of width sigma over voxels of width spacing. [0] is the weight of the centre, [n] the weight
// of each of the two voxels at distance n. The weights of all voxels sum to 1.
std::vector<float> gaussian_weights(double sigma, double spacing) {
  if (sigma <= 0) return {1};
  const int radius = static_cast<int>(std::ceil(3 * sigma / spacing));
  std::vector<double> weights;
  double sum = 0;
  for (int i = 0; i <= radius; ++i) {
    const auto below = [&](double x) { return 0.5 * std::erfc(-x * spacing / (sigma * std::sqrt(2.0))); };
    weights.push_back(below(i + 0.5) - below(i - 0.5));
    sum += (i ? 2 : 1) * weights.back();
  }
  std::vector<float> normalised;
  for (const double w : weights) normalised.push_back(static_cast<float>(w / sum));
  return normalised;
}

// Convolves every line of the field along one axis. Along y and z it handles a row of lines together, so that memory
// is read in order.
void convolve(const VoxelGrid& grid, int axis, const std::vector<float>& weights, std::vector<float>& field) {
  const int radius = static_cast<int>(weights.size()) - 1;
  if (radius == 0) return;
  const int length = grid.size[axis];
  const std::size_t row = axis == 0 ? 1 : static_cast<std::size_t>(grid.size[0]);
  const std::size_t stride = axis == 0 ? 1 : axis == 1 ? row : row * grid.size[1];
  const int outer = axis == 2 ? 1 : grid.size[2];
  const int middle = axis == 1 ? 1 : grid.size[1];
  std::vector<float> line(static_cast<std::size_t>(length) * row);
  for (int k = 0; k < outer; ++k) {
    for (int j = 0; j < middle; ++j) {
      float* first = field.data() + grid.index(0, axis == 1 ? 0 : j, axis == 2 ? 0 : k);
      for (int n = 0; n < length; ++n) std::copy_n(first + n * stride, row, line.data() + n * row);
      for (int n = 0; n < length; ++n) {
        float* out = first + n * stride;
        std::fill_n(out, row, 0.0f);
        for (int d = std::max(-radius, -n); d <= std::min(radius, length - 1 - n); ++d) {
          const float w = weights[static_cast<std::size_t>(std::abs(d))];
          const float* in = line.data() + (n + d) * row;
          for (std::size_t x = 0; x < row; ++x) out[x] += w * in[x];
        }
      }
    }
  }
}

// Corner c of the cube lies at (c & 1, c >> 1 & 1, c >> 2). Each edge lists its two corners, the lower one first.
// Each face lists its corners counter-clockwise seen from outside.
constexpr int kEdges[12][2] = {{0, 1}, {2, 3}, {4, 5}, {6, 7}, {0, 2}, {1, 3},
                               {4, 6}, {5, 7}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
constexpr int kFaces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};

int edge_between(int a, int b) {
  for (int e = 0; e < 12; ++e) {
    if ((kEdges[e][0] == a && kEdges[e][1] == b) || (kEdges[e][0] == b && kEdges[e][1] == a)) return e;
  }
  return -1;
}

bool share_a_face(int e, int f) {
  for (const auto& face : kFaces) {
    const auto on = [&](int edge) {
      const auto has = [&](int corner) {
        return std::find(std::begin(face), std::end(face), corner) != std::end(face);
      };
      return has(kEdges[edge][0]) && has(kEdges[edge][1]);
    };
    if (on(e) && on(f)) return true;
  }
  return false;
}

// The triangles of one cube for one of the 256 sign patterns of its corners.
struct CubeCase {
  std::vector<std::array<int, 3>> triangles;  // 0 .. 11: the crossing on this edge; 12 + l: the centre of loop l
  std::vector<std::vector<int>> centred_loops;
};

// Joins the crossings of a cube to loops. On each face it walks along the corners counter-clockwise from outside. It
// joins each step from inside to outside to the next step back to inside. So inside corners that are diagonal stay
// apart, and the inside lies to the left of the loop as seen from outside the cube.
std::vector<std::vector<int>> crossing_loops(int pattern) {
  const auto in = [&](int corner) { return (pattern >> corner & 1) != 0; };
  std::array<int, 12> next;
  next.fill(-1);
  for (const auto& face : kFaces) {
    for (int c = 0; c < 4; ++c) {
      if (in(face[c]) || !in(face[(c + 1) % 4])) continue;  // the step goes from inside to outside
      int leave = c + 1;
      while (in(face[(leave + 1) % 4])) ++leave;
      next[edge_between(face[c], face[(c + 1) % 4])] = edge_between(face[leave % 4], face[(leave + 1) % 4]);
    }
  }
  std::vector<std::vector<int>> loops;
  std::array<bool, 12> used{};
  for (int start = 0; start < 12; ++start) {
    if (next[start] < 0 || used[start]) continue;
    loops.emplace_back();
    for (int e = start; !used[e]; e = next[e]) {
      used[e] = true;
      loops.back().push_back(e);
    }
  }
  return loops;
}

CubeCase cube_case(int pattern) {
  CubeCase result;
  for (const std::vector<int>& loop : crossing_loops(pattern)) {
    const int n = static_cast<int>(loop.size());
    // cut the loop into a fan, from a vertex whose diagonals all run through the interior of the cube
    int apex = -1;
    for (int a = 0; a < n && apex < 0; ++a) {
      bool interior = true;
      for (int d = 2; d <= n - 2; ++d) interior &= !share_a_face(loop[a], loop[(a + d) % n]);
      if (interior) apex = a;
    }
    if (apex >= 0) {
      for (int d = 1; d + 1 < n; ++d) {
        result.triangles.push_back({loop[apex], loop[(apex + d) % n], loop[(apex + d + 1) % n]});
      }
      continue;
    }
    const int centre = 12 + static_cast<int>(result.centred_loops.size());
    result.centred_loops.push_back(loop);
    for (int d = 0; d < n; ++d) result.triangles.push_back({loop[d], loop[(d + 1) % n], centre});
  }
  return result;
}

}  // namespace

std::vector<float> smooth_mask(const VoxelMask& mask, double sigma_mm) {
  std::vector<float> field(mask.inside.begin(), mask.inside.end());
  const std::array<double, 3> spacing = mask.grid.spacing();
  for (int axis = 0; axis < 3; ++axis) convolve(mask.grid, axis, gaussian_weights(sigma_mm, spacing[axis]), field);
  return field;
}

Isosurface isosurface(const VoxelGrid& grid, const std::vector<float>& field) {
  static const std::vector<CubeCase> cases = [] {
    std::vector<CubeCase> all;
    for (int pattern = 0; pattern < 256; ++pattern) all.push_back(cube_case(pattern));
    return all;
  }();
  const auto [nx, ny, nz] = grid.size;
  const auto inside = [&](int i, int j, int k) { return field[grid.index(i, j, k)] > 0.5f; };

  Isosurface result;
  TriangleSurface& surface = result.surface;
  // index of the point on each voxel edge of two neighbouring slices: [slice parity][axis][voxel of the slice]
  const std::size_t slice = static_cast<std::size_t>(nx) * ny;
  std::array<std::array<std::vector<std::int32_t>, 3>, 2> crossing;
  for (auto& parity : crossing) parity.fill(std::vector<std::int32_t>(slice, -1));
  const auto vertex = [&](int i, int j, int k, int axis) {
    std::int32_t& number = crossing[k & 1][axis][static_cast<std::size_t>(j) * nx + i];
    if (number < 0) {
      number = static_cast<std::int32_t>(surface.points.size());
      const std::array<int, 3> step = {axis == 0, axis == 1, axis == 2};
      const std::size_t here = grid.index(i, j, k), there = grid.index(i + step[0], j + step[1], k + step[2]);
      const double a = field[here], b = field[there];
      result.inside_voxel.push_back(a > b ? here : there);
      result.outside_voxel.push_back(a > b ? there : here);
      const double t = std::clamp((0.5 - a) / (b - a), 0.02, 0.98);
      surface.points.push_back(grid.point(i + t * step[0], j + t * step[1], k + t * step[2]));
    }
    return number;
  };

  for (int k = 0; k + 1 < nz; ++k) {
    for (auto& axis : crossing[(k + 1) & 1]) std::fill(axis.begin(), axis.end(), -1);
    for (int j = 0; j + 1 < ny; ++j) {
      for (int i = 0; i + 1 < nx; ++i) {
        int pattern = 0;
        for (int c = 0; c < 8; ++c) pattern |= inside(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)) << c;
        if (pattern == 0 || pattern == 255) continue;

        const CubeCase& cube = cases[static_cast<std::size_t>(pattern)];
        std::array<std::int32_t, 16> numbers{};
        const auto number_of = [&](int e) {
          const int c = kEdges[e][0];
          return vertex(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2), e / 4);
        };
        for (std::size_t l = 0; l < cube.centred_loops.size(); ++l) {
          Point centre{};
          for (const int e : cube.centred_loops[l]) centre = centre + surface.points[number_of(e)];
          const std::int32_t some = number_of(cube.centred_loops[l][0]);
          result.inside_voxel.push_back(result.inside_voxel[some]);
          result.outside_voxel.push_back(result.outside_voxel[some]);
          numbers[12 + l] = static_cast<std::int32_t>(surface.points.size());
          surface.points.push_back((1.0 / static_cast<double>(cube.centred_loops[l].size())) * centre);
        }
        for (const auto& triangle : cube.triangles) {
          Triangle out{};
          for (int corner = 0; corner < 3; ++corner) {
            out[corner] = triangle[corner] < 12 ? number_of(triangle[corner]) : numbers[triangle[corner]];
          }
          if (grid.left_handed()) std::swap(out[1], out[2]);
          surface.triangles.push_back(out);
        }
      }
    }
    if (surface.triangles.size() > kMostTriangles) {
      throw InputError(
          fmt::format("the label's surface has more than {} triangles at voxel resolution, which is more than "
                      "any organ's (noise?); clean the segmentation or resample the image",
                      kMostTriangles));
    }
  }
  return result;
}

std::vector<std::int64_t> handles_of_shells(const TriangleSurface& surface) {
  std::int32_t count = 0;
  const std::vector<std::int32_t> shell = shell_of_triangle(surface, &count);
  // on a closed surface E = 3 F / 2, so V - E + F = V - F / 2
  std::vector<std::int64_t> points(count), triangles(count);
  std::vector<bool> seen(surface.points.size());
  for (std::size_t t = 0; t < shell.size(); ++t) {
    ++triangles[shell[t]];
    for (const std::int32_t p : surface.triangles[t]) {
      if (!seen[p]) ++points[shell[t]];
      seen[p] = true;
    }
  }
  std::vector<std::int64_t> handles;
  for (std::int32_t s = 0; s < count; ++s) handles.push_back((2 - points[s] + triangles[s] / 2) / 2);
  return handles;
}

}  // namespace palpate
