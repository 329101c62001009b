// Measurements of an organ -> the choices that its files state: mesh sizes, smoothing, what is held, how it is pressed.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "programs/organ/organ_source.h"

namespace palpate {

// Every sentence of a reason becomes a comment beside the value.
struct OrganChoices {
  struct MeshSize {
    std::string name;
    double inside_mm = 0, surface_mm = 0;  // edges
    double vertices = 0;                   // expected
  };
  std::vector<MeshSize> sizes;  // coarse to fine
  std::string size_reason;
  double smooth_mm = 0;
  std::string smooth_reason;
  std::array<double, 3> held_towards{};  // of a frame's axes
  double held_share = 0.2;
  std::string held_reason;
  double depth_mm = 0, disc_mm = 0;
  std::string press_reason;
};

OrganChoices choose(const OrganSource& source);

}  // namespace palpate
