#include "runtime/loads/effect.h"

#include <algorithm>
#include <cmath>

#include "runtime/base/error_text.h"
#include "runtime/base/host_struct.h"
#include "runtime/bundle/load_field.h"
#include "runtime/contact/node_compliance.h"
#include "runtime/loads/loads.h"
#include "runtime/pose/pose.h"
#include "runtime/scene/effect_build.h"
#include "runtime/scene/needs.h"

namespace palpate {
namespace {

using formats::SectionId;

#define PALPATE_LOADS_KEY(field) "loads." PALPATE_EFFECT_KEY(loads_effect, palpate_loads_def, field)
constexpr EffectKey kKeys[] = {
    {PALPATE_LOADS_KEY(count), PALPATE_KEY_COUNT, "", "", 0, PALPATE_MAX_LOADS},
    {PALPATE_LOADS_KEY(centre), PALPATE_KEY_NUMBER, "m", "", -kNoLimit, kNoLimit},
    {PALPATE_LOADS_KEY(radius), PALPATE_KEY_NUMBER, "m", "", kAboveZero, 1},
};
constexpr EffectNeed kNeeds[] = {
    {"collision", 1u << PALPATE_COLLISION_OFF | 1u << PALPATE_COLLISION_DEFORMED,
     "tools meet an organ that loads move where it is: take collision DEFORMED, or OFF, or leave loads.count at 0"}};

const palpate_loads_def& loads_of(const palpate_scene_def& def) {
  return part_of<palpate_loads_def>(def, loads_effect);
}

const char* check(const palpate_scene_def& def) {
  const palpate_loads_def& loads = loads_of(def);
  for (std::int32_t i = 0; i < loads.count; ++i)
    if (!is_position(loads.centre[i]) || !(loads.radius[i] > 0 && loads.radius[i] <= 1))
      return "loads need centres within 1e6 m, and radii above 0 and at most 1 m";
  return nullptr;
}

void add_sections(const palpate_scene_def& def, SectionList& sections) {
  if (def.shape == PALPATE_SHAPE_VOLUME || key_number(def, "deformation") != 0)
    sections.add({SectionId::displacement_interior});
}

// With the targets of the contacts, and the means over the patches.
palpate_pass_work predict(const palpate_scene& scene, const palpate_step_load& load) {
  const auto* const loads = static_cast<const SurfaceLoads*>(scene.state_of(loads_effect));
  double means = 0;
  for (std::int32_t i = 0; i < loads->count(); ++i) means += loads->patch(i).count * (10 + 9.0 * load.nodes);
  return {0, 0, 20 + loads->count() * (20 + 9.0 * load.nodes) + means};
}

// ---- the rows --------------------------------------------------------------------------------------------------------

constexpr double kMostPerNewton = 1e12;  // m/N, as of motions

// Displacements by 1 N on patches, one after the other.
class LoadRows {
 public:
  LoadRows(const palpate_scene& scene, SceneMemory& scratch) : scene_(scene), scratch_(scratch) {}

  palpate_status begin(const SectionReader& reader) {
    surface_ = reader.surface_nodes();
    column_ = scratch_.array<std::int32_t>(static_cast<std::size_t>(surface_));
    if (!column_) return reader.no_memory("loads");
    std::fill(column_, column_ + surface_, -1);
    for (std::int32_t k = 0; k < reader.columns(); ++k) column_[scene_.touchable[k]] = k;
    const auto inside = static_cast<std::int32_t>(reader.counts().nodes) - surface_;
    if (!asks_inside(scene_) || inside == 0) return PALPATE_OK;
    inside_ = inside;
    // A corridor alone has the columns of its own nodes.
    if (!reader.find(SectionId::displacement_interior))
      return scene_.tensors.corridor && scene_.touch.body->responds_linearly()
                 ? PALPATE_OK
                 : reader.missing("loads", SectionId::displacement_interior);
    return reader.map_rows(SectionId::displacement_interior, &interior_);
  }
  std::int32_t inside() const { return inside_; }
  bool has_columns(const LoadPatch& patch) const {
    return std::all_of(patch.node, patch.node + patch.count, [&](std::int32_t n) { return column_[n] >= 0; });
  }

  // u~ of each node of the patch by 1 N along axis i, m.
  bool take(const LoadPatch& patch, int i) {
    if (patch.count > room_) {
      field_ = LoadField();
      column_of_ = scratch_.array<std::int32_t>(static_cast<std::size_t>(patch.count));
      modified_ = scratch_.array<Vec3>(static_cast<std::size_t>(patch.count));
      if (!field_.create(scratch_, patch.count) || scratch_.failed()) return false;
      room_ = patch.count;
    }
    count_ = patch.count;
    field_.begin(scene_.tensors);
    for (std::int32_t k = 0; k < count_; ++k) {
      Mat3 compliance;
      column_of_[k] = column_[patch.node[k]];
      self_compliance(scene_.tensors.stiffness + 9 * static_cast<std::size_t>(column_of_[k]), &compliance);
      for (int j = 0; j < 3; ++j) modified_[k][j] = patch.weight[k] * compliance.m[j][i];
      field_.add(column_of_[k], modified_[k]);
    }
    return true;
  }
  // m/N, of that force. node: of the organ.
  Vec3 at(std::int32_t node) const {
    if (node < surface_ || !interior_.numbers) return field_.at_node(node);
    Vec3 sum;
    for (std::int32_t k = 0; k < count_; ++k) sum += interior_.entry(node - surface_, column_of_[k]) * modified_[k];
    return sum;
  }

 private:
  const palpate_scene& scene_;
  SceneMemory& scratch_;
  DisplacementRows interior_;
  LoadField field_;
  std::int32_t *column_ = nullptr, *column_of_ = nullptr;  // of each surface node; of those of the patch
  Vec3* modified_ = nullptr;
  std::int32_t surface_ = 0, inside_ = 0, room_ = 0, count_ = 0;
};

// Three rows for each patch, in the scene's memory. False: there is none, or the bundle's numbers give no displacements.
bool make_rows(SceneMemory& memory, LoadRows& of, const LoadPatch* patch, std::int32_t count, OffsetRows* out) {
  out->count = 3 * count, out->nodes_inside = of.inside();
  const auto numbers = [&](std::int32_t nodes) {
    return memory.array<float>(9 * static_cast<std::size_t>(count) * static_cast<std::size_t>(nodes));
  };
  float *at = numbers(out->nodes), *inside = out->nodes_inside > 0 ? numbers(out->nodes_inside) : nullptr;
  auto* const force = memory.array<RowForce>(3 * static_cast<std::size_t>(count));
  out->numbers = at, out->inside = inside, out->force = force;
  for (std::int32_t m = 0; m < out->count && !memory.failed(); ++m) {
    const LoadPatch& on = patch[m / 3];
    force[m] = {on.node, on.weight, on.count, m % 3};
    if (!of.take(on, m % 3)) return false;
    for (std::int32_t n = 0; n < out->nodes + out->nodes_inside; ++n) {
      const Vec3 moved = of.at(n);
      float*& to = n < out->nodes ? at : inside;
      for (int i = 0; i < 3; ++i) {
        if (!(std::fabs(moved[i]) <= kMostPerNewton)) return false;
        *to++ = static_cast<float>(moved[i]);
      }
    }
  }
  return !memory.failed();
}

palpate_status find_patches(const SectionReader& reader, palpate_scene& scene, const LoadRows& rows, LoadPatch* patch) {
  const palpate_loads_def& loads = loads_of(scene.def);
  for (std::int32_t i = 0; i < loads.count; ++i) {
    const auto refuse = [&](const char* why) {
      return fail(reader.error(), PALPATE_ERROR_ARGUMENT, 0, "palpate_loads_def: the patch of load %d %s",
                  static_cast<int>(i), why);
    };
    TouchedSurface& surface = scene.touch.surface;
    if (!find_patch(reader.memory(), surface.index, surface.triangles, reader.surface_nodes(), load3(loads.centre[i]),
                    loads.radius[i], &patch[i]))
      return reader.no_memory("loads");
    if (patch[i].count == 0) return refuse("is farther from the surface than its radius; move its centre to the organ");
    if (!rows.has_columns(patch[i]))
      return refuse(
          "reaches nodes that are held or not touchable, where the bundle has no column; take another place, "
          "or a smaller radius");
  }
  return PALPATE_OK;
}

palpate_status prepare(EffectBuild& build, SceneMemory& scratch) {
  const SectionReader& reader = build.reader;
  palpate_scene& scene = build.scene;
  SceneMemory& memory = reader.memory();
  const std::int32_t count = loads_of(scene.def).count;
  auto* const loads = memory.make<SurfaceLoads>();
  auto* const patch = memory.array<LoadPatch>(static_cast<std::size_t>(count));
  if (!loads || !patch) return reader.no_memory("loads");
  build.state = loads;
  LoadRows of(scene, scratch);
  if (const palpate_status status = of.begin(reader)) return status;
  if (const palpate_status status = find_patches(reader, scene, of, patch)) return status;
  OffsetRows rows;
  rows.nodes = reader.surface_nodes();
  if (!make_rows(memory, of, patch, count, &rows))
    return memory.failed() ? reader.no_memory("loads") : reader.not_usable(SectionId::force, 0);
  const std::int32_t first = scene.touch.offset.add(memory, rows);
  if (first < 0 || !loads->create(memory, {&scene.touch, first, count, patch, build.pass}))
    return reader.no_memory("loads");
  // Before motions, which hold volumes beside the loads.
  scene.touch.parts.add_first(loads);
  return PALPATE_OK;
}

palpate_status prepare(EffectBuild& build) {
  SceneMemory scratch = build.reader.memory().of_same_host();
  const palpate_status status = prepare(build, scratch);
  scratch.release_all();
  return status;
}

SurfaceLoads* loads_of(const palpate_scene* scene) {
  return scene ? static_cast<SurfaceLoads*>(scene->state_of(loads_effect)) : nullptr;
}

}  // namespace

constinit const Effect loads_effect = {
    .name = "loads",
    .order = 12,
    .def = effect_struct<palpate_loads_def, palpate_init_loads_def>("loads_def"),
    .keys = kKeys,
    .needs = kNeeds,
    .check = check,
    .uses = kUsesRest | kUsesSurface | kUsesDisplacements,
    .pass = {"loads", Half::touch, Pass::input, predict},
    .sections = add_sections,
    .prepare = prepare,
};

}  // namespace palpate

void palpate_init_loads_def(palpate_loads_def* def, size_t struct_bytes) {
  palpate_loads_def defaults = {};
  defaults.part.effect = &palpate::loads_effect;
  palpate::write_host_struct(defaults, def, struct_bytes);
}

palpate_status palpate_scene_set_load(palpate_scene* scene, int32_t load, palpate_load_kind kind,
                                      const double vector[3], palpate_error* error) {
  palpate::SurfaceLoads* const loads = palpate::loads_of(scene);
  return loads ? loads->set(load, kind, vector, error)
               : palpate::fail(
                     error, PALPATE_ERROR_ARGUMENT, 0,
                     "loads: expected a scene with loads, found %s; create the scene with a palpate_loads_def", "none");
}

const palpate_load_state* palpate_scene_load_state(const palpate_scene* scene, int32_t load) {
  const palpate::SurfaceLoads* const loads = palpate::loads_of(scene);
  return loads ? loads->state(load) : nullptr;
}
