// The points of a tool that touch, and the tool's position at a time.
#pragma once

#include <vector>

#include "formats/scene_config.h"

namespace palpate {

// Points on the skin of a capsule in the tool's frame, m: the first on the tip of the first cap, the last on that of
// the second, the others on a golden-angle spiral of equal area per point. (On a sphere and on a cylinder of one radius
// the area up to an axial height grows equally fast, Archimedes, so equal steps of height are equal areas on the whole
// skin.)
std::vector<SceneConfig::Vector> sample_capsule(const SceneConfig::Capsule& capsule);

// The tool's points in its own frame: those it lists, then those of its capsule.
std::vector<SceneConfig::Vector> tool_points(const SceneConfig::Tool& tool);

// The tool's origin at a time, m: linear between key frames, at rest before the first and after the last.
// Whether the scene takes the tool away at a time, s.
bool is_away(const SceneConfig::Tool& tool, double time);

SceneConfig::Vector position_at(const std::vector<SceneConfig::KeyFrame>& path, double time);

}  // namespace palpate
