#include "runtime/contact/touchable_disc.h"

#include "runtime/contact/thinned_disc.h"

namespace palpate {
void press_disc(const DiscSource& source, const SurfacePoint& place, double radius, int most, TouchableDisc* disc,
                double resolved) {
  disc->outward = source.measure->outward(place);
  if (length(disc->outward) == 0) disc->outward = source.surface->outward(place.triangle);
  if (length(disc->outward) == 0) disc->outward = {0, 0, 1};
  disc->along[0] = across(disc->outward, {}), disc->along[1] = cross(disc->outward, disc->along[0]);
  ContactPatch& patch = *source.patch;
  patch.press(place, disc->outward, disc->along[0], radius, resolved);
  disc->local = patch.local(), disc->disc = patch.disc();
  double moment[2][ContactPatch::kMaxNodes], sum = 0;
  patch.first_moments(moment[0], moment[1]);
  disc->count = 0;
  for (int e = 0; e < patch.count(); ++e) {
    if (source.column_of_node[patch.nodes()[e]] < 0) continue;
    const int to = disc->count++;
    disc->node[to] = patch.nodes()[e], disc->weight[to] = patch.weights()[e];
    for (int d = 0; d < 2; ++d) disc->moment[d][to] = moment[d][e];
    sum += patch.weights()[e];
  }
  disc->lacks_nodes = disc->count < patch.count();
  for (int e = 0; e < disc->count; ++e) disc->weight[e] /= sum;
  if (disc->count <= most) return;
  WeightedNodes nodes = {disc->node, disc->weight, disc->count};
  thin_nodes(source.rest, disc->along[0], disc->along[1], most, &nodes);
  disc->count = nodes.count;
}

}  // namespace palpate
