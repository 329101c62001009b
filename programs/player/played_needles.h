// The needles of the tools of a played scene, as the library takes them.
#pragma once

#include <palpate/palpate_complete.h>

#include <cstddef>
#include <string>
#include <vector>

#include "formats/scene_config.h"
#include "programs/player/tool_places.h"
#include "programs/player/tool_turn.h"

namespace palpate {

class PlayedNeedles {
 public:
  // Finds where each needle enters, on the surface as it was meshed. Errors: InputError, which names the line, for a place that is
  // farther from the organ than the organ is large.
  PlayedNeedles(const SceneConfig& scene, const palpate_bundle* bundle);

  bool any() const;
  // The needle of a tool as it was placed last; nullptr: it has none.
  const palpate_needle* of(std::size_t tool) const { return needles_[tool].radius > 0 ? &needles_[tool] : nullptr; }
  // m, of the shaft as it is drawn: a part of it stays outside when the needle is as deep as it goes.
  double drawn_length(std::size_t tool) const { return drawn_[tool]; }
  // The point that the place where it enters is nearest to.
  const SceneConfig::Vector& near(std::size_t tool) const { return near_[tool]; }
  int places() const { return places_; }  // of the tissue, that each needle holds at most
  int most_nodes() const;                 // what they may add to the nodes under contact

  // The needle that a tool takes to the next step from its position and turn; nullptr: none. pose: of the organ; nullptr: it is where it
  // was meshed. Allocates nothing.
  palpate_needle* place(std::size_t tool, const SceneConfig::Vector& position, const Rotation& turn,
                        const palpate_pose* pose);

 private:
  void find(const SceneConfig::Tool& tool, const PlaceFinder& finder, const palpate_bundle* bundle,
            const std::filesystem::path& file, std::size_t index);

  int places_;
  std::vector<palpate_needle> needles_;          // [tool] radius 0: none
  std::vector<SceneConfig::Vector> near_;        // [tool] m
  std::vector<SceneConfig::Vector> directions_;  // [tool] in the organ's frame, of length 1, before the tool turns
  std::vector<double> drawn_;                    // [tool] m
};

}  // namespace palpate
