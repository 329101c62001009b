#include "studies/validation/pressed_bodies.h"

#include <fmt/format.h>

#include <algorithm>
#include <palpate/palpate.hpp>

#include "formats/errors.h"
#include "studies/timing/timing.h"

namespace palpate::validation {
namespace {

using Eigen::Vector3d;

constexpr double kTick = 1e-3;  // s
constexpr std::int32_t kMostPairs = 1000;
constexpr int kMostSolutions = 3;  // of a body beside the touch, in each step

// A body that is solved in the touch knows all of its nodes; any other has those inside from the bundle's section.
bool has_nodes_inside(const Bundle& bundle, palpate_deformation_model deformation) {
  return deformation == PALPATE_DEFORMATION_LARGE || bundle.describe().has_interior;
}

SceneDef definition(const Bundle& bundle, palpate_deformation_model deformation) {
  SceneDef def;
  def.collision = PALPATE_COLLISION_DEFORMED, def.law = PALPATE_LAW_UNILATERAL;
  def.max_operations = INT64_MAX;
  def.large.deformation = deformation;
  if (has_nodes_inside(bundle, deformation)) def.shape = PALPATE_SHAPE_VOLUME;
  def.motions.motions = bundle.describe().motion_count > 0;
  return def;
}

class Bodies {
 public:
  explicit Bodies(const Pressing& pressing) : pressing_(pressing) {
    const std::size_t count = pressing.bodies.size();
    std::vector<SceneDef> defs;
    std::vector<palpate_world_organ> organs(count, palpate_default_world_organ());
    for (const PressedBody& body : pressing.bodies) {
      bundles_.emplace_back(body.bundle.c_str());
      defs.push_back(definition(bundles_.back(), body.deformation));
      linear_ = linear_ && body.deformation == PALPATE_DEFORMATION_LINEAR;
    }
    const palpate_pose start = pressing.last(0);
    for (std::size_t k = 0; k < count; ++k) organs[k].bundle = bundles_[k].get(), organs[k].def = &defs[k];
    organs.back().pose = &start;
    palpate_world_def def = palpate_default_world_def();
    def.organs = organs.data(), def.organ_count = static_cast<std::int32_t>(count);
    def.max_pairs = kMostPairs, def.friction = pressing.friction;
    world_ = World(def);
  }

  PressedAnswer press() {
    const double begun = studies::processor_seconds();
    WorldContacts contacts = world_.make_contacts();
    PressedAnswer answer;
    for (int s = 0; s <= pressing_.steps + pressing_.rest_steps; ++s) {
      const double share = std::min(1.0, static_cast<double>(s) / pressing_.steps);
      const palpate_step_flags flags = step(share, contacts);
      if (flags && pressing_.refuses_flags && (linear_ || s == pressing_.steps + pressing_.rest_steps))
        throw OperationError(
            fmt::format("bodies pressed on one another: the step at {} of the way raised flags {}", share, flags));
      answer.flagged += flags != 0;
      pressing_.each_step(share, Vector3d(contacts.state(last()).pressed));
    }
    answer.force = Vector3d(contacts.state(last()).pressed);
    for (std::int32_t i = 0; i < contacts->pair_count; ++i) {
      const palpate_world_pair& pair = contacts.pair(i);
      const double force = Vector3d(pair.force).dot(Vector3d(pair.normal));
      if (force <= 0) continue;
      const double* nodes = palpate_bundle_nodes(bundles_[static_cast<std::size_t>(pair.organ[0])].get());
      answer.touches.push_back({pair.organ[0], Vector3d(nodes + 3 * static_cast<std::ptrdiff_t>(pair.node)), force});
    }
    for (std::int32_t k = 0; k <= last(); ++k) answer.u.push_back(shape(k, contacts));
    answer.seconds = studies::processor_seconds() - begun;
    return answer;
  }

 private:
  std::int32_t last() const { return static_cast<std::int32_t>(bundles_.size()) - 1; }

  palpate_step_flags step(double share, WorldContacts& contacts) {
    world_.set_pose(last(), pressing_.last(share));
    for (std::int32_t k = 0; k <= last(); ++k)
      if (bundles_[static_cast<std::size_t>(k)].describe().motion_count > 0)
        palpate_scene_set_motions(world_.scene(k), &share, 1, nullptr);
    const palpate_step_flags flags = world_.touch(nullptr, 0, kTick, contacts);
    for (std::int32_t k = 0; k <= last(); ++k)  // of bodies that are not solved beside the touch it returns -1
      for (int i = 0; i < kMostSolutions && palpate_scene_deform(world_.scene(k)) > 0;) ++i;
    return flags;
  }

  std::vector<Vector3d> shape(std::int32_t organ, const WorldContacts& contacts) {
    const auto k = static_cast<std::size_t>(organ);
    const palpate_bundle_info info = bundles_[k].describe();
    const bool inside = has_nodes_inside(bundles_[k], pressing_.bodies[k].deformation);
    const auto count = static_cast<std::size_t>(inside ? info.node_count : info.surface_node_count);
    std::vector<float> u(3 * count);
    palpate_shape_out out = palpate_default_shape_out();
    out.displacements = u.data(), out.node_capacity = static_cast<std::int32_t>(count);
    world_.shape(organ, contacts, out);
    std::vector<Vector3d> all;
    for (std::size_t n = 0; n < count; ++n) all.emplace_back(u[3 * n], u[3 * n + 1], u[3 * n + 2]);
    return all;
  }

  const Pressing& pressing_;
  std::vector<Bundle> bundles_;
  bool linear_ = true;
  World world_;
};

}  // namespace

PressedAnswer press(const Pressing& pressing) {
  return Bodies(pressing).press();
}

}  // namespace palpate::validation
