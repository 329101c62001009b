// Random worlds with all of it: 1 to 3 organs, each linear or under large deformation, that touch, are linked, breathe, bear loads and hold a
// volume, under a tool, a grip, jaws, a needle and a tool that presses with a given force, whose targets wander, jump and vanish. Some of the
// linear ones are cut by a blade that wanders; these have no needle, tell nothing of what is inside, and hold no volume.
// In every step:
// - all numbers are finite;
// - forces and displacements are bounded (random_worlds.cpp says by what).
// At the end everything is let go, and each organ comes back to rest.
#pragma once

#include <functional>
#include <random>
#include <string>

#include "tests/effects/effects.h"

namespace palpate::tests {

struct WorldCounts {
  long steps = 0, flagged = 0, large = 0, touching = 0, found = 0;  // large: steps with a body under large deformation
  long cut = 0;                                                     // faces
  double force = 0, displacement = 0,
         left = 0;  // largest: N; m; m, of what a world that was let go has left of its displacement
};

class RandomWorld {
 public:
  using Tell = std::function<void(const std::string&)>;

  RandomWorld(std::uint64_t seed, WorldCounts* counts, Tell tell);
  // Plays the world, then lets it go.
  void play(int steps);
  // What the seed has drawn, in words.
  std::string text() const;

 private:
  // A number that wanders: two waves, and now and then a jump.
  struct Wander {
    double size[2], rate[2], phase[2], jumped = 0;
  };
  struct Organ {
    SceneDef def;
    palpate_pose base;
    bool holds_volume = false;
    std::vector<palpate_link> links;
    bool is_cut = false;
    struct {
      Eigen::Vector3d place, edge, ahead;  // m, of its middle; half of it; unit
      std::array<Wander, 3> way;
      double toughness = 0;  // J/m^2
    } blade;
  };

  int draw(int below) { return static_cast<int>(random_() % static_cast<std::uint64_t>(below)); }
  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  bool happens(double share) { return between(0, 1) < share; }
  Wander any_wander(double size);
  double at(Wander& wander);
  Eigen::Vector3d at(std::array<Wander, 3>& wander);
  std::array<Wander, 3> any_way(double size) { return {any_wander(size), any_wander(size), any_wander(size)}; }
  const TouchedBody& body() const { return body_of(Store::f32).touched; }
  const TouchedBody& body(const Organ& organ) const;
  palpate_link_end any_end();

  SceneDef any_def();
  void make_organs();
  void let_be_cut(Organ& organ, std::mt19937_64 random);
  void make_links();
  void set_tools();
  void set_organs();
  void set_blade(std::size_t organ);
  void let_go();
  void step(const std::vector<palpate_tool>& tools);
  void look();
  void look_at_rest();
  double displacement_left(std::size_t organ) const;
  palpate_pose pose_of(std::size_t organ, const Eigen::Vector3d& moved) const;
  Eigen::Vector3d in_world(std::size_t organ, const Eigen::Vector3d& p) const;
  Eigen::Vector3d turned(std::size_t organ, const Eigen::Vector3d& v) const;
  void find(const std::string& what);

  std::mt19937_64 random_;
  std::uint64_t seed_;
  WorldCounts& counts_;
  Tell tell_;
  int at_ = 0;
  double dt_ = 1e-3;
  std::vector<Organ> organs_;
  std::vector<palpate_pose> poses_;
  std::vector<palpate_world_link> links_;
  double friction_ = 0;
  WorldPointer world_;
  std::unique_ptr<WorldContacts> contacts_;
  palpate_step_flags flags_ = 0;
  std::vector<std::vector<float>> displacements_, positions_;

  // Tools.
  std::vector<palpate_tool> tools_;
  std::array<Wander, 3> finger_way_, grip_way_, jaws_way_, needle_way_, pushed_way_;
  std::array<Wander, 3> near_way_, force_way_, traction_way_;
  std::array<Wander, 4> amount_way_;
  Wander volume_way_, rest_length_way_;
  std::int32_t of_tool_[5];  // the organ that it acts on
  Eigen::Vector3d finger_, pusher_, on_top_;
  palpate_grip grip_;
  palpate_grasp grasp_;
  palpate_needle needle_;
  palpate_given_force given_;
  bool is_away_[5] = {};
  std::int32_t entries_ = 1;
};

}  // namespace palpate::tests
