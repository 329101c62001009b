// Fills a scene: maps and checks the sections that its effects need and takes all its memory.
#pragma once

#include "runtime/scene/scene.h"

namespace palpate {

// PALPATE_OK, or the error, with *error filled, where the host's numbers are outside of the ranges that palpate.h states.
palpate_status check_scene_def(const palpate_scene_def& def, EffectList effects, palpate_error* error);

// The contact nodes that the scene gets: those that the host asks for, or a number that fits its other limits.
std::int32_t contact_nodes_for(const palpate_scene_def& def);

// Of one organ's part in a pair with another organ.
inline constexpr std::int32_t kNodesOfPair = 3;

// What an organ of a world may have to hold beside its own contacts.
struct PartOfWorld {
  std::int32_t pairs = 0;  // with other organs
  std::int32_t links = 0;  // of the world
  std::int32_t constraints() const { return pairs + links; }
};
// The contact nodes that come on top for it.
std::int32_t contact_nodes_for(const palpate_scene_def& def, PartOfWorld part);

// palpate_scene_create of palpate.h, with the effects that the scene may have on. part: of an organ in a world. effects: at most
// kMostEffects; the order is that in which the effects are built and act. The list may end after the call, the descriptors may not.
palpate_status create_scene(palpate_bundle* bundle, const palpate_scene_def* def, EffectList effects, PartOfWorld part,
                            palpate_scene** scene, palpate_error* error);

// scene: new, with a checked def. On failure *error is filled, and the scene holds memory that the caller must release.
palpate_status build_scene(palpate_scene& scene, palpate_error* error);

}  // namespace palpate
