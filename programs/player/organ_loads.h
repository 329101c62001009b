// The [[load]] tables of a scene, played on patches of its organ.
#pragma once

#include <palpate/palpate_complete.h>

#include <string>
#include <vector>

#include "formats/scene_config.h"

namespace palpate {

class OrganLoads {
 public:
  // Finds the places of the patches. Errors: InputError with file and line, as find_place().
  OrganLoads(const SceneConfig& scene, const palpate_bundle* bundle);

  bool any() const { return !loads_.empty(); }
  std::size_t count() const { return loads_.size(); }
  const std::string& name_of(std::size_t i) const { return loads_[i].name; }
  // The patches as the library takes them.
  const palpate_loads_def& definition() const { return def_; }
  // After a touch step; nullptr: the library's scene has no loads.
  static const palpate_load_state* state(const palpate_scene* scene, std::size_t i) {
    return palpate_scene_load_state(scene, static_cast<std::int32_t>(i));
  }
  // Gives a scene with these patches what they bear at a time, s. Errors: InputError where the library refuses it. Allocates nothing.
  void set(palpate_scene* scene, double time) const;

 private:
  std::string file_;
  std::vector<SceneConfig::Load> loads_;
  palpate_loads_def def_ = palpate_default_loads_def();
};

}  // namespace palpate
