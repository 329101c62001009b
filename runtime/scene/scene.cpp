// Creation: effects become a plan, the plan's sections are mapped and checked, all memory is taken.
#include "runtime/scene/scene.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <new>

#include "runtime/base/error_text.h"
#include "runtime/surface/surface_tissue.h"

namespace palpate {
namespace {

using formats::SectionId;

#define PALPATE_COMPLIANCE_SECTIONS                                                                           \
  "tensors/compliance/nodes tensors/compliance/clusters tensors/compliance/blocks tensors/compliance/values " \
  "tensors/compliance/scale"

// By its bits: a caller in C may have stored any number in an enum.
template <class Enum>
bool is_one_of(const Enum& value, int last) {
  int number = 0;
  static_assert(sizeof value == sizeof number);
  std::memcpy(&number, &value, sizeof number);
  return number >= 0 && number <= last;
}

palpate_status check_def(const palpate_scene_def& def, palpate_error* error) {
  const auto bad = [&](const char* what) {
    return fail(error, PALPATE_ERROR_ARGUMENT, 0, "palpate_scene_def: %s", what);
  };
  if (!is_one_of(def.collision, PALPATE_COLLISION_DEFORMED) || !is_one_of(def.contact, PALPATE_CONTACT_PATCH) ||
      !is_one_of(def.law, PALPATE_LAW_COULOMB) || !is_one_of(def.force, PALPATE_FORCE_RESPONSE) ||
      !is_one_of(def.shape, PALPATE_SHAPE_VOLUME) || !is_one_of(def.radial, PALPATE_RADIAL_RESPONSE) ||
      !is_one_of(def.preload, PALPATE_PRELOAD_ON))
    return bad("an effect has a value that palpate.h does not list; start from palpate_default_scene_def()");
  if (!is_one_of(def.relaxation.model, PALPATE_RELAXATION_PRONY))
    return bad("relaxation.model has a value that palpate.h does not list");
  if (def.relaxation.model == PALPATE_RELAXATION_PRONY) {
    if (def.force == PALPATE_FORCE_OFF) return bad("relaxation acts on a force, and force is OFF");
    if (!PronySeries().set(def.relaxation))
      return bad("relaxation needs 1 .. 8 terms, shares of 0 and above that sum to less than 1, and times above 0 s");
  }
  if (def.max_tools < 1 || def.max_tools > PALPATE_MAX_TOOLS) return bad("max_tools must be 1 .. PALPATE_MAX_TOOLS");
  if (def.max_points < 1 || def.max_points > 100000) return bad("max_points must be 1 .. 100000");
  if (def.max_contact_nodes < 1 || def.max_contact_nodes > 3000) return bad("max_contact_nodes must be 1 .. 3000");
  if (!(def.force_limit > 0)) return bad("force_limit must be above 0 N");
  if (!(def.force_slew > 0)) return bad("force_slew must be above 0 N/s");
  if ((def.allocator.allocate == nullptr) != (def.allocator.release == nullptr))
    return bad("the allocator needs both allocate and release, or neither");
  if (def.radial != PALPATE_RADIAL_OFF && def.shape == PALPATE_SHAPE_OFF)
    return bad("radial corrects a shape, and shape is OFF");
  if (def.render_mesh && def.shape == PALPATE_SHAPE_OFF) return bad("render_mesh follows a shape, and shape is OFF");
  if (!kHasEffects && uses_effects(def))
    return fail(error, PALPATE_ERROR_EFFECT, 0, "this library was built with PALPATE_WITHOUT_EFFECTS; leave them off");
  return PALPATE_OK;
}

palpate_status missing(palpate_error* error, const char* effect, SectionId id) {
  return fail(error, PALPATE_ERROR_EFFECT, 0,
              "%s needs section %s, which this bundle does not have; precompute it or turn the effect off", effect,
              formats::describe_section(id)->path);
}

// Builds a scene pass by pass; each part maps what it needs, fills its half and adds its line to the plan.
class Builder {
 public:
  Builder(palpate_scene& scene, palpate_bundle& bundle, palpate_error* error)
      : scene_(scene), bundle_(bundle), def_(scene.def), error_(error), counts_(bundle.index.counts) {}

  palpate_status build() {
    palpate_status status = PALPATE_OK;
    const auto then = [&](palpate_status (Builder::*part)()) {
      if (status == PALPATE_OK) status = (this->*part)();
    };
    then(&Builder::tensors);
    if (needs_triangles()) then(&Builder::triangles);
    if (needs_surface()) then(&Builder::surface);
    if (needs_frame(def_)) then(&Builder::measure);
    if (def_.contact == PALPATE_CONTACT_PATCH) then(&Builder::tissue);
    if (def_.render_mesh) then(&Builder::render_mesh);
    add_pass(Pass::input, {"input", "touch", "", 0});
    if (def_.collision != PALPATE_COLLISION_OFF) then(&Builder::collision);
    then(&Builder::contacts);
    if (def_.force != PALPATE_FORCE_OFF) then(&Builder::force);
    if (def_.relaxation.model != PALPATE_RELAXATION_OFF) then(&Builder::relaxation);
    add_pass(Pass::output, {"output", "touch", "", 0});
    if (def_.shape != PALPATE_SHAPE_OFF) then(&Builder::shape);
    if (def_.radial != PALPATE_RADIAL_OFF) then(&Builder::radial);
    if (def_.shape != PALPATE_SHAPE_OFF)
      add_pass(Pass::positions, {"positions", "shape", rest_sections(false), rest_bytes(false)});
    if (def_.render_mesh) add_pass(Pass::skin, {"skin: render mesh", "shape", "", 0});
    if (status == PALPATE_OK && scene_.memory.failed())
      status = fail(error_, PALPATE_ERROR_MEMORY, 0, "the allocator has no more memory for the scene");
    if (bundle_.is_lost())  // whatever else seemed wrong
      status = fail(error_, PALPATE_ERROR_TRUNCATED, 0,
                    "the bundle's file became shorter or was written over while it was read");
    return status;
  }

 private:
  bool needs_surface() const { return def_.collision != PALPATE_COLLISION_OFF || needs_frame(def_); }
  bool needs_triangles() const { return needs_surface() || def_.contact != PALPATE_CONTACT_NODE; }

  // A section that must be there; nullptr with *error_ filled otherwise.
  template <class T>
  const T* section(SectionId id) {
    return section_as<T>(&bundle_, id, error_);
  }
  palpate_status failed() const { return error_->status == PALPATE_OK ? PALPATE_ERROR_FILE : error_->status; }
  std::uint64_t bytes_of(SectionId id) const {
    const formats::SectionEntry* entry = formats::find_section(bundle_.index, id);
    return entry ? entry->bytes : 0;
  }
  void add_creation(const palpate_plan_pass& pass) { scene_.plan[scene_.pass_count++] = pass; }
  void add_pass(Pass id, const palpate_plan_pass& pass) {
    scene_.place_in_plan[static_cast<std::int32_t>(id)] = scene_.pass_count;
    scene_.plan[scene_.pass_count++] = pass;
  }

  palpate_status not_finite(SectionId id, std::uint64_t at) {
    const formats::SectionEntry* entry = formats::find_section(bundle_.index, id);
    return fail(error_, PALPATE_ERROR_CONTENT, entry->offset + 8 * at,
                "section %s: number %llu is not usable (not finite, or a stiffness that is not positive definite); "
                "rebuild the bundle",
                formats::describe_section(id)->path, static_cast<unsigned long long>(at));
  }

  // Copies of what is used as an index: a file that changes later cannot undo the check.
  template <class Member>
  palpate_status copy_indices(SectionId id, std::size_t count, Member member, const std::int32_t** out) {
    const std::int32_t* stored = section<std::int32_t>(id);
    if (!stored) return failed();
    std::int32_t* copy = scene_.memory.array<std::int32_t>(count);
    if (!copy) return fail(error_, PALPATE_ERROR_MEMORY, 0, "the allocator has no more memory for the scene");
    std::copy(stored, stored + count, copy);
    formats::IndexedSections sections;
    sections.*member = copy;
    formats::BundleError from;
    if (formats::check_stored_indices(bundle_.index, sections, &from) != formats::BundleStatus::ok)
      return fail(error_, from);
    *out = copy;
    return PALPATE_OK;
  }

  palpate_status tensors() {
    Tensors& tensors = scene_.tensors;
    tensors.surface_nodes = static_cast<std::int32_t>(counts_.surface_nodes);
    tensors.columns = static_cast<std::int32_t>(counts_.touchable);
    if (const palpate_status status = copy_indices(SectionId::touchable, counts_.touchable,
                                                   &formats::IndexedSections::touchable, &scene_.touchable))
      return status;
    tensors.force = section<double>(SectionId::force);
    if (!tensors.force) return failed();
    const bool stored_in_rows = formats::find_section(bundle_.index, SectionId::displacement_surface) != nullptr;
    if (const palpate_status status =
            stored_in_rows ? rows(SectionId::displacement_surface, &tensors.surface) : compliance())
      return status;
    for (std::int32_t k = 0; k < tensors.columns; ++k) {
      Mat3 compliance;
      const double* force = tensors.force + 9 * static_cast<std::size_t>(k);
      const bool finite = std::all_of(force, force + 9, [](double x) { return std::isfinite(x); });
      if (!finite || !self_compliance(force, &compliance)) return not_finite(SectionId::force, 9ull * k);
    }
    return PALPATE_OK;
  }

  // Displacement rows in the type they are stored in; f16 with its scales.
  palpate_status rows(SectionId id, DisplacementRows* out) {
    const formats::SectionEntry* entry = formats::find_section(bundle_.index, id);
    out->numbers = section<void>(id);
    if (!out->numbers) return failed();
    out->type = static_cast<formats::ElementType>(entry->type);
    out->nodes = static_cast<std::int32_t>(entry->shape[2]);
    if (out->type != formats::ElementType::f16) return PALPATE_OK;
    out->scale = section<float>(SectionId::displacement_scale);
    return out->scale ? PALPATE_OK : failed();
  }

  // The tables are copied and checked, as what is used as an index is; the blocks' numbers stay in the bundle.
  palpate_status compliance() {
    const auto length = [&](SectionId id) { return formats::find_section(bundle_.index, id)->shape[0]; };
    using Sections = formats::IndexedSections;
    Compliance::Stored stored;
    stored.touchable = scene_.touchable;
    stored.surface_nodes = scene_.tensors.surface_nodes, stored.columns = scene_.tensors.columns;
    stored.clusters = static_cast<std::int32_t>(length(SectionId::compliance_clusters));
    stored.block_count = static_cast<std::int32_t>(length(SectionId::compliance_blocks));
    if (const palpate_status status = copy_indices(SectionId::compliance_nodes, counts_.surface_nodes,
                                                   &Sections::compliance_nodes, &stored.nodes))
      return status;
    if (const palpate_status status =
            copy_indices(SectionId::compliance_clusters, length(SectionId::compliance_clusters),
                         &Sections::compliance_clusters, &stored.cluster_ends))
      return status;
    const std::int32_t* blocks = section<std::int32_t>(SectionId::compliance_blocks);
    stored.scale = section<float>(SectionId::compliance_scale);
    stored.values = section<void>(SectionId::compliance_values);
    if (!blocks || !stored.scale || !stored.values) return failed();
    const std::size_t numbers = 5 * static_cast<std::size_t>(stored.block_count);
    std::int32_t* copy = scene_.memory.array<std::int32_t>(numbers);
    if (!copy) return fail(error_, PALPATE_ERROR_MEMORY, 0, "the allocator has no more memory for the scene");
    std::copy(blocks, blocks + numbers, copy);
    formats::IndexedSections sections;
    sections.compliance_clusters = stored.cluster_ends, sections.compliance_blocks = copy;
    sections.compliance_scale = stored.scale;
    formats::BundleError from;
    if (formats::check_stored_indices(bundle_.index, sections, &from) != formats::BundleStatus::ok)
      return fail(error_, from);
    stored.blocks = reinterpret_cast<const formats::StoredBlock*>(copy);
    const formats::SectionEntry* values = formats::find_section(bundle_.index, SectionId::compliance_values);
    stored.type = static_cast<formats::ElementType>(values->type);
    const Compliance::Outcome outcome = scene_.compliance.create(scene_.memory, stored, def_.max_contact_nodes);
    if (outcome == Compliance::Outcome::no_memory)
      return fail(error_, PALPATE_ERROR_MEMORY, 0, "the allocator has no more memory for the scene");
    if (outcome == Compliance::Outcome::inconsistent)
      return fail(error_, PALPATE_ERROR_CONTENT, values->offset,
                  "tensors/compliance/nodes and blocks contradict one another; copy the bundle again or rebuild it");
    scene_.tensors.compliance = &scene_.compliance;
    return PALPATE_OK;
  }

  palpate_status triangles() {
    return copy_indices(SectionId::triangles, 3 * counts_.triangles, &formats::IndexedSections::triangles,
                        &scene_.touch.triangles);
  }

  // What the preload moves every node by; nullptr where the scene has none.
  palpate_status preload(const double** out) {
    *out = nullptr;
    if (def_.preload == PALPATE_PRELOAD_OFF) return PALPATE_OK;
    if (!formats::find_section(bundle_.index, SectionId::preload_displacement))
      return missing(error_, "preload ON", SectionId::preload_displacement);
    *out = section<double>(SectionId::preload_displacement);
    return *out ? PALPATE_OK : failed();
  }

  // Rest positions of the first `nodes` nodes, preload included, as T.
  template <class T>
  palpate_status rest_positions(std::uint64_t nodes, const T** out) {
    const double *position = section<double>(SectionId::nodes), *moved = nullptr;
    if (!position) return failed();
    if (const palpate_status status = preload(&moved)) return status;
    return sum_of(position, moved, nodes, scene_.memory, out);
  }

  // position + moved of the first `nodes` nodes, as T, in memory's; moved may be nullptr.
  template <class T>
  palpate_status sum_of(const double* position, const double* moved, std::uint64_t nodes, SceneMemory& memory,
                        const T** out) {
    T* rest = memory.array<T>(3 * nodes);
    if (!rest) return fail(error_, PALPATE_ERROR_MEMORY, 0, "the allocator has no more memory for the scene");
    for (std::uint64_t i = 0; i < 3 * nodes; ++i) {
      const double sum = position[i] + (moved ? moved[i] : 0.0);
      if (!(std::fabs(sum) <= 1e6)) return not_finite(SectionId::nodes, i);
      rest[i] = static_cast<T>(sum);
    }
    *out = rest;
    return PALPATE_OK;
  }

  const char* rest_sections(bool with_triangles) const {
    if (def_.preload == PALPATE_PRELOAD_ON)
      return with_triangles ? "mesh/nodes mesh/triangles preload/displacement" : "mesh/nodes preload/displacement";
    return with_triangles ? "mesh/nodes mesh/triangles" : "mesh/nodes";
  }
  std::uint64_t rest_bytes(bool with_triangles) const {
    return bytes_of(SectionId::nodes) + (with_triangles ? bytes_of(SectionId::triangles) : 0) +
           (def_.preload == PALPATE_PRELOAD_ON ? bytes_of(SectionId::preload_displacement) : 0);
  }

  // What the stored surface displacements are: their section names in the plan, by form, and their bytes.
  enum class Form { rows, scaled_rows, blocks };
  Form form() const {
    if (scene_.tensors.compliance) return Form::blocks;
    return scene_.tensors.surface.scale ? Form::scaled_rows : Form::rows;
  }
  std::uint64_t surface_bytes() const {
    if (form() != Form::blocks)
      return bytes_of(SectionId::displacement_surface) +
             (form() == Form::scaled_rows ? bytes_of(SectionId::displacement_scale) : 0);
    std::uint64_t bytes = 0;
    for (const SectionId id : {SectionId::compliance_nodes, SectionId::compliance_clusters,
                               SectionId::compliance_blocks, SectionId::compliance_values, SectionId::compliance_scale})
      bytes += bytes_of(id);
    return bytes;
  }
  const char* surface_sections() const {
    static const char* const names[] = {"tensors/displacement_surface",
                                        "tensors/displacement_surface tensors/displacement_scale",
                                        PALPATE_COMPLIANCE_SECTIONS};
    return names[static_cast<int>(form())];
  }
  const char* contact_sections() const {
    static const char* const names[] = {
        "tensors/nodes tensors/force tensors/displacement_surface",
        "tensors/nodes tensors/force tensors/displacement_surface tensors/displacement_scale",
        "tensors/nodes tensors/force " PALPATE_COMPLIANCE_SECTIONS};
    return names[static_cast<int>(form())];
  }
  const char* volume_sections() const {
    static const char* const names[] = {
        "tensors/displacement_surface tensors/displacement_interior",
        "tensors/displacement_surface tensors/displacement_interior tensors/displacement_scale",
        PALPATE_COMPLIANCE_SECTIONS " tensors/displacement_interior"};
    if (form() == Form::blocks && scene_.shape.interior.scale)
      return PALPATE_COMPLIANCE_SECTIONS " tensors/displacement_interior tensors/displacement_scale";
    return names[static_cast<int>(form())];
  }
  std::uint64_t volume_bytes() const {
    const bool own_scale = form() == Form::blocks && scene_.shape.interior.scale;
    return surface_bytes() + bytes_of(SectionId::displacement_interior) +
           (own_scale ? bytes_of(SectionId::displacement_scale) : 0);
  }

  palpate_status no_memory(const char* what) {
    return fail(error_, PALPATE_ERROR_MEMORY, 0, "the allocator has no more memory for the scene's %s", what);
  }

  palpate_status surface() {
    TouchHalf& touch = scene_.touch;
    if (const palpate_status status = rest_positions(counts_.surface_nodes, &touch.rest)) return status;
    if (!touch.surface.build(scene_.memory, touch.rest, touch.triangles, static_cast<std::int32_t>(counts_.triangles)))
      return no_memory("surface");
    add_creation({"rest surface in buckets", "create", rest_sections(true), rest_bytes(true)});
    return PALPATE_OK;
  }

  palpate_status measure() {
    TouchHalf& touch = scene_.touch;
    if (!touch.measure.build(scene_.memory, touch.rest, scene_.tensors.surface_nodes, touch.triangles,
                             static_cast<std::int32_t>(counts_.triangles)))
      return no_memory("surface");
    return PALPATE_OK;
  }

  palpate_status tissue() {
    TouchHalf& touch = scene_.touch;
    if (const palpate_status status = read_tissue(bundle_, scene_.memory, touch.measure, error_)) return status;
    if (!touch.patch.create(scene_.memory, &touch.surface, &touch.measure, touch.triangles,
                            scene_.tensors.surface_nodes))
      return no_memory("patches");
    const bool regions = counts_.regions > 1;
    add_creation({"tissue under a patch", "create", tissue_sections(bundle_),
                  bytes_of(SectionId::young) + bytes_of(SectionId::poisson) + bytes_of(SectionId::provenance) +
                      (regions ? bytes_of(SectionId::tetrahedra) + bytes_of(SectionId::region) : 0)});
    return PALPATE_OK;
  }

  palpate_status render_mesh() {
    SceneMemory scratch(def_.allocator);
    const palpate_status status = bind_render_mesh(scratch);
    scratch.release_all();
    add_creation({"render mesh on the surface", "create", rest_sections(true), rest_bytes(true)});
    return status;
  }
  palpate_status bind_render_mesh(SceneMemory& scratch) {
    const std::int32_t* triangles = scene_.touch.triangles;
    if (!triangles)
      if (const palpate_status status = copy_indices(SectionId::triangles, 3 * counts_.triangles,
                                                     &formats::IndexedSections::triangles, &triangles))
        return status;
    const double *position = section<double>(SectionId::nodes), *moved = nullptr, *nodes = nullptr;
    const float* preloaded = nullptr;
    if (!position) return failed();
    if (const palpate_status status = preload(&moved)) return status;
    if (const palpate_status status = sum_of(position, nullptr, counts_.surface_nodes, scratch, &nodes)) return status;
    if (moved)
      if (const palpate_status status = sum_of(moved, nullptr, counts_.surface_nodes, scene_.memory, &preloaded))
        return status;
    return scene_.skin.bind(scene_.memory, scratch, *def_.render_mesh, nodes, scene_.tensors.surface_nodes, preloaded,
                            triangles, static_cast<std::int32_t>(counts_.triangles), error_);
  }

  palpate_status collision() {
    TouchHalf& touch = scene_.touch;
    const bool deformed = def_.collision == PALPATE_COLLISION_DEFORMED;
    if (deformed && !touch.field.create(scene_.memory, def_.max_contact_nodes, scene_.tensors.surface_nodes))
      return no_memory("collision");
    touch.collision.create(&touch.surface, touch.triangles, &touch.field, deformed);
    for (std::int32_t t = 0; t < def_.max_tools; ++t)
      touch.points[t] = scene_.memory.array<PointState>(static_cast<std::size_t>(def_.max_points));
    add_pass(Pass::collision, {deformed ? "collision: deformed" : "collision: rest", "touch",
                               deformed ? surface_sections() : "", deformed ? surface_bytes() : 0});
    return PALPATE_OK;
  }

  palpate_status contacts() {
    TouchHalf& touch = scene_.touch;
    SceneMemory& memory = scene_.memory;
    const std::size_t nodes = static_cast<std::size_t>(def_.max_contact_nodes);
    InputLimits limits;
    limits.surface_nodes = scene_.tensors.surface_nodes;
    limits.triangles = static_cast<std::int32_t>(counts_.triangles);
    limits.max_tools = def_.max_tools, limits.max_points = def_.max_points;
    limits.places_in_triangles = touch.triangles != nullptr;
    touch.column_of_node = memory.array<std::int32_t>(counts_.surface_nodes);
    const std::int32_t per_point = def_.contact == PALPATE_CONTACT_TRIANGLE ? 3 : 1,
                       blocks = std::min(def_.max_contact_nodes, per_point * def_.max_points);
    touch.force = memory.array<Vec3>(nodes);
    touch.modified = memory.array<Vec3>(nodes);
    const ContactRows::Source source = {def_.contact, touch.column_of_node, touch.triangles, touch.rest,
                                        def_.contact == PALPATE_CONTACT_PATCH ? &touch.patch : nullptr};
    if (!touch.input.create(memory, limits) || !touch.rows.create(memory, source, def_.max_contact_nodes, blocks) ||
        !touch.solver.create(memory, def_.max_contact_nodes, blocks, scene_.tensors.columns,
                             def_.collision == PALPATE_COLLISION_DEFORMED))
      return no_memory("contacts");
    std::fill(touch.column_of_node, touch.column_of_node + counts_.surface_nodes, -1);
    for (std::int32_t k = 0; k < scene_.tensors.columns; ++k) touch.column_of_node[scene_.touchable[k]] = k;
    static const char* const models[] = {"contact: node", "contact: triangle", "contact: point", "contact: patch"};
    static const char* const laws[] = {"solve: sticking", "solve: sliding", "solve: unilateral", "solve: coulomb"};
    const bool triangles = needs_triangles() && !needs_surface();  // mapped for places in them alone
    add_pass(Pass::rows, {models[def_.contact], "touch", triangles ? "mesh/triangles" : "",
                          triangles ? bytes_of(SectionId::triangles) : 0});
    add_pass(Pass::contact, {laws[def_.law], "touch", contact_sections(),
                             bytes_of(SectionId::touchable) + bytes_of(SectionId::force) + surface_bytes()});
    return PALPATE_OK;
  }

  palpate_status curve(SectionId id, const char* effect, int which, ResponseCurve* out) {
    const formats::SectionEntry* entry = formats::find_section(bundle_.index, id);
    if (!entry) return missing(error_, effect, id);
    if (!formats::find_section(bundle_.index, SectionId::response_range))
      return missing(error_, effect, SectionId::response_range);
    const double* coefficients = section<double>(id);
    const double* range = section<double>(SectionId::response_range);
    if (!coefficients || !range) return failed();
    const int count = static_cast<int>(std::min<std::uint64_t>(entry->shape[0], ResponseCurve::kMaxCoefficients + 1));
    if (range[which] == 0)
      return fail(error_, PALPATE_ERROR_EFFECT, entry->offset,
                  "%s: the bundle's response curve was not measured for it", effect);
    if (!out->set(coefficients, count, range[which])) return not_finite(id, 0);
    return PALPATE_OK;
  }

  palpate_status force() {
    if (def_.force == PALPATE_FORCE_LINEAR) {
      add_pass(Pass::force, {"force: linear", "touch", "", 0});
      return PALPATE_OK;
    }
    if (const palpate_status status = curve(SectionId::response_force, "force RESPONSE", 1, &scene_.touch.response))
      return status;
    add_pass(Pass::force, {"force: response", "touch", "material/response/force material/response/range",
                           bytes_of(SectionId::response_force) + bytes_of(SectionId::response_range)});
    return PALPATE_OK;
  }

  palpate_status relaxation() {
    TouchHalf& touch = scene_.touch;
    touch.relaxation.set(def_.relaxation);
    touch.memory = scene_.memory.array<PronySeries::Memory>(static_cast<std::size_t>(def_.max_tools));
    if (!touch.memory) return no_memory("relaxation");
    add_pass(Pass::relaxation, {"relaxation: prony", "touch", "", 0});
    return PALPATE_OK;
  }

  palpate_status shape() {
    ShapeHalf& shape = scene_.shape;
    SceneMemory& memory = scene_.memory;
    const bool volume = def_.shape == PALPATE_SHAPE_VOLUME;
    shape.nodes = static_cast<std::int32_t>(volume ? counts_.nodes : counts_.surface_nodes);
    if (volume && counts_.nodes > counts_.surface_nodes) {
      if (!formats::find_section(bundle_.index, SectionId::displacement_interior))
        return missing(error_, "shape VOLUME", SectionId::displacement_interior);
      if (const palpate_status status = rows(SectionId::displacement_interior, &shape.interior)) return status;
    }
    if (const palpate_status status = rest_positions(static_cast<std::uint64_t>(shape.nodes), &shape.rest))
      return status;
    const std::size_t columns = 3 * static_cast<std::size_t>(def_.max_contact_nodes);
    shape.slot_of_column = memory.array<std::int32_t>(counts_.touchable);
    shape.sum = memory.array<double>(columns);
    shape.row_scale = memory.array<float>(columns);
    shape.coefficient = memory.array<float>(columns);
    shape.surface_column = memory.array<const void*>(columns);
    shape.interior_column = memory.array<const void*>(columns);
    if (scene_.tensors.compliance) {
      // Contacts that are corrected tool by tool make a field each.
      const std::size_t groups = def_.radial == PALPATE_RADIAL_OFF ? 1 : static_cast<std::size_t>(def_.max_tools) + 1;
      shape.slot_column = memory.array<std::int32_t>(columns / 3);
      shape.loads = memory.array<LoadedColumn>(columns / 3);
      shape.group_field = memory.array<float>(groups * 3 * counts_.surface_nodes);
    }
    shape.field = memory.array<float>(3 * ShapeHalf::kChunkNodes);
    shape.tool_field = memory.array<float>(3 * ShapeHalf::kChunkNodes);
    const bool interior = shape.interior.numbers != nullptr;
    add_pass(Pass::superposition,
             {volume ? "superposition: volume" : "superposition: surface", "shape",
              interior ? volume_sections() : surface_sections(), interior ? volume_bytes() : surface_bytes()});
    return PALPATE_OK;
  }

  palpate_status radial() {
    if (const palpate_status status = curve(SectionId::response_radial, "radial RESPONSE", 0, &scene_.shape.radial))
      return status;
    add_pass(Pass::radial, {"radial: response", "shape", "material/response/radial material/response/range",
                            bytes_of(SectionId::response_radial) + bytes_of(SectionId::response_range)});
    return PALPATE_OK;
  }

  palpate_scene& scene_;
  palpate_bundle& bundle_;
  const palpate_scene_def& def_;
  palpate_error* error_;
  const formats::BundleCounts& counts_;
};

}  // namespace
}  // namespace palpate

palpate_scene_def palpate_default_scene_def(void) {
  palpate_scene_def def = {};
  def.collision = PALPATE_COLLISION_REST;
  def.contact = PALPATE_CONTACT_PATCH;
  def.law = PALPATE_LAW_STICKING;
  def.force = PALPATE_FORCE_LINEAR;
  def.shape = PALPATE_SHAPE_SURFACE;
  def.radial = PALPATE_RADIAL_OFF;
  def.preload = PALPATE_PRELOAD_OFF;
  def.relaxation.model = PALPATE_RELAXATION_OFF;
  def.max_tools = 4;
  def.max_points = 64;
  def.max_contact_nodes = 192;
  def.force_limit = 50;
  def.force_slew = 1e4;
  return def;
}

palpate_status palpate_scene_create(palpate_bundle* bundle, const palpate_scene_def* def, palpate_scene** scene,
                                    palpate_error* error) {
  if (scene) *scene = nullptr;
  if (!bundle || !def || !scene)
    return palpate::fail(error, PALPATE_ERROR_ARGUMENT, 0, "bundle, def and scene must not be NULL");
  palpate_error local = {};
  if (!error) error = &local;
  *error = palpate_error{};
  if (const palpate_status status = palpate::check_def(*def, error)) return status;
  palpate::SceneMemory own(def->allocator);
  void* place =
      own.array<std::max_align_t>((sizeof(palpate_scene) + sizeof(std::max_align_t) - 1) / sizeof(std::max_align_t));
  if (!place) return palpate::fail(error, PALPATE_ERROR_MEMORY, 0, "the allocator has no memory for the scene");
  palpate_scene* created = new (place) palpate_scene(*def);
  created->bundle = bundle;
  const palpate_status status = palpate::Builder(*created, *bundle, error).build();
  if (status != PALPATE_OK) {
    palpate_scene_destroy(created);
    return status;
  }
  created->def.render_mesh = nullptr;  // the host's, who may be done with it
  *scene = created;
  return palpate::succeed(error);
}

void palpate_scene_destroy(palpate_scene* scene) {
  if (!scene) return;
  const palpate_allocator host = scene->def.allocator;
  scene->memory.release_all();
  scene->~palpate_scene();
  if (host.allocate)
    host.release(host.user, scene);
  else
    std::free(scene);
}

const palpate_plan_pass* palpate_scene_plan(const palpate_scene* scene, int32_t* count) {
  if (count) *count = scene ? scene->pass_count : 0;
  return scene ? scene->plan : nullptr;
}

void palpate_watch_passes(palpate_scene* scene, palpate_pass_watcher watcher, void* user) {
  if (!scene) return;
  scene->watcher = watcher, scene->watcher_user = user;
}
