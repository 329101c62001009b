// The [[blade]] and [[removal]] tables of a scene, played against its organ.
#pragma once

#include <palpate/palpate_complete.h>

#include <algorithm>
#include <string>
#include <vector>

#include "formats/scene_config.h"

namespace palpate {

class OrganCuts {
 public:
  explicit OrganCuts(const SceneConfig& scene);

  bool any() const { return !blades_.empty() || !removals_.empty(); }
  std::size_t blade_count() const { return blades_.size(); }
  const SceneConfig::Blade& blade(std::size_t i) const { return blades_[i].of; }
  // Blades that feel the tissue; whether there are any.
  int feeling_blades() const {
    return static_cast<int>(std::ranges::count_if(blades_, [](const Blade& blade) { return blade.of.toughness > 0; }));
  }
  bool feels() const { return feeling_blades() > 0; }
  // Where the edge of a blade is since set(), m, in the world; no points where the blade is withdrawn.
  const std::vector<SceneConfig::Vector>& edge(std::size_t blade) const { return blades_[blade].now; }
  // After a touch step; nullptr: the library's scene does not cut.
  static const palpate_cut_state* state(const palpate_scene* scene) { return palpate_scene_cut_state(scene); }
  static const palpate_blade_state* blade_state(const palpate_scene* scene, std::size_t i) {
    return palpate_scene_blade_state(scene, static_cast<std::int32_t>(i));
  }
  // Puts the blades where they are at a time, s, and removes what is due then: one removal in a step, others in the next steps. Errors: InputError where
  // the library refuses it. Allocates nothing.
  void set(palpate_scene* scene, double time);

 private:
  struct Blade {
    SceneConfig::Blade of;
    std::vector<SceneConfig::Vector> now;
    SceneConfig::Vector direction;  // of length 1, in its frame
  };
  struct Removal {
    SceneConfig::Removal of;
    std::uint64_t asked = 0,
                  owed = 0;  // removals that have come due; of these, those that the scene has not been given yet
  };
  void remove_due(palpate_scene* scene, double time);

  std::string file_;
  std::vector<Blade> blades_;
  std::vector<Removal> removals_;
  std::size_t turn_ = 0;  // of the removals
  double time_ = 0;       // of the last set()
};

// The surface of an organ that is cut, as it is now.
class PresentSurface {
 public:
  // Whether it has changed since the last call; at the first call it has. False for a scene that does not cut.
  bool follow(const palpate_scene* scene);
  const std::vector<std::int32_t>& triangles() const { return triangles_; }  // [triangle][3] nodes of a shape
  const std::vector<std::uint8_t>& is_lip() const { return is_lip_; }        // [triangle]

 private:
  bool followed_ = false;
  std::uint64_t version_ = 0;
  std::vector<std::int32_t> triangles_;
  std::vector<std::uint8_t> is_lip_;
};

// Makes the displacements of a shape's new nodes those from where they lie at rest. The library's are from where the bundle has them. nodes: the bundle's
// [node][3] m.
void place_new_nodes(const palpate_scene* scene, const double* nodes, const palpate_shape_out& shape);

// What happened to a cut, as events.csv names it.
inline constexpr const char *kFirstCut = "first cut", *kPieceCameOff = "piece came off", *kFull = "full";
struct CutEvent {
  double time;       // s
  const char* what;  // one of these
  int pieces;        // of the organ then
};
class CutHistory {
 public:
  // Call it after each touch. Whether the state is another one than at the call before.
  bool add(const palpate_cut_state& state, double time);
  const palpate_cut_state& state() const { return state_; }
  double time() const { return time_; }  // s, of the last change; below 0: there has been no call
  const std::vector<CutEvent>& events() const { return events_; }

 private:
  palpate_cut_state state_ = {};
  double time_ = -1;
  std::vector<CutEvent> events_;
};

}  // namespace palpate
