// Random scenes of points that wander about a body while grips move and open it, a needle pierces it and a pose moves all of it, beside
// the reference: the winding number of the deformed mesh. deformed_collision_test plays some, collision_fuzz as many as it is asked for.
// The memory of each scene has guard bytes.
#pragma once

#include <palpate/palpate_scene_def.hpp>

#include <cstring>
#include <random>
#include <string>

#include "tests/runtime/touched_box.h"
#include "tests/support/box_corridor.h"
#include "tests/support/deformed_truth.h"
#include "tests/support/fine_body.h"
#include "tests/support/grid_body.h"
#include "tests/support/guarded_memory.h"

namespace palpate::tests {

SceneDef deformed_def();

// A tool with one point and a tool that grips, step by step, beside the true surface that the step meets.
class Watched {
 public:
  // host and fine: the scene's fine surface, or nullptr for the body's own.
  explicit Watched(const TouchedBody& body, const SceneDef& def = deformed_def(), const FineHost* host = nullptr,
                   const BoundFine* fine = nullptr)
      : body_(body),
        fine_(fine),
        surface_(host ? host->surface() : body.body),
        scene_(body.scene(def)),
        contacts_(scene_.get()),
        before_(surface_),
        now_(surface_),
        next_(surface_) {}

  // Moves the point to p while the grips hold. Afterwards height() is the true signed distance (m) of p to the surface that the
  // step met, and moved() how far point and surface moved in the step.
  void step(const Eigen::Vector3d& p, const std::vector<palpate_grip>& grips);
  bool touches() { return palpate_contacts_tool(contacts_, 1)->contact_count > 0; }
  Eigen::Vector3d force() { return Eigen::Vector3d(palpate_contacts_tool(contacts_, 1)->force_raw); }
  double height() const { return height_; }
  double moved() const { return moved_; }
  palpate_step_flags flags() const { return flags_; }
  const DeformedTruth& next() const { return next_; }

 private:
  const TouchedBody& body_;
  const BoundFine* fine_;
  const SurfaceFirst surface_;
  ScenePointer scene_;
  Contacts contacts_;
  DeformedTruth before_, now_, next_;
  Eigen::Vector3d last_ = Eigen::Vector3d::Zero();
  bool known_ = false;
  double moved_ = 0, height_ = 0;
  palpate_step_flags flags_ = 0;
};

// The true surface is read from single-precision displacements.
inline constexpr double kStored = 1e-6;

// A closed surface that moves. It says the same as DeformedTruth, from a ray in place of solid angles and from all triangles that a
// sphere around them does not rule out: some 20 times faster.
class QuickTruth {
 public:
  explicit QuickTruth(const SurfaceFirst& body);
  // displacement: [surface nodes][3] m
  void move(const std::vector<float>& displacement);
  // m: below zero inside.
  double signed_distance(const Eigen::Vector3d& p) const;
  // How many times the surface winds around p.
  int winding(const Eigen::Vector3d& p) const;
  Eigen::Vector3d place(std::int32_t node) const { return place_[node]; }
  // Whether a triangle within `reach` (m) of p has a normal whose cosine with a direction is below `most`.
  bool looks_away(const Eigen::Vector3d& p, double reach, const Eigen::Vector3d& from, double most) const;
  // m, the largest displacement of a node that is or rests within `reach` (m) of p, or of a triangle within it.
  double displaced_within(const Eigen::Vector3d& p, double reach) const;
  // m, the largest distance that any node moved to another truth's place.
  double largest_move(const QuickTruth& other) const;

 private:
  struct Ball {
    Eigen::Vector3d middle;
    double radius;
  };
  Eigen::Vector3d outward(std::size_t triangle) const;
  // Turns the ray to the third axis. It lies along no edge and no face of the bodies.
  static const Eigen::Matrix3d& along_ray();
  // On which side of an edge the ray passes. An edge's two triangles get the same number with the opposite sign.
  double side(std::int32_t from, std::int32_t to, const Eigen::Vector3d& q) const;
  double squared_distance(const Eigen::Vector3d& p, std::size_t triangle) const;

  const SurfaceFirst* body_;
  std::vector<float> moved_by_;
  std::vector<Eigen::Vector3d> place_, seen_;
  std::vector<Ball> balls_;
  mutable std::size_t nearest_before_ = 0;
};

// A step whose contact contradicts the reference by more than the motion of one step.
struct Contradiction {
  std::uint64_t seed;
  int step, tool, point;
  const char* what;
  double height, tolerance;  // m: of the point over the surface that decides
};

std::string sentence_of(const Contradiction& found);

// All but steps and pierced count each tool point of each step.
struct Contradictions {
  long steps = 0, points = 0, near = 0, touched = 0, begun = 0, ended = 0, found = 0;
  long pierced = 0;  // steps in which a needle held the organ
  // Not compared: WORK_DEFERRED; TRACKING_LOST, and after it until the point has been outside; NOT_TOUCHABLE where it matters.
  long deferred = 0, lost = 0, over_held = 0;
  // In contact and out of the surface without the contact, or pulled: compared; not compared, because other contacts change with the
  // end of this one, or REGULARISED or SOLVE_INEXACT says that the surface is not the only one that the contacts could make.
  long out = 0, out_unknown = 0;

  // Of the tool points, those that a flag of their tool excused.
  double excused() const { return static_cast<double>(deferred + lost) / static_cast<double>(std::max(1L, points)); }
};

class Dice {
 public:
  explicit Dice(std::uint64_t seed) : random_(seed) {}
  double between(double low, double high);
  // Each decade between two powers of ten is as likely.
  double decade(double low, double high) { return std::pow(10.0, between(low, high)); }
  int below(std::size_t count) { return static_cast<int>(random_() % count); }
  bool one_in(int count) { return below(static_cast<std::size_t>(count)) == 0; }
  // Each coordinate within 1.
  Eigen::Vector3d direction();

 private:
  std::mt19937_64 random_;
};

inline constexpr double kStep = 1e-3;  // s

// The organ's frame in the world. It goes from pose to pose at velocities that stay for many steps.
class OrganPath {
 public:
  explicit OrganPath(Dice& dice)
      : moves_(!dice.one_in(4)),
        sent_every_(dice.one_in(3) ? 4 : 1),
        speed_(dice.decade(-6, -2.6)),
        turn_(dice.decade(-6, -1.3)) {}

  // One step further.
  void step(Dice& dice);
  // Says where the organ is, if the scene does not know it by the velocities.
  void send(palpate_scene* scene) const;
  // As it was in the step before, and stays.
  void send_before(palpate_scene* scene) const;
  Eigen::Vector3d to_world(const Eigen::Vector3d& p) const { return now_.position + now_.orientation * p; }
  Eigen::Vector3d to_organ(const Eigen::Vector3d& p) const;
  Eigen::Vector3d to_world_before(const Eigen::Vector3d& p) const { return before_.position + before_.orientation * p; }

 private:
  struct Place {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  };
  static Eigen::Quaterniond turn_by(const Eigen::Vector3d& angle);
  // A pose within 10 mm and some 10 degrees of the first one, and the velocities that lead there.
  void choose(Dice& dice);
  static void set(palpate_scene* scene, const Place& place, const Eigen::Vector3d& velocity,
                  const Eigen::Vector3d& angular);

  const bool moves_;
  const int sent_every_;
  const double speed_, turn_;  // m and rad in a step, at most
  int left_ = 0, stepped_ = 0;
  bool is_new_ = false;
  Place now_, before_;
  Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero(), angular_ = Eigen::Vector3d::Zero();  // in a step
};

// Grips that move and open the body.
class RandomGrips {
 public:
  RandomGrips(Dice& dice, const TouchedBody& body, double usual_reach);
  std::vector<palpate_grip> step(int s, Dice& dice);

 private:
  double reach_, speed_;  // m; m in a step
  std::vector<std::int32_t> held_;
  std::vector<Eigen::Vector3d> aim_, at_;
};

// A needle that goes in and out of the body and enters elsewhere, in a third of the scenes. It has dice of its own, so that the other
// scenes are the same as without it.
class RandomNeedle {
 public:
  RandomNeedle(std::uint64_t seed, const TouchedBody& body);
  bool is_there() const { return is_there_; }
  void draw(SceneDef& def) const;
  void step();
  // In this step, or in the one before. to_world: of a place in the organ's frame.
  template <class ToWorld>
  palpate_needle now(bool before, ToWorld to_world) const {
    palpate_needle needle = needle_;
    const Eigen::Vector3d tip = to_world(entry_ + (before ? before_ : depth_) * inwards_),
                          ahead = to_world(entry_ + inwards_) - to_world(entry_);
    Eigen::Map<Eigen::Vector3d>(needle.tip) = tip, Eigen::Map<Eigen::Vector3d>(needle.direction) = ahead.normalized();
    return needle;
  }
  // After a step: whether the needle has moved on in the tissue, so that a repetition of the step meets it elsewhere.
  bool has_gone_on(const palpate_needle_state& state);

 private:
  static constexpr int kPlaces = 8;
  void enter();

  Dice dice_;
  const TouchedBody& body_;
  const bool is_there_;
  const double speed_;  // m in a step
  palpate_needle needle_;
  palpate_needle_state last_ = {};
  double depth_ = 0, before_ = 0, goal_ = 0;  // m, of the tip behind the place where it enters, at rest
  Eigen::Vector3d entry_ = Eigen::Vector3d::Zero(), inwards_ = Eigen::Vector3d::Zero();
};

// A tool point, and what the reference remembers of it.
struct RandomPoint {
  int tool = 0, point = 0;
  bool rides = true;  // it goes where it wants to in the organ's frame, however the organ moves
  double speed = 0;   // m in a step
  Eigen::Vector3d goal, organ, world, organ_before, world_before;
  double moved = 0;   // m in the step, against the organ
  double unseen = 0;  // m, that point and surface moved in the steps before that deferred the test
  Eigen::Vector3d anchor = Eigen::Vector3d::Zero();  // m, the place of its contact at rest, after the last step
  bool touches = false, slips = false;               // after the last step
  bool was_over_held = false;                        // inside, without a contact, over held nodes
  bool blind = false;                                // its tracking was lost, and it has not been outside since
  bool may_be_through = false;                       // it may have left its contact through an opposite face
};

// The surface without one point's contact, and where the point is.
struct WithoutContact {
  // m, over the surface without the contact's own part, and over that which there would be if the contact had ended.
  double own = 0, predicted = 0;
  // m, over the plane of the contact's triangle there.
  double over_plane = -INFINITY;
  Eigen::Vector3d outward = Eigen::Vector3d::Zero();  // of the contact's triangle at rest
  double pulls = 0;                                   // of the contact's force, the part that pulls: -1 .. 1
  bool asked = false;                                 // the point may be out: predicted and what follows is filled
  bool is_known = true;                               // no other contact changed with this one's end
  bool is_far_side = true;                            // the nearest face may be opposite to that of the contact
};

class RandomScene {
 public:
  RandomScene(std::uint64_t seed, const TouchedBody& body, double usual_reach, const FineHost* host,
              const BoundFine* fine);
  RandomScene(const RandomScene&) = delete;

  template <class Tell>
  void step(Contradictions* all, Tell tell) {
    const int s = steps_++;
    organ_.step(dice_);
    // The twin's steps repeat the one before.
    grips_before_ = grip_list_, grip_list_ = grips_.step(s, dice_);
    needle_.step();
    for (RandomPoint& p : points_) move(p, s);
    const double surface_moved = now().largest_move(before());
    save_state();
    std::vector<WithoutContact> without(points_.size());
    for (std::size_t k = 0; k < points_.size(); ++k)
      if (points_[k].touches) without[k] = ask_without(points_[k], points_[k].moved + surface_moved + kStored);
    organ_.send(scene_.get());
    flags_before_ = touch(scene_.get(), contacts_, false, -1);
    if (const palpate_needle_state* needle = palpate_scene_needle_state(scene_.get(), 0)) {
      needle_has_gone_on_ = needle_.has_gone_on(*needle);
      all->pierced += needle->condition >= PALPATE_NEEDLE_PRESSES;
    }
    next().move(displaced(contacts_));
    ++all->steps;
    const std::vector<bool> touches = touching(scene_.get());
    for (std::size_t k = 0; k < points_.size(); ++k) {
      RandomPoint& p = points_[k];
      Seen seen = see(p, touches, surface_moved);
      const char* what = compare(p, seen, without[k], all);
      if (what) ++all->found, tell(Contradiction{seed_, s, p.tool, p.point, what, seen.height, seen.tolerance});
    }
    for (RandomPoint& p : points_) remember(p);
    std::rotate(truths_.begin(), truths_.begin() + 1, truths_.begin() + 3);
  }
  // Bytes that the library has written outside of its memory.
  long written_outside() const { return memory_.written_outside(); }

 private:
  struct Seen {
    double height, tolerance;  // m, over the surface that the step met
    bool touches, others_ended;
    palpate_step_flags flags;  // of the point's tool
  };

  // touches: each point's, after the step. surface_moved: m.
  Seen see(const RandomPoint& p, const std::vector<bool>& touches, double surface_moved);
  void remember(RandomPoint& p) const;

  // Of a step whose surface is not the only one that its contacts could make, so that its repetition tells nothing.
  static constexpr palpate_step_flags kUndecided =
      PALPATE_STEP_WORK_DEFERRED | PALPATE_STEP_REGULARISED | PALPATE_STEP_SOLVE_INEXACT;

  // The surface that the last step met, that which this one meets, and that which it leaves.
  QuickTruth& before() { return truths_[0]; }
  QuickTruth& now() { return truths_[1]; }
  QuickTruth& next() { return truths_[2]; }
  QuickTruth& without_contact() { return truths_[3]; }

  // A third of the scenes have the defaults of the library.
  SceneDef draw_def();
  void draw_points();

  // To a place beside a random node as it was meshed, some mm outside or inside; sometimes to another point's.
  void choose_goal(RandomPoint& p);
  void move(RandomPoint& p, int s);

  // A touch step. again: that of the step before, with one point far outside, which ends its contact.
  palpate_step_flags touch(palpate_scene* scene, Contacts& contacts, bool again, int without,
                           const Eigen::Vector3d& far = Eigen::Vector3d::Zero());
  const palpate_contact* contact_of(const palpate_scene* scene, const RandomPoint& p) const;
  std::vector<bool> touching(const palpate_scene* scene) const;
  // Of the surface's vertices.
  std::vector<float> displaced(Contacts& contacts);

  // Before a step: what the end of a point's contact would leave of the surface. tolerance: m.
  WithoutContact ask_without(const RandomPoint& p, double tolerance);
  // The surface of the last step without the own part of the contact.
  void take_out(const RandomPoint& p, const Eigen::Vector3d& outward, double* pulls);
  double over_plane(const RandomPoint& p, const palpate_contact& contact, const Eigen::Vector3d& outward);
  void save_state();
  // The last step once more, with the point far outside: the library solves for the others alone. False where other contacts came or
  // went with that.
  bool end_in_twin(const RandomPoint& p, const Eigen::Vector3d& outward);
  // Where places slide on although nothing moves, the step and its repetition are two surfaces. A place that slips does so after the
  // solution, which the repetition then begins with.
  bool twin_holds_the_others(const RandomPoint& ended) const;
  Eigen::Vector3d anchor_of(const palpate_contact& contact) const;

  // What is wrong with a point in this step, or nullptr. Sets seen to the distance that says so.
  const char* compare(RandomPoint& p, Seen& seen, WithoutContact& without, Contradictions* all);
  // Over held nodes there is no contact, or one that acts on other nodes: the step says so.
  const char* compare_free(RandomPoint& p, const Seen& seen, bool is_over_held, Contradictions* all);
  const char* compare_in_contact(RandomPoint& p, Seen& seen, WithoutContact& without, bool is_over_held,
                                 Contradictions* all);

  Dice dice_;
  const TouchedBody& body_;
  const FineHost* host_;
  const BoundFine* fine_;
  const SurfaceFirst surface_;
  OrganPath organ_;
  RandomGrips grips_;
  RandomNeedle needle_;
  GuardedMemory memory_;
  palpate_fine_surface view_ = palpate_default_fine_surface();
  double radius_ = 0, friction_ = 0;
  const SceneDef def_;
  ScenePointer scene_, twin_;
  Contacts contacts_, twins_;
  std::vector<QuickTruth> truths_;
  const std::uint64_t seed_;
  Eigen::Vector3d high_;
  int tools_ = 1, steps_ = 0;
  palpate_step_flags flags_before_ = 0;  // of the last step
  bool needle_has_gone_on_ = false;      // in the last step
  std::vector<RandomPoint> points_;
  std::vector<palpate_grip> grip_list_, grips_before_;
  std::vector<std::uint64_t> state_;  // after the last step
  std::size_t state_bytes_ = 0;
};

class RandomScenes {
 public:
  // bump: m; above 0, tools meet finer surfaces of the bodies, with bumps of that height (fine_of).
  explicit RandomScenes(double bump = 0);

  // A seed names the body, the scene's definition and all motions.
  bool is_thin(std::uint64_t seed) const { return seed % 3 == 2; }

  // tell(Contradiction) is called for each of them.
  template <class Tell>
  void play(std::uint64_t seed, int steps, Contradictions* all, Tell tell) const {
    constexpr double usual_reach[3] = {.006, .004, .003};
    const std::size_t b = seed % 3;
    RandomScene scene(seed, *bodies_[b], usual_reach[b], hosts_.empty() ? nullptr : &hosts_[b],
                      hosts_.empty() ? nullptr : fine_[b].get());
    for (int s = 0; s < steps; ++s) scene.step(all, tell);
    if (scene.written_outside() == 0) return;
    ++all->found, tell(Contradiction{seed, steps, 0, 0, "a step wrote outside of the scene's memory", 0, 0});
  }

 private:
  // With a corridor through all of it.
  static TouchedBody pierceable(const DenseBody& dense);
  const TouchedBody block_{pierceable(slotted_block())}, slab_{pierceable(clamped_slab())},
      box_{pierceable(dense_box({}))};
  const TouchedBody* const bodies_[3] = {&block_, &box_, &slab_};
  std::vector<FineHost> hosts_;  // of the bodies; empty: tools meet the bodies' own surfaces
  std::vector<std::unique_ptr<BoundFine>> fine_;
};

}  // namespace palpate::tests
