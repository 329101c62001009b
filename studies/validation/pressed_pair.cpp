#include "studies/validation/pressed_pair.h"

#include <fmt/format.h>

#include <palpate/palpate.hpp>

#include "formats/errors.h"
#include "studies/timing/timing.h"

namespace palpate::validation {
namespace {

using Eigen::Vector3d;

constexpr double kTick = 1e-3;               // s
constexpr int kSteps = 50, kRestSteps = 30;  // of the way; at rest, until places lag no more

SceneDef definition(const Bundle& bundle, bool large) {
  SceneDef def;
  def.collision = PALPATE_COLLISION_DEFORMED, def.law = PALPATE_LAW_UNILATERAL;
  def.max_operations = INT64_MAX;
  if (large) def.large.deformation = PALPATE_DEFORMATION_LARGE;
  def.motions.motions = bundle.describe().motion_count > 0;
  return def;
}

class Pressing {
 public:
  explicit Pressing(const PressedPair& pair)
      : pair_(pair), bundles_{Bundle(pair.bundles[0].c_str()), Bundle(pair.bundles[1].c_str())} {
    SceneDef defs[2];
    palpate_world_organ organs[2] = {palpate_default_world_organ(), palpate_default_world_organ()};
    const palpate_pose start = pair.second(0);
    for (std::size_t k = 0; k < 2; ++k) {
      defs[k] = definition(bundles_[k], pair.large);
      organs[k].bundle = bundles_[k].get(), organs[k].def = &defs[k];
      has_motion_[k] = defs[k].motions.motions;
    }
    organs[1].pose = &start;
    palpate_world_def def = palpate_default_world_def();
    def.organs = organs, def.organ_count = 2, def.max_pairs = 1000;
    world_ = World(def);
  }

  void step(double share, WorldContacts& contacts) {
    world_.set_pose(1, pair_.second(share));
    for (std::int32_t k = 0; k < 2; ++k)
      if (has_motion_[static_cast<std::size_t>(k)]) palpate_scene_set_motions(world_.scene(k), &share, 1, nullptr);
    const palpate_step_flags flags = world_.touch(nullptr, 0, kTick, contacts);
    if (flags && (!pair_.large || share == 1))
      throw OperationError(
          fmt::format("two bodies pressed on one another: the step at {} of the way raised flags {}", share, flags));
  }

  PairAnswer press() {
    const double begun = studies::processor_seconds();
    WorldContacts contacts = world_.make_contacts();
    for (int s = 0; s <= kSteps + kRestSteps; ++s) step(std::min(1.0, static_cast<double>(s) / kSteps), contacts);
    PairAnswer answer;
    answer.force = Vector3d(contacts.state(0).pressed);
    for (std::int32_t i = 0; i < contacts->pair_count; ++i) {
      const palpate_world_pair& pair = contacts.pair(i);
      const double force = Vector3d(pair.force).dot(Vector3d(pair.normal));
      if (force <= 0) continue;
      const double* nodes = palpate_bundle_nodes(bundles_[static_cast<std::size_t>(pair.organ[0])].get());
      answer.touches.push_back({pair.organ[0], Vector3d(nodes + 3 * static_cast<std::ptrdiff_t>(pair.node)), force});
    }
    for (std::int32_t k = 0; k < 2; ++k) answer.u[static_cast<std::size_t>(k)] = shape(k, contacts);
    answer.seconds = studies::processor_seconds() - begun;
    return answer;
  }

 private:
  std::vector<Vector3d> shape(std::int32_t organ, const WorldContacts& contacts) {
    const auto count =
        static_cast<std::size_t>(bundles_[static_cast<std::size_t>(organ)].describe().surface_node_count);
    std::vector<float> u(3 * count);
    palpate_shape_out out = palpate_default_shape_out();
    out.displacements = u.data(), out.node_capacity = static_cast<std::int32_t>(count);
    world_.shape(organ, contacts, out);
    std::vector<Vector3d> all;
    for (std::size_t n = 0; n < count; ++n) all.emplace_back(u[3 * n], u[3 * n + 1], u[3 * n + 2]);
    return all;
  }

  const PressedPair& pair_;
  std::array<Bundle, 2> bundles_;
  std::array<bool, 2> has_motion_{};
  World world_;
};

}  // namespace

PairAnswer press(const PressedPair& pair) {
  return Pressing(pair).press();
}

}  // namespace palpate::validation
