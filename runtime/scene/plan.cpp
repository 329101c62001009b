#include "runtime/scene/plan.h"

#include <algorithm>
#include <cstring>

#include "runtime/scene/needs.h"
#include "runtime/scene/scene.h"

namespace palpate {
namespace {

using formats::SectionId;

// What the passes of the core map.
class CoreSections {
 public:
  CoreSections(const palpate_scene_def& def, const palpate_bundle& bundle) : def_(def), bundle_(bundle) {}

  SectionList none() const { return SectionList(bundle_); }

  SectionList rest(bool with_triangles) const {
    SectionList list = none();
    list.add({SectionId::nodes});
    if (with_triangles) list.add({SectionId::triangles});
    return with_preload(list);
  }

  SectionList triangles() const { return none().add({SectionId::triangles}); }

  SectionList tissue() const {
    SectionList list = none();
    list.add({SectionId::young, SectionId::poisson});
    if (bundle_.index.counts.regions > 1) list.add({SectionId::tetrahedra, SectionId::region});
    return list.add({SectionId::provenance});
  }

  SectionList surface() const { return none().add_surface(); }

  SectionList contacts() const { return none().add_contacts(); }

  // Surface and interior. Rows of both share one section of scales; blocks have scales of their own.
  SectionList volume() const {
    SectionList list = none();
    list.add_surface().add({SectionId::displacement_interior});
    if (!list.is_half(SectionId::displacement_surface) && list.is_half(SectionId::displacement_interior))
      list.add({SectionId::displacement_scale});
    return list;
  }

  SectionList response(SectionId id) const { return none().add({id, SectionId::response_range}); }

 private:
  SectionList with_preload(SectionList list) const {
    if (def_.preload == PALPATE_PRELOAD_ON) list.add({SectionId::preload_displacement});
    return list;
  }
  const palpate_scene_def& def_;
  const palpate_bundle& bundle_;
};

// The sections' names, separated by spaces.
const char* text_of(const SectionList& list, Plan& plan) {
  char* const text = plan.text + plan.text_count;
  char* end = text;
  for (int i = 0; i < list.count(); ++i) {
    const char* const name = list.name(i);
    const std::size_t size = std::strlen(name);
    if (end + size + 2 > plan.text + Plan::kMostText) break;
    if (i > 0) *end++ = ' ';
    std::memcpy(end, name, size);
    end += size;
  }
  *end++ = '\0';
  plan.text_count = static_cast<std::int32_t>(std::min<std::ptrdiff_t>(end - plan.text, Plan::kMostText - 1));
  return text;
}

}  // namespace

void make_plan(palpate_scene& scene, const MemoryUse& memory) {
  const palpate_scene_def& def = scene.def;
  const palpate_bundle& bundle = scene.context.bundle;
  Plan& plan = scene.plan;
  const CoreSections sections(def, bundle);
  const auto add = [&](const char* name, const char* half, const SectionList& maps, std::uint64_t bytes) {
    plan.pass[plan.count++] = {name, half, text_of(maps, plan), maps.bytes(), bytes, 0};
  };
  const auto create = [&](const char* name, const SectionList& maps, std::uint64_t bytes) {
    add(name, "create", maps, bytes);
  };
  const auto add_step = [&](Pass id, const char* name, const char* half, const SectionList& maps,
                            std::uint64_t bytes = 0) {
    scene.watch.index_in_plan[static_cast<std::int32_t>(id)] = plan.count;
    add(name, half, maps, bytes);
  };
  const auto sections_of = [&](const Effect& effect) {
    SectionList list = sections.none();
    if (effect.sections) effect.sections(def, list);
    return list;
  };
  // A pass of the core, and behind it those of effects.
  const auto step = [&](bool is_on, Pass id, const char* name, const char* half, const SectionList& maps,
                        std::uint64_t bytes = 0) {
    if (is_on) add_step(id, name, half, maps, bytes);
    for (std::int32_t e = 0; e < scene.effect_count; ++e) {
      const EffectInScene& on = scene.effects[e];
      const EffectPass& pass = on.effect->pass;
      if (!pass.name || pass.behind != id) continue;
      const char* const of_half = pass.half == Half::touch ? "touch" : "shape";
      if (on.effect->creates)
        add_step(pass_of_effect(e), pass.name, of_half, sections.none());
      else
        add_step(pass_of_effect(e), pass.name, of_half, sections_of(*on.effect), on.bytes);
    }
  };
  const bool has_shape = def.shape != PALPATE_SHAPE_OFF;

  if (needs_surface(def, scene.uses)) create("rest surface in buckets", sections.rest(true), memory.surface);
  if (def.contact == PALPATE_CONTACT_PATCH) create("tissue under a patch", sections.tissue(), memory.tissue);
  for (std::int32_t e = 0; e < scene.effect_count; ++e)
    if (const EffectInScene& on = scene.effects[e]; on.effect->creates)
      create(on.effect->creates, sections_of(*on.effect), on.bytes);

  const SectionList none = sections.none();
  step(true, Pass::input, "input", "touch", none);
  const bool deformed = def.collision == PALPATE_COLLISION_DEFORMED;
  step(def.collision != PALPATE_COLLISION_OFF, Pass::collision, deformed ? "collision: deformed" : "collision: rest",
       "touch", deformed ? sections.surface() : none, memory.collision);
  static const char* const models[] = {"contact: node", "contact: triangle", "contact: point", "contact: patch"};
  static const char* const laws[] = {"solve: sticking", "solve: sliding", "solve: unilateral", "solve: coulomb"};
  const bool maps_triangles =
      needs_triangles(def, scene.uses) && !needs_rest(def, scene.uses);  // for grips in triangles alone
  step(true, Pass::rows, models[def.contact], "touch", maps_triangles ? sections.triangles() : none,
       needs_surface(def, scene.uses) ? 0 : memory.surface);
  const EffectInScene* const body = scene.body();
  const SectionList of_body = body ? sections_of(*body->effect) : none;
  const bool has_own_field = scene.touch.body->surface_field() != nullptr;
  if (has_own_field)
    step(true, Pass::contact, body->effect->body->pass(def), "touch", of_body, memory.contacts + body->bytes);
  else
    step(true, Pass::contact, laws[def.law], "touch", sections.contacts(), memory.contacts);
  const bool responds = def.force == PALPATE_FORCE_RESPONSE;
  step(def.force != PALPATE_FORCE_OFF, Pass::force, responds ? "force: response" : "force: linear", "touch",
       responds ? sections.response(SectionId::response_force) : none);
  step(true, Pass::output, "output", "touch", none);

  if (body && !has_own_field) step(true, Pass::deform, body->effect->body->pass(def), "deform", of_body, body->bytes);

  const char* const superposition =
      def.shape == PALPATE_SHAPE_VOLUME ? "superposition: volume" : "superposition: surface";
  const auto superposed = [&] {
    if (has_own_field) return none;
    return has_interior_shape(scene) ? sections.volume() : sections.surface();
  };
  step(has_shape, Pass::superposition, has_own_field ? "displacements of the touch" : superposition, "shape",
       superposed(), memory.shape);
  step(def.radial != PALPATE_RADIAL_OFF, Pass::radial, "radial: response", "shape",
       sections.response(SectionId::response_radial));
  step(has_shape, Pass::positions, "positions", "shape", sections.rest(false));
}

}  // namespace palpate
