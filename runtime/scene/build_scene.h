// Fills a scene: maps and checks the sections that its effects need and takes all its memory.
#pragma once

#include "runtime/scene/scene.h"

namespace palpate {

// PALPATE_OK, or the error, with *error filled, where the host's numbers are outside of the ranges that palpate.h states.
palpate_status check_scene_def(const palpate_scene_def& def, EffectList effects, palpate_error* error);

// What the effects may add to the rows of a step.
RowBudget rows_of(const palpate_scene_def& def, EffectList effects);
// A tool point or a grip makes so many constraints, and each of them holds a node or more.
std::int32_t constraints_of_point(const palpate_scene_def& def);
// Of max_contact_nodes.
inline constexpr std::int32_t kMostContactNodes = 3000;
// For tool points and grips, and for all, where the host does not set max_contact_nodes.
inline constexpr std::int32_t kMostNodesByDefault = 1024;
std::int32_t nodes_of_points(const palpate_scene_def& def);
// The contact nodes that the scene gets: those that the host asks for, or a number that fits its other limits.
std::int32_t contact_nodes_for(const palpate_scene_def& def, const RowBudget& rows);

// palpate_scene_create of palpate.h. reserved: on top of what the effects need.
palpate_status create_scene(palpate_bundle* bundle, const palpate_scene_def* def, const ReservedRows& reserved,
                            palpate_scene** scene, palpate_error* error);

// scene: new, with a checked def. On failure *error is filled, and the scene holds memory that the caller must release.
palpate_status build_scene(palpate_scene& scene, palpate_error* error);

}  // namespace palpate
