#include "runtime/grasps/grasp_patch.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

// Patches whose nodes lie nearly on one line hold no gradients: M is then singular.
constexpr double kOnALine = 1e-3;

// Leaves a disc `most` nodes that are spread over it as its pressure is: the lightest node goes, and the nearest one takes its weight and its
// moments. mean: weights of another disc on the same nodes. Cost: nodes squared.
void gather(const double* rest, int most, TouchableDisc* disc, double* mean) {
  const auto place = [&](int e) { return load3(rest + 3 * static_cast<std::size_t>(disc->node[e])); };
  double* const taken[] = {disc->weight, disc->moment[0], disc->moment[1], mean};
  while (disc->count > most) {
    const int light = static_cast<int>(std::min_element(disc->weight, disc->weight + disc->count) - disc->weight);
    int to = -1;
    double nearest = INFINITY;
    for (int e = 0; e < disc->count; ++e) {
      const Vec3 way = place(e) - place(light);
      if (const double far = dot(way, way); e != light && far < nearest) nearest = far, to = e;
    }
    const int last = --disc->count;
    for (double* of : taken) of[to] += of[light], of[light] = of[last];
    disc->node[light] = disc->node[last];
  }
}

int add_empty(std::int32_t node, TouchableDisc* disc) {
  if (disc->count == ContactPatch::kMaxNodes) return 0;
  const int at = disc->count++;
  disc->node[at] = node, disc->weight[at] = disc->moment[0][at] = disc->moment[1][at] = 0;
  return at;
}

// The weights of `from` on the nodes of `disc`, which gets those that only `from` has. Where it has no room, the first node takes their weight.
void lay_on(const TouchableDisc& from, TouchableDisc* disc, double* weight) {
  std::fill(weight, weight + ContactPatch::kMaxNodes, 0.0);
  for (int e = 0; e < from.count; ++e) {
    const std::int32_t* const at = std::find(disc->node, disc->node + disc->count, from.node[e]);
    const auto known = static_cast<int>(at - disc->node);
    weight[known < disc->count ? known : add_empty(from.node[e], disc)] += from.weight[e];
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

// What the mesh shows a disc as that turns: b + blur s as for a push (surface_measure.h), with the next power of s/b, since the compliance goes
// with the cube of the radius.
double shown(double b, double s, const TurnBlur& blur) {
  return b + blur.first * s + blur.second * s * s / b;
}

// 1/m^3: by how much softer a disc is against a turn than as the mesh shows it, over the compliance of a disc of radius 1.
double lacking(double a, double wide) {
  return std::max(0.0, 1 / (a * a * a) - 1 / (wide * wide * wide));
}

// A rigid disc has the stiffness 8 G a^3 / (3 (1 - nu)) against a tilt and 16 G a^3 / 3 against a twist, of which each gradient takes a
// half; with 1/G from the compliances (1 - nu) / (4 G) along its normal and (2 - nu) / (8 G) across it.
void find_compliance_of_gradients(const SurfaceMeasure& measure, const SurfacePoint& place, GraspPatch* patch) {
  const LocalCompliance tissue = measure.tissue(place);
  ContactDisc disc = patch->discs[0];
  const double s = measure.spacing(place), a = disc.radius, b = std::max(a, GraspPatch::kResolved * s),
               tilt = 1.5 * tissue.normal, twist = 3 * tissue.tangent - 1.5 * tissue.normal;
  disc.wide[0] = shown(b, s, tissue.tilt_blur), disc.wide[1] = shown(b, s, tissue.twist_blur);
  const Vec3 n = disc.outward;
  disc.normal_root = std::sqrt(tilt * shared_part_of_turn(a, disc.wide[0])) * n;
  const double across = std::sqrt(twist * shared_part_of_turn(a, disc.wide[1])),
               tilts = tilt * lacking(a, disc.wide[0]), twists = twist * lacking(a, disc.wide[1]);
  Mat3 local;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      local.m[i][j] = (tilts - twists) * n[i] * n[j] + (i == j ? twists : 0);
      disc.tangent_root.m[i][j] = across * ((i == j ? 1 : 0) - n[i] * n[j]);
    }
  for (int part = 1; part < 3; ++part) {
    patch->local[part] = local, patch->discs[part] = disc;
    patch->discs[part].gradient = patch->along[part - 1];
  }
}

}  // namespace

// The mean is that of a disc as tools press it, so that a jaw and a disc at one place are one; the gradients are those of one that is as wide as
// they need it.
void find_grasp_patch(const DiscSource& source, const SurfacePoint& place, double radius, int most, GraspPatch* patch) {
  *patch = GraspPatch{};
  TouchableDisc disc, turned;
  press_disc(source, place, radius, ContactPatch::kMaxNodes, &disc);
  press_disc(source, place, radius, ContactPatch::kMaxNodes, &turned, GraspPatch::kResolved);
  if (disc.count == 0 || turned.count == 0) return;
  double mean[ContactPatch::kMaxNodes];
  lay_on(disc, &turned, mean);
  gather(source.rest, std::min(most, GraspPatch::kMostNodes), &turned, mean);
  patch->count = turned.count, patch->along[0] = turned.along[0], patch->along[1] = turned.along[1];
  std::copy(turned.node, turned.node + turned.count, patch->node);
  std::copy(mean, mean + turned.count, patch->weight[0]);
  find_gradients(source.rest, turned, patch);
  patch->local[0] = disc.local, patch->discs[0] = disc.disc;
  find_compliance_of_gradients(*source.measure, place, patch);
}

}  // namespace palpate
