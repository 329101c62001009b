// A disc on the surface at rest as a module holds it, and as a tool that is not in contact meets it: on its touchable nodes alone, and on a few of them
#pragma once

#include <cstdint>

#include "runtime/contact/contact_patch.h"

namespace palpate {

// What a disc is made from; borrowed.
struct DiscSource {
  const double* rest;                  // [Ns][3] m
  const std::int32_t* column_of_node;  // [Ns] -1: not touchable
  SurfaceIndex* surface;
  const SurfaceMeasure* measure;
  ContactPatch* patch;  // its work space
};

struct TouchableDisc {
  std::int32_t node[ContactPatch::kMaxNodes];
  double weight[ContactPatch::kMaxNodes];     // sum to one
  double moment[2][ContactPatch::kMaxNodes];  // [2][count] m, from the disc's centre; of a disc on all its nodes
  int count = 0;                              // 0: the disc has no touchable node
  bool lacks_nodes = false;                   // others of its nodes are not touchable
  Vec3 outward, along[2];                     // unit, orthogonal
  Mat3 local;                                 // m/N, compliance that the mesh does not resolve
  ContactDisc disc;                           // in x, y, z
};

// Fills `disc` for the disc of that radius, m, around a place: at most `most` nodes. resolved: node spacings of the least disc that the
// nodes stand for. Cost: that of ContactPatch::press.
void press_disc(const DiscSource& source, const SurfacePoint& place, double radius, int most, TouchableDisc* disc,
                double resolved = ContactPatch::kResolved);

}  // namespace palpate
