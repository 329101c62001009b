// What a touch takes by what a scene has of organs, pairs, modes, links, grips and places of a needle.
#pragma once

#include <nlohmann/json.hpp>

#include "studies/scenes/baked.h"

namespace palpate::scenes {

// [{axis, setting, count, median_us, p90_us, worst_us, ratio, flags}]: processor time of the touching thread. ratio: median over that of one organ with one
// tool, measured just before the axis; flags: all that the touches raised. The first row is that one. Rows
// of pairs whose bodies are solved beside the touch also have solutions_hz: solutions of each body in a second.
std::vector<nlohmann::ordered_json> measure_costs(const BakedOrgan& baked, const ScenesOptions& options);

// A stack of organs, the second one turned over on the first one and so on, `apart` m farther away than where they touch first.
std::vector<OrganAt> stack_of(palpate_bundle* bundle, const Box& box, int count, double apart, double touching_gap);

// Springs between middles of triangles of organ 0 and 1; rest_share: of the distance between their ends.
std::vector<palpate_world_link> springs_between(const std::vector<SurfacePlace>& places,
                                                const std::vector<OrganAt>& organs, double rest_share,
                                                double stiffness);

// A needle at the entry of the way; its tip at `depth` m and `aside` m beside the way.
palpate_needle needle_on(const Way& way, double depth, double spacing, double aside = 0);

}  // namespace palpate::scenes
