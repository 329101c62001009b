// Two baked bodies that the runtime presses on one another.
#pragma once

#include <palpate/palpate_complete.h>

#include <Eigen/Dense>
#include <array>
#include <filesystem>
#include <functional>
#include <vector>

namespace palpate::validation {

struct PressedPair {
  std::array<std::filesystem::path, 2> bundles;
  // Where the second body is when a share of the way is done; with share 0 the bodies do not touch. A bundle with a motion has that share
  // of it.
  std::function<palpate_pose(double share)> second;
  bool large = false;  // hyperelastic bodies
};

struct PairAnswer {
  struct Touch {
    int carrier;            // the body whose vertex it is
    Eigen::Vector3d place;  // of the vertex at rest, in its body's frame, m
    double force;           // along the normal, N
  };
  std::vector<Touch> touches;                     // pairs with a force
  Eigen::Vector3d force;                          // N, on the first body, in the world
  std::array<std::vector<Eigen::Vector3d>, 2> u;  // m, of the surface nodes, in their body's frame
  double seconds = 0;                             // processor time of the steps
};
// The bodies come to rest at share 1. Errors: OperationError where a step raises a flag.
PairAnswer press(const PressedPair& pair);

}  // namespace palpate::validation
