#include "runtime/large/effect.h"

#include <algorithm>
#include <cmath>

#include "runtime/base/error_text.h"
#include "runtime/base/host_struct.h"
#include "runtime/large/body_reader.h"
#include "runtime/large/large_body.h"
#include "runtime/scene/build_scene.h"
#include "runtime/scene/effect_build.h"

namespace palpate {
namespace {

using formats::SectionId;

// Of a solve beside the touch, for its laws: some 10 ms. Where many rows of several organs hold the same few nodes, laws end only slowly.
constexpr Operations kMostOfLawsBeside = 10'000'000;

// Counted operations for each node that a touch takes to follow a tool at 0.1 m/s: LARGE_AUTO compares them with max_operations.
constexpr Operations kOperationsOfNode = 500;

constexpr EffectKey kKeys[] = {{PALPATE_EFFECT_KEY(large_effect, palpate_large_def, deformation), PALPATE_KEY_CHOICE,
                                "", "linear, large, large-beside, large-renewed, large-auto", 0,
                                PALPATE_DEFORMATION_LARGE_AUTO}};
constexpr char kResponseIsLinear[] =
    "deformation LARGE is right at any depth without the measured response; leave force and radial at their defaults, "
    "or take deformation LINEAR";
constexpr EffectNeed kNeeds[] = {
    {"force", 1u << PALPATE_FORCE_OFF | 1u << PALPATE_FORCE_LINEAR, kResponseIsLinear},
    {"radial", 1u << PALPATE_RADIAL_OFF, kResponseIsLinear},
};

palpate_deformation_model deformation_of(const palpate_scene_def& def) {
  return part_of<palpate_large_def>(def, large_effect).deformation;
}
bool is_in_touch(const palpate_scene_def& def) {
  return deformation_of(def) == PALPATE_DEFORMATION_LARGE;
}
bool renews_metric(const palpate_scene_def& def) {
  return deformation_of(def) == PALPATE_DEFORMATION_LARGE_RENEWED;
}

// Of contacts, or of what else asks for rows.
bool rows_may_give_way(const palpate_scene& scene) {
  return contacts_may_give_way(scene.def) || scene.rows.constraints > 0 || scene.reserved.constraints > 0;
}

bool may_be_cut(const palpate_scene_def& def) {
  return key_number(def, "cut") != 0;
}

// Nodes that a cut of the mesh may split off. Where the bundle has none, whoever cuts says so.
NewNodes new_nodes_of(const SectionReader& reader, const palpate_scene_def& def) {
  const std::int32_t* reserve = nullptr;
  if (!may_be_cut(def) || !reader.find(SectionId::cut_reserve)) return {};
  if (reader.map(SectionId::cut_reserve, &reserve) != PALPATE_OK) return {};
  const std::int64_t first = reserve[0], count = reserve[1], end = reader.surface_nodes();
  if (first < 0 || count < 0 || first + count != end) return {};
  const auto most = static_cast<std::int64_t>(key_number(def, "cut_nodes"));
  return {reserve[0], static_cast<std::int32_t>(most > 0 ? std::min(most, count) : count)};
}

LargeBody& body_of(const palpate_scene& scene) {
  return *static_cast<LargeBody*>(scene.touch.body);
}

void add_sections(const palpate_scene_def& def, SectionList& sections) {
  sections.add({SectionId::nodes, SectionId::tetrahedra, SectionId::region, SectionId::fixed, SectionId::young,
                SectionId::poisson, SectionId::large_order, SectionId::large_stiffening, SectionId::large_law,
                SectionId::provenance, SectionId::large_support_nodes, SectionId::large_support_stiffness});
  if (def.preload == PALPATE_PRELOAD_ON) sections.add({SectionId::preload_displacement});
}

// ---- the bundle's body -----------------------------------------------------------------------------------------------

palpate_status read_large_body(const SectionReader& reader, HyperelasticBody* body, TissueLaw* laws) {
  const char* const effect = "deformation LARGE";
  palpate_status status = read_body(reader, effect, body, laws);
  if (status == PALPATE_OK) status = read_laws(reader, effect, laws);
  return status == PALPATE_OK ? read_fixed(reader, body) : status;
}

// Each node that can move stands once in the order.
bool is_an_order(const HyperelasticBody& body, const std::int32_t* order, std::int32_t count, std::uint8_t* seen) {
  for (std::int32_t i = 0; i < count; ++i)
    if (seen[order[i]]++ > 0) return false;
  for (std::int32_t n = 0; n < body.node_count; ++n) {
    const std::uint8_t* const held = body.fixed + 3 * static_cast<std::size_t>(n);
    if ((held[0] && held[1] && held[2]) == (seen[n] > 0)) return false;
  }
  return true;
}

// All of the body, whose arrays last as long as `scratch`.
palpate_status read_whole_body(const SectionReader& reader, SceneMemory& scratch, HyperelasticBody* body) {
  const SectionReader of_scratch(reader.bundle(), scratch, reader.error());
  TissueLaw* const laws = scratch.array<TissueLaw>(reader.counts().regions);
  if (!laws) return reader.no_memory("deformation");
  palpate_status status = read_large_body(reader, body, laws);
  if (status == PALPATE_OK) status = read_tetrahedra(of_scratch, body);
  if (status == PALPATE_OK) status = read_supports(reader, of_scratch, body);
  return status;
}

palpate_status make_deforming_body(SectionReader& reader, SceneMemory& scratch, const palpate_scene& scene,
                                   DeformingBody& deforming) {
  const palpate_scene_def& def = scene.def;
  // These are needed until the body is made.
  const SectionReader of_scratch(reader.bundle(), scratch, reader.error());
  const char* const effect = "deformation LARGE";
  if (!reader.find(SectionId::large_order)) return reader.missing(effect, SectionId::large_order);
  HyperelasticBody body;
  std::uint8_t* const seen = scratch.array<std::uint8_t>(reader.counts().nodes);
  if (!seen) return reader.no_memory("deformation");
  if (const palpate_status status = read_whole_body(reader, scratch, &body)) return status;
  const std::int32_t* order = nullptr;
  const double* preload = nullptr;
  const std::uint64_t count = reader.find(SectionId::large_order)->shape[0];
  using Sections = formats::IndexedSections;
  palpate_status status = of_scratch.copy_indices(SectionId::large_order, count, &Sections::large_order, &order);
  if (status == PALPATE_OK) status = reader.map_preload(def, &preload);
  if (status != PALPATE_OK) return status;
  if (!is_an_order(body, order, static_cast<std::int32_t>(count), seen))
    return fail(reader.error(), PALPATE_ERROR_CONTENT, reader.find(SectionId::large_order)->offset,
                "large/order: expected each node that is not held once, found another list; rebuild the bundle");
  for (std::int64_t i = 0; preload && i < 3 * static_cast<std::int64_t>(body.node_count); ++i)
    if (!(std::fabs(preload[i]) <= 1e6))
      return reader.not_usable(SectionId::preload_displacement, static_cast<std::uint64_t>(i));
  DeformingBody::Limits limits;
  limits.nodes = def.max_contact_nodes, limits.constraints = scene.touch.most_constraints;
  limits.gives_way = rows_may_give_way(scene), limits.renews_metric = renews_metric(def);
  limits.of_laws = is_in_touch(def) ? def.max_operations : kMostOfLawsBeside;
  limits.new_nodes = new_nodes_of(reader, def);
  const auto rank = may_be_cut(def) ? static_cast<Operations>(key_number(def, "cut_rank")) : 0;
  limits.of_cut = rank * rank / kDense;
  switch (deforming.create(reader.memory(), body, order, static_cast<std::int32_t>(count), limits, preload)) {
    case LargeSolver::Created::no_memory:
      return reader.no_memory("deformation");
    case LargeSolver::Created::not_definite:
      return fail(reader.error(), PALPATE_ERROR_CONTENT, reader.find(SectionId::tetrahedra)->offset,
                  "deformation LARGE: the stiffness of the bundle's mesh is not positive definite; rebuild the bundle");
    case LargeSolver::Created::no_equilibrium:
      return fail(reader.error(), PALPATE_ERROR_EFFECT, 0,
                  "deformation LARGE: expected a preload under which the body comes to rest, found one under which its "
                  "equilibrium was not found, though the load grew in steps of 1/512; take a stiffer tissue, a smaller "
                  "load, or "
                  "preload OFF");
    case LargeSolver::Created::made:
      break;
  }
  if (!preload) return PALPATE_OK;
  // The organ rests where the loads bring it in truth.
  double* const rest = reader.memory().array<double>(3 * static_cast<std::size_t>(body.node_count));
  if (!rest) return reader.no_memory("deformation");
  for (std::int32_t n = 0; n < body.node_count; ++n) store3(deforming.rest_displacement(n), rest + 3 * n);
  reader.replace_preload(rest);
  return PALPATE_OK;
}

// LARGE_AUTO becomes the model that it stands for, in the scene's own copy of the definition.
void choose_model(const SectionReader& reader, palpate_scene& scene) {
  auto& own = const_cast<palpate_large_def&>(part_of<palpate_large_def>(scene.def, large_effect));
  if (own.deformation != PALPATE_DEFORMATION_LARGE_AUTO) return;
  const auto nodes = static_cast<Operations>(reader.counts().nodes);
  const bool fits = nodes * kOperationsOfNode <= scene.def.max_operations;
  own.deformation = fits ? PALPATE_DEFORMATION_LARGE : PALPATE_DEFORMATION_LARGE_BESIDE;
  scene.context.bundle.log.say(
      PALPATE_LOG_NOTE,
      "scene: deformation LARGE_AUTO is %s here: %lld nodes, and max_operations is %lld, enough "
      "to solve %lld nodes in the touch",
      fits ? "LARGE" : "LARGE_BESIDE", static_cast<long long>(nodes), static_cast<long long>(scene.def.max_operations),
      static_cast<long long>(scene.def.max_operations / kOperationsOfNode));
}

palpate_status prepare(EffectBuild& build) {
  palpate_scene& scene = build.scene;
  choose_model(build.reader, scene);
  SceneMemory& memory = build.reader.memory();
  LargeBody* body = nullptr;
  if (is_in_touch(scene.def))
    body = memory.make<BodyInTouch>();
  else
    body = memory.make<BodyInThread>();
  if (!body) return build.reader.no_memory("deformation");
  scene.touch.body = body;
  SceneMemory scratch = memory.of_same_host();
  const palpate_status status = make_deforming_body(build.reader, scratch, scene, body->deforming());
  scratch.release_all();
  return status;
}

// ---- its place in the touch ------------------------------------------------------------------------------------------

// Nodes whose displacements the contacts of a step hold.
std::int32_t field_nodes_of(const SectionReader& reader, const palpate_scene& scene) {
  const std::int32_t nodes = static_cast<std::int32_t>(reader.counts().nodes),
                     of_shape[] = {scene.uses & kUsesHeldSurface ? reader.surface_nodes() : 0, reader.surface_nodes(),
                                   nodes};
  return of_shape[scene.def.shape];
}

TurnedSurface::Source surface_of(const SectionReader& reader, const TouchState& touch) {
  const TouchedSurface& surface = touch.surface;
  return {surface.rest, reader.surface_nodes(), surface.fans ? surface.triangle_count : reader.triangles(),
          surface.triangles, surface.fans};
}

// In the thread of the body.
TurnedSurface::Source surface_of_body(const SectionReader& reader, const TouchState& touch, const LargeBody& body) {
  TurnedSurface::Source source = surface_of(reader, touch);
  const MeshStream* const stream = body.stream();
  if (!stream) return source;
  const MeshStream::Surface surface = stream->surface();
  source.rest = surface.rest, source.triangles = surface.triangles, source.fans = surface.fans;
  return source;
}

bool place_in_touch(const SectionReader& reader, palpate_scene& scene, BodyInTouch& body) {
  const palpate_scene_def& def = scene.def;
  scene.touch.admission.admit_any(body.deforming().operations_to_renew());
  if (!body.reserve(reader.memory(), new_nodes_of(reader, def))) return false;
  return !(follows_deformed_surface(def) || (scene.uses & kUsesDisplacements) != 0) ||
         body.create_field(reader.memory(), scene.touch.offset.exists() ? &scene.touch.offset : nullptr,
                           scene.touch.most_constraints, reader.surface_nodes());
}

bool place_in_thread(const SectionReader& reader, palpate_scene& scene, BodyInThread& body) {
  const palpate_scene_def& def = scene.def;
  TouchState& touch = scene.touch;
  BodyBeside::Limits limits;
  limits.nodes = def.max_contact_nodes, limits.constraints = touch.most_constraints;
  limits.surface_nodes = reader.surface_nodes(), limits.stream = body.stream();
  const std::int32_t nodes = static_cast<std::int32_t>(reader.counts().nodes);
  limits.field_nodes = scene.tensors.corridor ? nodes : std::max(reader.surface_nodes(), touch.held.nodes);
  return body.beside().create(reader.memory(), &body.deforming(), &touch.offset, limits) &&
         (def.law == PALPATE_LAW_STICKING || body.beside().follow_normals(reader.memory(), surface_of(reader, touch)));
}

void log_fewest_steps(const palpate_scene& scene) {
  const Operations fewest = body_of(scene).deforming().fewest_operations();
  if (!is_in_touch(scene.def) || fewest <= scene.def.max_operations) return;
  scene.context.bundle.log.say(
      PALPATE_LOG_NOTE,
      "scene: deformation LARGE takes up to %d steps in a touch, %lld operations, though max_operations is "
      "%lld: fewer do not follow; where a touch then takes too long, take LARGE_BESIDE",
      static_cast<int>(LargeSolver::kFewestSteps), static_cast<long long>(fewest),
      static_cast<long long>(scene.def.max_operations));
}

// What moves the organ from outside is known now.
palpate_status take_offset(const SectionReader& reader, const Offset& offset, DeformingBody& deforming) {
  if (offset.count() == 0) return PALPATE_OK;
  SceneMemory scratch = reader.memory().of_same_host();
  HyperelasticBody body;
  palpate_status status = read_whole_body(reader, scratch, &body);
  if (status == PALPATE_OK && !deforming.take_offset(reader.memory(), body, offset.rows()))
    status = reader.no_memory("deformation");
  scratch.release_all();
  return status;
}

// After the surface and the limits of contacts are known.
palpate_status build(EffectBuild& build) {
  const SectionReader& reader = build.reader;
  palpate_scene& scene = build.scene;
  const palpate_scene_def& def = scene.def;
  TouchState& touch = scene.touch;
  LargeBody& body = body_of(scene);
  if (const palpate_status status = take_offset(reader, touch.offset, body.deforming())) return status;
  // Of a body that is cut the touch has the whole field.
  touch.held = scene.shape.held = {field_nodes_of(reader, scene), !is_in_touch(def) && !may_be_cut(def)};
  const bool made = (!contacts_may_slide(def) || body.watch_energy(reader.memory(), touch.most_constraints)) &&
                    (def.law == PALPATE_LAW_STICKING ||
                     body.deforming().follow_normals(reader.memory(), surface_of_body(reader, touch, body))) &&
                    (is_in_touch(def) ? place_in_touch(reader, scene, static_cast<BodyInTouch&>(body))
                                      : place_in_thread(reader, scene, static_cast<BodyInThread&>(body)));
  if (made) log_fewest_steps(scene);
  return made ? PALPATE_OK : reader.no_memory("deformation");
}

// ---- what it takes ---------------------------------------------------------------------------------------------------

const char* pass_of(const palpate_scene_def& def) {
  static const char* const names[][4] = {
      {"deformation: large, sticking", "deformation: large, sliding", "deformation: large, unilateral",
       "deformation: large, coulomb"},
      {"deformation: large-beside, sticking", "deformation: large-beside, sliding",
       "deformation: large-beside, unilateral", "deformation: large-beside, coulomb"},
      {"deformation: large-renewed, sticking", "deformation: large-renewed, sliding",
       "deformation: large-renewed, unilateral", "deformation: large-renewed, coulomb"}};
  return names[deformation_of(def) - 1][def.law];
}

// Of a tool that moves at 0.1 m/s: one and a half back-substitutions, and as many evaluations.
palpate_pass_work predict(const palpate_scene& scene, const palpate_step_load&) {
  const double numbers = static_cast<double>(body_of(scene).deforming().factor_numbers());
  return {12 * numbers, 6 * numbers, 18 * static_cast<double>(scene.context.bundle.index.counts.tetrahedra)};
}

double most_contacts(const palpate_scene& scene) {
  return static_cast<double>(constraints_of_point(scene.def)) * scene.def.max_points + scene.rows.constraints;
}

// The steps, and the laws, which are solved anew in each round: as many as a step has, and one sweep each.
double most_operations(const palpate_scene& scene) {
  const palpate_scene_def& def = scene.def;
  const auto steps = static_cast<double>(body_of(scene).deforming().most_operations());
  const double contacts = most_contacts(scene), rows = 3 * contacts;
  if (!rows_may_give_way(scene)) return steps;
  return steps + static_cast<double>(def.max_operations) +
         DeformingBody::kMostRounds * (8 * rows * rows + 1600 * contacts) / kDense;
}

// Of rows that change without being asked, as those of all contacts do where a solution arrives from beside the touch.
double most_unasked(const palpate_scene& scene, double) {
  const palpate_scene_def& def = scene.def;
  const double contacts = most_contacts(scene), rows = 3 * contacts, nodes = def.max_contact_nodes,
               of_discs = def.contact == PALPATE_CONTACT_PATCH ? static_cast<double>(kOfTwoDiscs) * contacts : 0;
  if (is_in_touch(def)) return 0;
  return (9 * nodes * (nodes + contacts) +
          std::min(rows * rows * rows / 3, 12 * static_cast<double>(def.max_operations))) /
             kDense +
         contacts * of_discs;
}

constexpr EffectBody kBody = {pass_of, predict, most_operations};

}  // namespace

const DeformingBody& deforming_body_of(const palpate_scene& scene) {
  return body_of(scene).deforming();
}

constinit const Effect large_effect = {
    .name = "deformation",
    .order = 0,
    .def = effect_struct<palpate_large_def, palpate_init_large_def>("large_def"),
    .keys = kKeys,
    .needs = kNeeds,
    .pass = {nullptr, Half::touch, Pass::contact, nullptr, most_unasked},
    .body = &kBody,
    .sections = add_sections,
    .build = build,
    .prepare = prepare,
};

}  // namespace palpate

void palpate_init_large_def(palpate_large_def* def, size_t struct_bytes) {
  palpate_large_def defaults = {};
  defaults.part.effect = &palpate::large_effect;
  defaults.deformation = PALPATE_DEFORMATION_LARGE;
  palpate::write_host_struct(defaults, def, struct_bytes);
}

int32_t palpate_scene_deform(palpate_scene* scene) {
  const std::int32_t evaluations = scene ? scene->touch.body->deform() : -1;
  if (evaluations >= 0) scene->watch.ended(palpate::Pass::deform);
  return evaluations;
}
