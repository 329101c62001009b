#include "runtime/contact/grasp_patch.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

// Patches whose nodes lie nearly on one line hold no gradients: M is then singular.
constexpr double kOnALine = 1e-3;

// Leaves a disc `most` nodes that are spread over it as its pressure is: the lightest node goes, and the nearest one takes its weight and its
// moments. Cost: nodes squared.
void gather(const double* rest, int most, TouchableDisc* disc) {
  const auto place = [&](int e) { return load3(rest + 3 * static_cast<std::size_t>(disc->node[e])); };
  while (disc->count > most) {
    const int light = static_cast<int>(std::min_element(disc->weight, disc->weight + disc->count) - disc->weight);
    int to = -1;
    double nearest = INFINITY;
    for (int e = 0; e < disc->count; ++e) {
      const Vec3 way = place(e) - place(light);
      if (const double far = dot(way, way); e != light && far < nearest) nearest = far, to = e;
    }
    disc->weight[to] += disc->weight[light];
    for (double* moment : disc->moment) moment[to] += moment[light];
    const int last = --disc->count;
    disc->node[light] = disc->node[last], disc->weight[light] = disc->weight[last];
    for (double* moment : disc->moment) moment[light] = moment[last];
  }
}

// v = M^-1 (m1, m2) with M_ij = sum_n m_i x_j: zero for a displacement that is the same everywhere, exact for one that is linear.
void find_gradients(const double* rest, const TouchableDisc& disc, GraspPatch* patch) {
  double moment[2][GraspPatch::kMostNodes], m[2][2] = {};
  for (int i = 0; i < 2; ++i) {
    double sum = 0;
    for (int e = 0; e < disc.count; ++e) sum += disc.moment[i][e];
    for (int e = 0; e < disc.count; ++e) {
      const Vec3 x = load3(rest + 3 * static_cast<std::size_t>(disc.node[e]));
      moment[i][e] = disc.moment[i][e] - sum * disc.weight[e];
      for (int j = 0; j < 2; ++j) m[i][j] += moment[i][e] * dot(x, disc.along[j]);
    }
  }
  const double determinant = m[0][0] * m[1][1] - m[0][1] * m[1][0], most = std::max(m[0][0], m[1][1]);
  patch->has_gradients = determinant > kOnALine * most * most;
  for (int e = 0; e < disc.count && patch->has_gradients; ++e) {
    patch->weight[1][e] = (m[1][1] * moment[0][e] - m[0][1] * moment[1][e]) / determinant;
    patch->weight[2][e] = (m[0][0] * moment[1][e] - m[1][0] * moment[0][e]) / determinant;
  }
}

// 1/m^3: by how much softer than as the mesh shows it a disc is against a turn, over the compliance of a disc of radius 1. b + blur s as for
// a push (surface_measure.h), with the next power of s/b, since the compliance goes with the cube of the radius.
double lacking(double a, double b, double s, const TurnBlur& blur) {
  const double shown = b + blur.first * s + blur.second * s * s / b;
  return std::max(0.0, 1 / (a * a * a) - 1 / (shown * shown * shown));
}

// A rigid disc has the stiffness 8 G a^3 / (3 (1 - nu)) against a tilt and 16 G a^3 / 3 against a twist, of which each gradient takes a
// half; with 1/G from the compliances (1 - nu) / (4 G) along its normal and (2 - nu) / (8 G) across it.
Mat3 lacking_of_gradients(const SurfaceMeasure& measure, const SurfacePoint& place, double radius, Vec3 outward) {
  const LocalCompliance tissue = measure.tissue(place);
  const double s = measure.spacing(place), a = std::max(radius, ContactPatch::kLeastRadius),
               b = std::max(a, GraspPatch::kResolved * s),
               tilt = 1.5 * tissue.normal * lacking(a, b, s, tissue.tilt_blur),
               twist = (3 * tissue.tangent - 1.5 * tissue.normal) * lacking(a, b, s, tissue.twist_blur);
  Mat3 local;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) local.m[i][j] = (tilt - twist) * outward[i] * outward[j] + (i == j ? twist : 0);
  return local;
}

}  // namespace

void find_grasp_patch(const DiscSource& source, const SurfacePoint& place, double radius, int most, GraspPatch* patch) {
  *patch = GraspPatch{};
  TouchableDisc disc;
  press_disc(source, place, radius, ContactPatch::kMaxNodes, &disc, GraspPatch::kResolved);
  if (disc.count == 0) return;
  gather(source.rest, std::min(most, GraspPatch::kMostNodes), &disc);
  patch->count = disc.count, patch->along[0] = disc.along[0], patch->along[1] = disc.along[1];
  std::copy(disc.node, disc.node + disc.count, patch->node);
  std::copy(disc.weight, disc.weight + disc.count, patch->weight[0]);
  find_gradients(source.rest, disc, patch);
  patch->local[0] = disc.local;
  patch->local[1] = patch->local[2] = lacking_of_gradients(*source.measure, place, radius, disc.outward);
}

}  // namespace palpate
