// Vectors of three and matrices of three by three.
#pragma once

#include <cmath>

namespace palpate {

struct Vec3 {
  double x = 0, y = 0, z = 0;
  // (&x)[i] would be undefined behaviour: with it, clang -O2 compiled wrong crossings.
  double& operator[](int i) { return i == 0 ? x : i == 1 ? y : z; }
  double operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
};

inline Vec3 operator+(Vec3 a, Vec3 b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Vec3 operator-(Vec3 a, Vec3 b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Vec3 operator*(double s, Vec3 a) {
  return {s * a.x, s * a.y, s * a.z};
}
inline Vec3& operator+=(Vec3& a, Vec3 b) {
  return a = a + b;
}
inline double dot(Vec3 a, Vec3 b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Vec3 cross(Vec3 a, Vec3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(Vec3 a) {
  return std::sqrt(dot(a, a));
}
inline bool is_zero(Vec3 a) {
  return a.x == 0 && a.y == 0 && a.z == 0;
}
inline bool is_finite(Vec3 a) {
  return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}
inline Vec3 load3(const double* p) {
  return {p[0], p[1], p[2]};
}
inline void store3(Vec3 a, double* p) {
  p[0] = a.x, p[1] = a.y, p[2] = a.z;
}

// The unit vector along a, or zero where a has no direction: below 1e-150 m the squares underflow, and a result made of
// denormal numbers would depend on whether the host flushes them to zero.
inline Vec3 unit_or_zero(Vec3 a) {
  const double l = length(a);
  return l > 1e-150 && std::isfinite(l) ? (1 / l) * a : Vec3{};
}

struct Mat3 {
  double m[3][3] = {};
};

inline Vec3 operator*(const Mat3& a, Vec3 v) {
  return {a.m[0][0] * v.x + a.m[0][1] * v.y + a.m[0][2] * v.z, a.m[1][0] * v.x + a.m[1][1] * v.y + a.m[1][2] * v.z,
          a.m[2][0] * v.x + a.m[2][1] * v.y + a.m[2][2] * v.z};
}
inline Mat3 operator*(const Mat3& a, const Mat3& b) {
  Mat3 c;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c.m[i][j] = a.m[i][0] * b.m[0][j] + a.m[i][1] * b.m[1][j] + a.m[i][2] * b.m[2][j];
  return c;
}

// a times the transpose of b.
inline Mat3 times_transposed(const Mat3& a, const Mat3& b) {
  Mat3 c;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c.m[i][j] = a.m[i][0] * b.m[j][0] + a.m[i][1] * b.m[j][1] + a.m[i][2] * b.m[j][2];
  return c;
}
// The transpose of a times v.
inline Vec3 transposed_times(const Mat3& a, Vec3 v) {
  return {a.m[0][0] * v.x + a.m[1][0] * v.y + a.m[2][0] * v.z, a.m[0][1] * v.x + a.m[1][1] * v.y + a.m[2][1] * v.z,
          a.m[0][2] * v.x + a.m[1][2] * v.y + a.m[2][2] * v.z};
}
inline void add_scaled(Mat3& sum, double factor, const Mat3& a) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) sum.m[i][j] += factor * a.m[i][j];
}

}  // namespace palpate
