#include "runtime/tool_shape/samples.h"

#include <algorithm>

#include "runtime/base/sine.h"

namespace palpate {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kNearest = 0.75;   // spacings between two points of a triangle mesh
constexpr double kCandidate = 0.2;  // spacings between two candidates

// Parts into which to cut a length so that each is at most `most` long.
std::int32_t parts_of(double length, double most) {
  return static_cast<std::int32_t>(std::min(std::ceil(length / most - 1e-9), 1e6));
}

// Every second ring is turned by half a step, so that the points of three rings form triangles.
void add_ring(double radius, double z, double spacing, bool turned, Samples* out) {
  const std::int32_t count = std::max<std::int32_t>(parts_of(2 * kPi * radius, spacing), 3);
  for (std::int32_t i = 0; i < count; ++i) {
    const SineCosine at = sine_cosine(2 * kPi * (i + (turned ? 0.5 : 0.0)) / count);
    out->add({radius * at.cosine, radius * at.sine, z});
  }
}

void add_if_far(Vec3 p, double squared, Samples* out) {
  const std::int32_t known = std::min(out->count, out->capacity);
  for (std::int32_t i = 0; i < known; ++i)
    if (dot(p - out->points[i], p - out->points[i]) < squared) return;
  out->add(p);
}

void sample_edge(Vec3 a, Vec3 b, double spacing, double squared, Samples* out) {
  const std::int32_t parts = parts_of(length(b - a), kCandidate * spacing);
  for (std::int32_t i = 1; i < parts && out->count <= out->capacity; ++i)
    add_if_far(a + (static_cast<double>(i) / parts) * (b - a), squared, out);
}

// Lines along the longest edge, from that edge to the opposite corner.
void sample_inside(const Triangle& triangle, double spacing, double squared, Samples* out) {
  const Vec3* c = triangle.corner;
  int top = 0;
  for (int v = 1; v < 3; ++v)
    if (length(c[(v + 2) % 3] - c[(v + 1) % 3]) > length(c[(top + 2) % 3] - c[(top + 1) % 3])) top = v;
  const Vec3 a = c[(top + 1) % 3], b = c[(top + 2) % 3];
  const double base = length(b - a);
  if (!(base > 0)) return;
  const double height = length(cross(b - a, c[top] - a)) / base;
  const std::int32_t lines = parts_of(height, kCandidate * spacing);
  for (std::int32_t line = 1; line < lines; ++line) {
    const double up = static_cast<double>(line) / lines;
    sample_edge(a + up * (c[top] - a), b + up * (c[top] - b), spacing, squared, out);
  }
}

}  // namespace

double capsule_area(double radius, double length) {
  return 2 * kPi * radius * (2 * radius + length);
}

double triangle_area(const Triangle* triangles, std::int32_t count, double* longest) {
  double area = 0;
  for (std::int32_t t = 0; t < count; ++t) {
    const Vec3* c = triangles[t].corner;
    area += 0.5 * length(cross(c[1] - c[0], c[2] - c[0]));
    for (int v = 0; v < 3; ++v) *longest = std::max(*longest, length(c[(v + 1) % 3] - c[v]));
  }
  return area;
}

double disc_of(double area) {
  return std::sqrt(area / kPi);
}

void sample_capsule(double radius, double length, double spacing, Samples* out) {
  const std::int32_t cap = std::max<std::int32_t>(parts_of(0.5 * kPi * radius, spacing), 1);
  const std::int32_t side = length > 0 ? std::max<std::int32_t>(parts_of(length, spacing), 1) : 0;
  bool turned = false;
  out->add({0, 0, -0.5 * length - radius});
  for (std::int32_t i = 1; i <= 2 * cap + side - 1; ++i, turned = !turned) {
    double z = 0, ring = radius;
    if (i < cap || i > cap + side) {
      const SineCosine up = sine_cosine(0.5 * kPi * (i < cap ? cap - i : i - cap - side) / cap);
      ring = radius * up.cosine;
      z = i < cap ? -0.5 * length - radius * up.sine : 0.5 * length + radius * up.sine;
    } else {
      z = side > 0 ? length * (static_cast<double>(i - cap) / side - 0.5) : 0;
    }
    add_ring(ring, z, spacing, turned, out);
  }
  out->add({0, 0, 0.5 * length + radius});
}

void sample_triangles(const Triangle* triangles, std::int32_t count, double spacing, Samples* out) {
  const double squared = kNearest * spacing * kNearest * spacing;
  for (std::int32_t t = 0; t < count; ++t) {
    const Vec3* c = triangles[t].corner;
    for (int v = 0; v < 3; ++v) add_if_far(c[v], squared, out);
  }
  for (std::int32_t t = 0; t < count; ++t)
    for (int v = 0; v < 3; ++v)
      sample_edge(triangles[t].corner[v], triangles[t].corner[(v + 1) % 3], spacing, squared, out);
  for (std::int32_t t = 0; t < count && out->count <= out->capacity; ++t)
    sample_inside(triangles[t], spacing, squared, out);
}

}  // namespace palpate
