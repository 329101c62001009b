#include "studies/accuracy/held_nodes.h"

#include <fmt/format.h>

#include <cmath>
#include <palpate/palpate.hpp>

#include "formats/errors.h"

namespace palpate::accuracy {

HeldAnswer hold_nodes(const std::filesystem::path& bundle_file, std::span<const std::int32_t> nodes,
                      std::span<const Vec3> displacement) {
  const Bundle bundle(bundle_file.c_str());
  palpate_scene_def def = palpate_default_scene_def();
  def.collision = PALPATE_COLLISION_OFF, def.contact = PALPATE_CONTACT_NODE;
  def.max_points = static_cast<std::int32_t>(nodes.size());
  def.max_contact_nodes = 3 * def.max_points;
  def.force_limit = def.force_slew = INFINITY;
  Scene scene(bundle, def);
  Contacts contacts = scene.make_contacts();
  std::vector<palpate_grip> grips(nodes.size());
  for (std::size_t g = 0; g < grips.size(); ++g) {
    grips[g] = palpate_default_grip();
    grips[g].kind = PALPATE_GRIP_NODE, grips[g].node = nodes[g];
    store3(displacement[g], grips[g].displacement);
  }
  palpate_tool tool = palpate_default_tool();
  tool.grips = grips.data(), tool.grip_count = static_cast<std::int32_t>(grips.size());
  std::vector<float> u(3 * static_cast<std::size_t>(bundle.describe().surface_node_count));
  palpate_shape_out out = palpate_default_shape_out();
  out.displacements = u.data(), out.node_capacity = bundle.describe().surface_node_count;
  const auto flags = scene.touch(&tool, 1, 1e-3, contacts) | scene.shape(contacts, out);
  if (flags != 0)
    throw OperationError(
        fmt::format("{}: holding {} nodes raised flags {}", bundle_file.string(), grips.size(), flags));
  HeldAnswer answer;
  for (std::size_t n = 0; 3 * n < u.size(); ++n) answer.u.push_back({u[3 * n], u[3 * n + 1], u[3 * n + 2]});
  answer.force = -1 * load3(contacts.tool(0).force_raw);
  return answer;
}

}  // namespace palpate::accuracy
