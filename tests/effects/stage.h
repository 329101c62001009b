// A scene of effects in time: who touches what in each of 200 steps.
//
// The box is 60 x 50 x 40 mm, held at x = 0. A finger comes down on its top, drags, leaves, comes again and drags; a grip draws on the face
// y = 50 mm; jaws pull and turn the bottom; a needle goes in at y = 0; links hold the face y = 50 mm; a second box comes against x = 60 mm. In
// the last 40 steps everything stands still. A blade cuts a slit near the support. A pusher presses the bottom with a given force, and a plate the edge between the top and x = 60 mm. The organ is somewhere in the world, turned.
#pragma once

#include "tests/effects/effects.h"

namespace palpate::tests {

inline constexpr int kSteps = 200, kStandsFrom = 160, kHoldsVolumeFrom = 80, kCutsFrom = 60;
// Between these steps the finger is not sent, and the jaws are open; they close anew on tissue that others hold.
inline constexpr int kFingerIsAway[] = {107, 113}, kJawsAreOpen[] = {92, 98};
inline constexpr std::int32_t kIdOfFinger = 3, kIdOfGrip = 4, kIdOfJaws = 5, kIdOfNeedle = 6, kIdOfPusher = 7;
inline constexpr double kStepTime = 1e-3;
inline constexpr double kPairFriction = 0.3, kFingerFriction = 0.4, kFingerRadius = 0.004, kPlateFriction = 0.3,
                        kToughness = 2;  // J/m^2
// Unit, of the plate that presses the edge between the top and the face x = 60 mm.
inline const Eigen::Vector3d kPlateNormal = Eigen::Vector3d(-1, 0, -1).normalized();

class Stage {
 public:
  // Makes the scene, or keeps the refusal.
  explicit Stage(const SceneOfEffects& of);
  // Goes on from the state of another one with the same scene.
  void restore(const Stage& from);

  const palpate_error& refusal() const { return refusal_; }
  bool made() const { return scene_ || world_; }
  void step(int s);

  int organs() const { return world_ ? 2 : 1; }
  palpate_scene* scene(int organ) { return world_ ? palpate_world_scene(world_.get(), organ) : scene_.get(); }
  const palpate_contacts& contacts(int organ) { return world_ ? world_contacts_->organ(organ) : *contacts_->get(); }
  palpate_world* world() { return world_.get(); }
  WorldContacts& world_contacts() { return *world_contacts_; }
  // As the host means it, in the frame of organ 0; the scene gets it in the world.
  const palpate_tool& tool(int t) const { return tools_[t]; }
  int tool_of_grasp() const { return tool_of_grasp_; }
  int tool_of_needle() const { return tool_of_needle_; }
  int tool_of_pusher() const { return tool_of_pusher_; }
  // N, in the frame of organ 0.
  const Eigen::Vector3d& pushed() const { return pushed_; }
  const Eigen::Vector4d& amounts() const { return amounts_; }
  double held_volume(int k) const { return held_volume_[k]; }  // m^3; NaN: none is held
  // m, in each organ's frame: where the plate is that presses the organ.
  const Eigen::Vector3d& plate() const { return plate_; }
  // N on each dof, what the loads bear on an organ, in its frame.
  Eigen::VectorXd loads(int organ) const;
  const palpate_pose& pose(int organ) const { return poses_[organ]; }
  const std::vector<palpate_link>& links() const { return links_; }
  const std::vector<palpate_world_link>& world_links() const { return world_links_; }
  palpate_step_flags flags = 0;

  // A point or direction of an organ in the world, and a direction back.
  Eigen::Vector3d in_world(int organ, const Eigen::Vector3d& p) const;
  Eigen::Vector3d direction_in_world(int organ, const Eigen::Vector3d& v) const;
  Eigen::Vector3d direction_in_organ(const double* v) const;

 private:
  void move_tools(int s);
  void send_tools();
  palpate_pose pose_of_second(double nearer, double aside) const;
  void move_organs(int s);
  void set_loads(int s);
  void set_plate(int s);
  void set_links(int s);
  void set_blade(int s);
  Eigen::Vector3d rest_of(const palpate_link_end& end) const;

  SceneOfEffects of_;
  const TouchedBody& body_;
  palpate_error refusal_ = {};
  ScenePointer scene_;
  std::unique_ptr<Contacts> contacts_;
  WorldPointer world_;
  std::unique_ptr<WorldContacts> world_contacts_;
  palpate_pose poses_[2];
  std::vector<palpate_tool> tools_, sent_;
  Eigen::Vector3d finger_, sent_finger_, pusher_, sent_pusher_, pushed_ = Eigen::Vector3d::Zero();
  palpate_given_force given_force_ = palpate_default_given_force();
  palpate_grip grip_;
  palpate_grasp grasp_, sent_grasp_;
  palpate_needle needle_, sent_needle_;
  std::vector<palpate_link> links_;
  std::vector<palpate_world_link> world_links_;
  Eigen::Vector4d amounts_ = Eigen::Vector4d::Zero();
  Eigen::Vector3d plate_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d force_ = Eigen::Vector3d::Zero(), traction_ = force_;  // N in the world; Pa in each organ's frame
  double apart_[2] = {};                                                 // m, of the ends of the world's links at first
  double held_volume_[2] = {NAN, NAN}, volume_before_[2] = {0, 0};
  int tool_of_grasp_ = -1, tool_of_needle_ = -1, tool_of_pusher_ = -1;
};

}  // namespace palpate::tests
