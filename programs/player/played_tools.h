// The tools of a played scene as the library takes them: where they are, and what they hold.
#pragma once

#include <cstddef>
#include <vector>

#include <palpate/palpate_complete.h>
#include "formats/scene_config.h"
#include "programs/player/played_organ.h"
#include "programs/player/tool_turn.h"

namespace palpate {

class PlayedTools {
 public:
  // organs: those of the scene, one at least; a tool's grips, grasp and needle hold the organ that it names. poses: of these organs; empty: in
  // the world's frame. scene and organs must outlive this.
  PlayedTools(const SceneConfig& scene, std::vector<PlayedOrgan*> organs, std::vector<palpate_pose> poses = {});
  PlayedTools(const PlayedTools&) = delete;
  PlayedTools& operator=(const PlayedTools&) = delete;

  // None of these allocates. move puts all tools where their paths are at a time and withdraws those that are away then.
  void move(double time);
  void place(std::size_t tool, const SceneConfig::Vector& position, const Rotation& turn = kNoTurn);
  void withdraw(std::size_t tool);  // it touches nothing until it is placed again
  // After a touch: tools that press with a force are where that has brought them.
  void follow();

  const std::vector<palpate_tool>& tools() const { return tools_; }
  const std::vector<SceneConfig::Vector>& positions() const { return positions_; }         // [tool] origin, m
  const std::vector<std::vector<SceneConfig::Vector>>& points() const { return points_; }  // [tool][point], m

 private:
  const SceneConfig& scene_;
  std::vector<PlayedOrgan*> organs_;
  std::vector<palpate_pose> poses_;
  std::vector<std::vector<SceneConfig::Vector>> local_points_, points_;  // [tool][point]: own frame; now
  std::vector<SceneConfig::Vector> positions_;                           // [tool]
  std::vector<palpate_given_force> forces_;                              // [tool] of those that have one
  std::vector<palpate_tool> tools_;
};

}  // namespace palpate
