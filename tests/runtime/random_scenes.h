// Random scenes of a point that wanders about a body while grips move and open it, beside the slow reference: the winding number of
// the deformed mesh. deformed_collision_test plays some, collision_fuzz as many as it is asked for.
#pragma once

#include <random>
#include <string>

#include "tests/runtime/touched_box.h"
#include "tests/support/deformed_truth.h"
#include "tests/support/fine_body.h"
#include "tests/support/grid_body.h"

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

// A step whose contact contradicts the reference by more than the motion of one step.
struct Contradiction {
  std::uint64_t seed;
  int step;
  const char* what;
  double height, tolerance;  // m: of the point over the deformed surface
};

inline std::string sentence_of(const Contradiction& found) {
  char text[200];
  std::snprintf(
      text, sizeof text, "seed %llu, step %d: %s; the point is %.6f mm over the surface, the tolerance is %.6f mm",
      static_cast<unsigned long long>(found.seed), found.step, found.what, 1e3 * found.height, 1e3 * found.tolerance);
  return text;
}

struct Contradictions {
  long steps = 0, near = 0, touched = 0, begun = 0, found = 0;
};

class RandomScenes {
 public:
  // bump: m; above 0, tools meet finer surfaces of the bodies, with bumps of that height (fine_of).
  explicit RandomScenes(double bump = 0) : off_the_place_(bump) {
    if (!(bump > 0)) return;
    for (int b = 0; b < 3; ++b) {
      hosts_.push_back(fine_of(bodies_[b]->body, 1, bump));
      fine_.push_back(std::make_unique<BoundFine>(hosts_.back(), bodies_[b]->body));
    }
  }

  // A seed names the body, the grips and all motions.
  bool is_thin(std::uint64_t seed) const { return seed % 3 == 2; }

  // tell(Contradiction) is called for each of them.
  template <class Tell>
  void play(std::uint64_t seed, int steps, Contradictions* all, Tell tell) const {
    const TouchedBody& body = *bodies_[seed % 3];
    const double grip_reach = seed % 3 == 0 ? .006 : seed % 3 == 1 ? .004 : .003;
    std::mt19937_64 random(seed);
    const auto between = [&](double low, double high) {
      return low + (high - low) * static_cast<double>(random() >> 11) / 9007199254740992.0;
    };
    const auto direction = [&] {
      const double x = between(-1, 1), y = between(-1, 1), z = between(-1, 1);
      return Eigen::Vector3d(x, y, z);
    };
    palpate_scene_def def = deformed_def();
    const FineHost* host = hosts_.empty() ? nullptr : &hosts_[seed % 3];
    const BoundFine* fine = host ? fine_[seed % 3].get() : nullptr;
    palpate_fine_surface view = palpate_default_fine_surface();
    if (host) view = host->view(), def.fine_surface = &view;
    Watched watched(body, def, host, fine), without(body, def, host, fine);
    Eigen::Vector3d low = body.node(0), high = low;
    for (std::int32_t n = 0; n < body.body.surface_nodes; ++n)
      low = low.cwiseMin(body.node(n)), high = high.cwiseMax(body.node(n));
    std::vector<std::int32_t> held;
    std::vector<Eigen::Vector3d> aim, at;
    for (int g = 0; g < 3; ++g) {
      held.push_back(body.touchable[random() % body.touchable.size()]);
      aim.push_back(grip_reach * direction()), at.push_back(Eigen::Vector3d::Zero());
    }
    std::sort(held.begin(), held.end());
    Eigen::Vector3d p = high + Eigen::Vector3d::Constant(.01), goal = p;
    double speed = 0;
    bool was_touching = false;
    const Eigen::Vector3d nowhere = high + Eigen::Vector3d::Constant(.5);
    for (int s = 0; s < steps; ++s) {
      if ((goal - p).norm() < 1e-9 || s % 97 == 0) {
        // To a place beside a random node as it was meshed: some mm outside or inside.
        goal =
            body.node(static_cast<std::int32_t>(random() % body.body.surface_nodes)) + between(0, .012) * direction();
        speed = std::pow(10.0, between(-5, -2.3));  // m in a step
      }
      const Eigen::Vector3d way = goal - p;
      p += way * std::min(1.0, speed / std::max(1e-12, way.norm()));
      std::vector<palpate_grip> grips;
      for (int g = 0; g < 3; ++g) {
        if (s % 150 == 50 * g) aim[g] = grip_reach * direction();
        const Eigen::Vector3d to = aim[g] - at[g];
        at[g] += to * std::min(1.0, 2e-4 / std::max(1e-12, to.norm()));
        if (g == 0 || held[g] != held[g - 1]) grips.push_back(grip_at_node(held[g], at[g]));
      }
      watched.step(p, grips);
      // The surface as the grips alone deform it: what the point would meet if its contact ended.
      const double height_without = without.next().signed_distance(p);
      without.step(nowhere, grips);
      const double tolerance = watched.moved() + kStored;
      // Over held nodes there is no contact, or one that acts on other nodes: the step says so.
      const bool trusted = !(watched.flags() & PALPATE_STEP_NOT_TOUCHABLE), touches = watched.touches();
      ++all->steps, all->touched += touches;
      all->near += std::abs(watched.height()) < .002;
      all->begun += touches && !was_touching;
      const char* what = nullptr;
      if (!was_touching && touches && watched.height() > tolerance) what = "a contact began in the air";
      if (!was_touching && !touches && watched.height() < -tolerance && trusted) what = "a contact was missed";
      // A point that has gone through the slab keeps its contact; the other bodies are too thick for that.
      if (was_touching && touches && watched.height() > tolerance + off_the_place_ &&
          height_without > tolerance + without.moved() && trusted && !is_thin(seed))
        what = "a contact stayed in the air";
      if (what) {
        ++all->found;
        tell(Contradiction{seed, s, what, watched.height(), tolerance});
      }
      was_touching = touches;
    }
  }

 private:
  const TouchedBody block_{slotted_block()}, slab_{clamped_slab()};
  const TouchedBox box_;
  // m: a contact holds the mesh below its place on a fine surface, and the place is off the tool by what its offset turns: by a quarter
  // of the offset in one scene of ten, by more in one of a hundred, below a point that the mesh shows as a spike.
  const double off_the_place_;
  const TouchedBody* const bodies_[3] = {&block_, &box_, &slab_};
  std::vector<FineHost> hosts_;  // of the bodies; empty: tools meet the bodies' own surfaces
  std::vector<std::unique_ptr<BoundFine>> fine_;
};

}  // namespace palpate::tests
