// How a tool is turned at a time.
#pragma once

#include <array>
#include <vector>

#include "formats/scene_config.h"

namespace palpate {

using Rotation = std::array<std::array<double, 3>, 3>;  // rows
inline constexpr Rotation kNoTurn = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

// Of the rows `turn` of a tool (degrees): on straight lines between the key frames, at rest before the first and after the last.
// Without rows kNoTurn, to the bit. The bits do not depend on the C library.
Rotation turn_at(const std::vector<SceneConfig::KeyFrame>& turn, double time);

// w x y z, of length 1, of a rotation.
std::array<double, 4> quaternion_of(const Rotation& turn);

SceneConfig::Vector turned(const Rotation& turn, const SceneConfig::Vector& v);

}  // namespace palpate
