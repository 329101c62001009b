// Plays a scene of several organs through the runtime's C API, as Player plays a scene of one.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <vector>

#include <palpate/palpate_complete.h>
#include "programs/player/organ_links.h"
#include "programs/player/player.h"

namespace palpate {

// One touch step of all organs. The references are valid until the callback returns.
struct WorldTouchRecord {
  double time;                                        // s
  palpate_step_flags flags;                           // of all organs together
  const std::vector<SceneConfig::Vector>& positions;  // [tool] origin, m, in the world
  const palpate_world_contacts& contacts;
};

// The shapes of all organs at one time.
struct WorldShapeRecord {
  const palpate_world_contacts& contacts;
  const std::vector<ShapeRecord>&
      organs;  // [organ], each in the frame of its organ; without nodes where its scene has no shape
};

class WorldPlayer {
 public:
  // Opens the bundles, [organ], and creates the runtime's world. Errors: InputError that names the byte of a bundle, or the line of the
  // scene.
  WorldPlayer(SceneConfig scene, const std::vector<std::filesystem::path>& bundles);

  const SceneConfig& scene() const { return scene_; }  // with the positions of the tools, in the world
  std::size_t organ_count() const { return organs_.size(); }
  const PlayedOrgan& organ(std::size_t k) const { return *organs_[k]; }
  const palpate_pose& pose(std::size_t k) const { return poses_[k]; }
  const std::vector<std::vector<SceneConfig::Vector>>& points() const { return tools_->points(); }  // [tool][point], m
  std::uint64_t shape_count() const;
  std::uint64_t touch_count() const { return touch_count_of(scene_); }

  const OrganLinks& links() const { return *links_; }  // between organs

  palpate_world* runtime_world() const { return world_.get(); }

  // Plays the whole scene from its start. The times are those of palpate_world_touch, and those of the shapes, and of the solves beside
  // the touch, of all organs together. before is called before each of these, on_deform after such solves.
  Timing play(const std::function<void(const WorldTouchRecord&)>& on_touch,
              const std::function<void(const WorldShapeRecord&)>& on_shape, const std::function<void()>& before = {},
              const std::function<void()>& on_deform = {});

 private:
  struct DestroyWorld {
    void operator()(palpate_world* world) const { palpate_world_destroy(world); }
  };
  void create();
  bool solves_beside() const;
  void put_placed_tools_into_the_world();

  SceneConfig scene_;
  std::vector<std::unique_ptr<PlayedOrgan>> organs_;
  std::vector<palpate_pose> poses_;
  std::unique_ptr<OrganLinks> links_;
  std::unique_ptr<palpate_world, DestroyWorld> world_;
  std::unique_ptr<PlayedTools> tools_;
};

}  // namespace palpate
