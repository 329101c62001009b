// Random worlds of 2 to 4 organs that links of all kinds join, under tools, moving poses and numbers that change. In every step:
// - all numbers are finite, and no force of a link exceeds what bound() states;
// - what a link does to its two organs is equal and opposite in the world, and so is what organs that touch do to one another;
// - a link whose law is missed has a flag;
// - a world that goes on from a saved state gives the same bytes.
#pragma once

#include <cstring>
#include <functional>
#include <map>
#include <random>
#include <string>
#include <utility>

#include "tests/runtime/world/touching_world.h"

namespace palpate::tests {

struct LinkCounts {
  long steps = 0, flagged = 0, broken = 0,
       touching = 0;   // flagged: laws may be missed; touching: organs press one another
  double largest = 0;  // force of a link over bound()
  double missed = 0;   // law of a link in a step without a flag, over what is allowed
  long found = 0;
};

class RandomLinks {
 public:
  using Tell = std::function<void(const std::string&)>;

  RandomLinks(std::uint64_t seed, LinkCounts* counts, Tell tell);

  // Plays the world; from the middle on a second one that begins with the state of the first.
  void play(int steps);

 private:
  struct Played {
    WorldPointer world;
    std::unique_ptr<WorldContacts> contacts;
  };
  struct Placed {
    const TouchedBody* body;
    palpate_pose base, pose;
    Eigen::Vector3d sway;  // m
  };

  int draw(int below) { return static_cast<int>(random_() % static_cast<std::uint64_t>(below)); }
  double between(double low, double high);
  Eigen::Vector3d any_vector(double size) { return {between(-size, size), between(-size, size), between(-size, size)}; }
  void find(const std::string& what);

  // ---- organs ----

  // In a heap, a little apart, or anywhere within some centimetres where they pass through one another.
  void place_organs();
  Played make() const;
  void move_organs(int s);
  Eigen::Quaterniond turn_of(std::size_t organ) const;
  // ---- links ----

  static bool is_free(const TouchedBody& body, std::int32_t node);
  // How much of an end is on nodes that move.
  double free_share(const palpate_world_link& link, int e) const;
  palpate_link_end any_end(std::int32_t* organ);
  // Some ends stand where an end of an earlier link does: so links contradict one another.
  palpate_world_link any_link(std::size_t index);
  void change(palpate_world_link* link);
  void change_links();
  void set_links(const Played& played);

  // ---- steps ----

  // A point that comes down on an organ where organs collide, and a grip that draws on a node of another one.
  std::vector<palpate_tool> tools_at(int s);
  static palpate_step_flags step(Played& played, const std::vector<palpate_tool>& tools);
  void restore();
  void expect_same(palpate_step_flags one, palpate_step_flags other);
  void leaves_nothing();

  // ---- what is looked at ----

  static const palpate_link_state* state(const Played& played, std::size_t link);
  // m/N: what an end gives way by where it gives way least. A disc is on more nodes than a point: a quarter is less than any here has.
  double softness_of(const palpate_world_link& link, int e) const;
  // N: 1,024 times the force that the stiffest link alone needs for the largest target (docs/method.md, section 17), and a clip has three
  // rows. No line is longer than 0.3 m.
  double bound() const;
  void look(palpate_step_flags flags);
  // N, in the world, on the nodes that link l holds of an organ.
  Eigen::Vector3d on_organ(std::size_t organ, std::size_t link);
  void look_at_forces(std::size_t l, double most);
  // The law along the line that the step has used, which is that of the force.
  void look_at_law(std::size_t l);
  void look_at_pairs();

  std::mt19937_64 random_;
  LinkCounts& counts_;
  Tell tell_;
  bool touch_ = false, patch_ = false;
  double friction_ = 0;
  std::vector<Placed> organs_;
  std::vector<palpate_world_link> links_;
  Played now_, restored_;
  int at_ = 0;
  double most_ = 0;  // N
  Eigen::Vector3d point_;
  std::vector<palpate_grip> grips_;
};

}  // namespace palpate::tests
