// The faces of a convex hull, by trying every plane through three points.
#include <algorithm>

#include "runtime/surface/exact_signs.h"
#include "runtime/tool_shape/samples.h"

namespace palpate {
namespace {

bool are_equal(Vec3 a, Vec3 b) {
  return a.x == b.x && a.y == b.y && a.z == b.z;
}

bool are_in_line(Vec3 a, Vec3 b, Vec3 c) {
  const Vec3 u = b - a, v = c - a;
  const double size = length(u) * length(v);
  return !(length(cross(u, v)) > 1e-12 * size);
}

// +1 above the plane through a, b and c, -1 below, 0 in it: exact.
int side(Vec3 a, Vec3 b, Vec3 c, Vec3 p) {
  const Difference u{b, a}, v{c, a}, w{p, a};
  const int plain = plain_sign_of_determinant(u, v, w);
  return plain ? plain : exact_sign_of_determinant(u, v, w);
}

// Whether all points lie on one side of the plane through points i < j < k, or in it; *above: whether that side is the upper one.
bool is_face(const Vec3* points, std::int32_t count, const std::int32_t* triple, bool* above) {
  int seen = 0;
  for (std::int32_t p = 0; p < count; ++p) {
    const int s = side(points[triple[0]], points[triple[1]], points[triple[2]], points[p]);
    if (s != 0 && seen == -s) return false;
    if (s != 0) seen = s;
  }
  *above = seen > 0;
  return seen != 0;
}

// The corners of the polygon around the points of a plane, in order, seen against the normal; gift wrapping. Returns their number.
std::int32_t wrap(const Vec3* points, const std::int32_t* in_plane, std::int32_t count, Vec3 normal,
                  std::int32_t* polygon) {
  const auto is_before = [&](std::int32_t a, std::int32_t b) {
    const Vec3 p = points[a], q = points[b];
    return p.x != q.x ? p.x < q.x : p.y != q.y ? p.y < q.y : p.z < q.z;
  };
  std::int32_t first = in_plane[0];
  for (std::int32_t i = 1; i < count; ++i)
    if (is_before(in_plane[i], first)) first = in_plane[i];
  std::int32_t at = first, corners = 0;
  do {
    polygon[corners++] = at;
    std::int32_t next = -1;
    for (std::int32_t i = 0; i < count; ++i) {
      const std::int32_t p = in_plane[i];
      if (p == at) continue;
      if (next < 0) {
        next = p;
        continue;
      }
      const Vec3 u = points[next] - points[at], v = points[p] - points[at];
      const double turn = dot(cross(u, v), normal);
      const bool straight = are_in_line(points[at], points[next], points[p]);
      if (straight ? dot(v, v) > dot(u, u) && dot(u, v) > 0 : turn < 0) next = p;
    }
    at = next;
  } while (at != first && corners < count);
  return corners;
}

// Of a face with more than three points every triple of them is tried; only the first one in order makes the face.
bool is_first(const Vec3* points, const std::int32_t* in_plane, std::int32_t count, const std::int32_t* triple) {
  if (in_plane[0] != triple[0] || in_plane[1] != triple[1]) return false;
  for (std::int32_t i = 2; i < count && in_plane[i] < triple[2]; ++i)
    if (!are_in_line(points[triple[0]], points[triple[1]], points[in_plane[i]])) return false;
  return true;
}

}  // namespace

std::int32_t hull_triangles(Vec3* points, std::int32_t count, std::int32_t* scratch, Triangle* out) {
  std::int32_t kept = 0;
  for (std::int32_t p = 0; p < count; ++p) {
    bool is_new = true;
    for (std::int32_t q = 0; q < kept && is_new; ++q) is_new = !are_equal(points[p], points[q]);
    if (is_new) points[kept++] = points[p];
  }
  const std::int32_t most = std::max(0, 2 * kept - 4);
  std::int32_t made = 0;
  std::int32_t *in_plane = scratch, *polygon = scratch + count;
  for (std::int32_t i = 0; i < kept; ++i)
    for (std::int32_t j = i + 1; j < kept; ++j)
      for (std::int32_t k = j + 1; k < kept; ++k) {
        const std::int32_t triple[3] = {i, j, k};
        bool above = false;
        if (are_in_line(points[i], points[j], points[k]) || !is_face(points, kept, triple, &above)) continue;
        std::int32_t in = 0;
        for (std::int32_t p = 0; p < kept; ++p)
          if (side(points[i], points[j], points[k], points[p]) == 0) in_plane[in++] = p;
        if (!is_first(points, in_plane, in, triple)) continue;
        const Vec3 normal = cross(points[j] - points[i], points[k] - points[i]);
        const std::int32_t corners = wrap(points, in_plane, in, above ? -1.0 * normal : normal, polygon);
        for (std::int32_t c = 2; c < corners && made < most; ++c)
          out[made++] = {points[polygon[0]], points[polygon[c - 1]], points[polygon[c]]};
      }
  return made;
}

}  // namespace palpate
