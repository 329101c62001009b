// Palpate as one of the compared systems: plays the push through the runtime's API.
#pragma once

#include <palpate/palpate.hpp>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "formats/errors.h"
#include "studies/peers/measured.h"
#include "studies/peers/push.h"

namespace palpate::studies {

// A scene with the paper's contact, a node, and without force limits.
SceneDef node_contact_scene();

class PalpatePeer {
 public:
  // Errors: InputError if the bundle cannot be opened or belongs to another mesh.
  PalpatePeer(const std::filesystem::path& bundle, const Push& push, const SceneDef& def);

  // With collision: a tool point enters the surface at push.entry and moves on.
  template <typename ExactAnswer>
  void play(Measured& touch, Measured& frame, const ExactAnswer& exact) {
    scene_.reset();
    touch_point(push_.entry + 1e-3 * push_.outward);
    for (const Eigen::Vector3d& displacement : push_.displacements) {
      const auto start = Clock::now();
      touch_point(push_.entry + displacement);
      const double touched = seconds_since(start);
      shape();
      const double shaped = seconds_since(start);
      check_held(displacement);
      touch.add(touched, answer(), exact.at(displacement));
      frame.add(shaped, answer(), exact.at(displacement));
    }
  }

  // A grip holds the node, without collision; any node. Returns the seconds of touch and shape together.
  double grip(std::int32_t node, const Eigen::Vector3d& displacement, Answer& out);

 private:
  void touch_point(const Eigen::Vector3d& point);
  void shape();
  void check_held(const Eigen::Vector3d& displacement);
  Answer answer();

  const Push& push_;
  Bundle bundle_;
  Scene scene_;
  Contacts contacts_{0};
  std::vector<float> surface_;
};

}  // namespace palpate::studies
