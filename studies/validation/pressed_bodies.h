// Baked bodies in one world, of which the runtime presses the last one on the others.
#pragma once

#include <palpate/palpate_complete.h>

#include <Eigen/Dense>
#include <filesystem>
#include <functional>
#include <vector>

namespace palpate::validation {

struct PressedBody {
  std::filesystem::path bundle;
  palpate_deformation_model deformation = PALPATE_DEFORMATION_LINEAR;
};

struct Pressing {
  std::vector<PressedBody> bodies;
  // Where the last body is when a share of the way is done; with share 0 the bodies do not touch. A bundle with a motion has that share
  // of it.
  std::function<palpate_pose(double share)> last;
  double friction = 0;
  int steps = 50;       // of the way
  int rest_steps = 30;  // at share 1, until places lag no more
  bool refuses_flags = true;
  // Called after each step: the share, and the force on the last body, N, in the world.
  std::function<void(double share, const Eigen::Vector3d& force)> each_step = [](double, const Eigen::Vector3d&) {};
};

struct PressedAnswer {
  struct Touch {
    int carrier;            // the body whose vertex it is
    Eigen::Vector3d place;  // of the vertex at rest, in its body's frame, m
    double force;           // along the normal, N
  };
  std::vector<Touch> touches;  // pairs with a force
  Eigen::Vector3d force;       // N, on the last body, in the world
  std::vector<std::vector<Eigen::Vector3d>>
      u;  // m, in its frame: of each body's surface nodes; of all nodes where it is solved in the touch or its bundle has the interior
  double seconds = 0;  // processor time of the steps
  int flagged = 0;     // steps of the way that raised a flag
};
// The bodies come to rest at share 1. Errors: OperationError if flags are refused and a step raises one at rest, or, where
// all bodies are linear, on the way.
PressedAnswer press(const Pressing& pressing);

}  // namespace palpate::validation
