// What holds tissue beside the points of tools under large deformation, against Newton's method with the rows of the last step.
#include <Eigen/Geometry>

#include "runtime/large/effect.h"
#include "tests/runtime/large/large_scene.h"
#include "tests/runtime/linked_scene.h"
#include "tests/support/box_corridor.h"
#include "tests/support/grid_body.h"

namespace palpate::tests {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr palpate_deformation_model kForms[] = {PALPATE_DEFORMATION_LARGE, PALPATE_DEFORMATION_LARGE_BESIDE,
                                                PALPATE_DEFORMATION_LARGE_RENEWED};

// 60 x 50 x 40 mm, held at x = 0, with a corridor through all inner nodes.
const TouchedBody& box() {
  static const DenseBody dense = dense_box({.cells = {5, 4, 3}});
  static const TouchedBody shared(dense, [](BundleParts& parts) {
    with_large(false)(parts);
    add_whole_corridor(parts, dense);
  });
  return shared;
}
const LargeReference& newton() {
  static const Seen seen(box(), false, 0);
  static const LargeReference reference(seen.body);
  return reference;
}

// One tool without points. Beside the touch a step is solved to its end before the next one.
struct Holding {
  explicit Holding(const SceneDef& def, const TouchedBody& of = box(), const LargeReference& by = newton())
      : body(of), reference(by), scene(of.scene(def)), contacts(scene.get()) {}
  palpate_step_flags step(const palpate_part* part) {
    palpate_tool tool = palpate_default_tool();
    tool.parts = part;
    return step(tool);
  }
  palpate_step_flags step(palpate_tool tool) {
    tool.id = 3, tool.has_torque = 1;
    const palpate_step_flags flags = palpate_scene_touch(scene.get(), &tool, 1, 1e-3, contacts.get(), contacts.bytes());
    for (int i = 0; i < 100 && palpate_scene_deform(scene.get()) > 0;) ++i;
    return flags;
  }
  Vector3d force() const { return Vector3d(palpate_contacts_tool(contacts, 0)->force_raw); }
  Vector3d torque() const { return Vector3d(palpate_contacts_tool(contacts, 0)->torque_raw); }
  VectorXd moved() {
    const auto u = displacements(scene.get(), contacts, static_cast<std::int32_t>(body.dofs() / 3));
    return Eigen::Map<const Eigen::VectorXf>(u.data(), static_cast<Eigen::Index>(u.size())).cast<double>();
  }
  // The rows are at their places in truth: 1 % of the field, 2 % of the forces on the nodes.
  void expect_newton(double least_moved = 0.005) {
    const HeldRows rows = held_rows(deforming_body_of(*scene), static_cast<std::int32_t>(body.dofs() / 3));
    const VectorXd found = moved();
    VectorXd exact = found;
    const VectorXd carried = reference.solve(rows.weights, rows.place, &exact, 1e-9, rows.compliance);
    EXPECT_GT(exact.cwiseAbs().maxCoeff(), least_moved) << "little is pulled";
    EXPECT_LE((found - exact).norm(), 0.01 * exact.norm());
    const VectorXd force = rows.weights.transpose() * carried;
    EXPECT_LE((rows.weights.transpose() * rows.carried - force).norm(), 0.02 * force.norm());
    VectorXd told = VectorXd::Zero(body.dofs());
    for (std::int32_t e = 0; e < contacts->node_count; ++e) {
      const palpate_contact_node& node = *palpate_contacts_node(contacts, e);
      told.segment<3>(3 * node.node) += Vector3d(node.force);
    }
    EXPECT_LE((told - force).norm(), 0.02 * force.norm());
  }

  // Nothing acts any more.
  void expect_rest() {
    for (int s = 0; s < 300; ++s) step(nullptr);
    EXPECT_EQ(moved().cwiseAbs().maxCoeff(), 0);
    EXPECT_EQ(force().norm(), 0);
  }

  const TouchedBody& body;
  const LargeReference& reference;
  ScenePointer scene;
  Contacts contacts;
};

SceneDef holding_def(palpate_deformation_model form, palpate_contact_law law = PALPATE_LAW_STICKING) {
  SceneDef def = large_def(PALPATE_CONTACT_PATCH);
  def.large.deformation = form, def.law = law, def.shape = PALPATE_SHAPE_VOLUME;
  def.torque_limit = def.torque_slew = INFINITY;
  return def;
}

// ---- jaws --------------------------------------------------------------------------------------------------------------

const Vector3d kGrasped(0.06, 0.035, 0.028);

// Jaws that have closed on the far face and gone on by `way`, turned by `turn`.
palpate_grasp jaws_at(const Vector3d& way, const Quaterniond& turn) {
  palpate_grasp grasp = palpate_default_grasp();
  const PlaceOnFace place = place_at(box(), {1, 0, 0}, kGrasped);
  grasp.triangle = place.triangle, grasp.radius = 0.008, grasp.id = 1;
  Eigen::Map<Vector3d>(grasp.barycentric) = place.weights;
  Eigen::Map<Vector3d>(grasp.position) = kGrasped + way;
  grasp.orientation[0] = turn.w(), grasp.orientation[1] = turn.x(), grasp.orientation[2] = turn.y();
  grasp.orientation[3] = turn.z();
  return grasp;
}
SceneDef grasping_def(palpate_deformation_model form, palpate_contact_law law = PALPATE_LAW_STICKING) {
  SceneDef def = holding_def(form, law);
  def.grasps.grasps = 1;
  return def;
}

const Vector3d kPull(0.005, 0.004, 0.008);
Quaterniond turned(double angle) {
  return Quaterniond(AngleAxisd(angle, Vector3d(0.3, 1, 0.2).normalized()));
}

// 10 mm at 0.1 m/s, and a turn by 0.4 rad.
TEST(LargeHolds, JawsDrawALobeAsNewtonsMethodSaysAndLetItGo) {
  for (const auto form : kForms)
    for (const auto law : kEveryLaw) {
      Holding holding(grasping_def(form, law));
      int flagged = 0;
      for (int s = 0; s <= 140; ++s) {
        const double share = std::min(1.0, s / 100.0);
        const palpate_grasp grasp = jaws_at(share * kPull, turned(0.4 * share));
        flagged += holding.step(&grasp.part) != 0;
      }
      EXPECT_EQ(flagged, 0) << form << " " << law;
      holding.expect_newton();
      const Vector3d place(palpate_scene_grasp_state(holding.scene.get(), 3)->place);
      EXPECT_LE((place - kGrasped - kPull).norm(), 1e-3);
      holding.expect_rest();
    }
}

// Jaws on the free end of a slab of 120 x 30 x 12 mm, one disc above and one below.
struct PinchedSlab {
  DenseBody dense = [] {
    GridBody grid;
    grid.lines = {grid_lines(0, 0.12, 8), grid_lines(0, 0.03, 2), grid_lines(0, 0.012, 2)};
    DenseBody body = dense_grid(grid);
    body.interior = true;
    return body;
  }();
  TouchedBody slab{dense, with_large(false)};
  Seen seen{slab, false, 0};
  LargeReference reference{seen.body};
  Vector3d held{0.105, 0.015, 0.012};
  palpate_grasp grasp = palpate_default_grasp();

  PinchedSlab() {
    const PlaceOnFace above = place_at(slab, {0, 0, 1}, held),
                      below = place_at(slab, {0, 0, -1}, Vector3d(held.x(), held.y(), 0));
    grasp.triangle = above.triangle, grasp.opposite_triangle = below.triangle, grasp.radius = 0.008, grasp.id = 1;
    Eigen::Map<Vector3d>(grasp.barycentric) = above.weights;
    Eigen::Map<Vector3d>(grasp.opposite_barycentric) = below.weights;
    bend(0);
  }
  // As an arc of this angle, rad.
  void bend(double angle) {
    const double radius = angle > 0 ? held.x() / angle : 0;
    const Quaterniond turn(AngleAxisd(-angle, Vector3d::UnitY()));
    const Vector3d of_axis(angle > 0 ? radius * std::sin(angle) : held.x(), held.y(), radius * (1 - std::cos(angle)));
    Eigen::Map<Vector3d>(grasp.position) = of_axis + turn * Vector3d(0, 0, held.z());
    grasp.orientation[0] = turn.w();
    Eigen::Map<Vector3d>(grasp.orientation + 1) = turn.vec();
  }
};

// Jaws close by 3 mm, and bend the slab up by 60 mm. Then they open.
TEST(LargeHolds, JawsCloseOnAFoldDrawItBySixtyMillimetresAndLetItGo) {
  PinchedSlab body;
  for (const auto form : kForms) {
    Holding holding(grasping_def(form), body.slab, body.reference);
    const auto flagged_on = [&](int steps, double closing, double from, double to) {
      int flagged = 0;
      for (int s = 1; s <= steps; ++s) {
        const double share = from + (to - from) * s / steps;
        body.grasp.closing = closing >= 0 ? closing : 0.003 * s / steps;
        body.bend(1.3 * share);
        flagged += holding.step(&body.grasp.part) != 0;
      }
      return flagged;
    };
    // Beside the touch nothing is known of the first contact, nor where a tool sets out.
    EXPECT_LE(flagged_on(60, -1, 0, 0), form == PALPATE_DEFORMATION_LARGE ? 0 : 6) << form;
    EXPECT_EQ(flagged_on(40, 0.003, 0, 0), 0) << form;
    holding.expect_newton(0.0003);
    EXPECT_LE(flagged_on(200, 0.003, 0, 0.5), form == PALPATE_DEFORMATION_LARGE ? 0 : 40) << form;
    holding.expect_newton(0.025);
    // The slender part has turned by 75 degrees, and is stable.
    EXPECT_LE(flagged_on(200, 0.003, 0.5, 1), form == PALPATE_DEFORMATION_LARGE ? 0 : 40) << form;
    EXPECT_EQ(flagged_on(40, 0.003, 1, 1), 0) << form;
    holding.expect_newton(0.055);
    holding.expect_rest();
  }
}

// Out, turned, back another way: force times way and torque times turn.
TEST(LargeHolds, JawsGiveBackNoMoreThanWentInOnAClosedWay) {
  for (const auto form : kForms) {
    Holding holding(grasping_def(form));
    const Vector3d corners[] = {{0, 0, 0}, {0.006, 0, 0.004}, {0.004, 0.006, 0.008}, {-0.002, 0.006, 0.002}, {0, 0, 0}};
    const double angles[] = {0, 0.2, 0.4, -0.2, 0};
    double work = 0, most = 0;
    Vector3d force = Vector3d::Zero(), torque = Vector3d::Zero(), at = corners[0];
    Quaterniond turn = Quaterniond::Identity();
    for (int c = 1; c < 5; ++c)
      for (int s = 1; s <= 60; ++s) {
        const double share = s / 60.0;
        const Vector3d to = (1 - share) * corners[c - 1] + share * corners[c];
        const Quaterniond next = turned((1 - share) * angles[c - 1] + share * angles[c]);
        const palpate_grasp grasp = jaws_at(to, next);
        holding.step(&grasp.part);
        const AngleAxisd by(next * turn.inverse());
        // The torque is about the origin of the organ.
        const auto about = [&](const Vector3d& t, const Vector3d& f, const Vector3d& p) -> Vector3d {
          return t - (kGrasped + p).cross(f);
        };
        work -=
            0.5 * (force + holding.force()).dot(to - at) +
            0.5 * by.angle() * by.axis().dot(about(torque, force, at) + about(holding.torque(), holding.force(), to));
        most = std::max(most, work);
        force = holding.force(), torque = holding.torque(), at = to, turn = next;
      }
    EXPECT_GT(most, 1e-4);
    EXPECT_LE(-work, 0.02 * most) << form;
    EXPECT_LE(work, 0.02 * most) << form;
  }
}

// A pull beyond the friction: what is felt stays at it.
TEST(LargeHolds, JawsSlipAtTheirFriction) {
  for (const auto form : kForms) {
    Holding holding(grasping_def(form));
    int slips = 0, flagged = 0;
    for (int s = 0; s <= 100; ++s) {
      palpate_grasp grasp = jaws_at(s * 1e-4 * Vector3d(1, 0.3, 0.4).normalized(), turned(0));
      grasp.friction = 0.3, grasp.clamp_force = 0.5;
      flagged += holding.step(&grasp.part) != 0;
      if (palpate_scene_grasp_state(holding.scene.get(), 3)->condition != PALPATE_GRASP_SLIPS) continue;
      ++slips;
      EXPECT_NEAR(holding.force().norm(), 0.15, 0.02 * 0.15) << form << " step " << s;
    }
    EXPECT_GT(slips, 20) << form;
    EXPECT_LE(flagged, slips / 10) << form;
  }
}

// ---- links -------------------------------------------------------------------------------------------------------------

palpate_link_end end_at(const Vector3d& p) {
  const PlaceOnFace place = place_at(box(), {1, 0, 0}, p);
  return on_surface(place.triangle, place.weights);
}
struct Linking : Holding {
  explicit Linking(palpate_deformation_model form, palpate_contact_law law = PALPATE_LAW_STICKING)
      : Holding([&] {
          SceneDef def = holding_def(form, law);
          def.links.max_links = 4;
          return def;
        }()) {}
  palpate_step_flags step_with(const std::vector<palpate_link>& links) {
    palpate_error error = {};
    EXPECT_EQ(palpate_scene_set_links(scene.get(), links.data(), static_cast<std::int32_t>(links.size()), &error), 0)
        << error.text;
    return step(nullptr);
  }
  const palpate_link_state& state(std::int32_t i = 0) { return *palpate_scene_link_state(scene.get(), i); }
  Vector3d apart(std::int32_t i = 0) { return Vector3d(state(i).ends[1]) - Vector3d(state(i).ends[0]); }
  // m, of the directions of the link and of its force.
  double off_line(std::int32_t i = 0) {
    return apart(i).normalized().cross(Vector3d(state(i).force).normalized()).norm();
  }
};

// 6 mm at 0.1 m/s. Its ends may be discs, which give way by more than the mesh shows.
TEST(LargeHolds, AThreadPullsTwoFoldsTogetherAsNewtonsMethodSays) {
  const Vector3d fold(0.06, 0.014, 0.03), other(0.06, 0.036, 0.028);
  for (const auto form : kForms)
    for (const auto law : kEveryLaw)
      for (const double radius : {0.0, 0.005}) {
        Linking linking(form, law);
        palpate_link thread = link_of(PALPATE_LINK_THREAD, end_at(fold), end_at(other));
        thread.radius = radius;
        int flagged = 0;
        for (int s = 0; s <= 100; ++s) {
          thread.rest_length = (fold - other).norm() - 1e-4 * std::min(s, 60);
          flagged += linking.step_with({thread}) != 0;
        }
        EXPECT_EQ(flagged, 0) << form << " " << law << " " << radius;
        linking.expect_newton(radius > 0 ? 0.0005 : 0.0025);
        EXPECT_GT(linking.state().tension, 0.1);
        if (radius == 0) {
          EXPECT_NEAR(linking.apart().norm(), thread.rest_length, 1e-4) << form << " " << law;
        }
        EXPECT_LE(linking.off_line(), radius > 0 ? 0.04 : 0.01);
        linking.step_with({});
        linking.expect_rest();
      }
}

// Through four places, in which it slides.
TEST(LargeHolds, ASeamHasOneTensionInAllItsParts) {
  const Vector3d at[] = {{0.06, 0.012, 0.03}, {0.06, 0.022, 0.012}, {0.06, 0.03, 0.03}, {0.06, 0.04, 0.014}};
  for (const auto form : kForms) {
    Linking linking(form);
    std::vector<palpate_link> seam;
    double whole = 0;
    for (int i = 0; i < 3; ++i) {
      const double length = (at[i] - at[i + 1]).norm();
      seam.push_back(link_of(PALPATE_LINK_THREAD, end_at(at[i]), end_at(at[i + 1]), length));
      seam.back().runs_on = i < 2;
      whole += length;
    }
    const double first = seam[0].rest_length;
    for (int s = 0; s <= 120; ++s) {
      seam[0].rest_length = first - 1e-4 * std::min(s, 80);
      linking.step_with(seam);
    }
    linking.expect_newton(0.002);
    double sum = 0;
    for (int i = 0; i < 3; ++i) {
      sum += linking.apart(i).norm();
      EXPECT_EQ(linking.state(i).tension, linking.state(0).tension);
      EXPECT_LE(linking.off_line(i), 0.02);
    }
    EXPECT_GT(linking.state().tension, 0.1);
    EXPECT_NEAR(sum, whole - 0.008, 1e-4) << form;
    linking.step_with({});
    linking.expect_rest();
  }
}

// The end in the world is led out, aside and back: the spring takes and gives the same work.
TEST(LargeHolds, ASpringToTheWorldGivesBackNoMoreThanWentInOnAClosedWay) {
  const Vector3d corners[] = {
      {0.07, 0.025, 0.03}, {0.085, 0.02, 0.04}, {0.08, 0.04, 0.045}, {0.07, 0.045, 0.03}, {0.07, 0.025, 0.03}};
  for (const auto form : kForms) {
    Linking linking(form);
    double work = 0, most = 0;
    Vector3d at = corners[0], before = Vector3d::Zero();
    const auto go = [&](const Vector3d& to) {
      linking.step_with({link_of(PALPATE_LINK_SPRING, end_at({0.06, 0.025, 0.028}), in_world(to), 0.009, 80)});
      // On the first end, along the line to the one in the world.
      const Vector3d pull(linking.state().force);
      work += 0.5 * (before + pull).dot(to - at), most = std::max(most, work);
      before = pull, at = to;
    };
    for (int s = 0; s < 20; ++s) go(corners[0]);
    work = most = 0;
    for (int c = 1; c < 5; ++c)
      for (int s = 1; s <= 150; ++s) go((1 - s / 150.0) * corners[c - 1] + s / 150.0 * corners[c]);
    EXPECT_GT(most, 5e-4);
    EXPECT_LE(std::fabs(work), 0.02 * most) << form;
  }
}

// N, that a finger feels which comes and presses by 0.7 mm, while a thread through three places is drawn tighter by 0.8 mm.
double felt_beside_a_thread(palpate_deformation_model form, palpate_contact_law law) {
  const Vector3d at[] = {{0.06, 0.012, 0.03}, {0.06, 0.024, 0.016}, {0.06, 0.036, 0.03}}, pressed(0.06, 0.04, 0.01);
  SceneDef def = holding_def(form, law);
  def.collision = PALPATE_COLLISION_REST, def.links.max_links = 2;
  Holding holding(def);
  for (int s = 0; s <= 80; ++s) {
    palpate_link parts[2];
    for (int i = 0; i < 2; ++i)
      parts[i] = link_of(PALPATE_LINK_THREAD, end_at(at[i]), end_at(at[i + 1]), (at[i] - at[i + 1]).norm());
    parts[0].rest_length -= 1e-5 * (s + 1), parts[0].runs_on = 1;
    palpate_scene_set_links(holding.scene.get(), parts, 2, nullptr);
    const Vector3d point = pressed + Vector3d(1e-4 - 1e-5 * s, 0, 0);
    holding.step(point_tool(point.data(), 1, 0.004));
  }
  return holding.force().norm();
}

// What the thread does to the body is paid for, and takes no force from the finger. So little moves that the linear organ tells the force.
TEST(LargeHolds, AFingerThatComesWhileAThreadIsDrawnFeelsTheTissue) {
  const double linear = felt_beside_a_thread(PALPATE_DEFORMATION_LINEAR, PALPATE_LAW_STICKING);
  EXPECT_GT(linear, 0.01);
  for (const auto form : kForms)
    for (const auto law : kEveryLaw)
      EXPECT_NEAR(felt_beside_a_thread(form, law), linear, 0.02 * linear) << form << " " << law;
}

// ---- needles -----------------------------------------------------------------------------------------------------------

const Vector3d kEntry(0.06, 0.024, 0.022), kInwards(-1, 0, 0);

struct Piercing : Holding {
  explicit Piercing(palpate_deformation_model form, palpate_contact_law law = PALPATE_LAW_STICKING)
      : Holding([&] {
          SceneDef def = holding_def(form, law);
          def.needles.needles = 1, def.needles.needle_places = 12;
          return def;
        }()) {}
  // to: from the entry.
  palpate_step_flags drive(const Vector3d& to) {
    palpate_needle needle = palpate_default_needle();
    const PlaceOnFace place = place_at(box(), {1, 0, 0}, kEntry);
    needle.triangle = place.triangle, needle.id = 1, needle.radius = 5e-4, needle.spacing = 5e-3;
    Eigen::Map<Vector3d>(needle.barycentric) = place.weights;
    Eigen::Map<Vector3d>(needle.tip) = kEntry + to;
    Eigen::Map<Vector3d>(needle.direction) = kInwards;
    needle.friction = friction, needle.puncture_force = 0.3, needle.cutting_force = 0.15;
    tip = to;
    return step(&needle.part);
  }
  // Steps that are flagged.
  int go(const Vector3d& to, int steps) {
    const Vector3d from = tip;
    int flagged = 0;
    for (int s = 1; s <= steps; ++s) {
      flagged += drive(from + s / double(steps) * (to - from)) != 0;
      pressed = std::max(pressed, state().tip_force);
    }
    return flagged;
  }
  const palpate_needle_state& state() { return *palpate_scene_needle_state(scene.get(), 3); }
  double friction = 12, pressed = 0;
  Vector3d tip = -0.002 * kInwards;
};

// Pressed in by 35 mm at 0.1 m/s, aside by 6 mm, and drawn out.
TEST(LargeHolds, ANeedleIsPressedInAndDrawnOutAsNewtonsMethodSays) {
  for (const auto form : kForms)
    for (const auto law : kEveryLaw) {
      Piercing piercing(form, law);
      int flagged = piercing.go(0.035 * kInwards, 370);
      EXPECT_NEAR(piercing.pressed, 0.3, 0.01) << "the surface is pierced at its force";
      EXPECT_NEAR(piercing.state().tip_force, 0.15, 0.003) << "the tip cuts";
      EXPECT_EQ(piercing.state().condition, PALPATE_NEEDLE_CUTS);
      flagged += piercing.go(0.035 * kInwards + Vector3d(0, 0.004, 0.0045), 60);
      flagged += piercing.go(piercing.tip, 40);
      // Where the surface is pierced, and what held the tip is gone.
      EXPECT_LE(flagged, form == PALPATE_DEFORMATION_LARGE ? 0 : 4) << form << " " << law;
      piercing.expect_newton(0.003);
      piercing.go(piercing.tip - 0.06 * kInwards, 600);
      EXPECT_EQ(piercing.state().condition, PALPATE_NEEDLE_OUTSIDE) << form << " " << law;
      piercing.expect_rest();
    }
}

// It sticks in the tissue, and is led around across its axis.
TEST(LargeHolds, ANeedleGivesBackNoMoreThanWentInOnAClosedWay) {
  const Vector3d corners[] = {{0, 0, 0}, {0, 0.005, 0}, {0, 0.004, 0.006}, {0, -0.004, 0.003}, {0, 0, 0}};
  for (const auto form : kForms) {
    Piercing piercing(form);
    piercing.friction = 1000;
    const Vector3d inside = 0.035 * kInwards;
    piercing.go(inside, 370), piercing.go(inside, 50);
    double work = 0, most = 0;
    Vector3d before = piercing.force();
    for (int c = 1; c < 5; ++c)
      for (int s = 1; s <= 60; ++s) {
        const Vector3d to = inside + (1 - s / 60.0) * corners[c - 1] + s / 60.0 * corners[c], way = to - piercing.tip;
        piercing.drive(to);
        work -= 0.5 * (before + piercing.force()).dot(way), most = std::max(most, work);
        before = piercing.force();
      }
    EXPECT_GT(most, 1e-4);
    EXPECT_LE(std::fabs(work), 0.02 * most) << form;
  }
}

}  // namespace
}  // namespace palpate::tests
