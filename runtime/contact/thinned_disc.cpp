#include "runtime/contact/thinned_disc.h"

#include <algorithm>
#include <cmath>

#include "runtime/contact/contact_patch.h"

namespace palpate {
namespace {

// A node's weight may fall to this share of what it was beside the others, but not lower.
constexpr double kLeastShare = 0.1;

struct Plane {
  const double* rest;
  Vec3 u, v;
  // 1, and the node's coordinates on the plane.
  Vec3 at(std::int32_t node) const {
    const Vec3 p = load3(rest + 3 * static_cast<std::size_t>(node));
    return {1, dot(u, p), dot(v, p)};
  }
};

Vec3 mean_of(const Plane& plane, const WeightedNodes& nodes) {
  Vec3 sum;
  for (int e = 0; e < nodes.count; ++e) sum += nodes.weight[e] * plane.at(nodes.node[e]);
  return (1 / sum.x) * sum;
}

void keep_heaviest(int most, WeightedNodes* nodes) {
  const auto heavier = [&](int a, int b) {
    return nodes->weight[a] != nodes->weight[b] ? nodes->weight[a] > nodes->weight[b] : nodes->node[a] < nodes->node[b];
  };
  int order[ContactPatch::kMaxNodes];
  bool keeps[ContactPatch::kMaxNodes] = {};
  for (int e = 0; e < nodes->count; ++e) order[e] = e;
  std::nth_element(order, order + most, order + nodes->count, heavier);
  for (int k = 0; k < most; ++k) keeps[order[k]] = true;
  int kept = 0;
  for (int e = 0; e < nodes->count; ++e)
    if (keeps[e]) nodes->node[kept] = nodes->node[e], nodes->weight[kept++] = nodes->weight[e];
  nodes->count = kept;
}

// Multiplies the weights by 1 + a x + b y, with x and y from the present mean, so that the mean becomes `wanted`: the smallest
// such change. Nothing changes where that would make a weight too small.
void move_mean(const Plane& plane, Vec3 wanted, WeightedNodes* nodes) {
  const Vec3 mean = mean_of(plane, *nodes), off = wanted - mean;
  double xx = 0, xy = 0, yy = 0;
  for (int e = 0; e < nodes->count; ++e) {
    const Vec3 from = plane.at(nodes->node[e]) - mean;
    xx += nodes->weight[e] * from.y * from.y, xy += nodes->weight[e] * from.y * from.z,
        yy += nodes->weight[e] * from.z * from.z;
  }
  const double determinant = xx * yy - xy * xy;
  // On a line, nearly: the mean can only move along it.
  if (!(determinant > 1e-6 * (xx + yy) * (xx + yy))) return;
  const double a = (yy * off.y - xy * off.z) / determinant, b = (xx * off.z - xy * off.y) / determinant;
  double factor[ContactPatch::kMaxNodes], least = INFINITY;
  for (int e = 0; e < nodes->count; ++e) {
    const Vec3 from = plane.at(nodes->node[e]) - mean;
    factor[e] = 1 + a * from.y + b * from.z;
    least = std::min(least, factor[e]);
  }
  if (!(least >= kLeastShare)) return;
  for (int e = 0; e < nodes->count; ++e) nodes->weight[e] *= factor[e];
}

}  // namespace

double thin_nodes(const double* rest, Vec3 u, Vec3 v, int most, WeightedNodes* nodes) {
  if (nodes->count <= most) return 1;
  const Plane plane = {rest, u, v};
  const Vec3 mean = rest ? mean_of(plane, *nodes) : Vec3{};
  keep_heaviest(most, nodes);
  double kept = 0;
  for (int e = 0; e < nodes->count; ++e) kept += nodes->weight[e];
  for (int e = 0; e < nodes->count; ++e) nodes->weight[e] /= kept;
  if (rest) move_mean(plane, mean, nodes);
  return kept;
}

}  // namespace palpate
