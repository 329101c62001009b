#include "runtime/contact/touchable_disc.h"

#include "runtime/contact/thinned_disc.h"

namespace palpate {

void press_disc(const DiscSource& source, const SurfacePoint& place, double radius, int most, TouchableDisc* disc) {
  disc->outward = source.measure->outward(place);
  if (length(disc->outward) == 0) disc->outward = source.surface->outward(place.triangle);
  if (length(disc->outward) == 0) disc->outward = {0, 0, 1};
  disc->along[0] = across(disc->outward, {}), disc->along[1] = cross(disc->outward, disc->along[0]);
  ContactPatch& patch = *source.patch;
  patch.press(place, disc->outward, disc->along[0], radius);
  disc->local = patch.local();
  WeightedNodes nodes = {disc->node, disc->weight, 0};
  double sum = 0;
  for (int e = 0; e < patch.count(); ++e) {
    if (source.column_of_node[patch.nodes()[e]] < 0) continue;
    nodes.node[nodes.count] = patch.nodes()[e], nodes.weight[nodes.count++] = patch.weights()[e];
    sum += patch.weights()[e];
  }
  for (int e = 0; e < nodes.count; ++e) nodes.weight[e] /= sum;
  if (nodes.count > most) thin_nodes(source.rest, disc->along[0], disc->along[1], most, &nodes);
  disc->count = nodes.count;
}

}  // namespace palpate
