#include "precompute/elements/segment_distance.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

using Eigen::Vector3d;
using Face = std::array<Vector3d, 3>;

struct Segment {
  Vector3d from, to;
};

Vector3d vector_of(const std::array<double, 3>& p) {
  return Vector3d(p.data());
}

double squared_distance(const Vector3d& point, const Segment& s) {
  const Vector3d along = s.to - s.from;
  const double length = along.squaredNorm();
  const double t = length > 0 ? std::clamp((point - s.from).dot(along) / length, 0.0, 1.0) : 0.0;
  return (s.from + t * along - point).squaredNorm();
}

// A convex function of two places: its least value lies at an end of one of the segments, or where both slopes are zero.
double squared_distance(const Segment& s, const Segment& t) {
  double least = std::min(
      {squared_distance(s.from, t), squared_distance(s.to, t), squared_distance(t.from, s), squared_distance(t.to, s)});
  const Vector3d d = s.to - s.from, e = t.to - t.from, r = s.from - t.from;
  const double dd = d.squaredNorm(), ee = e.squaredNorm(), de = d.dot(e), dr = d.dot(r), er = e.dot(r);
  const double determinant = dd * ee - de * de;
  if (!(determinant > 0)) return least;
  const double u = (de * er - ee * dr) / determinant, v = (dd * er - de * dr) / determinant;
  if (u >= 0 && u <= 1 && v >= 0 && v <= 1) least = std::min(least, (r + u * d - v * e).squaredNorm());
  return least;
}

// To the inside of the face; infinite where the point does not lie above or below it: an edge is nearer then.
double squared_distance(const Vector3d& point, const Face& face) {
  const Vector3d normal = (face[1] - face[0]).cross(face[2] - face[0]);
  const double size = normal.squaredNorm();
  bool above = size > 0;
  for (std::size_t i = 0; i < 3 && above; ++i)
    above = (face[(i + 1) % 3] - face[i]).cross(point - face[i]).dot(normal) >= 0;
  const double height = normal.dot(point - face[0]);
  return above ? height * height / size : INFINITY;
}

// The part [low, high] of the segment that is not farther than slack outside of the face's plane. inner: the corner that
// the face does not have.
void clip(const Face& face, const Vector3d& inner, const Segment& s, double slack, double& low, double& high) {
  Vector3d normal = (face[1] - face[0]).cross(face[2] - face[0]);
  if (!(normal.squaredNorm() > 0)) return;
  normal.normalize();
  if (normal.dot(inner - face[0]) < 0) normal = -normal;
  const double at_from = normal.dot(s.from - face[0]) + slack, at_to = normal.dot(s.to - face[0]) + slack;
  if (at_from < 0 && at_to < 0) high = -1;
  if (at_from < 0 && at_to >= 0) low = std::max(low, at_from / (at_from - at_to));
  if (at_from >= 0 && at_to < 0) high = std::min(high, at_from / (at_from - at_to));
}

}  // namespace

double segment_distance(const std::array<double, 3>& point, const std::array<double, 3>& from,
                        const std::array<double, 3>& to) {
  return std::sqrt(squared_distance(vector_of(point), Segment{vector_of(from), vector_of(to)}));
}

double segment_distance(const Corners& corners, const std::array<double, 3>& from, const std::array<double, 3>& to) {
  const Segment segment{vector_of(from), vector_of(to)};
  std::array<Vector3d, 4> p;
  double largest = std::max(segment.from.lpNorm<Eigen::Infinity>(), segment.to.lpNorm<Eigen::Infinity>());
  for (std::size_t i = 0; i < 4; ++i)
    p[i] = vector_of(corners[i]), largest = std::max(largest, p[i].lpNorm<Eigen::Infinity>());
  double low = 0, high = 1, least = INFINITY;
  for (std::size_t i = 0; i < 4; ++i) {
    const Face face = {p[(i + 1) % 4], p[(i + 2) % 4], p[(i + 3) % 4]};
    clip(face, p[i], segment, 1e-12 * largest, low, high);
    least = std::min({least, squared_distance(segment.from, face), squared_distance(segment.to, face)});
    for (std::size_t j = 0; j < i; ++j) least = std::min(least, squared_distance(segment, Segment{p[i], p[j]}));
  }
  return low <= high ? 0.0 : std::sqrt(least);
}

}  // namespace palpate
