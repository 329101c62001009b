// Trees over the surface that tools meet, for collision and for whoever else asks where it is.
#pragma once

#include "runtime/contact/touch.h"
#include "runtime/scene/section_reader.h"

namespace palpate {

// Of the surface that tools meet. False where memory ends.
bool build_tree(SceneMemory& memory, const TouchState& touch, std::int32_t nodes, SurfaceTree& tree);

// How far a field of unit norm can move each node (surface_tree.h). A node without a column gets the largest reach. Of a body
// with a field of its own norms are lengths. Where a field is added that is known by its length, all nodes get the largest reach, *same. of_nodes:
// [surface nodes] takes the reaches; nullptr: nobody does.
bool set_reaches(const SectionReader& reader, Body& body, const Tensors& tensors, const std::int32_t* touchable,
                 const BoundSurface* bound, const OffsetRows& offset, SurfaceTree& tree, double* same,
                 double* of_nodes = nullptr);

}  // namespace palpate
