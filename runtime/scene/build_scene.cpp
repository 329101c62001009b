// A scene is built in steps. Each step is a function of the values that it reads and the value that it fills in;
// build_scene() at the end of the file names their order.
#include "runtime/scene/build_scene.h"

#include <cstring>

#include "runtime/base/host_struct.h"
#include "runtime/scene/effect_build.h"
#include "runtime/scene/needs.h"
#include "runtime/scene/section_reader.h"
#include "runtime/scene/state.h"
#include "runtime/scene/surface_trees.h"
#include "runtime/surface/surface_tissue.h"

namespace palpate {
namespace {

using formats::SectionId;

// ---- tensors ---------------------------------------------------------------------------------------------------------

// Copies and checks the tables of a stored compliance; the numbers stay in the bundle.
palpate_status read_compliance(const SectionReader& reader, const std::int32_t* touchable, std::int32_t max_loaded,
                               Compliance* out) {
  const auto length = [&](SectionId id) { return reader.find(id)->shape[0]; };
  using Sections = formats::IndexedSections;
  Compliance::Stored stored;
  stored.touchable = touchable;
  stored.surface_nodes = reader.surface_nodes(), stored.columns = reader.columns();
  stored.clusters = static_cast<std::int32_t>(length(SectionId::compliance_clusters));
  stored.block_count = static_cast<std::int32_t>(length(SectionId::compliance_blocks));
  if (const palpate_status status = reader.copy_indices(SectionId::compliance_nodes, reader.counts().surface_nodes,
                                                        &Sections::compliance_nodes, &stored.nodes))
    return status;
  if (const palpate_status status =
          reader.copy_indices(SectionId::compliance_clusters, length(SectionId::compliance_clusters),
                              &Sections::compliance_clusters, &stored.cluster_ends))
    return status;
  const std::int32_t* blocks = nullptr;
  if (const palpate_status status = reader.map(SectionId::compliance_blocks, &blocks)) return status;
  if (const palpate_status status = reader.map(SectionId::compliance_scale, &stored.scale)) return status;
  if (const palpate_status status = reader.map(SectionId::compliance_values, &stored.values)) return status;
  // The table of blocks is checked together with the clusters that it refers to.
  const std::size_t numbers = 5 * static_cast<std::size_t>(stored.block_count);
  std::int32_t* copy = reader.memory().array<std::int32_t>(numbers);
  if (!copy) return reader.no_memory();
  std::copy(blocks, blocks + numbers, copy);
  formats::IndexedSections sections;
  sections.compliance_clusters = stored.cluster_ends, sections.compliance_blocks = copy;
  sections.compliance_scale = stored.scale;
  if (const palpate_status status = reader.check(sections)) return status;
  stored.blocks = reinterpret_cast<const formats::StoredBlock*>(copy);
  const formats::SectionEntry* values = reader.find(SectionId::compliance_values);
  stored.type = static_cast<formats::ElementType>(values->type);
  const Compliance::Outcome outcome = out->create(reader.memory(), stored, max_loaded);
  if (outcome == Compliance::Outcome::no_memory) return reader.no_memory();
  if (outcome == Compliance::Outcome::inconsistent)
    return fail(reader.error(), PALPATE_ERROR_CONTENT, values->offset,
                "tensors/compliance/nodes and blocks contradict one another; copy the bundle again or rebuild it");
  return PALPATE_OK;
}

// compliance: filled where the bundle stores blocks; *touchable: [S] node of each column.
palpate_status read_tensors(const SectionReader& reader, std::int32_t max_loaded, Compliance* compliance,
                            const std::int32_t** touchable, Tensors* out) {
  out->surface_nodes = reader.surface_nodes(), out->columns = reader.columns();
  if (const palpate_status status = reader.copy_indices(SectionId::touchable, reader.counts().touchable,
                                                        &formats::IndexedSections::touchable, touchable))
    return status;
  if (const palpate_status status = reader.map(SectionId::force, &out->stiffness)) return status;
  if (reader.find(SectionId::displacement_surface)) {
    if (const palpate_status status = reader.map_rows(SectionId::displacement_surface, &out->surface)) return status;
  } else {
    if (const palpate_status status = read_compliance(reader, *touchable, max_loaded, compliance)) return status;
    out->compliance = compliance;
  }
  for (std::int32_t k = 0; k < out->columns; ++k) {
    Mat3 ignored;
    const double* stiffness = out->stiffness + 9 * static_cast<std::size_t>(k);
    const bool finite = std::all_of(stiffness, stiffness + 9, [](double x) { return std::isfinite(x); });
    if (!finite || !self_compliance(stiffness, &ignored)) return reader.not_usable(SectionId::force, 9ull * k);
  }
  return PALPATE_OK;
}

// A body whose surface changes has brought triangles of its own, for either half.
palpate_status read_triangles(const SectionReader& reader, palpate_scene& scene) {
  TouchedSurface& surface = scene.touch.surface;
  if (surface.triangles) return PALPATE_OK;
  surface.triangle_count = reader.triangles();
  const palpate_status status = reader.copy_indices(SectionId::triangles, 3 * reader.counts().triangles,
                                                    &formats::IndexedSections::triangles, &surface.triangles);
  scene.shape.surface = {surface.triangles, surface.triangle_count, nullptr};
  return status;
}

// A measured curve. which: 0 for P, 1 for Q, in material/response/range.
palpate_status read_curve(const SectionReader& reader, const char* effect, SectionId id, int which,
                          ResponseCurve* out) {
  const double *coefficients = nullptr, *range = nullptr;
  if (!reader.find(id)) return reader.missing(effect, id);
  if (const palpate_status status = reader.map_for(effect, SectionId::response_range, &range)) return status;
  if (const palpate_status status = reader.map(id, &coefficients)) return status;
  const formats::SectionEntry* entry = reader.find(id);
  if (range[which] == 0)
    return fail(reader.error(), PALPATE_ERROR_EFFECT, entry->offset,
                "%s: the bundle's response curve was not measured for it", effect);
  const int count = static_cast<int>(entry->shape[0]);
  return out->set(coefficients, count, range[which]) ? PALPATE_OK : reader.not_usable(id, 0);
}

// ---- the touch half --------------------------------------------------------------------------------------------------

// The search structure over the rest positions and, where contacts have frames, normals, spacing and curvature.
palpate_status build_surface(const SectionReader& reader, const palpate_scene_def& def, TouchState& touch) {
  TouchedSurface& surface = touch.surface;
  if (surface.active) surface.fans = &touch.tree.fans();
  if (!surface.index.build(reader.memory(), surface.rest, surface.triangles, surface.triangle_count, surface.active))
    return reader.no_memory("surface");
  if (!needs_contact_frames(def)) return PALPATE_OK;
  const bool measured = surface.measure.build(reader.memory(), surface.rest, reader.surface_nodes(), surface.triangles,
                                              surface.triangle_count, surface.active);
  return measured ? PALPATE_OK : reader.no_memory("surface");
}

palpate_status build_patches(const SectionReader& reader, TouchState& touch) {
  if (const palpate_status status =
          read_tissue(reader.bundle(), reader.memory(), touch.surface.measure, reader.error()))
    return status;
  const bool made = touch.surface.patch.create(reader.memory(), &touch.surface.index, &touch.surface.measure,
                                               touch.surface.triangles, reader.surface_nodes(), touch.surface.fans);
  return made ? PALPATE_OK : reader.no_memory("patches");
}

// With fewer contact nodes, a step in which all that may hold tissue does so must leave some of it out.
std::int32_t fewest_contact_nodes(const palpate_scene_def& def, const RowBudget& rows) {
  return constraints_of_point(def) * def.max_points + rows.fewest_nodes;
}

// When all effects have added their rows.
palpate_status build_offset(const SectionReader& reader, palpate_scene& scene) {
  Offset& offset = scene.touch.offset;
  if (!offset.create(reader.memory(), scene.touch.most_constraints)) return reader.no_memory("offset");
  scene.shape.moved_surface = offset.rows();
  if (!has_interior_shape(scene)) return PALPATE_OK;
  OffsetRows& interior = scene.shape.moved_interior = offset.rows();
  interior.numbers = interior.inside, interior.nodes = interior.nodes_inside;
  return PALPATE_OK;
}

palpate_status build_displacement(const SectionReader& reader, const palpate_scene_def& def, std::uint32_t uses,
                                  TouchState& touch) {
  DisplacementField& field = touch.displacement;
  field.offset_by(&touch.offset, touch.body->added());
  if (SurfaceField* const own = touch.body->surface_field()) field.follow(own);
  const bool asked =
      !touch.body->surface_field() && (follows_deformed_surface(def) || (uses & kUsesDisplacements) != 0);
  return !asked || field.create(reader.memory(), def.max_contact_nodes) ? PALPATE_OK : reader.no_memory("displacement");
}

// Where the definition states no release distance: this share of the diagonal of the organ's box.
constexpr double kReleaseShare = 0.2;

palpate_status build_collision(const SectionReader& reader, palpate_scene& scene) {
  const palpate_scene_def& def = scene.def;
  TouchState& touch = scene.touch;
  const bool deformed = def.collision == PALPATE_COLLISION_DEFORMED;
  if (!build_tree(reader.memory(), touch, reader.surface_nodes(), touch.tree)) return reader.no_memory("collision");
  const auto create_field = [&] {
    touch.field = touch.body->surface_field();
    if (touch.field) return true;
    touch.field = &touch.linear_field;
    return touch.linear_field.create(reader.memory(), &touch.displacement, def.max_contact_nodes,
                                     touch.most_constraints, reader.surface_nodes());
  };
  if ((scene.uses & kUsesNodeReach) != 0)
    touch.surface.node_reach = reader.memory().array<double>(static_cast<std::size_t>(reader.surface_nodes()));
  double reach = 1;
  if (deformed &&
      (!create_field() || !set_reaches(reader, *touch.body, scene.tensors, scene.touchable, touch.surface.bound,
                                       touch.offset.rows(), touch.tree, &reach, touch.surface.node_reach)))
    return reader.no_memory("collision");
  if (deformed && touch.body->added()) touch.linear_field.add(touch.body->added(), reach);
  if (deformed && touch.offset.exists()) touch.linear_field.move(&touch.offset, reach);
  if (!touch.deformed.create(reader.memory(), &touch.tree, touch.field, touch.surface.bound))
    return reader.no_memory("collision");
  if (deformed) touch.tree.keep_seen(reader.memory());
  touch.points.collision.create(reader.memory(), &touch.deformed,
                                touch.surface.bound ? &touch.surface.bound->index() : &touch.surface.index, touch.field,
                                &touch.work);
  touch.points.release_distance =
      def.release_distance > 0 ? def.release_distance : kReleaseShare * length(touch.tree.high() - touch.tree.low());
  for (std::int32_t t = 0; t < def.max_tools; ++t) {
    const std::size_t points = static_cast<std::size_t>(def.max_points);
    touch.points.of_tool[t] = reader.memory().array<PointState>(points);
    reader.memory().keep_array(touch.points.of_tool[t], points);
    if (!touch.surface.bound) continue;
    touch.points.bound_of_tool[t] = reader.memory().array<BoundContact>(points);
    reader.memory().keep_array(touch.points.bound_of_tool[t], points);
  }
  return reader.memory().failed() ? reader.no_memory("collision") : PALPATE_OK;
}

// A disc has about a dozen nodes on a coarse mesh.
ContactAdmission::PointContact point_contact_of(const palpate_scene_def& def) {
  constexpr std::int32_t nodes_of_disc = 12;
  const std::int32_t constraints = constraints_of_point(def), nodes = def.contact == PALPATE_CONTACT_NODE ? 1 : 3;
  const bool one_row = def.law == PALPATE_LAW_SLIDING || def.law == PALPATE_LAW_UNILATERAL;
  return {one_row ? constraints : 3 * constraints, constraints, nodes,
          def.contact == PALPATE_CONTACT_PATCH ? nodes_of_disc : nodes};
}

palpate_status build_contacts(const SectionReader& reader, palpate_scene& scene) {
  const palpate_scene_def& def = scene.def;
  TouchState& touch = scene.touch;
  SceneMemory& memory = reader.memory();
  InputLimits limits;
  limits.surface_nodes = reader.surface_nodes(), limits.triangles = touch.surface.triangle_count;
  limits.active = touch.surface.active;
  limits.max_tools = def.max_tools, limits.max_points = def.max_points;
  limits.has_triangles = touch.surface.triangles != nullptr;
  memory.keep(touch.step);
  memory.keep(touch.sent);
  memory.keep(touch.organ);
  limits.has_positions = touch.surface.rest != nullptr;
  touch.surface.column_of_node = memory.array<std::int32_t>(reader.counts().surface_nodes);
  const std::int32_t constraints = touch.most_constraints;
  touch.force = memory.array<Vec3>(static_cast<std::size_t>(def.max_contact_nodes));
  touch.modified = memory.array<Vec3>(static_cast<std::size_t>(def.max_contact_nodes));
  const ContactRows::Source source = {def.contact,
                                      touch.surface.column_of_node,
                                      touch.surface.triangles,
                                      touch.surface.rest,
                                      def.contact == PALPATE_CONTACT_PATCH ? &touch.surface.patch : nullptr,
                                      touch.body->responds_linearly() && contacts_may_slide(def) &&
                                          def.contact == PALPATE_CONTACT_PATCH && !touch.surface.bound};
  ContactSolver::Limits solver;
  solver.of.nodes = def.max_contact_nodes, solver.of.constraints = constraints;
  solver.of.columns = scene.tensors.all_columns(), solver.of.columns_of_surface = scene.tensors.columns;
  solver.of.surface_nodes = reader.surface_nodes();
  solver.of.offset = &touch.offset;
  touch.work.create(def.max_operations);
  memory.keep(touch.work);
  memory.keep(touch.points.slides);
  solver.of.predicts = def.collision == PALPATE_COLLISION_DEFORMED, solver.operations = def.max_operations;
  if (!touch.input.create(memory, limits) || !touch.rows.create(memory, source, def.max_contact_nodes, constraints) ||
      !touch.solver.create(memory, solver))
    return reader.no_memory("contacts");
  touch.rows.reserve(scene.reserved.nodes, scene.reserved.constraints);
  if (touch.body->responds_linearly() && (contacts_may_slide(def) || (scene.uses & kUsesSlideEnergy) != 0) &&
      !touch.slide_energy.create(memory, constraints))
    return reader.no_memory("contacts");
  if (def.contact == PALPATE_CONTACT_PATCH) touch.deformed.meet_discs(touch.surface.discs());
  touch.admission.create(&touch.solver, &touch.rows, &touch.work, point_contact_of(def),
                         touch.body->added() != nullptr);
  std::fill(touch.surface.column_of_node, touch.surface.column_of_node + reader.counts().surface_nodes, -1);
  for (std::int32_t k = 0; k < reader.columns(); ++k) touch.surface.column_of_node[scene.touchable[k]] = k;
  return PALPATE_OK;
}

// ---- the shape half --------------------------------------------------------------------------------------------------

palpate_status build_shape(const SectionReader& reader, palpate_scene& scene) {
  const palpate_scene_def& def = scene.def;
  const Tensors& tensors = scene.tensors;
  ShapeState& shape = scene.shape;
  const formats::BundleCounts& counts = reader.counts();
  const std::uint64_t nodes = def.shape == PALPATE_SHAPE_VOLUME ? counts.nodes : counts.surface_nodes;
  shape.nodes = static_cast<std::int32_t>(nodes);
  if (has_interior_shape(scene)) {
    if (!reader.find(SectionId::displacement_interior))
      return reader.missing("shape VOLUME", SectionId::displacement_interior);
    if (const palpate_status status = reader.map_rows(SectionId::displacement_interior, &shape.interior)) return status;
  }
  if (const palpate_status status = reader.read_rest(def, nodes, &shape.rest)) return status;
  SceneMemory& memory = reader.memory();
  const std::size_t columns = 3 * static_cast<std::size_t>(def.max_contact_nodes);
  shape.slot_of_column = memory.array<std::int32_t>(static_cast<std::size_t>(tensors.all_columns()));
  shape.sum = memory.array<double>(columns);
  shape.row_scale = memory.array<float>(columns);
  shape.coefficient = memory.array<float>(columns);
  shape.surface_column = memory.array<const void*>(columns);
  shape.column_of_sums = memory.array<std::int32_t>(columns / 3);
  if (shape.interior.numbers) {
    shape.interior_column = memory.array<const void*>(columns);
    shape.interior_coefficient = memory.array<float>(columns);
  }
  if (tensors.compliance) {
    // One field for each corrected tool, and one for all others.
    const std::size_t groups = def.radial == PALPATE_RADIAL_OFF ? 1 : static_cast<std::size_t>(def.max_tools) + 1;
    shape.loads = memory.array<LoadedColumn>(columns / 3);
    shape.group_field = memory.array<float>(groups * 3 * counts.surface_nodes + 1);
  }
  shape.field = memory.array<float>(3 * ShapeState::kChunkNodes);
  shape.tool_field = memory.array<float>(3 * ShapeState::kChunkNodes);
  return PALPATE_OK;
}

// ---- what the host's log is told -----------------------------------------------------------------------------------

// A scene of the default limits takes a few MB.
constexpr std::uint64_t kMuchMemory = std::uint64_t{256} << 20;
// Half precision keeps 11 bits: the system of several hundred contacts may then not be definite (docs/method.md).
constexpr std::int32_t kManyContactsForHalf = 256;

// Who needs contact nodes at least: "1 for each of max_points 64", and how many each effect.
struct NeededNodes {
  char text[160] = {};
  NeededNodes(const palpate_scene_def& def, EffectList effects) {
    int end = std::snprintf(text, sizeof text, "%d for each of max_points %d",
                            static_cast<int>(constraints_of_point(def)), static_cast<int>(def.max_points));
    for (const Effect* effect : effects) {
      const std::int32_t nodes = effect->rows ? effect->rows(def).fewest_nodes : 0;
      if (nodes > 0 && end < static_cast<int>(sizeof text))
        end += std::snprintf(text + end, sizeof text - static_cast<std::size_t>(end), ", %d for %s",
                             static_cast<int>(nodes), effect->name);
    }
  }
};

// Where the host leaves max_contact_nodes to the library, or sets the largest one, the other limits may allow more.
void log_few_contact_nodes(const palpate_scene& scene) {
  const palpate_scene_def& def = scene.def;
  const std::int32_t nodes = def.max_contact_nodes - scene.reserved.nodes,
                     needed = fewest_contact_nodes(def, scene.rows);
  if (nodes >= needed) return;
  const NeededNodes of_limits(def, scene.parts.list());
  scene.context.bundle.log.say(
      PALPATE_LOG_WARNING,
      "scene: max_contact_nodes is %d, and %d are needed (%s): a step in which more hold leaves the others out and "
      "raises CONTACTS_DROPPED; set max_contact_nodes (at most %d), or lower max_points",
      static_cast<int>(nodes), static_cast<int>(needed), of_limits.text, static_cast<int>(kMostContactNodes));
}

void log_scene(const palpate_scene& scene, const MemoryUse& use) {
  const palpate_scene_def& def = scene.def;
  const palpate_bundle& bundle = scene.context.bundle;
  const std::uint64_t bytes = scene.memory.bytes();
  bundle.log.say(PALPATE_LOG_NOTE, "scene: %d passes, %llu bytes", static_cast<int>(scene.plan.count),
                 static_cast<unsigned long long>(bytes));
  if (bytes > kMuchMemory)
    bundle.log.say(PALPATE_LOG_WARNING,
                   "scene: takes %llu MB, of these %llu MB for contacts; a smaller max_contact_nodes (now %d) or "
                   "max_points (now %d) takes less",
                   static_cast<unsigned long long>(bytes >> 20), static_cast<unsigned long long>(use.contacts >> 20),
                   static_cast<int>(def.max_contact_nodes), static_cast<int>(def.max_points));
  log_few_contact_nodes(scene);
  const bool has_preload = formats::find_section(bundle.index, SectionId::preload_displacement) != nullptr;
  if (has_preload && def.preload == PALPATE_PRELOAD_OFF)
    bundle.log.say(PALPATE_LOG_WARNING,
                   "scene: the bundle has a preload, and preload is OFF: rest is the shape as it was meshed");
  const formats::ElementType type = scene.tensors.compliance ? scene.compliance.type() : scene.tensors.surface.type;
  if (type == formats::ElementType::f16 && scene.touch.most_constraints > kManyContactsForHalf)
    bundle.log.say(PALPATE_LOG_WARNING,
                   "scene: the tensors have half precision, too coarse for %d contacts at once: such steps may "
                   "raise UNSOLVED",
                   static_cast<int>(scene.touch.most_constraints));
}

// A number that the host has set holds what the other limits allow.
palpate_status check_contact_nodes(const palpate_scene_def& def, EffectList effects, palpate_error* error) {
  const std::int32_t nodes = def.max_contact_nodes,
                     least = std::min(fewest_contact_nodes(def, rows_of(def, effects)), kMostContactNodes);
  if (nodes == 0 || nodes >= least) return PALPATE_OK;
  return fail(error, PALPATE_ERROR_ARGUMENT, 0,
              "palpate_scene_def: max_contact_nodes is %d, expected 0 or at least %d: %s; raise max_contact_nodes, or "
              "lower max_points",
              static_cast<int>(nodes), static_cast<int>(least), NeededNodes(def, effects).text);
}

palpate_status refuse_missing_effects(palpate_error* error) {
  return fail(error, PALPATE_ERROR_EFFECT, 0, "this library was built with PALPATE_WITHOUT_EFFECTS; leave them off");
}

// ---- the effects of the list -----------------------------------------------------------------------------------------

palpate_status check_effect(const Effect& effect, const palpate_scene_def& def, palpate_error* error) {
  for (const EffectKey& key : effect.keys)
    if (const palpate_status status = check_key(key, def, error)) return status;
  if (!kHasEffects) return refuse_missing_effects(error);
  const char* wrong = nullptr;
  for (const EffectNeed& need : effect.needs)
    if (!wrong && !need.is_met(def)) wrong = need.reason;
  if (!wrong && effect.check) wrong = effect.check(def);
  return wrong ? fail(error, PALPATE_ERROR_ARGUMENT, 0, "palpate_scene_def: %s", wrong) : PALPATE_OK;
}

// function: prepare or build of the effect e; nullptr: there is none.
palpate_status run(palpate_status (*function)(EffectBuild&), SectionReader& reader, palpate_scene& scene,
                   std::int32_t e) {
  EffectBuild build = {reader, scene, pass_of_effect(e), scene.effects[e].state};
  const palpate_status status = function ? function(build) : PALPATE_OK;
  scene.effects[e].state = build.state;
  return status;
}

}  // namespace

palpate_status check_scene_def(const palpate_scene_def& def, EffectList effects, palpate_error* error) {
  const auto bad = [&](const char* what) {
    return fail(error, PALPATE_ERROR_ARGUMENT, 0, "palpate_scene_def: %s", what);
  };
  for (const EffectKey& key : core_keys())
    if (const palpate_status status = check_key(key, def, error)) return status;
  if ((def.allocator.allocate == nullptr) != (def.allocator.release == nullptr))
    return bad("the allocator needs both allocate and release, or neither");
  if (def.radial != PALPATE_RADIAL_OFF && def.shape == PALPATE_SHAPE_OFF)
    return bad("radial corrects a shape, and shape is OFF");
  for (const Effect* effect : effects)
    if (const palpate_status status = check_effect(*effect, def, error)) return status;
  if (const palpate_status status = check_contact_nodes(def, effects, error)) return status;
  if (asks_for_missing_effects(def)) return refuse_missing_effects(error);
  return PALPATE_OK;
}

RowBudget rows_of(const palpate_scene_def& def, EffectList effects) {
  RowBudget rows;
  for (const Effect* effect : effects)
    if (effect->rows) rows.add(effect->rows(def));
  return rows;
}

std::int32_t constraints_of_point(const palpate_scene_def& def) {
  return def.contact == PALPATE_CONTACT_TRIANGLE ? 3 : 1;
}

// A disc on eight nodes keeps the force of one on all of them within a few per cent, unless it is wide against the mesh; and one wide disc
// alone finds many. Memory grows with the square.
std::int32_t nodes_of_points(const palpate_scene_def& def) {
  constexpr std::int32_t each = 8, fewest = 192, most = kMostNodesByDefault;
  const std::int32_t of_points = def.max_points > most / each ? most : std::max(fewest, each * def.max_points);
  return of_points;
}

std::int32_t contact_nodes_for(const palpate_scene_def& def, const RowBudget& rows) {
  return def.max_contact_nodes > 0 ? def.max_contact_nodes
                                   : std::min(kMostContactNodes, nodes_of_points(def) + rows.nodes);
}

palpate_status build_scene(palpate_scene& scene, palpate_error* error) {
  const palpate_scene_def& def = scene.def;
  palpate_bundle& bundle = scene.context.bundle;
  SectionReader reader(bundle, scene.memory, error);
  TouchState& touch = scene.touch;
  ShapeState& shape = scene.shape;

  palpate_status status = PALPATE_OK;
  MemoryUse use;
  std::uint64_t unused = 0;
  // taken: grows by the memory that the step takes.
  const auto step = [&](bool wanted, std::uint64_t& taken, auto build) {
    const std::uint64_t before = scene.memory.bytes();
    if (wanted && status == PALPATE_OK) status = build();
    taken += scene.memory.bytes() - before;
  };
  step(true, use.contacts, [&] {
    return read_tensors(reader, def.max_contact_nodes, &scene.compliance, &scene.touchable, &scene.tensors);
  });
  const auto prepare = [&](bool bodies) {
    for (std::int32_t e = 0; e < scene.effect_count; ++e) {
      EffectInScene& on = scene.effects[e];
      step((on.effect->body != nullptr) == bodies, on.bytes, [&] { return run(on.effect->prepare, reader, scene, e); });
    }
  };
  prepare(true);
  step(needs_triangles(def, scene.uses), use.surface, [&] { return read_triangles(reader, scene); });
  step(needs_rest(def, scene.uses) && !touch.surface.rest, use.surface,
       [&] { return reader.read_rest(def, reader.counts().surface_nodes, &touch.surface.rest); });
  step(needs_surface(def, scene.uses), use.surface, [&] { return build_surface(reader, def, touch); });
  prepare(false);
  step(touch.offset.exists(), use.contacts, [&] { return build_offset(reader, scene); });
  step(def.contact == PALPATE_CONTACT_PATCH, use.tissue, [&] { return build_patches(reader, touch); });
  step(true, use.contacts, [&] { return build_displacement(reader, def, scene.uses, touch); });
  step(def.collision != PALPATE_COLLISION_OFF, use.collision, [&] { return build_collision(reader, scene); });
  step(true, use.contacts, [&] { return build_contacts(reader, scene); });
  touch.parts.ask(&touch.tools);
  step(def.force == PALPATE_FORCE_RESPONSE, unused,
       [&] { return read_curve(reader, "force RESPONSE", SectionId::response_force, 1, &touch.response); });
  step(def.shape != PALPATE_SHAPE_OFF, use.shape, [&] { return build_shape(reader, scene); });
  step(def.radial != PALPATE_RADIAL_OFF, unused,
       [&] { return read_curve(reader, "radial RESPONSE", SectionId::response_radial, 0, &shape.radial); });
  for (std::int32_t e = 0; e < scene.effect_count; ++e) {
    EffectInScene& on = scene.effects[e];
    step(true, on.bytes, [&] { return run(scene.effects[e].effect->build, reader, scene, e); });
  }
  step(scene.memory.failed(), unused, [&] { return reader.no_memory(); });
  // Whatever failed before: if the file was cut meanwhile, that is the reason.
  if (bundle.is_lost())
    status = fail(error, PALPATE_ERROR_TRUNCATED, 0,
                  "the bundle's file became shorter or was written over while it was read");
  if (status != PALPATE_OK) return status;
  make_plan(scene, use);
  scene.definition = definition_of(scene);
  if (const palpate_status bounded = state_work_bounds(scene, error)) return bounded;
  log_scene(scene, use);
  return status;
}

}  // namespace palpate
