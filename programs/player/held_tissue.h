// What holds the tissue of a played scene: its links and the grasps of its tools, as the library takes them.
#pragma once

#include <palpate/palpate_complete.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "formats/scene_config.h"
#include "programs/player/link_stretches.h"
#include "programs/player/tool_turn.h"

namespace palpate {

class HeldTissue {
 public:
  // Finds the places on the surface as it was meshed. Errors: InputError, which names the line, for a place that is farther from the
  // organ than the organ is large.
  HeldTissue(const SceneConfig& scene, const palpate_bundle* bundle);

  const std::vector<LinkStretch>& stretches() const { return stretches_; }
  const std::vector<palpate_link>& links() const { return links_; }  // [stretch]
  std::string name_of(std::size_t stretch) const;
  bool has_grasps() const;
  // The grasp of a tool, whether it is closed or not; nullptr: it has none.
  const palpate_grasp* grasp(std::size_t tool) const { return grasps_[tool].radius > 0 ? &grasps_[tool] : nullptr; }

  // How far apart the two jaws of a grasp are where they were put, m; 0 with one.
  double apart(std::size_t tool) const { return apart_[tool]; }

  // What they may add to the nodes under contact.
  int most_nodes() const;

  // For what follows: allocates nothing.
  // Gives the scene its links as they are at a time, if they are not those that it has. Call it in the thread of touch.
  void hold_links(palpate_scene* scene, double time);
  // Opens and closes jaws, as the tools' scene says for that time.
  void close_grasps(double time);
  // The grasp that a tool takes to the next step from its position and turn; nullptr: none, or it is open.
  palpate_grasp* place_grasp(std::size_t tool, const SceneConfig::Vector& position, const Rotation& turn);

 private:
  void find_links(const palpate_bundle* bundle);
  void find_grasps(const palpate_bundle* bundle);

  std::string file_;
  std::vector<SceneConfig::Link> from_links_;
  std::vector<std::string> tools_;                              // names
  std::vector<std::optional<SceneConfig::Grasp>> from_grasps_;  // [tool]
  std::vector<LinkStretch> stretches_;
  std::vector<palpate_link> links_;
  bool links_are_given_ = false;
  std::vector<palpate_grasp> grasps_;  // [tool] radius 0: none
  std::vector<char> closed_;           // [tool]
  std::vector<double> apart_;          // [tool]
};

}  // namespace palpate
