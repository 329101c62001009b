// Tools against bodies that other tools deform, with bodies made by the programs: geometry -> mesh -> bundle -> scene. The reference is
// the winding number of the surface that palpate_scene_shape draws.
#include "tests/runtime/touched_box.h"
#include "tests/stability/programs.h"
#include "tests/stability/stability_case.h"
#include "tests/support/deformed_truth.h"
#include "tests/support/wandering_points.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;

// A geometry of this folder, meshed and solved, with one of its patches held.
class MadeBody {
 public:
  MadeBody(const std::string& geometry, const std::string& held) {
    Programs programs;
    programs.write(
        "organ.toml",
        "name = \"body\"\nmesh_unit = \"mm\"\nframe = \"none\"\nelement = \"p1-anp\"\n[[region]]\nname = \"body\"\n"
        "young = { value = 5.4, unit = \"kPa\", source = \"test\" }\n"
        "poisson = { value = 0.45, source = \"test\" }\n");
    programs.write("bc.toml", "name = \"held\"\n[[fixed]]\ndofs = \"xyz\"\nselect = { patch = \"" + held + "\" }\n");
    for (const ProgramRun& run :
         {programs.execute(PALPATE_TETRAHEDRA " " PALPATE_GEOMETRIES "/" + geometry + " --quiet -o box.msh"),
          programs.precompute("x.h5")})
      if (run.code != 0) throw std::runtime_error(run.errors);
    bytes_ = std::make_unique<AlignedBytes>(file_bytes(programs.folder() / "x.h5"));
    palpate_bundle* opened = nullptr;
    palpate_error error = {};
    if (palpate_bundle_open(bytes_->data(), bytes_->size(), nullptr, &opened, &error) != PALPATE_OK)
      throw std::runtime_error(error.text);
    bundle_.reset(opened);
    const palpate_bundle_info info = palpate_bundle_describe(opened);
    surface.surface_nodes = info.surface_node_count;
    const double* nodes = palpate_bundle_nodes(opened);
    for (std::int32_t n = 0; n < info.surface_node_count; ++n)
      surface.mesh.nodes.push_back({nodes[3 * n], nodes[3 * n + 1], nodes[3 * n + 2]});
    const std::int32_t* corners = palpate_bundle_triangles(opened);
    for (std::int32_t t = 0; t < info.triangle_count; ++t)
      surface.triangles.push_back({corners[3 * t], corners[3 * t + 1], corners[3 * t + 2]});
    const std::int32_t* first = palpate_bundle_touchable(opened);
    touchable.assign(first, first + info.touchable_count);
  }

  ScenePointer scene(const palpate_scene_def& def) const {
    palpate_scene* created = nullptr;
    palpate_error error = {};
    if (palpate_scene_create(bundle_.get(), &def, &created, &error) != PALPATE_OK) throw std::runtime_error(error.text);
    return ScenePointer(created);
  }
  Vector3d node(std::int32_t n) const { return Vector3d(surface.mesh.nodes[static_cast<std::size_t>(n)].data()); }
  std::int32_t touchable_nearest(const Vector3d& p) const {
    return *std::min_element(touchable.begin(), touchable.end(), [&](std::int32_t a, std::int32_t b) {
      return (node(a) - p).norm() < (node(b) - p).norm();
    });
  }

  SurfaceFirst surface;  // of the mesh, the surface's nodes alone
  std::vector<std::int32_t> touchable;

 private:
  std::unique_ptr<AlignedBytes> bytes_;
  BundlePointer bundle_;
};

const MadeBody& slotted() {
  static const MadeBody body("slotted_block.geo", "bottom");
  return body;
}
const MadeBody& slab() {
  static const MadeBody body("clamped_slab.geo", "clamp");
  return body;
}

using Grips = std::vector<palpate_grip>;

Grips drawn_by(const std::vector<std::int32_t>& nodes, const Vector3d& by) {
  Grips grips;
  for (const std::int32_t n : nodes) grips.push_back(grip_at_node(n, by));
  return grips;
}

// m: what counts as in the air, or as inside, beyond any doubt.
constexpr double kClear = 2e-4;
// m: the reference reads displacements in single precision.
constexpr double kStored = 1e-6;

palpate_scene_def deformed_def() {
  palpate_scene_def def = palpate_default_scene_def();
  def.collision = PALPATE_COLLISION_DEFORMED, def.contact = PALPATE_CONTACT_POINT;
  return def;
}

// A tool that grips and a tool with one point, step by step beside the surface that is drawn.
class Watched {
 public:
  explicit Watched(const MadeBody& body, const palpate_scene_def& def = deformed_def())
      : body_(body), scene_(body.scene(def)), contacts_(scene_.get()), drawn_(body.surface) {}

  // Forgets the point. The grips hold, and the surface rests.
  void begin(const Grips& grips) {
    palpate_scene_reset(scene_.get());
    for (int s = 0; s < 2; ++s) touch(grips, nullptr);
    known_ = false;
  }
  // Moves the point while the grips hold. height() is then the point's distance to the surface that was drawn before this step, which
  // is the one that the step meets.
  void step(const Vector3d& p, const Grips& grips) {
    const bool touched = known_ && touches();
    height_ = drawn_.signed_distance(p);
    touch(grips, p.data());
    changes_ = known_ ? changes_ + (touched != touches()) : 0;
    last_ = p, known_ = true;
  }
  bool touches() { return state().contact_count > 0; }
  Vector3d force() { return Vector3d(state().force); }
  Vector3d force_raw() { return Vector3d(state().force_raw); }
  double height() const { return height_; }
  int changes() const { return changes_; }  // how often a contact has begun or ended
  // Held nodes alone: no contact is made there, and none until the point has been outside again.
  bool meets_held() const { return (flags_ & PALPATE_STEP_NOT_TOUCHABLE) != 0; }
  const DeformedTruth& drawn() const { return drawn_; }

 private:
  const palpate_tool_state& state() { return *palpate_contacts_tool(contacts_, 1); }
  void touch(const Grips& grips, const double* point) {
    const palpate_tool tools[2] = {tool_of(grips), point_tool(point, 1, 0, 0.3)};
    flags_ = palpate_scene_touch(scene_.get(), tools, point ? 2 : 1, 1e-3, contacts_.get(), contacts_.bytes());
    drawn_.move(displacements(scene_.get(), contacts_.get(), body_.surface.surface_nodes));
  }

  const MadeBody& body_;
  ScenePointer scene_;
  Contacts contacts_;
  DeformedTruth drawn_;
  Vector3d last_ = Vector3d::Zero();
  bool known_ = false;
  double height_ = 0;
  int changes_ = 0;
  palpate_step_flags flags_ = 0;
};

// What approaches have found.
struct Found {
  long in_the_air = 0, false_contacts = 0, met = 0;
  double early = 0, late = 0;  // m: a contact above the surface; none below it
  double far_force = 0;        // N, 3 mm and more from the surface
  double pulls = 0;            // N, along the motion
  int most_changes = 0;

  void note(Watched& watched, bool touched_before) {
    const double height = watched.height();
    if (touched_before) return;
    in_the_air += height > kClear, false_contacts += height > kClear && watched.touches();
    if (height > 3e-3) far_force = std::max({far_force, watched.force().norm(), watched.force_raw().norm()});
    if (watched.touches())
      ++met, early = std::max(early, height);
    else if (!watched.meets_held())
      late = std::max(late, -height);
  }
};

// Moves the point in steps until it has been in contact for `deep` metres, meets a held part, or is at the end of the way.
Vector3d go(Watched& watched, const Grips& grips, Vector3d p, const Vector3d& along, double step, double longest,
            double deep, Found* found) {
  double touched = 0;
  for (double way = 0; way < longest && touched < deep; way += step) {
    const bool before = watched.touches();
    p += step * along;
    watched.step(p, grips);
    found->note(watched, before);
    if (watched.meets_held()) break;
    if (watched.touches()) touched += step, found->pulls = std::max(found->pulls, watched.force_raw().dot(along));
  }
  found->most_changes = std::max(found->most_changes, watched.changes());
  return p;
}

// The rim of the wall at x = 30 mm, or its node in the middle.
std::vector<std::int32_t> rim(bool whole) {
  if (!whole) return {slotted().touchable_nearest({.030, .015, .050})};
  std::vector<std::int32_t> nodes;
  for (const std::int32_t n : slotted().touchable)
    if (std::abs(slotted().node(n)[0] - .030) < 1e-9 && std::abs(slotted().node(n)[2] - .050) < 1e-9)
      nodes.push_back(n);
  return nodes;
}

TEST(StabilityDeformedSurface, AnOpenedGapIsAir) {
  StabilityCase attack(
      "A wall of the slot is drawn back. A search that starts from the nearest place and asks the surface at rest "
      "takes "
      "the opened gap for tissue, and what is tissue now for air.");
  for (const double by : {.010, .030})
    for (const bool whole : {false, true}) {
      const Grips grips = drawn_by(rim(whole), {-by, 0, 0});
      Watched watched(slotted());
      Found found;
      for (double x = .004; x < .034; x += .0011)
        for (const double y : {.004, .0151, .0262}) {
          watched.begin(grips);
          Vector3d p(x, y, .090);
          watched.step(p, grips);
          go(watched, grips, p, {0, 0, -1}, 5e-4, .080, 2e-3, &found);
        }
      const std::string of = std::string(", ") + (whole ? "rim" : "one node") + " drawn back by " +
                             std::to_string(static_cast<int>(1e3 * by)) + " mm";
      EXPECT_GT(found.in_the_air, 5000) << of;
      attack.hold("share of places in the air with a contact" + of,
                  static_cast<double>(found.false_contacts) / static_cast<double>(found.in_the_air), 0,
                  "in the air by more than 0.2 mm from what is drawn");
      attack.hold("a contact above the surface, m" + of, found.early, kStored, "single precision of the shape");
      attack.hold("no contact below the surface, m" + of, found.late, kStored, "single precision of the shape");
      attack.hold("force 3 mm from any tissue, N" + of, found.far_force, 0, "nothing touches there");
      attack.hold("begins and ends on one approach" + of, found.most_changes, 1, "it begins once");
    }
}

TEST(StabilityDeformedSurface, AWallThatIsDrawnBackIsMetSideways) {
  StabilityCase attack(
      "A point in the slot goes to the drawn wall and to the other one: felt before the wall is there, it is pulled "
      "the "
      "wrong way.");
  for (const double by : {.010, .030}) {
    const Grips grips = drawn_by(rim(true), {-by, 0, 0});
    Watched watched(slotted());
    Found found, down;
    for (const double to : {-1.0, 1.0})
      for (const double y : {.004, .0151, .0262})
        for (double z = .045; z > .018; z -= .003) {
          watched.begin(grips);
          Vector3d p(.0315, y, .060);
          watched.step(p, grips);
          p = go(watched, grips, p, {0, 0, -1}, 5e-4, .060 - z, 1e-3, &down);
          if (!watched.touches()) go(watched, grips, p, {to, 0, 0}, 1e-4, .035, 1.5e-3, &found);
        }
    const std::string of = ", " + std::to_string(static_cast<int>(1e3 * by)) + " mm";
    EXPECT_GE(found.met, 40) << of;
    attack.hold("a wall felt before it is there, m" + of, found.early, kStored, "single precision of the shape");
    attack.hold("a wall passed without a contact, m" + of, found.late, kStored, "single precision of the shape");
    attack.hold("force that pulls to the wall, N" + of, found.pulls, 0, "an elastic body resists");
    attack.hold("begins and ends on one approach" + of, found.most_changes, 1, "it begins once");
  }
}

TEST(StabilityDeformedSurface, RandomGripsOf30Millimetres) {
  StabilityCase attack(
      "Three nodes anywhere are drawn by 30 mm in any direction, so that the body opens, folds and overlaps itself; a "
      "point comes from any side.");
  constexpr double kStep = 5e-4;  // m
  for (const MadeBody* body : {&slotted(), &slab()}) {
    // Contacts beside a grip, which the grip takes anywhere, stay too.
    palpate_scene_def def = deformed_def();
    def.release_distance = INFINITY;
    Watched watched(*body, def);
    Found found;
    WanderingRandom random;
    const auto direction = [&] {
      Vector3d d;
      do
        for (double& x : d) x = random(-1, 1);
      while (d.norm() > 1 || d.norm() < 0.1);
      return Vector3d(d.normalized());
    };
    for (int scene = 0; scene < quick_or_long(12, 200); ++scene) {
      Grips grips;
      for (int g = 0; g < 3; ++g)
        grips.push_back(
            grip_at_node(body->touchable[random.below(static_cast<int>(body->touchable.size()))], .030 * direction()));
      for (int approach = 0; approach < 8; ++approach) {
        watched.begin(grips);
        const Vector3d to = watched.drawn().place(random.below(body->surface.surface_nodes)), along = direction();
        const Vector3d p = to - .150 * along;
        if (watched.drawn().signed_distance(p) < 0) continue;
        watched.step(p, grips);
        go(watched, grips, p, along, kStep, .180, 1e-3, &found);
      }
    }
    const std::string of = body == &slab() ? ", slab" : ", block";
    EXPECT_GT(found.met, 50) << of;
    EXPECT_GT(found.in_the_air, 10000) << of;
    attack.hold("share of places in the air with a contact" + of,
                static_cast<double>(found.false_contacts) / static_cast<double>(found.in_the_air), 0,
                "in the air by more than 0.2 mm from what is drawn");
    attack.hold("a contact above the surface, m" + of, found.early, kStep + kStored, "the motion of a step");
    attack.hold("no contact below the surface, m" + of, found.late, kStep + kStored, "the motion of a step");
  }
}

// ---- a lever -------------------------------------------------------------------------------------------------------------

TEST(StabilityDeformedSurface, ALeverIsMet) {
  StabilityCase attack(
      "A node beside the clamp is held 3 mm lower, and the free end goes down several times as far: a bound that knows "
      "only what is imposed lets the free end pass through a point.");
  const std::int32_t lever = slab().touchable_nearest({.015, .015, .012});
  const auto pressed = [&](double by) { return drawn_by({lever}, {0, 0, -by}); };
  Watched watched(slab());
  watched.begin(pressed(.003));
  double tip = 0;
  for (std::int32_t n = 0; n < slab().surface.surface_nodes; ++n)
    tip = std::max(tip, (watched.drawn().place(n) - slab().node(n)).norm());
  attack.hold("1.5 over the free end's motion, in motions of the held node", 1.5 * .003 / tip, 0.75,
              "the body is a lever, so that a bound of 1.5 would be seen");
  Found comes, goes;
  int passed = 0, not_met = 0, entered = 0, not_felt = 0;
  for (const double x : {.050, .065, .080, .095, .105, .112, .118})
    for (const double y : {.002, .0131, .028}) {
      // The slab comes down to a point that stands below it.
      for (const double below : {.0003, .001, .002, .004}) {
        const Vector3d p(x, y, -below);
        watched.begin(pressed(.003));
        const bool passes = watched.drawn().signed_distance(p) < -kStored;
        watched.begin(pressed(0));
        bool met = false;
        for (int ms = 0; ms <= 300; ++ms) {
          const bool before = ms > 0 && watched.touches();
          watched.step(p, pressed(1e-5 * ms));
          comes.note(watched, before);
          met = met || watched.touches();
        }
        passed += passes, not_met += passes && !met;
      }
      // A point goes up to the slab that is held down.
      watched.begin(pressed(.003));
      const Vector3d p(x, y, -.030);
      watched.step(p, pressed(.003));
      go(watched, pressed(.003), p, {0, 0, 1}, 1e-4, .040, 2e-3, &goes);
      ++entered, not_felt += !watched.touches();
    }
  EXPECT_GE(passed, 42);
  attack.hold("points that the slab passed without a contact, of " + std::to_string(passed), not_met, 0,
              "the drawn slab is beyond the point");
  attack.hold("points that went into the slab without a contact, of " + std::to_string(entered), not_felt, 0,
              "each of them ends in the slab");
  attack.hold("a contact above the surface, m", std::max(comes.early, goes.early), kStored,
              "single precision of the shape");
  attack.hold("no contact below the surface, m", std::max(comes.late, goes.late), kStored,
              "single precision of the shape");
}

// ---- jumps -----------------------------------------------------------------------------------------------------------------

struct Jump {
  const MadeBody& body;
  Vector3d from, along;  // from: 5 mm in front of the surface
  double thickness;      // m, along the jump
};

std::vector<Jump> jumps() {
  return {{slotted(), {-.005, .0151, .0101}, {1, 0, 0}, .063},  // through the base
          {slotted(), {-.005, .0151, .0351}, {1, 0, 0}, .063},  // through both walls
          {slotted(), {.0152, -.005, .0303}, {0, 1, 0}, .030},
          {slab(), {.0703, .0151, .017}, {0, 0, -1}, .012},
          {slab(), {.1033, -.005, .0061}, {0, 1, 0}, .030}};
}

std::vector<palpate_scene_def> touching_defs() {
  std::vector<palpate_scene_def> defs;
  for (const auto contact : {PALPATE_CONTACT_TRIANGLE, PALPATE_CONTACT_POINT, PALPATE_CONTACT_PATCH})
    for (const auto law : {PALPATE_LAW_STICKING, PALPATE_LAW_SLIDING, PALPATE_LAW_UNILATERAL, PALPATE_LAW_COULOMB}) {
      palpate_scene_def def = palpate_default_scene_def();
      def.collision = PALPATE_COLLISION_DEFORMED, def.contact = contact, def.law = law;
      defs.push_back(def);
    }
  return defs;
}

// A scene with one tool of one point.
class OnePoint {
 public:
  OnePoint(const MadeBody& body, const palpate_scene_def& def, double radius, bool holds)
      : scene_(body.scene(def)), contacts_(scene_.get()), radius_(radius), holds_(holds) {}
  void step(const Vector3d& p, double dt = 1e-3) {
    const palpate_tool tool = point_tool(p.data(), 1, radius_, 0.3, holds_);
    flags = palpate_scene_touch(scene_.get(), &tool, 1, dt, contacts_.get(), contacts_.bytes());
  }
  bool lost() const { return (flags & PALPATE_STEP_TRACKING_LOST) != 0; }
  bool touches() { return palpate_contacts_tool(contacts_, 0)->contact_count > 0; }
  Vector3d force() { return Vector3d(palpate_contacts_tool(contacts_, 0)->force); }
  Vector3d force_raw() { return Vector3d(palpate_contacts_tool(contacts_, 0)->force_raw); }
  palpate_step_flags flags = 0;

 private:
  ScenePointer scene_;
  Contacts contacts_;
  double radius_;
  bool holds_;
};

TEST(StabilityDeformedSurface, AJumpThroughTheBodyIsLostTracking) {
  StabilityCase attack(
      "A point is in front of the body in one step and behind it in the next: taken for a motion, it would hold the "
      "body from then on, with tens of newtons.");
  int jumped = 0, silent = 0, touching = 0;
  double force = 0, change = 0, left = 0, raw = 0;
  int pressed = 0, kept = 0;
  for (const Jump& jump : jumps())
    for (palpate_scene_def def : touching_defs())
      for (const double length : {jump.thickness + .010, .211, 1.0}) {
        // In a step of a second the jump is slow, but longer than the body is thick.
        for (const double dt : {1e-4, 1e-3, 1.0}) {
          OnePoint point(jump.body, def, .004, false);
          for (int s = 0; s < 2; ++s) point.step(jump.from, dt);
          point.step(jump.from + length * jump.along, dt);
          ++jumped, silent += !point.lost();
          for (int s = 0; s < 3; ++s) {
            touching += point.touches();
            force = std::max({force, point.force().norm(), point.force_raw().norm()});
            point.step(jump.from + (length + 1e-3 * s) * jump.along, dt);
          }
        }
        // Pressed by 4 mm it jumps on, in one step, and stays there.
        for (const bool holds : {false, true}) {
          def.force_slew = &jump.body == &slab() ? 0.02 : 2;  // N/s: a small part of what presses
          OnePoint point(jump.body, def, .004, holds);
          double depth = -.005;
          for (; depth < .004; depth += 1e-4) point.step(jump.from + (.005 + depth) * jump.along);
          for (int s = 0; s < 300; ++s) point.step(jump.from + (.005 + depth) * jump.along);
          const double allowed = def.force_slew * 1e-3;
          Vector3d before = point.force();
          pressed += point.touches() && before.norm() > 5 * allowed;
          const int steps = 2 + static_cast<int>(before.norm() / allowed);
          for (int s = 0; s < steps; ++s) {
            point.step(jump.from + length * jump.along);
            kept += point.touches(), raw = std::max(raw, point.force_raw().norm());
            silent += s == 0 && !point.lost();
            change = std::max(change, (point.force() - before).norm() / allowed);
            before = point.force();
          }
          left = std::max(left, point.force().norm());
        }
      }
  EXPECT_GE(pressed, 5 * 12 * 3 * 2 - 12);  // discs that slide freely go off the rim of one body
  attack.hold("jumps without a flag, of " + std::to_string(jumped + pressed), silent, 0, "TRACKING_LOST");
  attack.hold("contacts after a jump", touching + kept, 0, "the point is in the air");
  attack.hold("force after a jump through the body, N", force, 0, "nothing touches");
  attack.hold("force before the limits after a jump out of a contact, N", raw, 0, "nothing touches");
  attack.hold("change of the sent force in a step, in force_slew times the step", change, 1 + 1e-9,
              "force_slew; rounding");
  attack.hold("force that is left when the slew has had its time, N", left, 0, "nothing touches");
}

TEST(StabilityDeformedSurface, AContactEndsAtTheReleaseDistance) {
  StabilityCase attack(
      "A tool that holds its place moves away without end: the contact would draw the body after it, however far.");
  double off = 0, force = 0;
  int silent = 0, again = 0, ended = 0;
  for (const double given : {0.0, .002, .010, .050})
    for (const auto contact : {PALPATE_CONTACT_TRIANGLE, PALPATE_CONTACT_POINT, PALPATE_CONTACT_PATCH})
      for (const Jump& jump : jumps()) {
        palpate_scene_def def = palpate_default_scene_def();
        def.collision = PALPATE_COLLISION_DEFORMED, def.contact = contact, def.release_distance = given;
        Vector3d low = jump.body.node(0), high = low;
        for (std::int32_t n = 0; n < jump.body.surface.surface_nodes; ++n)
          low = low.cwiseMin(jump.body.node(n)), high = high.cwiseMax(jump.body.node(n));
        const double release = given > 0 ? given : (high - low).norm() / 5;
        // It touches by 1 mm, and then draws the body back the way it came.
        OnePoint point(jump.body, def, .004, true);
        const Vector3d place = jump.from + .005 * jump.along;
        for (double depth = -.005; depth < .001; depth += 1e-4) point.step(place + depth * jump.along);
        EXPECT_TRUE(point.touches());
        double farthest = 0;
        constexpr double step = 1e-4;
        for (double depth = .001; depth > -.200; depth -= step) {
          const bool before = point.touches();
          point.step(place + depth * jump.along);
          if (point.touches()) farthest = std::max(farthest, std::abs(depth)), again += !before;
          silent += before && !point.touches() && !point.lost(), ended += before && !point.touches();
          if (!point.touches()) force = std::max(force, point.force_raw().norm());
        }
        off = std::max(off, std::abs(farthest - release));
      }
  EXPECT_EQ(ended, 4 * 3 * 5);
  attack.hold("farthest place that a contact held, off release_distance, m", off, 1e-4 + 1e-9, "the motion of a step");
  attack.hold("contacts that ended without a flag, of 60", silent, 0, "TRACKING_LOST");
  attack.hold("contacts that began again in the air", again, 0, "the point is in the air");
  attack.hold("force after the end, N", force, 0, "nothing touches");
}

}  // namespace
}  // namespace palpate::tests
