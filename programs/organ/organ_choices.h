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
    double bundle_megabytes = 0;           // expected at most: smoothing makes a rough surface smaller
  };
  std::vector<MeshSize> sizes;  // coarse to fine
  std::string size_reason;
  std::string size_warning;  // empty, or why bundles are as large as they are
  double smooth_mm = 0;
  std::string smooth_reason;
  std::array<double, 3> held_towards{};  // of a frame's axes
  double held_share = 0.2;
  std::string held_reason;
  double depth_mm = 0, disc_mm = 0;
  std::string press_reason;
};

OrganChoices choose(const OrganSource& source);

// What the user should look at before the organ is made: doubts(), a bundle that gets large, pieces that are dropped, an organ that the
// image cuts off. A sentence each; `organ` is its subject. Errors: as doubts().
std::vector<std::string> warnings_of(const std::string& organ, const OrganRequest& request, const OrganSource& source);

// Several organs as one mesh: the volumes, boxes and surfaces of all of them together, which choose() takes like those of one organ.
OrganSource welded(const OrganGroup& group);

// Organs that touch over more than a fiftieth of the smaller one's surface hold each other; each such set is held by itself.
struct HeldSet {
  std::vector<std::size_t> organs;  // of the group
  double beyond = 0;                // y in mm: what lies farther to the back is held, a fifth of the set's surface
  double within = 0;                // mm: how far a mesh's node may lie from the voxels of its organ
};
std::vector<HeldSet> choose_held_sets(const OrganGroup& group);

}  // namespace palpate
