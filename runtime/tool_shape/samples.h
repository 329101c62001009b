// Points on the surface of a rigid body, at a stated spacing. Only sums, products, quotients and square roots: the same bits in
// every build.
#pragma once

#include <cstdint>

#include "runtime/base/vec3.h"

namespace palpate {

// Takes points up to its capacity, and counts on beyond it.
struct Samples {
  Vec3* points = nullptr;  // [capacity]
  std::int32_t capacity = 0;
  std::int32_t count = 0;  // may exceed the capacity
  double area = 0;         // m^2, of the surface

  void add(Vec3 p) {
    if (count < capacity) points[count] = p;
    if (count < INT32_MAX) ++count;
  }
};

// Rings around z, at most `spacing` apart, each with points at most `spacing` apart. length 0: a sphere.
void sample_capsule(double radius, double length, double spacing, Samples* out);

struct Triangle {
  Vec3 corner[3];
};

double capsule_area(double radius, double length);
// Also *longest: the longest edge, m, where it is longer than *longest.
double triangle_area(const Triangle* triangles, std::int32_t count, double* longest);
// The radius of a disc of that area.
double disc_of(double area);

// Greedy sampling: walks over candidates in order and takes each one that has no point within 0.75 spacing. The corners of the
// triangles come first, then their edges, then their insides; candidates are at most 0.2 spacing apart along two directions, so
// every place of the surface has a point within the spacing. Beyond the capacity it stops.
// Cost: candidates times points.
void sample_triangles(const Triangle* triangles, std::int32_t count, double spacing, Samples* out);

// The faces of the smallest convex body around the points, as triangles: at most 2 count - 4. Which points lie in a plane is
// decided exactly. scratch: [2 count]. Returns their number; 0 where all points lie in one plane.
// Cost: count^3 tests of a few points each.
std::int32_t hull_triangles(Vec3* points, std::int32_t count, std::int32_t* scratch, Triangle* out);

}  // namespace palpate
