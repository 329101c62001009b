// Palpate itself, beside its peers: the push as a program would play it.
#pragma once

#include <palpate/palpate.h>

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bench/peers/measured.h"
#include "bench/peers/push.h"
#include "formats/errors.h"

namespace palpate::bench {

// The paper's contact, a node, and forces that no safety limits.
palpate_scene_def node_contact_scene();

class PalpatePeer {
 public:
  // Errors: InputError where the bundle cannot be opened or is not of the push's mesh.
  PalpatePeer(const std::filesystem::path& bundle, const Push& push, const palpate_scene_def& def);

  // Collision included: a tool point enters the triangle at push.place and goes on from there.
  // between runs before each tick, outside the clock.
  template <typename ExactAnswer, typename Between>
  void play(Measured& touch, Measured& frame, const ExactAnswer& exact, const Between& between) {
    palpate_reset(scene_.get());
    touch_point(push_.place + 1e-3 * push_.outward);
    for (const Eigen::Vector3d& displacement : push_.displacements) {
      between();
      const auto start = Clock::now();
      touch_point(push_.place + displacement);
      const double touched = seconds_since(start);
      shape();
      const double shaped = seconds_since(start);
      check_held(displacement);
      touch.add(touched, answer(), exact.at(displacement));
      frame.add(shaped, answer(), exact.at(displacement));
    }
  }

  // The node held by a grip: the same without collision, and at any node. Seconds of touch, of touch and shape.
  std::pair<double, double> grip(std::int32_t node, const Eigen::Vector3d& displacement, Answer& out);

  std::string description() const;

 private:
  struct Close {
    void operator()(palpate_bundle* bundle) const { palpate_bundle_close(bundle); }
    void operator()(palpate_scene* scene) const { palpate_scene_destroy(scene); }
  };
  palpate_contacts* contacts() { return reinterpret_cast<palpate_contacts*>(memory_.data()); }
  void touch_point(const Eigen::Vector3d& point);
  void shape();
  void check_held(const Eigen::Vector3d& displacement);
  Answer answer();

  const Push& push_;
  std::unique_ptr<palpate_bundle, Close> bundle_;
  std::unique_ptr<palpate_scene, Close> scene_;
  std::vector<std::uint64_t> memory_;
  std::vector<float> surface_;
};

}  // namespace palpate::bench
