#include "runtime/cut/effect.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "runtime/base/error_text.h"
#include "runtime/cut/cut_beside.h"
#include "runtime/cut/cut_large.h"
#include "runtime/cut/cut_organ.h"
#include "runtime/cut/cut_region.h"
#include "runtime/cut/cut_scene.h"
#include "runtime/cut/lips.h"
#include "runtime/include/palpate/palpate_large.h"
#include "runtime/scene/effect_build.h"

namespace palpate {
namespace {

using formats::SectionId;

#define PALPATE_CUT_KEY(field) PALPATE_EFFECT_KEY(cut_effect, palpate_cut_def, field)
constexpr EffectKey kKeys[] = {
    {PALPATE_CUT_KEY(cut), PALPATE_KEY_CHOICE, "", "off, on", 0, PALPATE_CUT_ON},
    {PALPATE_CUT_KEY(cut_nodes), PALPATE_KEY_COUNT, "", "", 0, 100'000},
    {PALPATE_CUT_KEY(cut_rank), PALPATE_KEY_COUNT, "", "", 16, 4096},
    {PALPATE_CUT_KEY(cut_operations), PALPATE_KEY_COUNT, "", "", 1000, 1'000'000'000},
    {PALPATE_CUT_KEY(cut_points), PALPATE_KEY_COUNT, "", "", 2, PALPATE_MAX_BLADE_POINTS},
    {PALPATE_CUT_KEY(cut_lips), PALPATE_KEY_COUNT, "", "", 0, 1000},
    {PALPATE_CUT_KEY(cut_rebase), PALPATE_KEY_COUNT, "", "", 0, 4096},
};
constexpr const char* kResponseIsOfTheWhole =
    "response curves were measured on the organ that is whole: take force LINEAR and radial OFF, or leave cut OFF";
constexpr const char* kBelowTheSurface =
    "what lies below the surface is known for the whole mesh alone and does not follow a cut: leave it out, with shape "
    "SURFACE, or leave cut OFF";
constexpr const char* kAveragedShear =
    "under large deformation the element p1-ang averages strain over the tetrahedra around a node, on both sides of a "
    "cut: take a bundle of p1 or p1-anp, deformation LINEAR, or leave cut OFF";
constexpr const char* kOnTheSurface =
    "what is bound to the triangles of the whole organ does not follow a cut: leave it out, or leave cut OFF";
constexpr const char* kRebasesTheLinearOrgan =
    "cut_rebase is of the linear organ: under large deformation the rank of a cut costs time in the body's own method: "
    "take deformation LINEAR, or leave cut_rebase 0";
constexpr const char* kRebasesBelowTheRank =
    "re-basing begins while cuts still have room to go on: take cut_rebase below cut_rank, or leave it 0";
constexpr EffectNeed kNeeds[] = {
    {"collision", 1u << PALPATE_COLLISION_DEFORMED,
     "lips of a cut are where forces have moved them: take collision DEFORMED, or leave cut OFF"},
    {"force", 1u << PALPATE_FORCE_OFF | 1u << PALPATE_FORCE_LINEAR, kResponseIsOfTheWhole},
    {"radial", 1u << PALPATE_RADIAL_OFF, kResponseIsOfTheWhole},
    {"needles", kAbsent, kBelowTheSurface},
    {"queries", kAbsent, kOnTheSurface},
    {"crossings", kAbsent, kOnTheSurface},
};

bool deforms(const palpate_scene_def& def, palpate_deformation_model as) {
  return static_cast<int>(key_number(def, "deformation")) == as;
}
bool is_linear(const palpate_scene_def& def) {
  return deforms(def, PALPATE_DEFORMATION_LINEAR);
}
// Under large deformation in the touch.
bool is_large(const palpate_scene_def& def) {
  return deforms(def, PALPATE_DEFORMATION_LARGE);
}

const palpate_cut_def& cut_of(const palpate_scene_def& def) {
  return part_of<palpate_cut_def>(def, cut_effect);
}

const char* check(const palpate_scene_def& def) {
  const bool knows_all = is_large(def) || deforms(def, PALPATE_DEFORMATION_LARGE_AUTO);
  if (def.shape == PALPATE_SHAPE_VOLUME && !knows_all) return kBelowTheSurface;
  const std::int32_t rebase = cut_of(def).cut_rebase;
  if (rebase > 0 && !is_linear(def)) return kRebasesTheLinearOrgan;
  if (rebase >= cut_of(def).cut_rank) return kRebasesBelowTheRank;
  return key_number(def, "fine_surface") != 0 || key_number(def, "render_mesh") != 0 ? kOnTheSurface : nullptr;
}

// The effect's state: what it made of the bundle, the body of the touch and the part of the step.
struct CutOfScene {
  CutRegion region;
  std::optional<RegionPairs> pairs;
  CutOrgan organ;    // of the linear organ
  CutBeside beside;  // beside the touch
  CutLarge large;    // under large deformation
  CutScene scene;
  Lips lips;
};

CutOfScene* cut_of(const palpate_scene* scene) {
  return scene ? static_cast<CutOfScene*>(scene->state_of(cut_effect)) : nullptr;
}

RowBudget rows(const palpate_scene_def& def) {
  const std::int32_t points = PALPATE_MAX_BLADES * cut_of(def).cut_points, lips = cut_of(def).cut_lips,
                     nodes = Blades::kNodesOfPoint * points + 2 * lips;
  return {Blades::kRowsOfPoint * points + lips, nodes, nodes};
}

void add_sections(const palpate_scene_def&, SectionList& sections) {
  sections.add({SectionId::nodes, SectionId::tetrahedra, SectionId::region, SectionId::fixed, SectionId::young,
                SectionId::poisson, SectionId::provenance, SectionId::foundation, SectionId::large_support_nodes,
                SectionId::large_support_stiffness});
}

const char* pass_of(const palpate_scene_def& def) {
  static const char* const names[] = {"deformation: cut, sticking", "deformation: cut, sliding",
                                      "deformation: cut, unilateral", "deformation: cut, coulomb"};
  return names[def.law];
}

// Of a step without a change: the field at all nodes of the surface.
palpate_pass_work predict(const palpate_scene& scene, const palpate_step_load&) {
  const double numbers = 3.0 * cut_of(&scene)->scene.state().rank * scene.tensors.surface_nodes;
  return {8 * numbers, 2 * numbers, 0};
}

double most_of_body(const palpate_scene& scene) {
  return cut_of(scene.def).cut_rank * 3.0 * scene.tensors.surface_nodes / kDense;
}

double most_of_changes(const palpate_scene& scene, double) {
  return cut_of(&scene)->scene.most_operations();
}

// Memory of the pairs of these nodes grows with their square; a cut of this rank acts on fewer.
std::int32_t slots_of(const palpate_cut_def& def, std::int32_t most_slots) {
  return std::min(most_slots, def.cut_rank + def.cut_rank / 4);
}
// Nodes on which a cut may act: of the region, and where the compliance is re-based new ones.
std::int32_t most_slots(const palpate_cut_def& def, const CutRegion& region, std::int32_t new_nodes) {
  return region.node_count + (def.cut_rebase > 0 ? new_nodes : 0);
}

// The body that is cut. False where memory ends.
bool create_target(const SectionReader& reader, palpate_scene& scene, CutOfScene& cut, const CutCapacity& capacity,
                   const double* rest, const double* preload) {
  const CutRegion& region = cut.region;
  CutLarge::Parts large;
  large.body = &region.body, large.pairs = &*cut.pairs, large.supports = region.supports, large.capacity = capacity;
  large.surface_nodes = reader.surface_nodes(), large.first_reserve = region.first_reserve;
  large.follower = scene.touch.body->mesh_follower();
  if (is_large(scene.def)) return cut.large.create(reader.memory(), large, &scene.touch);
  CutOrgan::Parts organ;
  if (!is_linear(scene.def)) {
    organ.beside = large.follower, organ.stream = &cut.beside.stream();
    if (!cut.beside.create(reader.memory(), large, cut.scene.surface().all(), rest)) return false;
    large.follower->follow_beside(&cut.organ, &cut.beside);
  }
  organ.body = &region.body, organ.tensors = &scene.tensors, organ.touchable = scene.touchable;
  organ.pairs = &*cut.pairs, organ.pair_nodes = region.nodes, organ.preload = preload;
  // The base of a later compliance has to be as precise as the pairs.
  organ.pair_count = cut_of(scene.def).cut_rebase > 0 ? region.node_count : 0;
  organ.surface_nodes = reader.surface_nodes(), organ.first_reserve = region.first_reserve;
  organ.contact_nodes = scene.def.max_contact_nodes, organ.constraints = scene.touch.most_constraints;
  organ.capacity = capacity, organ.supports = region.supports;
  organ.rebase_at = cut_of(scene.def).cut_rebase;
  organ.most_slots = most_slots(cut_of(scene.def), region, capacity.new_nodes);
  return cut.organ.create(reader.memory(), organ, scene.touch);
}

// What the organ has to be before the core is built: its triangles, and the body of the touch.
palpate_status prepare(EffectBuild& build) {
  palpate_scene& scene = build.scene;
  const SectionReader& reader = build.reader;
  SceneMemory& memory = reader.memory();
  const palpate_cut_def& def = cut_of(scene.def);
  // LARGE_AUTO has become what it stands for.
  if (const char* const wrong = check(scene.def))
    return fail(reader.error(), PALPATE_ERROR_EFFECT, 0, "cut: %s", wrong);
  auto* const cut = memory.make<CutOfScene>();
  if (!cut) return reader.no_memory("cut");
  build.state = cut;
  CutRegion& region = cut->region;
  TouchedSurface& surface = scene.touch.surface;
  const double *rest = nullptr, *preload = nullptr;
  palpate_status status = read_cut_region(reader, scene.tensors, scene.touchable, &region);
  if (status == PALPATE_OK) status = reader.read_rest(scene.def, reader.counts().surface_nodes, &rest);
  if (status == PALPATE_OK) status = reader.map_preload(scene.def, &preload);
  if (status != PALPATE_OK) return status;
  if (!is_linear(scene.def) && region.body.averaged_shear > 0)
    return fail(reader.error(), PALPATE_ERROR_EFFECT, 0, "cut: %s", kAveragedShear);
  CutScene::Source source;
  source.touched = {&scene.touch, scene.def.max_points};
  source.target = is_large(scene.def) ? static_cast<CutTarget*>(&cut->large) : &cut->organ, source.body = region.mesh,
  source.tissue = &region.body, source.can_hold = region.may_divide;
  source.rest = const_cast<double*>(rest), source.surface_nodes = reader.surface_nodes();
  source.first_reserve = region.first_reserve;
  source.new_nodes = def.cut_nodes > 0 ? std::min(def.cut_nodes, region.reserve) : region.reserve;
  source.rank = def.cut_rank, source.operations = def.cut_operations, source.blade_points = def.cut_points;
  cut->pairs.emplace(scene.tensors, region.pairs);
  CutCapacity capacity;
  capacity.new_nodes = source.new_nodes, capacity.patterns = def.cut_rank;
  capacity.nodes = slots_of(def, most_slots(def, region, source.new_nodes));
  if (const char* const wrong = cut->scene.create(memory, source))
    return fail(reader.error(), PALPATE_ERROR_CONTENT, reader.find(SectionId::tetrahedra)->offset,
                "cut: %s; rebuild the bundle", wrong);
  if (memory.failed() || !create_target(reader, scene, *cut, capacity, rest, preload)) return reader.no_memory("cut");
  surface.triangles = cut->scene.surface().triangles(), surface.triangle_count = cut->scene.surface().capacity();
  surface.active = cut->scene.surface().active(), surface.rest = rest, surface.divided = &cut->scene.divided();
  // The shape half, which may run beside the touch, has the bundle's own triangles.
  scene.shape.surface.triangle_count = reader.triangles();
  return reader.copy_indices(SectionId::triangles, 3 * reader.counts().triangles, &formats::IndexedSections::triangles,
                             &scene.shape.surface.triangles);
}

// After the surface and the limits of contacts are known.
palpate_status build(EffectBuild& build) {
  palpate_scene& scene = build.scene;
  if (!is_large(scene.def)) scene.touch.held = scene.shape.held = {build.reader.surface_nodes(), false};
  CutOfScene& cut = *cut_of(&scene);
  scene.touch.parts.ask(&cut.scene);
  SceneMemory& memory = build.reader.memory();
  const std::int32_t lips = cut_of(scene.def).cut_lips;
  if (lips > 0) scene.touch.parts.ask(&cut.lips);
  const bool made = (lips == 0 || cut.lips.create(memory, cut.scene.lips(lips))) &&
                    (is_large(scene.def) || cut.organ.take_loads(memory, cut.region.body, cut.region.may_divide));
  return made ? PALPATE_OK : build.reader.no_memory("cut");
}

constexpr EffectBody kBody = {pass_of, predict, most_of_body};

bool is_place(const double* point) {
  return std::all_of(point, point + 3, [](double x) { return std::fabs(x) <= 1e6; });
}

// The sentence of what is wrong; nullptr: nothing.
const char* fault_of(const palpate_blade& blade) {
  if (blade.point_count < 0 || blade.point_count == 1 || blade.point_count > PALPATE_MAX_BLADE_POINTS ||
      (blade.point_count > 0 && !blade.points))
    return "0 points, or from 2 to PALPATE_MAX_BLADE_POINTS";
  for (std::int32_t i = 0; i < blade.point_count; ++i)
    if (!is_place(blade.points + 3 * i)) return "points within 1e6 m";
  if (!(blade.toughness >= 0 && blade.toughness <= 1e6)) return "a toughness from 0 to 1e6 J/m^2";
  if (!(blade.friction >= 0 && blade.friction <= 1e6)) return "a friction from 0 to 1e6 Pa";
  if (!(blade.width >= 0 && blade.width <= 1e6)) return "a width from 0 to 1e6 m";
  if (blade.friction > 0 && !(blade.toughness > 0 && blade.width > 0))
    return "with friction, a toughness and a width above 0";
  const double size = is_place(blade.direction) ? length(load3(blade.direction)) : 0;
  return blade.toughness == 0 || std::fabs(size - 1) < 1e-3 ? nullptr : "a direction of length 1";
}

}  // namespace

const CutMesh& cut_mesh_of(const palpate_scene& scene) {
  return cut_of(&scene)->scene.mesh();
}

constinit const Effect cut_effect = {
    .name = "cut",
    .order = 16,
    .def = effect_struct<palpate_cut_def, palpate_init_cut_def>("cut_def"),
    .keys = kKeys,
    .needs = kNeeds,
    .check = check,
    .uses = kUsesRest | kUsesSurface | kUsesHeldSurface | kUsesDisplacements,
    .rows = rows,
    .pass = {nullptr, Half::touch, Pass::contact, nullptr, most_of_changes},
    .body = &kBody,
    .sections = add_sections,
    .build = build,
    .prepare = prepare,
};

}  // namespace palpate

void palpate_init_cut_def(palpate_cut_def* def, size_t struct_bytes) {
  palpate_cut_def defaults = {};
  defaults.part.effect = &palpate::cut_effect;
  defaults.cut = PALPATE_CUT_ON;
  defaults.cut_rank = 600, defaults.cut_operations = 100'000, defaults.cut_points = 12, defaults.cut_lips = 64;
  palpate::write_host_struct(defaults, def, struct_bytes);
}

void palpate_init_blade(palpate_blade* blade, size_t struct_bytes) {
  palpate::write_host_struct(palpate_blade{}, blade, struct_bytes);
}

palpate_status palpate_scene_set_blade(palpate_scene* scene, int32_t blade, const palpate_blade* now,
                                       palpate_error* error) {
  palpate::CutOfScene* const cut = palpate::cut_of(scene);
  const auto refuse = [&](const char* what) {
    return palpate::fail(error, PALPATE_ERROR_ARGUMENT, 0, "blade %d: expected %s", static_cast<int>(blade), what);
  };
  if (!cut) return refuse("a scene with cut ON, found another");
  if (blade < 0 || blade >= PALPATE_MAX_BLADES) return refuse("a number from 0 to PALPATE_MAX_BLADES - 1");
  palpate_blade one = {};
  if (const palpate_status status = palpate::read_host_struct("blade", now, &one, error)) return status;
  if (const char* const wrong = palpate::fault_of(one)) return refuse(wrong);
  cut->scene.set_blade(blade, one);
  return palpate::succeed(error);
}

const palpate_blade_state* palpate_scene_blade_state(const palpate_scene* scene, int32_t blade) {
  const palpate::CutOfScene* const cut = palpate::cut_of(scene);
  return cut && blade >= 0 && blade < PALPATE_MAX_BLADES ? &cut->scene.blade_state(blade) : nullptr;
}

palpate_status palpate_scene_remove_tissue(palpate_scene* scene, const double* centre, double radius, double held,
                                           double needed, palpate_error* error) {
  palpate::CutOfScene* const cut = palpate::cut_of(scene);
  if (!cut || !centre || !palpate::is_place(centre) || !(radius > 0 && radius <= 1e6))
    return palpate::fail(error, PALPATE_ERROR_ARGUMENT, 0,
                         "remove tissue: expected a scene with cut ON, a centre within 1e6 m and a radius above 0");
  if (!(held >= 0 && held <= 1e6 && needed >= 0 && needed <= 1e6))
    return palpate::fail(error, PALPATE_ERROR_ARGUMENT, 0, "remove tissue: expected times from 0 to 1e6 s");
  cut->scene.remove_tissue(centre, radius, held, needed);
  return palpate::succeed(error);
}

const palpate_cut_state* palpate_scene_cut_state(const palpate_scene* scene) {
  const palpate::CutOfScene* const cut = palpate::cut_of(scene);
  return cut ? &cut->scene.state() : nullptr;
}

int32_t palpate_scene_cut_surface(const palpate_scene* scene, int32_t* triangles, uint8_t* is_lip, int32_t capacity) {
  palpate::CutOfScene* const cut = palpate::cut_of(scene);
  return cut ? cut->scene.surface().write(triangles, is_lip, capacity) : 0;
}

int32_t palpate_scene_cut_nodes(const palpate_scene* scene, int32_t* nodes, int32_t capacity) {
  palpate::CutOfScene* const cut = palpate::cut_of(scene);
  return cut ? cut->scene.write_nodes(nodes, capacity) : 0;
}
