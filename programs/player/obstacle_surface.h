// The surface of an obstacle of a scene, in its own frame, and where that frame is.
#pragma once

#include <palpate/palpate_pose.h>

#include "formats/scene_config.h"
#include "programs/player/render_mesh.h"

namespace palpate {

// A rectangle's or a disc's surface looks along z, and a disc's has 48 corners, as palpate_obstacles.h says. Errors: InputError of a mesh's file.
RenderMesh surface_of(const SceneConfig::Obstacle& obstacle);

// At a time, s: its place, its turn, and that of its normal. An obstacle that does not turn and whose normal is z has the orientation 1 0 0 0.
palpate_pose pose_at(const SceneConfig::Obstacle& obstacle, double time);

// Whether it moves or turns while the scene is played.
inline bool moves(const SceneConfig::Obstacle& obstacle) {
  return obstacle.path.size() > 1 || obstacle.turn.size() > 1;
}

}  // namespace palpate
