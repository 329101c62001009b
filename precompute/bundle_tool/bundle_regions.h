// Where a bundle's organ may be touched and where it is held: boxes and areas.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "precompute/bundle_tool/bundle_file.h"

namespace palpate {

// {"organ": R, "touchable": R, "held": R, "supported": R} with R = {"nodes", "box_mm": [[low], [high]], "area_mm2", "share": of the surface's
// area}. A node's area is a third of that of each triangle around it, so that inner nodes have none. Held is a node that is fixed
// along at least one axis, supported one at a triangle with an elastic foundation. box_mm is null for no nodes. Nodes and triangles that a damaged bundle does not have are passed
// over.
nlohmann::json regions_json(const BundleFile& file);

}  // namespace palpate
