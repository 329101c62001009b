#include "runtime/scene/plan.h"

#include <initializer_list>

#include "runtime/scene/needs.h"
#include "runtime/surface/surface_tissue.h"

namespace palpate {
namespace {

using formats::SectionId;

#define PALPATE_COMPLIANCE_SECTIONS                                                                           \
  "tensors/compliance/nodes tensors/compliance/clusters tensors/compliance/blocks tensors/compliance/values " \
  "tensors/compliance/scale"

// The sections of a pass: their names, separated by spaces, and their bytes in the bundle.
struct Sections {
  const char* names = "";
  std::uint64_t bytes = 0;
};

class SectionsOf {
 public:
  SectionsOf(const palpate_scene_def& def, const palpate_bundle& bundle) : def_(def), bundle_(bundle) {}

  std::uint64_t bytes(SectionId id) const {
    const formats::SectionEntry* entry = find(id);
    return entry ? entry->bytes : 0;
  }

  Sections rest(bool with_triangles) const {
    const bool preload = def_.preload == PALPATE_PRELOAD_ON;
    const char* names = "mesh/nodes";
    if (preload)
      names = with_triangles ? "mesh/nodes mesh/triangles preload/displacement" : "mesh/nodes preload/displacement";
    else if (with_triangles)
      names = "mesh/nodes mesh/triangles";
    return {names, bytes(SectionId::nodes) + (with_triangles ? bytes(SectionId::triangles) : 0) +
                       (preload ? bytes(SectionId::preload_displacement) : 0)};
  }

  Sections tissue() const {
    const bool regions = bundle_.index.counts.regions > 1;
    return {tissue_sections(bundle_), bytes(SectionId::young) + bytes(SectionId::poisson) +
                                          bytes(SectionId::provenance) +
                                          (regions ? bytes(SectionId::tetrahedra) + bytes(SectionId::region) : 0)};
  }

  Sections surface() const {
    static const char* const names[] = {"tensors/displacement_surface",
                                        "tensors/displacement_surface tensors/displacement_scale",
                                        PALPATE_COMPLIANCE_SECTIONS};
    return {names[static_cast<int>(form())], surface_bytes()};
  }

  Sections contacts() const {
    static const char* const names[] = {
        "tensors/nodes tensors/force tensors/displacement_surface",
        "tensors/nodes tensors/force tensors/displacement_surface tensors/displacement_scale",
        "tensors/nodes tensors/force " PALPATE_COMPLIANCE_SECTIONS};
    return {names[static_cast<int>(form())], bytes(SectionId::touchable) + bytes(SectionId::force) + surface_bytes()};
  }

  // Surface and interior. Rows of both share one section of scales; blocks have scales of their own.
  Sections volume() const {
    static const char* const names[] = {
        "tensors/displacement_surface tensors/displacement_interior",
        "tensors/displacement_surface tensors/displacement_interior tensors/displacement_scale",
        PALPATE_COMPLIANCE_SECTIONS " tensors/displacement_interior"};
    const bool own_scale = form() == Form::blocks && is_half(SectionId::displacement_interior);
    return {own_scale ? PALPATE_COMPLIANCE_SECTIONS " tensors/displacement_interior tensors/displacement_scale"
                      : names[static_cast<int>(form())],
            surface_bytes() + bytes(SectionId::displacement_interior) +
                (own_scale ? bytes(SectionId::displacement_scale) : 0)};
  }

  Sections deformation() const {
#define PALPATE_LARGE_SECTIONS                                                                         \
  "mesh/nodes mesh/tetrahedra mesh/region boundary/fixed material/young material/poisson large/order " \
  "large/stiffening "                                                                                  \
  "provenance"
#define PALPATE_SUPPORT_SECTIONS " large/support/nodes large/support/stiffness"
    static const char* const names[2][2] = {{PALPATE_LARGE_SECTIONS, PALPATE_LARGE_SECTIONS " preload/displacement"},
                                            {PALPATE_LARGE_SECTIONS PALPATE_SUPPORT_SECTIONS,
                                             PALPATE_LARGE_SECTIONS PALPATE_SUPPORT_SECTIONS " preload/displacement"}};
    const bool preload = def_.preload == PALPATE_PRELOAD_ON, supports = find(SectionId::large_support_nodes);
    Sections sections = {names[supports][preload]};
    if (supports) sections.bytes += bytes(SectionId::large_support_nodes) + bytes(SectionId::large_support_stiffness);
    if (preload) sections.bytes += bytes(SectionId::preload_displacement);
    for (const SectionId id :
         {SectionId::nodes, SectionId::tetrahedra, SectionId::region, SectionId::fixed, SectionId::young,
          SectionId::poisson, SectionId::large_order, SectionId::large_stiffening, SectionId::provenance})
      sections.bytes += bytes(id);
    return sections;
  }

  Sections inside() const {
#define PALPATE_INSIDE_SECTIONS "mesh/nodes mesh/tetrahedra mesh/region material/young material/poisson provenance"
    static const char* const names[2][2] = {{PALPATE_INSIDE_SECTIONS, PALPATE_INSIDE_SECTIONS " preload/displacement"},
                                            {PALPATE_INSIDE_SECTIONS " large/stiffening",
                                             PALPATE_INSIDE_SECTIONS " large/stiffening preload/displacement"}};
    const bool preload = def_.preload == PALPATE_PRELOAD_ON, large = def_.deformation != PALPATE_DEFORMATION_LINEAR;
    Sections sections = {names[large][preload]};
    if (preload) sections.bytes += bytes(SectionId::preload_displacement);
    if (large) sections.bytes += bytes(SectionId::large_stiffening);
    for (const SectionId id : {SectionId::nodes, SectionId::tetrahedra, SectionId::region, SectionId::young,
                               SectionId::poisson, SectionId::provenance})
      sections.bytes += bytes(id);
    return sections;
  }

  Sections needles() const {
#define PALPATE_NEEDLE_SECTIONS                                                                                \
  "mesh/nodes mesh/tetrahedra mesh/region material/young material/poisson corridor/nodes corridor/compliance " \
  "corridor/displacement_surface"
    Sections sections = {PALPATE_NEEDLE_SECTIONS};
    for (const SectionId id :
         {SectionId::nodes, SectionId::tetrahedra, SectionId::region, SectionId::young, SectionId::poisson,
          SectionId::corridor_nodes, SectionId::corridor_compliance, SectionId::corridor_surface})
      sections.bytes += bytes(id);
    return sections;
  }

  // interior: those of the shape.
  Sections motions(bool interior) const {
    const bool volume = find(SectionId::motion_volume);
    Sections sections = {
        volume ? "motion/kinds motion/displacement_surface motion/volume" : "motion/kinds motion/displacement_surface",
        bytes(SectionId::motion_kinds) + bytes(SectionId::motion_surface) + bytes(SectionId::motion_volume)};
    if (interior) {
      sections.names = volume ? "motion/kinds motion/displacement_surface motion/displacement_interior motion/volume"
                              : "motion/kinds motion/displacement_surface motion/displacement_interior";
      sections.bytes += bytes(SectionId::motion_interior);
    }
    return sections;
  }

  Sections response(SectionId id, const char* names) const {
    return {names, bytes(id) + bytes(SectionId::response_range)};
  }

 private:
  // How the bundle stores the surface's displacements.
  enum class Form { rows, scaled_rows, blocks };
  const formats::SectionEntry* find(SectionId id) const {
    return formats::find_section(bundle_.index, id);
  }
  bool is_half(SectionId id) const {
    const formats::SectionEntry* entry = find(id);
    return entry && static_cast<formats::ElementType>(entry->type) == formats::ElementType::f16;
  }
  Form form() const {
    if (!find(SectionId::displacement_surface)) return Form::blocks;
    return is_half(SectionId::displacement_surface) ? Form::scaled_rows : Form::rows;
  }
  std::uint64_t surface_bytes() const {
    if (form() != Form::blocks)
      return bytes(SectionId::displacement_surface) +
             (form() == Form::scaled_rows ? bytes(SectionId::displacement_scale) : 0);
    std::uint64_t sum = 0;
    for (const SectionId id : {SectionId::compliance_nodes, SectionId::compliance_clusters,
                               SectionId::compliance_blocks, SectionId::compliance_values, SectionId::compliance_scale})
      sum += bytes(id);
    return sum;
  }

  const palpate_scene_def& def_;
  const palpate_bundle& bundle_;
};

}  // namespace

Plan make_plan(const palpate_scene_def& def, const palpate_bundle& bundle, const MemoryUse& memory, PassWatch& watch) {
  Plan plan;
  const SectionsOf sections(def, bundle);
  const auto create = [&](const char* name, Sections maps, std::uint64_t bytes) {
    plan.pass[plan.count++] = {name, "create", maps.names, maps.bytes, bytes, 0};
  };
  const auto step = [&](Pass id, const char* name, const char* half, Sections maps = {}, std::uint64_t bytes = 0) {
    watch.index_in_plan[static_cast<std::int32_t>(id)] = plan.count;
    plan.pass[plan.count++] = {name, half, maps.names, maps.bytes, bytes, 0};
  };
  const bool has_shape = def.shape != PALPATE_SHAPE_OFF;

  if (needs_surface(def)) create("rest surface in buckets", sections.rest(true), memory.surface);
  if (def.contact == PALPATE_CONTACT_PATCH) create("tissue under a patch", sections.tissue(), memory.tissue);
  if (def.fine_surface) create("fine surface on the mesh", sections.rest(true), memory.fine_surface);
  if (def.queries != PALPATE_QUERIES_OFF) create("surface for queries", sections.rest(true), memory.queries);
  if (def.render_mesh) create("render mesh on the surface", sections.rest(true), memory.render_mesh);

  if (has_inside(def)) create("tetrahedra of the inside", sections.inside(), memory.inside);

  step(Pass::input, "input", "touch");
  if (has_motions(def))
    step(Pass::motions, "motions", "touch", sections.motions(has_interior_shape(def, bundle)), memory.motions);
  if (def.collision == PALPATE_COLLISION_REST) step(Pass::collision, "collision: rest", "touch", {}, memory.collision);
  if (def.collision == PALPATE_COLLISION_DEFORMED)
    step(Pass::collision, "collision: deformed", "touch", sections.surface(), memory.collision);
  static const char* const models[] = {"contact: node", "contact: triangle", "contact: point", "contact: patch"};
  static const char* const laws[] = {"solve: sticking", "solve: sliding", "solve: unilateral", "solve: coulomb"};
  const bool maps_triangles = needs_triangles(def) && !needs_rest(def);  // for grips in triangles alone
  step(Pass::rows, models[def.contact], "touch",
       maps_triangles ? Sections{"mesh/triangles", sections.bytes(SectionId::triangles)} : Sections{},
       needs_surface(def) ? 0 : memory.surface);
  static const char* const large_laws[] = {"deformation: large, sticking", "deformation: large, sliding",
                                           "deformation: large, unilateral", "deformation: large, coulomb"};
  static const char* const beside_laws[] = {"deformation: large-beside, sticking", "deformation: large-beside, sliding",
                                            "deformation: large-beside, unilateral",
                                            "deformation: large-beside, coulomb"};
  static const char* const renewed_laws[] = {
      "deformation: large-renewed, sticking", "deformation: large-renewed, sliding",
      "deformation: large-renewed, unilateral", "deformation: large-renewed, coulomb"};
  const bool large = def.deformation == PALPATE_DEFORMATION_LARGE;
  if (large)
    step(Pass::contact, large_laws[def.law], "touch", sections.deformation(), memory.contacts + memory.deformation);
  else
    step(Pass::contact, laws[def.law], "touch", sections.contacts(), memory.contacts);
  if (has_grasps(def)) step(Pass::grasps, "grasps", "touch", sections.contacts());
  if (has_needles(def)) step(Pass::needles, "needles", "touch", sections.needles(), memory.needles);
  if (has_links(def)) step(Pass::links, "links", "touch", sections.contacts(), memory.links);
  if (def.force == PALPATE_FORCE_LINEAR) step(Pass::force, "force: linear", "touch");
  if (def.force == PALPATE_FORCE_RESPONSE)
    step(Pass::force, "force: response", "touch",
         sections.response(SectionId::response_force, "material/response/force material/response/range"));
  if (def.relaxation.model != PALPATE_RELAXATION_OFF)
    step(Pass::relaxation, "relaxation: prony", "touch", {}, memory.relaxation);
  step(Pass::output, "output", "touch");
  if (def.report != PALPATE_REPORT_OFF)
    step(Pass::report, "report: contacts", "touch", sections.surface(), memory.report);

  if (deforms_beside(def))
    step(Pass::deform, renews_metric(def) ? renewed_laws[def.law] : beside_laws[def.law], "deform",
         sections.deformation(), memory.deformation);

  const bool has_interior = has_interior_shape(def, bundle);
  if (has_shape && large)
    step(Pass::superposition, "displacements of the touch", "shape", {}, memory.shape);
  else if (has_shape)
    step(Pass::superposition, def.shape == PALPATE_SHAPE_VOLUME ? "superposition: volume" : "superposition: surface",
         "shape", has_interior ? sections.volume() : sections.surface(), memory.shape);
  if (def.radial != PALPATE_RADIAL_OFF)
    step(Pass::radial, "radial: response", "shape",
         sections.response(SectionId::response_radial, "material/response/radial material/response/range"));
  if (has_shape) step(Pass::positions, "positions", "shape", sections.rest(false));
  if (def.render_mesh) step(Pass::skin, "skin: render mesh", "shape");
  if (draws_dents(def)) step(Pass::dent, "dent: discs", "shape", {}, memory.dent);
  if (has_inside(def)) step(Pass::inside, "inside: strain and stress", "shape");
  return plan;
}

}  // namespace palpate
