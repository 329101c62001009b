// What is done to the organ, played with the runtime library: the tools' forces, the field at the end, what a step took.
//
//   press      each place is pressed in by half a radius along the same direction on every mesh, from outside
//   drag       the same, then moved across by kDragDistance radii
//   neighbour  a second tool comes beside the first one, which has sunk the surface there
//   measured   press; the tissue answers by its measured curve
//   hold       press, then held for a second while the tissue relaxes
#pragma once

#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "studies/accuracy/places.h"
#include "studies/accuracy/setting.h"

namespace palpate::accuracy {

// The end of one exercise: N on each tool, and m at each sample place.
struct Press {
  std::vector<std::array<double, 3>> forces;
  std::vector<std::array<double, 3>> field;
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Press, forces, field)

struct StepTime {
  double median_us = 0, most_us = 0;  // most: 99 % of the steps take no more
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(StepTime, median_us, most_us)

struct Observation {
  std::vector<Press> presses;
  StepTime touch, shape;      // of steps in contact
  double open_ms = 0;         // opening the bundle and creating the scene, median
  std::uint32_t flags = 0;    // of all steps
  int contact_nodes = 0;      // most under contact at a time
  double farthest_place = 0;  // m: from a place of the study to this mesh's surface
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Observation, presses, touch, shape, open_ms, flags, contact_nodes, farthest_place)

// Errors: OperationError where the bundle cannot be opened or the scene not made of it.
Observation observe(const std::filesystem::path& bundle, const SceneSetting& setting, const StudyPlaces& places);

}  // namespace palpate::accuracy
