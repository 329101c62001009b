// Worlds of the box bundle, and their result in memory of its own.
#pragma once

#include <Eigen/Geometry>

#include <palpate/palpate_scene_def.hpp>
#include "tests/runtime/touched_box.h"

namespace palpate::tests {

struct WorldDestroyer {
  void operator()(palpate_world* world) const { palpate_world_destroy(world); }
};
using WorldPointer = std::unique_ptr<palpate_world, WorldDestroyer>;

inline palpate_pose pose_at(const Eigen::Vector3d& position,
                            const Eigen::Quaterniond& turn = Eigen::Quaterniond::Identity()) {
  palpate_pose pose = palpate_default_pose();
  Eigen::Map<Eigen::Vector3d>(pose.position) = position;
  pose.orientation[0] = turn.w(), pose.orientation[1] = turn.x(), pose.orientation[2] = turn.y(),
  pose.orientation[3] = turn.z();
  return pose;
}

inline palpate_world_organ organ_of(palpate_bundle* bundle, const SceneDef* def, const palpate_pose* pose) {
  palpate_world_organ organ = palpate_default_world_organ();
  organ.bundle = bundle, organ.def = def, organ.pose = pose;
  return organ;
}

inline WorldPointer world_of(const std::vector<palpate_world_organ>& organs, palpate_error* error = nullptr) {
  palpate_world_def def = palpate_default_world_def();
  def.organs = organs.data(), def.organ_count = static_cast<std::int32_t>(organs.size());
  palpate_world* world = nullptr;
  palpate_world_create(&def, &world, error);
  return WorldPointer(world);
}

struct WorldContacts {
  explicit WorldContacts(const palpate_world* world) : memory(palpate_world_contacts_bytes(world) / 8 + 1) {}
  palpate_world_contacts* get() { return reinterpret_cast<palpate_world_contacts*>(memory.data()); }
  palpate_world_contacts* operator->() { return get(); }
  std::size_t bytes() const { return memory.size() * sizeof memory[0]; }
  const palpate_world_tool_state& tool(std::int32_t i) { return *palpate_world_contacts_tool(get(), i); }
  const palpate_world_organ_state& state(std::int32_t k) { return *palpate_world_contacts_state(get(), k); }
  const palpate_contacts& organ(std::int32_t k) { return *palpate_world_contacts_organ(get(), k); }
  std::vector<std::uint64_t> memory;
};

}  // namespace palpate::tests
