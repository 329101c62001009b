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

class PlanWriter {
 public:
  PlanWriter(palpate_scene& scene, const MemoryUse& memory)
      : scene_(scene), def_(scene.def), memory_(memory), sections_(scene.def, scene.context.bundle) {}

  void add_creation() {
    if (needs_surface(def_, scene_.uses)) create("rest surface in buckets", sections_.rest(true), memory_.surface);
    if (def_.contact == PALPATE_CONTACT_PATCH) create("tissue under a patch", sections_.tissue(), memory_.tissue);
    for (std::int32_t e = 0; e < scene_.effect_count; ++e)
      if (const EffectInScene& on = scene_.effects[e]; on.effect->creates)
        create(on.effect->creates, sections_of(*on.effect), on.bytes);
  }

  void add_touch() {
    step(true, Pass::input, "input", "touch", none_);
    const bool deformed = def_.collision == PALPATE_COLLISION_DEFORMED;
    step(def_.collision != PALPATE_COLLISION_OFF, Pass::collision, deformed ? "collision: deformed" : "collision: rest",
         "touch", deformed ? sections_.surface() : none_, memory_.collision);
    static const char* const models[] = {"contact: node", "contact: triangle", "contact: point", "contact: patch"};
    const bool maps_triangles =
        needs_triangles(def_, scene_.uses) && !needs_rest(def_, scene_.uses);  // for grips in triangles alone
    step(true, Pass::rows, models[def_.contact], "touch", maps_triangles ? sections_.triangles() : none_,
         needs_surface(def_, scene_.uses) ? 0 : memory_.surface);
    add_solution();
    const bool responds = def_.force == PALPATE_FORCE_RESPONSE;
    step(def_.force != PALPATE_FORCE_OFF, Pass::force, responds ? "force: response" : "force: linear", "touch",
         responds ? sections_.response(SectionId::response_force) : none_);
    step(true, Pass::output, "output", "touch", none_);
  }

  void add_deform() {
    if (body_ && (!in_touch_ || scene_.touch.body->added()))
      step(true, Pass::deform, body_->effect->body->pass(def_), "deform", sections_of(*body_->effect), body_->bytes);
  }

  void add_shape() {
    const bool has_shape = def_.shape != PALPATE_SHAPE_OFF;
    const char* const superposition =
        def_.shape == PALPATE_SHAPE_VOLUME ? "superposition: volume" : "superposition: surface";
    const auto superposed = [&] {
      if (in_touch_) return none_;
      return has_interior_shape(scene_) ? sections_.volume() : sections_.surface();
    };
    step(has_shape, Pass::superposition, in_touch_ ? "displacements of the touch" : superposition, "shape",
         superposed(), memory_.shape);
    step(def_.radial != PALPATE_RADIAL_OFF, Pass::radial, "radial: response", "shape",
         sections_.response(SectionId::response_radial));
    step(has_shape, Pass::positions, "positions", "shape", sections_.rest(false));
  }

 private:
  void add_solution() {
    static const char* const laws[] = {"solve: sticking", "solve: sliding", "solve: unilateral", "solve: coulomb"};
    if (in_touch_)
      step(true, Pass::contact, in_touch_->effect->body->pass(def_), "touch", sections_of(*in_touch_->effect),
           memory_.contacts + in_touch_->bytes);
    else
      step(true, Pass::contact, laws[def_.law], "touch", sections_.contacts(), memory_.contacts);
  }
  SectionList sections_of(const Effect& effect) const {
    SectionList list = sections_.none();
    if (effect.sections) effect.sections(def_, list);
    return list;
  }
  void add(const char* name, const char* half, const SectionList& maps, std::uint64_t bytes) {
    Plan& plan = scene_.plan;
    plan.pass[plan.count++] = {name, half, text_of(maps, plan), maps.bytes(), bytes, 0};
  }
  void create(const char* name, const SectionList& maps, std::uint64_t bytes) { add(name, "create", maps, bytes); }
  void add_step(Pass id, const char* name, const char* half, const SectionList& maps, std::uint64_t bytes = 0) {
    scene_.watch.index_in_plan[static_cast<std::int32_t>(id)] = scene_.plan.count;
    add(name, half, maps, bytes);
  }
  // A pass of the core, and behind it those of effects.
  void step(bool is_on, Pass id, const char* name, const char* half, const SectionList& maps, std::uint64_t bytes = 0) {
    if (is_on) add_step(id, name, half, maps, bytes);
    for (std::int32_t e = 0; e < scene_.effect_count; ++e) {
      const EffectInScene& on = scene_.effects[e];
      const EffectPass& pass = on.effect->pass;
      if (!pass.name || pass.behind != id) continue;
      const char* const of_half = pass.half == Half::touch ? "touch" : "shape";
      if (on.effect->creates)
        add_step(pass_of_effect(e), pass.name, of_half, none_);
      else
        add_step(pass_of_effect(e), pass.name, of_half, sections_of(*on.effect), on.bytes);
    }
  }

  palpate_scene& scene_;
  const palpate_scene_def& def_;
  const MemoryUse& memory_;
  const CoreSections sections_;
  const SectionList none_ = sections_.none();
  const EffectInScene* const body_ = scene_.body();
  const EffectInScene* const in_touch_ = scene_.body_in_touch();
};

}  // namespace

void make_plan(palpate_scene& scene, const MemoryUse& memory) {
  PlanWriter plan(scene, memory);
  plan.add_creation();
  plan.add_touch();
  plan.add_deform();
  plan.add_shape();
}

}  // namespace palpate
