// A world of the C API as the study plays it.
#pragma once

#include <palpate/palpate.hpp>

#include <Eigen/Dense>
#include <filesystem>
#include <vector>

#include "studies/coupled/coupled_rows.h"

namespace palpate::studies {

// Errors: InputError.
Bundle open_bundle(const std::filesystem::path& file);

// Without limits of force and torque: point contact, no collision.
SceneDef free_scene();
// The same with collision and contacts that only push, as organs that touch need.
SceneDef touching_scene();

palpate_pose pose_at(const Eigen::Vector3d& position);
Eigen::Matrix3d turn_of(const palpate_pose& pose);

struct OrganAt {
  palpate_bundle* bundle;
  palpate_pose pose;
};

class PlayedWorld {
 public:
  // Errors: OperationError.
  PlayedWorld(const std::vector<OrganAt>& organs, const SceneDef& scene, int max_pairs = 0, int max_links = 0);

  palpate_step_flags touch(const std::vector<palpate_tool>& tools = {});
  void place(int organ, const palpate_pose& pose);
  // Errors: OperationError.
  void set_links(const std::vector<palpate_world_link>& links);

  palpate_scene* scene(int organ) const { return world_.scene(organ); }
  const palpate_world* get() const { return world_.get(); }
  const palpate_world_contacts* contacts() const { return contacts_.get(); }
  Eigen::Vector3d on_tool(int tool) const;         // N, without the device's limits
  Eigen::Vector3d torque_on_tool(int tool) const;  // N m, about its reference, without the device's limits
  std::vector<const palpate_world_pair*> pairs() const;
  int pressing() const;                    // pairs with a force
  Eigen::VectorXd shape(int organ) const;  // [3 surface nodes] m

 private:
  World world_;
  std::vector<int> surface_nodes_;
  WorldContacts contacts_{0};
};

// The row of two organs that press: the vertex of the pair against its place on the other organ, whose triangle has these corners. poses: of the organs;
// shapes: [3 surface nodes] m of each, as the world tells them with the pair. Its target is what they have come apart by less the gap that is told.
Row row_of_pair(const palpate_world_pair& pair, const std::array<std::int32_t, 3>& corners,
                const std::vector<palpate_pose>& poses, const std::vector<Eigen::VectorXd>& shapes);

}  // namespace palpate::studies
