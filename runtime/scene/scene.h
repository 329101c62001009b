// One organ under one set of effects: the memory and the plan of both halves.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/bundle/bundle.h"
#include "runtime/contact/contact_rows.h"
#include "runtime/contact/contact_solver.h"
#include "runtime/contact/tool_input.h"
#include "runtime/shape/skin.h"
#include "runtime/surface/collision.h"
#include "runtime/surface/surface_index.h"
#include "runtime/surface/surface_measure.h"
#include "runtime/tissue/relaxation.h"
#include "runtime/tissue/response_curve.h"

namespace palpate {

// The same steps without a trace of the effects of uses_effects(): what a scene that leaves them off is compared with, by
// the bit (recorded_run_test) and by the clock (bench/effects_off.cpp).
#ifdef PALPATE_WITHOUT_EFFECTS
inline constexpr bool kHasEffects = false;
#else
inline constexpr bool kHasEffects = true;
#endif

inline bool uses_effects(const palpate_scene_def& def) {
  return def.collision == PALPATE_COLLISION_DEFORMED || def.contact == PALPATE_CONTACT_PATCH ||
         def.law != PALPATE_LAW_STICKING || def.force == PALPATE_FORCE_RESPONSE || def.radial != PALPATE_RADIAL_OFF ||
         def.relaxation.model != PALPATE_RELAXATION_OFF || def.render_mesh;
}

// Whether contacts tell the normal from what is across it.
inline bool needs_frame(const palpate_scene_def& def) {
  return kHasEffects && (def.contact == PALPATE_CONTACT_PATCH || def.law != PALPATE_LAW_STICKING);
}

// The passes of a step, in order.
enum class Pass : std::int32_t {
  input,
  collision,
  rows,
  contact,
  force,
  relaxation,
  output,
  superposition,
  radial,
  positions,
  skin,
  count
};

// What palpate_touch alone reads and writes.
struct TouchHalf {
  const std::int32_t* triangles = nullptr;  // [F][3] copied and checked; nullptr where no effect needs them
  const double* rest = nullptr;             // [Ns][3] m, preload included; with collision, a patch or a law
  std::int32_t* column_of_node = nullptr;   // [Ns] or -1
  ToolInput input;
  SurfaceIndex surface;
  ContactField field;
  Collision collision;
  PointState* points[PALPATE_MAX_TOOLS] = {};  // [max_points]
  SurfaceMeasure measure;  // with a patch, or with a law that tells the normal from what is across it
  ContactPatch patch;
  ContactRows rows;
  ContactSolver solver;
  PronySeries relaxation;
  PronySeries::Memory* memory = nullptr;  // [max_tools]; nullptr: no relaxation
  ResponseCurve response;
  Vec3* force = nullptr;     // [max_contact_nodes]
  Vec3* modified = nullptr;  // [max_contact_nodes]
  Vec3 last_force[PALPATE_MAX_TOOLS];
  std::uint64_t step = 0;
};

// What palpate_shape alone reads and writes.
struct ShapeHalf {
  static constexpr std::int32_t kChunkNodes = 1024;
  DisplacementRows interior;    // numbers is nullptr where the shape ends at the surface
  const float* rest = nullptr;  // [nodes][3] m
  std::int32_t nodes = 0;       // Ns or N
  ResponseCurve radial;
  std::int32_t* slot_of_column = nullptr;  // [S] 1 + place in the group being gathered, 0 outside a call
  double* sum = nullptr;                   // [3 max_contact_nodes]
  float* row_scale = nullptr;              // [3 max_contact_nodes]
  float* coefficient = nullptr;            // [3 max_contact_nodes]
  const void** surface_column = nullptr;   // [3 max_contact_nodes]; unused with a compliance
  const void** interior_column = nullptr;  // [3 max_contact_nodes]
  std::int32_t* slot_column = nullptr;     // [max_contact_nodes] the column of three sums
  LoadedColumn* loads = nullptr;           // [max_contact_nodes]; these two with a compliance alone
  float* group_field = nullptr;            // [groups][Ns][3]
  float* field = nullptr;                  // [kChunkNodes][3]
  float* tool_field = nullptr;             // [kChunkNodes][3]
};

}  // namespace palpate

struct palpate_scene {
  explicit palpate_scene(const palpate_scene_def& wanted) : def(wanted), memory(wanted.allocator) {
    for (std::int32_t& place : place_in_plan) place = -1;
  }
  palpate_scene_def def;
  palpate::SceneMemory memory;
  palpate_bundle* bundle = nullptr;
  palpate::Tensors tensors;
  palpate::Compliance compliance;           // where the bundle stores blocks
  const std::int32_t* touchable = nullptr;  // [S] copied and checked
  palpate::TouchHalf touch;
  palpate::ShapeHalf shape;
  palpate::Skin skin;  // of the shape's half; bound where the host gave a render mesh
  static constexpr std::int32_t kPasses = static_cast<std::int32_t>(palpate::Pass::count), kMaxPasses = kPasses + 3;
  palpate_plan_pass plan[kMaxPasses] = {};
  std::int32_t pass_count = 0;
  std::int32_t place_in_plan[kPasses];  // of a Pass; -1: not in the plan
  palpate_pass_watcher watcher = nullptr;
  void* watcher_user = nullptr;
};

namespace palpate {

// Said at the end of each stretch of a pass. Where nobody watches: one branch that is never taken.
inline void passed(const palpate_scene& scene, Pass pass) {
  if (kHasEffects && scene.watcher)
    scene.watcher(scene.watcher_user, scene.place_in_plan[static_cast<std::int32_t>(pass)]);
}

}  // namespace palpate
