// The touch half of a step: tools -> collision -> contact constraints -> forces -> palpate_contacts.
#pragma once

#include <cstddef>
#include <cstdint>

#include "runtime/base/contact_nodes.h"
#include "runtime/bundle/step_context.h"
#include "runtime/contact/body.h"
#include "runtime/contact/collision.h"
#include "runtime/contact/contact_admission.h"
#include "runtime/contact/contact_field.h"
#include "runtime/contact/contact_patch.h"
#include "runtime/contact/contact_rows.h"
#include "runtime/contact/contact_solver.h"
#include "runtime/contact/deformed_surface.h"
#include "runtime/contact/displacement_field.h"
#include "runtime/contact/offset.h"
#include "runtime/contact/slide_energy.h"
#include "runtime/contact/step_parts.h"
#include "runtime/contact/tool_contacts.h"
#include "runtime/contact/tool_input.h"
#include "runtime/pose/pose.h"
#include "runtime/surface/bound_surface.h"
#include "runtime/surface/surface_index.h"
#include "runtime/surface/surface_measure.h"
#include "runtime/tissue/response_curve.h"

namespace palpate {

class DividedNodes;

// Where a contact on a bound surface holds the mesh. It follows from the anchor and the tool's radius, of which it is a copy.
struct BoundContact {
  SurfacePoint anchor;
  double radius;
  SurfacePoint beneath;  // of the mesh
  Vec3 outward;          // unit, the bound surface's mean below the disc
};

// The organ's surface at rest. Arrays belong to the scene; nullptr where no effect needs them.
struct TouchedSurface {
  const std::int32_t* triangles = nullptr;  // [triangle_count][3] copied from the bundle and checked
  std::int32_t triangle_count = 0;
  // Of a scene whose surface changes (surface_change.h); nullptr: all triangles are the surface, and each of its nodes has some.
  const std::uint8_t* active = nullptr;    // [triangle_count]
  const NodeFans* fans = nullptr;          // the tree's
  std::uint64_t changes = 0;               // how often it has changed; a saved state has it
  std::uint64_t versions = 0;              // the same, and how often a state was restored
  const DividedNodes* divided = nullptr;   // of a surface that changes
  const double* rest = nullptr;            // [Ns][3] m, positions without contacts, preload included
  const double* rest_of_all = nullptr;     // [N][3] m, the same of all nodes, where contacts may hold some inside
  std::int32_t* column_of_node = nullptr;  // [Ns] tensor column of each surface node; -1: none
  SurfaceIndex index;
  SurfaceMeasure measure;         // where contacts have frames (needs_contact_frames)
  ContactPatch patch;             // of one disc after the other
  BoundSurface* bound = nullptr;  // that tools meet; nullptr: they meet the mesh's
  double* node_reach = nullptr;   // [Ns] m / sqrt(J), as surface_tree.h explains, where someone asks for it

  bool is_active(std::int32_t triangle) const { return !active || active[triangle] != 0; }
  bool has_triangles(std::int32_t node) const { return !fans || fans->has(node); }
  // m, at rest, of a node that a contact holds; zero where a scene of grips alone knows no positions.
  Vec3 place(std::int32_t node) const {
    const double* const of = rest_of_all ? rest_of_all : rest;
    return of ? load3(of + 3 * static_cast<std::size_t>(node)) : Vec3{};
  }
  DiscSource discs() { return {rest, column_of_node, &index, &measure, &patch}; }
};

// The points of tools, where there is collision: which are in contact, and with what.
struct TouchPoints {
  Collision collision;
  PointState* of_tool[PALPATE_MAX_TOOLS] = {};          // [max_points] for each tool
  BoundContact* bound_of_tool[PALPATE_MAX_TOOLS] = {};  // the same; nullptr: tools meet the mesh's surface
  Turns slides;                                         // of anchors that follow their tools
  double release_distance = 0;                          // m
};

// What each tool was sent in the last step, in the world.
struct SentForce {
  Vec3 force, torque;  // N, N m
};

// What the touch half alone reads and writes.
struct TouchState {
  StepWork work;
  ToolInput input;
  OrganPose organ;  // tool points and the forces on tools are in the world, all else in the organ's frame
  TouchedSurface surface;
  SurfaceTree tree;                // of the surface that tools meet, where there is collision
  DisplacementField displacement;  // where someone asks for it
  ContactField linear_field;
  // The body's or the linear one, where collision follows the deformed surface.
  SurfaceField* field = nullptr;
  DeformedSurface deformed;
  TouchPoints points;
  Offset offset;  // where something moves the organ from outside
  ContactRows rows;
  std::int32_t most_constraints = 0;  // that a step can have, reserved ones included
  StepParts parts;
  ToolContacts tools;
  ContactSolver solver;
  ContactAdmission admission;
  SlideEnergy slide_energy;  // where the body responds linearly and rows come to places of another stiffness
  static inline LinearOrgan linear_organ;  // has no state
  Body* body = &linear_organ;
  HeldField held;  // the displacements that a step writes: those that do not follow from the contact nodes alone
  ResponseCurve response;
  Vec3* force = nullptr;     // [max_contact_nodes] N, f of each contact node
  Vec3* modified = nullptr;  // [max_contact_nodes] m, u~ of each contact node
  SentForce sent[PALPATE_MAX_TOOLS];
  std::uint64_t step = 0;
};

struct TouchStep;

// One touch step; palpate_scene_touch of palpate.h states the contract. begin_touch() requests all constraints but those that whoever
// solves several organs as one adds. finish_touch() solves them and writes the output, which nobody needs before; it returns the step flags.
// joint: of the solution that the organ's solver has taken over; nullptr: the organ is solved alone.
void begin_touch(TouchStep& step, const StepContext& context, TouchState& state, const palpate_tool* tools,
                 std::int32_t tool_count, double dt);
std::uint32_t finish_touch(TouchStep& step, const ContactSolver::Outcome* joint, palpate_contacts& out);
// Both.
std::uint32_t touch_step(const StepContext& context, TouchState& state, const palpate_tool* tools,
                         std::int32_t tool_count, double dt, palpate_contacts& out);

// Forgets contacts, last positions and last forces: the state after creation.
void reset_touch(const palpate_scene_def& def, TouchState& state);

// Completes a restored state (scene_memory.h) by what follows from it.
void touch_restored(const StepContext& context, TouchState& state);

// The same as reset_touch for the tool with that id alone; nothing where no tool has it.
void reset_tool(const palpate_scene_def& def, TouchState& state, std::int32_t id);

}  // namespace palpate
