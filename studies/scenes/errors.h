// What each effect of a scene is off against a full solve: the whole finite-element bodies with a direct factor, in double precision, and
// the conditions of the effect as rows of one system.
#pragma once

#include <nlohmann/json.hpp>

#include "studies/scenes/baked.h"

namespace palpate::scenes {

// [{effect, force_N, force_error, field_mm, field_error, contacts}]: force_error is the length of the difference over the force; field_error
// that of the displacements of all surface nodes in the 2-norm, relative. force_error is null where an effect has no force; a grasp has
// a torque_error as well.
std::vector<nlohmann::ordered_json> measure_errors(const BakedOrgan& baked, const ScenesOptions& options);

}  // namespace palpate::scenes
