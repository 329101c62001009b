// The shape half of a step: palpate_contacts -> superposition (eq. 9) -> radial correction -> displaced nodes.
#pragma once

#include <cstdint>

#include "runtime/base/contact_nodes.h"
#include "runtime/bundle/offset_rows.h"
#include "runtime/bundle/step_context.h"
#include "runtime/tissue/response_curve.h"

namespace palpate {

// The triangles of the surface, where someone asks for them. Where the surface changes they are a copy for the shape half, since the touch may
// run beside it.
struct ShapedSurface {
  const std::int32_t* triangles = nullptr;  // [triangle_count][3]
  std::int32_t triangle_count = 0;
  const std::uint8_t* active = nullptr;  // [triangle_count]; nullptr: all are part of the surface
};

// What the shape half alone reads and writes. Arrays belong to the scene.
//
// A step gathers the tensor columns of all contact nodes into the arrays over columns: each contact node has three, one
// for each degree of freedom. A group is the columns of one corrected tool, or of all tools that need no correction.
struct ShapeState {
  static constexpr std::int32_t kChunkNodes = 1024;  // nodes that one turn of the loop completes
  DisplacementRows corridor_interior;                // of the corridor's columns, where the scene has one
  DisplacementRows interior;                         // numbers is nullptr where the shape ends at the surface
  const float* rest = nullptr;                       // [nodes][3] m, positions without contacts, preload included
  std::int32_t nodes = 0;                            // Ns for the surface, N for the volume
  ShapedSurface surface;
  HeldField held;                            // as in the touch
  OffsetRows moved_surface, moved_interior;  // of the offset; numbers nullptr: there is none
  ResponseCurve radial;
  std::int32_t* slot_of_column = nullptr;  // [S] 1 + first of its three entries in the arrays below; 0 between steps
  double* sum = nullptr;                   // [3 max_contact_nodes] m, u~ of a column, summed over contacts
  std::int32_t* column_of_sums = nullptr;  // [max_contact_nodes] the tensor column of three sums
  float* row_scale = nullptr;              // [3 max_contact_nodes] factor on a column's stored numbers on the surface
  float* coefficient = nullptr;            // [3 max_contact_nodes] sum times row_scale
  const void** surface_column = nullptr;   // [3 max_contact_nodes] stored numbers; unused with a stored compliance
  // These two only where the shape goes inside.
  float* interior_coefficient = nullptr;   // [3 max_contact_nodes] sum times the factor on the stored numbers inside
  const void** interior_column = nullptr;  // [3 max_contact_nodes] stored numbers
  // These two only where the bundle stores the compliance in blocks.
  LoadedColumn* loads = nullptr;  // [max_contact_nodes]
  float* group_field = nullptr;   // [groups][Ns][3] and a number more, m, in the order of the slots
  float* field = nullptr;         // [kChunkNodes][3] m
  float* tool_field = nullptr;    // [kChunkNodes][3] m
};

// One shape step; palpate_scene_shape of palpate.h states the contract. compliance: nullptr where the bundle stores rows.
// Returns the step flags.
std::uint32_t shape_step(const StepContext& context, ShapeState& state, Compliance* compliance,
                         const palpate_contacts* contacts, palpate_shape_out& out);

}  // namespace palpate
