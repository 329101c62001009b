// The input of the fill: closed triangle surfaces between named regions.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace palpate {

// Every triangle separates two regions, or a region from empty space. The patches of a region together close it.
struct VolumeBoundary {
  static constexpr std::int32_t kOutside = -1;  // the space around all regions
  static constexpr std::int32_t kCavity = -2;   // empty space that a region encloses

  struct Patch {
    std::int32_t behind = 0;        // the region that the normals point away from; never negative
    std::int32_t ahead = kOutside;  // the region that the normals point into, or kOutside or kCavity
    std::vector<std::array<std::int32_t, 3>> triangles;  // counter-clockwise seen from ahead
  };

  std::vector<std::array<double, 3>> points;
  std::vector<Patch> patches;
  std::vector<std::string> region_names;
};

// Returns the name of a patch in the mesh file, for example "liver-outside", "liver-cavity" or "liver-tumour".
inline std::string patch_name(const VolumeBoundary& boundary, const VolumeBoundary::Patch& patch) {
  const std::string ahead = patch.ahead == VolumeBoundary::kOutside  ? "outside"
                            : patch.ahead == VolumeBoundary::kCavity ? "cavity"
                                                                     : boundary.region_names[patch.ahead];
  return boundary.region_names[patch.behind] + "-" + ahead;
}

}  // namespace palpate
