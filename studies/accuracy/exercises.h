// The exercises: tools press the organ in a scene of the runtime library. Recorded are the tools' forces and the surface's
// displacement at the end, and the time of the steps.
//
//   press      a disc starts outside and presses the site in by half a radius; the direction is the same on every mesh
//   drag       press, then the disc moves along the surface by kDragDistance radii
//   neighbour  press, then a second disc presses beside the first, where the first has lowered the surface
//   measured   press, with forces from the tissue's measured curve
//   hold       press, then the disc stays for a second while the tissue relaxes
#pragma once

#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "studies/accuracy/setting.h"
#include "studies/accuracy/sites.h"

namespace palpate::accuracy {

// The end of one exercise: force on each tool, N, and displacement at each sample point, m.
struct Press {
  std::vector<std::array<double, 3>> forces;
  std::vector<std::array<double, 3>> field;
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Press, forces, field)

struct StepTime {
  double median_us = 0, most_us = 0;  // most_us: the 99th percentile
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(StepTime, median_us, most_us)

struct Observation {
  std::vector<Press> presses;
  StepTime touch, shape;     // of steps in which a tool is in contact
  double open_ms = 0;        // to open the bundle and create the scene, median
  std::uint32_t flags = 0;   // the step flags of all steps, joined
  int contact_nodes = 0;     // largest number in contact in one step
  double farthest_site = 0;  // m: from a site of the study to this mesh's surface
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Observation, presses, touch, shape, open_ms, flags, contact_nodes, farthest_site)

// Errors: OperationError where the bundle cannot be opened or the scene not made of it.
// fine: the surface that tools meet under surface "fine"; nullptr: there is none.
Observation observe(const std::filesystem::path& bundle, const SceneSetting& setting, const StudySites& sites,
                    const StudySurface* fine);

}  // namespace palpate::accuracy
