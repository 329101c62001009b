// Random scenes of points that wander about a body while grips move and open it, a needle pierces it and a pose moves all of it, beside
// the reference: the winding number of the deformed mesh. deformed_collision_test plays some, collision_fuzz as many as it is asked for.
// The memory of each scene has guard bytes.
#pragma once

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

inline palpate_scene_def deformed_def() {
  palpate_scene_def def = unlimited_def();
  def.collision = PALPATE_COLLISION_DEFORMED, def.contact = PALPATE_CONTACT_POINT;
  return def;
}

// A tool with one point and a tool that grips, step by step, beside the true surface that the step meets.
class Watched {
 public:
  // host and fine: the scene's fine surface, or nullptr for the body's own.
  explicit Watched(const TouchedBody& body, const palpate_scene_def& def = deformed_def(),
                   const FineHost* host = nullptr, const BoundFine* fine = nullptr)
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
  void step(const Eigen::Vector3d& p, const std::vector<palpate_grip>& grips) {
    before_ = now_, now_ = next_;
    moved_ = (known_ ? (p - last_).norm() : 0) + now_.largest_move(before_);
    const palpate_tool tools[2] = {tool_of(grips), point_tool(p.data())};
    flags_ = palpate_scene_touch(scene_.get(), tools, 2, 1e-3, contacts_.get(), contacts_.bytes());
    height_ = now_.signed_distance(p);
    const std::vector<float> u = displacements(scene_.get(), contacts_.get(), body_.body.surface_nodes);
    next_.move(fine_ ? fine_->moved_by(u) : u);
    last_ = p, known_ = true;
  }
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
  explicit QuickTruth(const SurfaceFirst& body) : body_(&body), place_(body.surface_nodes), seen_(body.surface_nodes) {
    move(std::vector<float>(3 * static_cast<std::size_t>(body.surface_nodes), 0.f));
  }
  // displacement: [surface nodes][3] m
  void move(const std::vector<float>& displacement) {
    if (displacement == moved_by_) return;
    moved_by_ = displacement;
    for (std::int32_t n = 0; n < body_->surface_nodes; ++n) {
      place_[n] = Eigen::Vector3d(body_->mesh.nodes[n].data()) +
                  Eigen::Map<const Eigen::Vector3f>(&displacement[3 * n]).cast<double>();
      seen_[n] = along_ray() * place_[n];
    }
    balls_.clear();
    for (const auto& t : body_->triangles) {
      const Eigen::Vector3d middle = (place_[t[0]] + place_[t[1]] + place_[t[2]]) / 3;
      double squared = 0;
      for (const std::int32_t n : t) squared = std::max(squared, (place_[n] - middle).squaredNorm());
      balls_.push_back({middle, std::sqrt(squared)});
    }
  }
  // m: below zero inside.
  double signed_distance(const Eigen::Vector3d& p) const {
    double nearest = squared_distance(p, nearest_before_), reach = std::sqrt(nearest);
    for (std::size_t f = 0; f < balls_.size(); ++f) {
      const double limit = reach + balls_[f].radius;
      if ((balls_[f].middle - p).squaredNorm() > limit * limit) continue;
      const double squared = squared_distance(p, f);
      if (squared >= nearest) continue;
      nearest = squared, reach = std::sqrt(squared), nearest_before_ = f;
    }
    return winding(p) > 0 ? -reach : reach;
  }
  // How many times the surface winds around p.
  int winding(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d q = along_ray() * p;
    int turns = 0;
    for (const auto& t : body_->triangles) {
      const Eigen::Vector3d &a = seen_[t[0]], &b = seen_[t[1]], &c = seen_[t[2]];
      if ((a[0] < q[0]) == (b[0] < q[0]) && (b[0] < q[0]) == (c[0] < q[0])) continue;
      if ((a[1] < q[1]) == (b[1] < q[1]) && (b[1] < q[1]) == (c[1] < q[1])) continue;
      const double ab = side(t[0], t[1], q), bc = side(t[1], t[2], q), ca = side(t[2], t[0], q);
      if (!((ab > 0 && bc > 0 && ca > 0) || (ab < 0 && bc < 0 && ca < 0))) continue;
      const double height = (bc * a[2] + ca * b[2] + ab * c[2]) / (ab + bc + ca);
      if (height > q[2]) turns += ab > 0 ? 1 : -1;
    }
    return turns;
  }
  Eigen::Vector3d place(std::int32_t node) const { return place_[node]; }
  // Whether a triangle within `reach` (m) of p has a normal whose cosine with a direction is below `most`.
  bool looks_away(const Eigen::Vector3d& p, double reach, const Eigen::Vector3d& from, double most) const {
    for (std::size_t f = 0; f < balls_.size(); ++f)
      if (squared_distance(p, f) < reach * reach && outward(f).dot(from) < most) return true;
    return false;
  }
  // m, the largest distance that any node moved to another truth's place.
  double largest_move(const QuickTruth& other) const {
    double most = 0;
    for (std::size_t n = 0; n < place_.size(); ++n) most = std::max(most, (place_[n] - other.place_[n]).squaredNorm());
    return std::sqrt(most);
  }

 private:
  struct Ball {
    Eigen::Vector3d middle;
    double radius;
  };
  Eigen::Vector3d outward(std::size_t triangle) const {
    const auto& t = body_->triangles[triangle];
    return (place_[t[1]] - place_[t[0]]).cross(place_[t[2]] - place_[t[0]]).normalized();
  }
  // Turns the ray to the third axis. It lies along no edge and no face of the bodies.
  static const Eigen::Matrix3d& along_ray() {
    static const Eigen::Matrix3d turn =
        Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d(.5377, .2713, .8019), Eigen::Vector3d::UnitZ())
            .toRotationMatrix();
    return turn;
  }
  // On which side of an edge the ray passes. An edge's two triangles get the same number with the opposite sign.
  double side(std::int32_t from, std::int32_t to, const Eigen::Vector3d& q) const {
    if (from > to) return -side(to, from, q);
    const Eigen::Vector3d &a = seen_[from], &b = seen_[to];
    return (b[0] - a[0]) * (q[1] - a[1]) - (b[1] - a[1]) * (q[0] - a[0]);
  }
  double squared_distance(const Eigen::Vector3d& p, std::size_t triangle) const {
    const auto& t = body_->triangles[triangle];
    const Eigen::Vector3d a = place_[t[0]] - p, b = place_[t[1]] - p, c = place_[t[2]] - p;
    double k[3];
    return closest_on_triangle({}, {a[0], a[1], a[2]}, {b[0], b[1], b[2]}, {c[0], c[1], c[2]}, k);
  }

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

inline std::string sentence_of(const Contradiction& found) {
  char text[240];
  std::snprintf(
      text, sizeof text,
      "seed %llu, step %d, tool %d, point %d: %s; the point is %.6f mm over the surface, the tolerance is %.6f mm",
      static_cast<unsigned long long>(found.seed), found.step, found.tool, found.point, found.what, 1e3 * found.height,
      1e3 * found.tolerance);
  return text;
}

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
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(random_() >> 11) / 9007199254740992.0;
  }
  // Each decade between two powers of ten is as likely.
  double decade(double low, double high) { return std::pow(10.0, between(low, high)); }
  int below(std::size_t count) { return static_cast<int>(random_() % count); }
  bool one_in(int count) { return below(static_cast<std::size_t>(count)) == 0; }
  // Each coordinate within 1.
  Eigen::Vector3d direction() {
    const double x = between(-1, 1), y = between(-1, 1), z = between(-1, 1);
    return {x, y, z};
  }

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
  void step(Dice& dice) {
    if (!moves_) return;
    before_ = now_;
    is_new_ = left_ == 0;
    if (left_ == 0) choose(dice);
    --left_, ++stepped_;
    now_.position += velocity_;
    now_.orientation = turn_by(angular_) * now_.orientation;
  }
  // Says where the organ is, if the scene does not know it by the velocities.
  void send(palpate_scene* scene) const {
    if (moves_ && (is_new_ || stepped_ % sent_every_ == 0)) set(scene, now_, velocity_ / kStep, angular_ / kStep);
  }
  // As it was in the step before, and stays.
  void send_before(palpate_scene* scene) const {
    if (moves_) set(scene, before_, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
  }
  Eigen::Vector3d to_world(const Eigen::Vector3d& p) const { return now_.position + now_.orientation * p; }
  Eigen::Vector3d to_organ(const Eigen::Vector3d& p) const {
    return now_.orientation.conjugate() * (p - now_.position);
  }
  Eigen::Vector3d to_world_before(const Eigen::Vector3d& p) const { return before_.position + before_.orientation * p; }

 private:
  struct Place {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  };
  static Eigen::Quaterniond turn_by(const Eigen::Vector3d& angle) {
    const double length = angle.norm();
    if (!(length > 0)) return Eigen::Quaterniond::Identity();
    return Eigen::Quaterniond(Eigen::AngleAxisd(length, angle / length));
  }
  // A pose within 10 mm and some 10 degrees of the first one, and the velocities that lead there.
  void choose(Dice& dice) {
    const Eigen::Vector3d way = .01 * dice.direction() - now_.position;
    const Eigen::AngleAxisd turn(turn_by(.2 * dice.direction()) * now_.orientation.conjugate());
    left_ = static_cast<int>(std::clamp(std::max(way.norm() / speed_, turn.angle() / turn_), 1.0, 60.0));
    velocity_ = way * std::min(1.0 / left_, speed_ / way.norm());
    angular_ = turn.axis() * std::min(turn.angle() / left_, turn_);
  }
  static void set(palpate_scene* scene, const Place& place, const Eigen::Vector3d& velocity,
                  const Eigen::Vector3d& angular) {
    palpate_pose pose = palpate_default_pose();
    const Eigen::Quaterniond& q = place.orientation;
    Eigen::Map<Eigen::Vector3d>(pose.position) = place.position;
    Eigen::Map<Eigen::Vector4d>(pose.orientation) = Eigen::Vector4d(q.w(), q.x(), q.y(), q.z());
    Eigen::Map<Eigen::Vector3d>(pose.velocity) = velocity;
    Eigen::Map<Eigen::Vector3d>(pose.angular_velocity) = angular;
    if (palpate_scene_set_pose(scene, &pose, nullptr) != PALPATE_OK) throw std::logic_error("a pose was refused");
  }

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
  RandomGrips(Dice& dice, const TouchedBody& body, double usual_reach) {
    const bool is_wide = dice.one_in(3);
    reach_ = is_wide ? .0173 : usual_reach, speed_ = is_wide ? dice.decade(-4, -3) : 2e-4;
    const int count = dice.one_in(6) ? dice.below(3) : 3;
    for (int g = 0; g < count; ++g) held_.push_back(body.touchable[dice.below(body.touchable.size())]);
    std::sort(held_.begin(), held_.end());
    held_.erase(std::unique(held_.begin(), held_.end()), held_.end());
    for (std::size_t g = 0; g < held_.size(); ++g) aim_.push_back(reach_ * dice.direction());
    at_.resize(held_.size(), Eigen::Vector3d::Zero());
  }
  std::vector<palpate_grip> step(int s, Dice& dice) {
    std::vector<palpate_grip> grips;
    for (std::size_t g = 0; g < held_.size(); ++g) {
      if (s % 150 == 50 * static_cast<int>(g)) aim_[g] = reach_ * dice.direction();
      const Eigen::Vector3d to = aim_[g] - at_[g];
      at_[g] += to * std::min(1.0, speed_ / std::max(1e-12, to.norm()));
      grips.push_back(grip_at_node(held_[g], at_[g]));
    }
    return grips;
  }

 private:
  double reach_, speed_;  // m; m in a step
  std::vector<std::int32_t> held_;
  std::vector<Eigen::Vector3d> aim_, at_;
};

// A needle that goes in and out of the body and enters elsewhere, in a third of the scenes. It has dice of its own, so that the other
// scenes are the same as without it.
class RandomNeedle {
 public:
  RandomNeedle(std::uint64_t seed, const TouchedBody& body)
      : dice_(seed ^ 0x6e6565646c65), body_(body), is_there_(dice_.one_in(3)), speed_(dice_.decade(-4.5, -3)) {
    needle_ = palpate_default_needle();
    needle_.radius = dice_.decade(-4, -2.7), needle_.spacing = dice_.decade(-2.7, -2);
    needle_.friction = dice_.one_in(3) ? 0 : dice_.decade(-1, 1);
    needle_.cutting_force = dice_.one_in(3) ? 0 : dice_.decade(-3, -1);
    needle_.puncture_force = needle_.cutting_force * dice_.between(0, 4);
    if (is_there_) enter();
  }
  bool is_there() const { return is_there_; }
  void draw(palpate_scene_def& def) const {
    if (is_there_) def.needles = 1, def.needle_places = kPlaces;
  }
  void step() {
    if (!is_there_) return;
    before_ = depth_;
    const double way = goal_ - depth_;
    depth_ += std::clamp(way, -speed_, speed_);
    if (std::abs(way) > speed_) return;
    if (goal_ < 0) return enter();
    goal_ = dice_.one_in(2) ? dice_.between(.001, .03) : -.003;
  }
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
  bool has_gone_on(const palpate_needle_state& state) {
    const bool is_still = state.slipping == 0 && state.depth == last_.depth && state.places == last_.places &&
                          state.condition == last_.condition && state.condition != PALPATE_NEEDLE_CUTS;
    last_ = state;
    return !is_still;
  }

 private:
  static constexpr int kPlaces = 8;
  void enter() {
    const auto triangle = static_cast<std::int32_t>(dice_.below(body_.body.triangles.size()));
    const Eigen::Vector3d k(dice_.between(.1, 1), dice_.between(.1, 1), dice_.between(.1, 1));
    ++needle_.id, needle_.triangle = triangle;
    Eigen::Map<Eigen::Vector3d>(needle_.barycentric) = k / k.sum();
    entry_ = body_.place(triangle, k / k.sum());
    inwards_ = (.5 * dice_.direction() - body_.outward(triangle)).normalized();
    before_ = depth_ = -.002, goal_ = dice_.between(.005, .03);
  }

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
              const BoundFine* fine)
      : dice_(seed),
        body_(body),
        host_(host),
        fine_(fine),
        surface_(host ? host->surface() : body.body),
        organ_(dice_),
        grips_(dice_, body, usual_reach),
        needle_(seed, body),
        def_(draw_def()),
        scene_(body.scene(def_)),
        twin_(body.scene(def_)),
        contacts_(scene_.get()),
        twins_(twin_.get()),
        truths_(4, QuickTruth(surface_)),
        seed_(seed) {
    draw_points();
  }
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
  Seen see(const RandomPoint& p, const std::vector<bool>& touches, double surface_moved) {
    bool others_ended = false;
    for (std::size_t k = 0; k < points_.size(); ++k)
      others_ended = others_ended || (points_[k].touches && !touches[k] && &points_[k] != &p);
    // What is tested behind a contact that ends meets the surface without it.
    const double moved = p.moved + surface_moved + (others_ended ? next().largest_move(now()) : 0);
    const bool touches_now = touches[static_cast<std::size_t>(&p - points_.data())];
    return {now().signed_distance(p.organ), moved + p.unseen + kStored, touches_now, others_ended,
            palpate_contacts_tool(contacts_, p.tool)->flags};
  }
  void remember(RandomPoint& p) const {
    const palpate_contact* contact = contact_of(scene_.get(), p);
    p.touches = contact != nullptr;
    if (contact) p.anchor = anchor_of(*contact), p.slips = contact->state == PALPATE_CONTACT_SLIPS;
  }

  // Of a step whose surface is not the only one that its contacts could make, so that its repetition tells nothing.
  static constexpr palpate_step_flags kUndecided =
      PALPATE_STEP_WORK_DEFERRED | PALPATE_STEP_REGULARISED | PALPATE_STEP_SOLVE_INEXACT;

  // The surface that the last step met, that which this one meets, and that which it leaves.
  QuickTruth& before() { return truths_[0]; }
  QuickTruth& now() { return truths_[1]; }
  QuickTruth& next() { return truths_[2]; }
  QuickTruth& without_contact() { return truths_[3]; }

  // A third of the scenes have the defaults of the library.
  palpate_scene_def draw_def() {
    const bool is_shipped = dice_.one_in(3);
    palpate_scene_def def = is_shipped ? palpate_default_scene_def() : deformed_def();
    constexpr palpate_contact_model models[] = {PALPATE_CONTACT_POINT, PALPATE_CONTACT_POINT, PALPATE_CONTACT_TRIANGLE,
                                                PALPATE_CONTACT_NODE, PALPATE_CONTACT_PATCH};
    constexpr palpate_contact_law laws[] = {PALPATE_LAW_STICKING, PALPATE_LAW_STICKING, PALPATE_LAW_SLIDING,
                                            PALPATE_LAW_UNILATERAL, PALPATE_LAW_COULOMB};
    def.collision = PALPATE_COLLISION_DEFORMED, def.report = PALPATE_REPORT_CONTACTS;
    def.contact = models[dice_.below(std::size(models))], def.law = laws[dice_.below(std::size(laws))];
    // The fewest that a step needs are some 40,000, and on a fine surface 160,000.
    const double least = host_ ? 200000 : 45000, most = host_ ? 300000 : 100000;
    if (is_shipped && dice_.one_in(2)) def.max_operations = static_cast<std::int64_t>(dice_.between(least, most));
    radius_ = def.contact == PALPATE_CONTACT_PATCH ? dice_.between(0, .006) : 0;
    friction_ = dice_.between(0, 1);
    if (host_) view_ = host_->view(), def.fine_surface = &view_;
    needle_.draw(def);
    def.allocator = memory_.allocator();
    return def;
  }
  void draw_points() {
    // A step on a fine surface takes several times as long.
    const int count = 1 + dice_.below(host_ ? 2 : 4);
    tools_ = count > 1 ? 1 + dice_.below(2) : 1;
    high_ = body_.node(0);
    for (std::int32_t n = 0; n < body_.body.surface_nodes; ++n) high_ = high_.cwiseMax(body_.node(n));
    int in_tool[3] = {};
    for (int k = 0; k < count; ++k) {
      RandomPoint p;
      p.tool = tools_ == 1 || k < (count + 1) / 2 ? 1 : 2, p.point = in_tool[p.tool]++;
      p.rides = !dice_.one_in(3);
      p.organ = p.goal = high_ + Eigen::Vector3d::Constant(.01 * (1 + k));
      p.world = p.organ, p.organ_before = p.organ, p.world_before = p.world;
      points_.push_back(p);
    }
  }

  // To a place beside a random node as it was meshed, some mm outside or inside; sometimes to another point's.
  void choose_goal(RandomPoint& p) {
    p.goal = body_.node(dice_.below(body_.body.surface_nodes)) + dice_.between(0, .012) * dice_.direction();
    if (dice_.one_in(4)) p.goal = points_[dice_.below(points_.size())].goal + .003 * dice_.direction();
    p.speed = dice_.decade(-5, -2.3);
  }
  void move(RandomPoint& p, int s) {
    if ((p.goal - p.organ).norm() < 1e-9 || s % 97 == 0) choose_goal(p);
    p.organ_before = p.organ, p.world_before = p.world;
    const auto ahead = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) -> Eigen::Vector3d {
      const Eigen::Vector3d way = to - from;
      return from + way * std::min(1.0, p.speed / std::max(1e-12, way.norm()));
    };
    if (p.rides)
      p.organ = ahead(p.organ, p.goal), p.world = organ_.to_world(p.organ);
    else
      p.world = ahead(p.world, organ_.to_world(p.goal)), p.organ = organ_.to_organ(p.world);
    p.moved = (p.organ - p.organ_before).norm();
  }

  // A touch step. again: that of the step before, with one point far outside, which ends its contact.
  palpate_step_flags touch(palpate_scene* scene, Contacts& contacts, bool again, int without,
                           const Eigen::Vector3d& far = Eigen::Vector3d::Zero()) {
    std::vector<double> places[3];
    for (std::size_t k = 0; k < points_.size(); ++k) {
      const RandomPoint& p = points_[k];
      const Eigen::Vector3d at = static_cast<int>(k) == without ? far : again ? p.world_before : p.world;
      places[p.tool].insert(places[p.tool].end(), at.data(), at.data() + 3);
    }
    palpate_tool tools[3] = {tool_of(again ? grips_before_ : grip_list_)};
    const palpate_needle needle = needle_.now(
        again, [&](const Eigen::Vector3d& p) { return again ? organ_.to_world_before(p) : organ_.to_world(p); });
    if (needle_.is_there()) tools[0].needle = &needle;
    for (int t = 1; t <= tools_; ++t)
      tools[t] = point_tool(places[t].data(), static_cast<std::int32_t>(places[t].size() / 3), radius_, friction_);
    return palpate_scene_touch(scene, tools, 1 + tools_, kStep, contacts.get(), contacts.bytes());
  }
  const palpate_contact* contact_of(const palpate_scene* scene, const RandomPoint& p) const {
    const palpate_contact_report* report = palpate_scene_report(scene);
    for (std::int32_t c = 0; c < report->contact_count; ++c) {
      const palpate_contact* contact = palpate_report_contact(report, c);
      if (contact->tool == p.tool && contact->point == p.point) return contact;
    }
    return nullptr;
  }
  std::vector<bool> touching(const palpate_scene* scene) const {
    std::vector<bool> touches;
    for (const RandomPoint& p : points_) touches.push_back(contact_of(scene, p) != nullptr);
    return touches;
  }
  // Of the surface's vertices.
  std::vector<float> displaced(Contacts& contacts) {
    const std::vector<float> u = displacements(twin_.get(), contacts, body_.body.surface_nodes);
    return fine_ ? fine_->moved_by(u) : u;
  }

  // Before a step: what the end of a point's contact would leave of the surface. tolerance: m.
  WithoutContact ask_without(const RandomPoint& p, double tolerance) {
    const palpate_contact& contact = *contact_of(scene_.get(), p);
    const Eigen::Vector3d outward = body_.outward(contact.triangle);
    WithoutContact found;
    found.outward = outward;
    take_out(p, outward, &found.pulls);
    found.own = without_contact().signed_distance(p.organ);
    // The normal of a fine surface's triangle at rest is not known here.
    found.asked = found.own > -tolerance || found.pulls > (fine_ ? .5 : -1e-9);
    if (!found.asked) return found;
    const double over_own = over_plane(p, contact, outward);
    found.is_known = end_in_twin(p, outward);
    found.predicted = without_contact().signed_distance(p.organ);
    found.is_far_side =
        without_contact().looks_away(p.organ, std::abs(found.predicted) + tolerance, outward, fine_ ? .3 : -.3);
    if (!fine_) found.over_plane = std::min(over_own, over_plane(p, contact, outward));
    return found;
  }
  // The surface of the last step without the own part of the contact.
  void take_out(const RandomPoint& p, const Eigen::Vector3d& outward, double* pulls) {
    Contacts& rest = twins_;
    std::memcpy(rest.get(), contacts_.get(), contacts_->used_bytes);
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    for (std::int32_t e = 0; e < rest->node_count; ++e) {
      auto* node = const_cast<palpate_contact_node*>(palpate_contacts_node(rest, e));
      if (node->tool != p.tool || node->point != p.point) continue;
      force += Eigen::Vector3d(node->force);
      std::fill(node->modified_displacement, node->modified_displacement + 3, 0.0);
    }
    *pulls = force.norm() > 0 ? force.normalized().dot(outward) : 0;
    without_contact().move(displaced(rest));
  }
  double over_plane(const RandomPoint& p, const palpate_contact& contact, const Eigen::Vector3d& outward) {
    if (fine_) return -INFINITY;
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    for (int v = 0; v < 3; ++v)
      place += contact.barycentric[v] * without_contact().place(body_.body.triangles[contact.triangle][v]);
    return (p.organ - place).dot(outward);
  }
  void save_state() {
    if (std::none_of(points_.begin(), points_.end(), [](const RandomPoint& p) { return p.touches; })) return;
    state_bytes_ = palpate_scene_state_bytes(scene_.get());
    state_.resize(state_bytes_ / 8 + 1);
    if (palpate_scene_save(scene_.get(), state_.data(), 8 * state_.size(), nullptr) != PALPATE_OK)
      throw std::logic_error("a state was not saved");
  }
  // The last step once more, with the point far outside: the library solves for the others alone. False where other contacts came or
  // went with that.
  bool end_in_twin(const RandomPoint& p, const Eigen::Vector3d& outward) {
    if (palpate_scene_restore(twin_.get(), state_.data(), state_bytes_, nullptr) != PALPATE_OK)
      throw std::logic_error("a state was refused");
    organ_.send_before(twin_.get());
    const Eigen::Vector3d far = organ_.to_world_before(p.organ_before + .5 * outward);
    const int own = static_cast<int>(&p - points_.data());
    const palpate_step_flags flags = touch(twin_.get(), twins_, true, own, far);
    without_contact().move(displaced(twins_));
    return !((flags | flags_before_) & kUndecided) && !needle_has_gone_on_ && twin_holds_the_others(p);
  }
  // Where places slide on although nothing moves, the step and its repetition are two surfaces. A place that slips does so after the
  // solution, which the repetition then begins with.
  bool twin_holds_the_others(const RandomPoint& ended) const {
    return std::all_of(points_.begin(), points_.end(), [&](const RandomPoint& p) {
      const palpate_contact* contact = contact_of(twin_.get(), p);
      if (!contact || &p == &ended) return !contact && (!p.touches || &p == &ended);
      return p.touches && !p.slips && (anchor_of(*contact) - p.anchor).norm() < kStored;
    });
  }
  Eigen::Vector3d anchor_of(const palpate_contact& contact) const {
    return body_.place(contact.triangle, Eigen::Vector3d(contact.barycentric));
  }

  // What is wrong with a point in this step, or nullptr. Sets seen to the distance that says so.
  const char* compare(RandomPoint& p, Seen& seen, WithoutContact& without, Contradictions* all) {
    ++all->points, all->touched += seen.touches, all->near += std::abs(seen.height) < .002;
    all->begun += seen.touches && !p.touches, all->ended += p.touches && !seen.touches;
    if (seen.flags & PALPATE_STEP_BAD_INPUT) return "good input was refused";
    if (seen.flags & PALPATE_STEP_TRACKING_LOST) p.blind = !seen.touches;
    if (seen.flags & PALPATE_STEP_WORK_DEFERRED) {
      ++all->deferred;
      p.unseen = seen.tolerance, p.may_be_through = true;
      return nullptr;
    }
    p.unseen = 0;
    if (seen.flags & PALPATE_STEP_TRACKING_LOST || (p.blind && seen.height < seen.tolerance)) {
      ++all->lost, p.may_be_through = true;
      return nullptr;
    }
    p.blind = false;
    const bool is_over_held = seen.flags & PALPATE_STEP_NOT_TOUCHABLE;
    if (!p.touches) return compare_free(p, seen, is_over_held, all);
    return compare_in_contact(p, seen, without, is_over_held, all);
  }
  // Over held nodes there is no contact, or one that acts on other nodes: the step says so.
  const char* compare_free(RandomPoint& p, const Seen& seen, bool is_over_held, Contradictions* all) {
    p.may_be_through = seen.height > -seen.tolerance;
    if (seen.touches || seen.height >= -seen.tolerance) p.was_over_held = false;
    if (seen.touches) return seen.height > seen.tolerance ? "a contact began in the air" : nullptr;
    if (seen.height >= -seen.tolerance) return nullptr;
    // A contact that was not made may end in this step, unseen.
    const bool is_excused = is_over_held || p.was_over_held;
    p.was_over_held = is_over_held;
    all->over_held += is_excused;
    return is_excused ? nullptr : "a contact was missed";
  }
  const char* compare_in_contact(RandomPoint& p, Seen& seen, WithoutContact& without, bool is_over_held,
                                 Contradictions* all) {
    if (is_over_held) return ++all->over_held, p.may_be_through = true, nullptr;
    if (!without.asked) {
      p.may_be_through = false;
      if (seen.touches || seen.others_ended) return nullptr;
      without.is_known = end_in_twin(p, without.outward);
      without.predicted = without_contact().signed_distance(p.organ);
    }
    if (!without.is_known || seen.others_ended) return ++all->out_unknown, p.may_be_through = true, nullptr;
    ++all->out;
    seen.height = without.predicted;
    if (without.predicted < -seen.tolerance) {
      p.may_be_through = false;
      return seen.touches ? nullptr : "a contact ended inside";
    }
    p.may_be_through = p.may_be_through || without.is_far_side;
    const bool is_asked_there = without.own > seen.tolerance || without.pulls > (fine_ ? .7 : 1e-9);
    const bool is_out = is_asked_there && without.predicted > seen.tolerance,
               must_end = is_out && (!p.may_be_through || without.over_plane > seen.tolerance);
    return must_end && seen.touches ? "a contact stayed in the air" : nullptr;
  }

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
  const palpate_scene_def def_;
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
  explicit RandomScenes(double bump = 0) {
    if (!(bump > 0)) return;
    for (int b = 0; b < 3; ++b) {
      hosts_.push_back(fine_of(bodies_[b]->body, 1, bump));
      fine_.push_back(std::make_unique<BoundFine>(hosts_.back(), bodies_[b]->body));
    }
  }

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
  static TouchedBody pierceable(const DenseBody& dense) {
    return TouchedBody(dense, [&](BundleParts& parts) { add_whole_corridor(parts, dense); });
  }
  const TouchedBody block_{pierceable(slotted_block())}, slab_{pierceable(clamped_slab())},
      box_{pierceable(dense_box({}))};
  const TouchedBody* const bodies_[3] = {&block_, &box_, &slab_};
  std::vector<FineHost> hosts_;  // of the bodies; empty: tools meet the bodies' own surfaces
  std::vector<std::unique_ptr<BoundFine>> fine_;
};

}  // namespace palpate::tests
