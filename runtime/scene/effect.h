// The descriptor of an effect: all that a scene has to know about it. A scene is built from a list of descriptors, and the builder, the
// plan, the predicted costs and saved states go through that list and name no effect. CONTRIBUTING.md says how to add one.
//
// A descriptor is constant data. The palpate_init function of the effect's struct names it, so that a host that does not call that function does not
// have the effect's code.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "runtime/base/host_struct.h"
#include "runtime/base/passes.h"
#include "runtime/include/palpate/palpate_keys.h"
#include "runtime/scene/section_list.h"

struct palpate_scene;

namespace palpate {

struct EffectBuild;  // effect_build.h

// What an effect may add to the rows of a step.
struct RowBudget {
  std::int32_t constraints = 0;   // at most
  std::int32_t nodes = 0;         // contact nodes for them, where the host leaves max_contact_nodes to the library
  std::int32_t fewest_nodes = 0;  // with which all of them find a place
  void add(const RowBudget& other) {
    constraints += other.constraints, nodes += other.nodes, fewest_nodes += other.fewest_nodes;
  }
};

// A field of palpate_scene_def, or of the struct of an effect. Its default is the one that the struct's palpate_init function writes.
using EffectKey = palpate_key;
// The first fields of an EffectKey: of palpate_scene_def, and of an effect's struct.
#define PALPATE_KEY(field) #field, nullptr, offsetof(palpate_scene_def, field), sizeof(palpate_scene_def::field)
#define PALPATE_EFFECT_KEY(effect, type, field) #field, &effect, offsetof(type, field), sizeof(type::field)
// The least value of a number that must be above 0, and the most of one without an upper limit.
constexpr double kAboveZero = std::numeric_limits<double>::denorm_min(), kNoLimit = HUGE_VAL;

// The keys that belong to no effect of the list.
std::span<const EffectKey> core_keys();
// PALPATE_OK, or the error, with *error filled, where the field is outside of its limits.
palpate_status check_key(const EffectKey& key, const palpate_scene_def& def, palpate_error* error);
// The number in a field of the struct that has it: palpate_key_number.
double number_in(const EffectKey& key, const void* fields);
// The number of the field of that name; 0 where it is one of an effect that the definition does not have.
double key_number(const palpate_scene_def& def, const char* name);

// The struct of an effect, of which a scene keeps a copy.
struct EffectStruct {
  const char* name = nullptr;  // without "palpate_"
  StructSizes sizes = {};
  void (*init)(void* def, std::size_t bytes) = nullptr;
};
constexpr std::size_t kMostPartBytes = 192;
template <class T, void (*kInit)(T*, std::size_t)>
constexpr EffectStruct effect_struct(const char* name) {
  static_assert(offsetof(T, part) == 0 && sizeof(T) <= kMostPartBytes && alignof(T) <= 8);
  return {name, {sizeof(palpate_part), sizeof(T), alignof(T)}, [](void* def, std::size_t bytes) {
            kInit(static_cast<T*>(def), bytes);
          }};
}

// The effect's struct in the chain of a definition; nullptr where there is none.
const palpate_part* find_part(const palpate_scene_def& def, const palpate_effect& effect);
// The same where the scene has the effect: its copy, which has all fields of this library.
template <class T>
const T& part_of(const palpate_scene_def& def, const palpate_effect& effect) {
  return *reinterpret_cast<const T*>(find_part(def, effect));
}

// What an effect needs of an enum or a flag: a field of palpate_scene_def, or the field that switches another effect. The latter counts as 0
// where the scene does not have that effect.
constexpr std::uint32_t kAbsent = 1u << 0;
struct EffectNeed {
  const char* key;       // its name
  std::uint32_t values;  // bit v: it may have the value v
  const char* reason;    // a sentence for the host: the physical reason, and what to do

  bool is_met(const palpate_scene_def& def) const {
    const double number = key_number(def, key);
    return number >= 0 && number < 32 && (values >> static_cast<int>(number) & 1u) != 0;
  }
};

// What a scene has only where something asks for it.
enum Use : std::uint32_t {
  kUsesRest = 1,           // positions of the surface's nodes without contacts
  kUsesSurface = 2,        // the surface at rest, searchable
  kUsesDisplacements = 4,  // where the nodes are after each solve (DisplacementField)
  kUsesHeldSurface =
      8,  // of a body with a field of its own: contacts that hold the surface's displacements, also without a shape
  kUsesSlideEnergy = 16,  // the account of energy of rows that come to places of another stiffness (slide_energy.h)
  kUsesNodeReach = 32,    // how far a field of unit norm moves each node of the surface (TouchState::node_reach)
};

// A pass of the steps that the effect adds to the plan. What acts in the touch half is part of what a saved state depends on. The effect ends
// its pass in each step (PassWatch::ended): nobody else does.
enum class Half { touch, shape };
struct EffectPass {
  const char* name;
  Half half;
  Pass behind;  // of the core's passes
  palpate_pass_work (*predict)(const palpate_scene& scene, const palpate_step_load& load);
  // Operations that it may count in a step on top of max_operations; nullptr: none. Without a name: in the pass of the contacts.
  // change: of one change of a contact.
  double (*most_operations)(const palpate_scene& scene, double change) = nullptr;
};

// Of an effect that is the scene's body (contact/body.h), which its prepare() gives to the touch. The body is solved in the touch, in the
// place of the pass of contacts, where it has a field of its own; else in a pass beside it.
struct EffectBody {
  const char* (*pass)(const palpate_scene_def& def);
  palpate_pass_work (*predict)(const palpate_scene& scene, const palpate_step_load& load);
  // Operations of that pass in the touch, which come on top of those of tests.
  double (*most_operations)(const palpate_scene& scene);
};

}  // namespace palpate

// The type of palpate.h.
struct palpate_effect {
  const char* name;
  std::int32_t order;  // effects are built and act in ascending order, each its own
  palpate::EffectStruct def;
  // The first one switches the effect on: 0 is off.
  std::span<const palpate::EffectKey> keys;
  std::span<const palpate::EffectNeed> needs;
  // What keys and needs do not say, limits of arrays too: the sentence of what is wrong, or nullptr. May be nullptr. It does not know the
  // bundle: what depends on that is refused in build() or prepare().
  const char* (*check)(const palpate_scene_def& def) = nullptr;
  std::uint32_t uses = 0;  // bits of Use
  // Of an effect that holds tissue, else nullptr.
  palpate::RowBudget (*rows)(const palpate_scene_def& def) = nullptr;
  // The name of a pass that ran when the scene was created, and is told to have its sections and memory; nullptr: there is none, and the
  // pass of the step has them.
  const char* creates = nullptr;
  palpate::EffectPass pass;  // its name nullptr: there is none
  const palpate::EffectBody* body = nullptr;
  // Adds the sections that the effect maps. May be nullptr.
  void (*sections)(const palpate_scene_def& def, palpate::SectionList& sections) = nullptr;
  // After the core has been built. Takes the effect's memory from the scene's, where it also marks what a state must keep.
  palpate_status (*build)(palpate::EffectBuild& build) = nullptr;
  // The same before the core's contacts are built, for what these use: nodes inside, the offset, a bound surface. The tensors are there, the
  // nodes of their columns (palpate_scene::touchable), and what `uses` asks for: rest and triangles by kUsesRest, TouchState::surface by
  // kUsesSurface; but not for an effect with a `body`, which may change the surface at rest. Not there: TouchState::column_of_node, patch and
  // field, and measure where contacts have no frames. One of the two may be nullptr.
  palpate_status (*prepare)(palpate::EffectBuild& build) = nullptr;
};

namespace palpate {

using Effect = palpate_effect;
using EffectList = std::span<const Effect* const>;

}  // namespace palpate
