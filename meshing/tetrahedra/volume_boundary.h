// What is to be filled with tetrahedra: closed triangle surfaces between named regions.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace palpate {

// Every triangle separates two regions, or a region and nothing. All patches around a region close it.
struct VolumeBoundary {
  static constexpr std::int32_t kOutside = -1;  // around everything
  static constexpr std::int32_t kCavity = -2;   // an empty pocket inside

  struct Patch {
    std::int32_t behind = 0;                             // region the normals point away from; never negative
    std::int32_t ahead = kOutside;                       // region the normals point into, or kOutside, kCavity
    std::vector<std::array<std::int32_t, 3>> triangles;  // counter-clockwise seen from ahead
  };

  std::vector<std::array<double, 3>> points;
  std::vector<Patch> patches;
  std::vector<std::string> region_names;
};

// "liver-outside", "liver-cavity", "liver-tumour": what a patch is called in the mesh file.
inline std::string patch_name(const VolumeBoundary& boundary, const VolumeBoundary::Patch& patch) {
  const std::string ahead = patch.ahead == VolumeBoundary::kOutside  ? "outside"
                            : patch.ahead == VolumeBoundary::kCavity ? "cavity"
                                                                     : boundary.region_names[patch.ahead];
  return boundary.region_names[patch.behind] + "-" + ahead;
}

}  // namespace palpate
