// The [[motion]] tables of a scene, played on the motions of its bundle.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "formats/scene_config.h"
#include "runtime/include/palpate/palpate.h"

namespace palpate {

// The amount of a motion at a time, in the file's units: the same bits as in the page of the viewer.
double amount_at(const SceneConfig::Motion& motion, double time);

class OrganMotions {
 public:
  // Errors: InputError with file and line where the bundle has no motion of that name; lists those that it has.
  OrganMotions(const SceneConfig& scene, const palpate_bundle* bundle);

  bool any() const { return !played_.empty(); }
  // Of the scene's motion i: metres in a unit of its amounts where these are lengths, else 1.
  double metres_of(std::size_t i) const { return played_[i].metres; }
  // Gives a scene with motions their amounts at a time, s. Errors: InputError where the library refuses them. Allocates nothing.
  void set(palpate_scene* scene, double time);

 private:
  struct Played {
    SceneConfig::Motion motion;
    std::size_t index;
    double scale;   // from the file's unit to the library's
    double metres;  // the same of a piston, else 1
  };
  std::string file_;
  std::vector<Played> played_;
  std::vector<double> amounts_;  // of all motions of the bundle
};

}  // namespace palpate
