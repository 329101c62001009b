#pragma once

#include "runtime/base/host_struct.h"
#include "runtime/cut/cut_mesh.h"
#include "runtime/include/palpate/palpate_cut.h"
#include "runtime/scene/effect.h"

namespace palpate {

// An organ that is cut while it is touched.
extern const Effect cut_effect;
// Of a scene that has it: the mesh that is left. Its new nodes are the nodes in reserve of the bundle, in their order.
const CutMesh& cut_mesh_of(const palpate_scene& scene);

template <>
inline constexpr std::size_t kLeastStructBytes<palpate_blade> = offsetof(palpate_blade, direction);

}  // namespace palpate
