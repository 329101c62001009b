// The [[obstacle]] tables of a scene, played against its organ.
#pragma once

#include <palpate/palpate_complete.h>

#include <string>
#include <vector>

#include "formats/scene_config.h"
#include "programs/player/render_mesh.h"

namespace palpate {

class OrganObstacles {
 public:
  // Reads the meshes. Errors: InputError of a file.
  explicit OrganObstacles(const SceneConfig& scene);

  bool any() const { return !given_.empty(); }
  std::size_t count() const { return given_.size(); }
  const SceneConfig::Obstacle& of(std::size_t i) const { return obstacles_[i]; }
  const RenderMesh& surface(std::size_t i) const { return surfaces_[i]; }
  // Adds them to what the library takes, which points into this.
  void put(palpate_obstacles_def* def) const;
  // What the library's sentence about one of them is about: "scene.toml:12: obstacle "rib" (rib.stl): expected ...". Other sentences stay.
  std::string named(const std::string& sentence) const;
  // After a touch step; nullptr: the library's scene has no obstacles.
  static const palpate_obstacle_state* state(const palpate_scene* scene, std::size_t i) {
    return palpate_scene_obstacle_state(scene, static_cast<std::int32_t>(i));
  }
  // Puts those that move where they are at a time, s. Errors: InputError where the library refuses it. Allocates nothing.
  void set(palpate_scene* scene, double time) const;

 private:
  std::string file_;
  std::vector<SceneConfig::Obstacle> obstacles_;
  std::vector<RenderMesh> surfaces_;
  std::vector<std::vector<std::int32_t>> triangles_;  // of a mesh
  std::vector<palpate_obstacle> given_;
};

}  // namespace palpate
