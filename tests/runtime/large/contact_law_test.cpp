// Sliding, unilateral contact and friction under large deformation, along the present normal of the surface.
#include <Eigen/Geometry>

#include "runtime/large/deforming_body.h"
#include "tests/runtime/large/large_scene.h"

namespace palpate::tests {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;

const TouchedBox& box() {
  static const TouchedBox shared({}, with_large(false));
  return shared;
}

// Tool points at the far face x = 60 mm, whose outward normal is +x.
class Probe {
 public:
  Probe(const SceneDef& def, double friction, double radius = 0.008) : scene(box().scene(def)), contacts(scene.get()) {
    tool = palpate_default_tool();
    tool.disc_radius = radius, tool.friction = friction;
  }
  // N, force on the tool.
  Vector3d move(const std::vector<Vector3d>& to) {
    points.clear();
    for (const Vector3d& p : to) points.insert(points.end(), p.data(), p.data() + 3);
    tool.points = points.data(), tool.point_count = static_cast<std::int32_t>(to.size());
    flags = palpate_scene_touch(scene.get(), &tool, 1, 1e-3, contacts.get(), contacts.bytes());
    return Vector3d(state().force_raw);
  }
  const palpate_tool_state& state() { return *palpate_contacts_tool(contacts.get(), 0); }
  // N, on the tool, of one of its points.
  Vector3d force_of(std::int32_t point) {
    Vector3d sum = Vector3d::Zero();
    for (std::int32_t e = 0; e < contacts->node_count; ++e)
      if (const auto* node = palpate_contacts_node(contacts.get(), e); node->point == point)
        sum -= Vector3d(node->force);
    return sum;
  }
  ScenePointer scene;
  Contacts contacts;
  palpate_tool tool;
  std::vector<double> points;
  palpate_step_flags flags = 0;
};

SceneDef law_def(palpate_contact_law law, palpate_contact_model contact = PALPATE_CONTACT_PATCH) {
  SceneDef def = large_def(contact);
  def.law = law, def.collision = PALPATE_COLLISION_REST;
  return def;
}

const Vector3d kPlace(0.06, 0.025, 0.02), kOut(1, 0, 0);

// The mean displacement of the contact nodes with their weights, and the contact's normal at rest, turned as the nodes' mean
// normal has.
struct Held {
  Vector3d displacement = Vector3d::Zero(), normal = kOut;
};
Held held_by(Probe& probe, const VectorXd& weight, const Vector3d& outward) {
  const auto u = displacements(probe.scene.get(), probe.contacts, box().body.surface_nodes);
  const auto at = [&](std::int32_t n) {
    return Vector3d(box().node(n) + Eigen::Map<const Eigen::Vector3f>(u.data() + 3 * n).cast<double>());
  };
  Held held;
  Vector3d before = Vector3d::Zero(), now = Vector3d::Zero();
  for (std::int32_t n = 0; n < weight.size(); ++n) {
    if (weight[n] == 0) continue;
    held.displacement += weight[n] * (at(n) - box().node(n));
    const auto around = [&](auto place) {
      Vector3d sum = Vector3d::Zero();
      for (const auto& t : box().body.triangles)
        if (t[0] == n || t[1] == n || t[2] == n) sum += (place(t[1]) - place(t[0])).cross(place(t[2]) - place(t[0]));
      return Vector3d(sum.normalized());
    };
    before += weight[n] * around([](std::int32_t node) { return box().node(node); });
    now += weight[n] * around(at);
  }
  held.normal = Eigen::Quaterniond::FromTwoVectors(before, now) * outward;
  return held;
}

TEST(LargeLaws, ASmallPushAndDragIsTheLinearOne) {
  for (const auto law : {PALPATE_LAW_SLIDING, PALPATE_LAW_UNILATERAL, PALPATE_LAW_COULOMB})
    for (const auto contact :
         {PALPATE_CONTACT_NODE, PALPATE_CONTACT_TRIANGLE, PALPATE_CONTACT_POINT, PALPATE_CONTACT_PATCH}) {
      Vector3d force[2];
      std::int32_t slips[2];
      for (int large = 0; large < 2; ++large) {
        SceneDef def = law_def(law, contact);
        def.large.deformation = static_cast<palpate_deformation_model>(large);
        Probe probe(def, 0.2);
        probe.move({kPlace + 1e-4 * kOut});
        for (int tick = 0; tick <= 20; ++tick)
          force[large] = probe.move({kPlace - 2e-5 * kOut + Vector3d(0, 1e-6 * tick, 0.5e-6 * tick)});
        EXPECT_EQ(probe.flags, 0u) << law << contact << large;
        slips[large] = probe.state().slip_count;
      }
      EXPECT_GT(force[0].norm(), 0);
      // The strain is 1e-3; friction and the solver's tolerance are 1 %.
      EXPECT_LE((force[0] - force[1]).norm(), 0.02 * force[0].norm()) << law << contact;
      EXPECT_EQ(slips[0], slips[1]) << law << contact;
    }
}

// Discs that overlap share what the mesh does not resolve (disc_compliance.h). The second one presses less deep, so that it slips while
// the first one sticks.
TEST(LargeLaws, ASmallPushAndDragOfDiscsThatOverlapIsTheLinearOne) {
  for (const auto law : {PALPATE_LAW_STICKING, PALPATE_LAW_COULOMB})
    for (const double apart : {0.0, 0.002}) {
      Vector3d force[3][3];
      const Vector3d aside(0, apart, 0);
      const std::vector<Vector3d> start = {kPlace + 1e-4 * kOut, kPlace + aside + 1e-4 * kOut};
      for (int discs = 1; discs <= 2; ++discs)
        for (int form = 0; form < 3; ++form) {
          SceneDef def = law_def(law);
          def.large.deformation = static_cast<palpate_deformation_model>(form);
          Probe probe(def, 0.2, 0.003);
          probe.move({start.begin(), start.begin() + discs});
          for (int tick = 0; tick <= 20; ++tick) {
            const Vector3d along(0, 1e-6 * tick, 0.5e-6 * tick);
            std::vector<Vector3d> to = {kPlace - 2e-5 * kOut + along, kPlace + aside - 1.9e-5 * kOut + along};
            to.resize(static_cast<std::size_t>(discs));
            force[discs][form] = probe.move(to);
            for (int i = 0; form == 2 && i < 100 && palpate_scene_deform(probe.scene.get()) > 0; ++i) {
            }
          }
          EXPECT_EQ(probe.flags, 0u) << law << form;
          // The strain is 1e-3; friction and the solver's tolerance are 1 %.
          EXPECT_LE((force[discs][form] - force[discs][0]).norm(), 0.02 * force[discs][0].norm())
              << law << form << apart;
        }
      // A second disc at the same place, a little less deep, adds next to nothing: the first one is already there.
      if (apart == 0 && law == PALPATE_LAW_COULOMB) {
        EXPECT_NEAR(force[2][1].norm(), force[1][1].norm(), 0.01 * force[1][1].norm());
      }
    }
}

// With a sliding contact the body is in equilibrium with a single force along the present normal, and the contact's mean
// displacement along it is the tool's.
TEST(LargeLaws, ADeepSlidingPushIsTheConvergedSolutionAlongThePresentNormal) {
  for (const auto law : {PALPATE_LAW_SLIDING, PALPATE_LAW_UNILATERAL}) {
    Probe probe(law_def(law), 0);
    // Off the middle of the face, where the normal turns.
    const Vector3d at(0.06, 0.035, 0.02);
    probe.move({at + 1e-4 * kOut});
    // The normal at rest is interpolated between the nodes, those of the edge among them.
    const Vector3d outward = probe.move({at - 1e-6 * kOut}).normalized();
    Vector3d p, force;
    // The frame follows the surface by a quarter of what it is off in each step.
    for (int tick = 0; tick <= 150; ++tick) force = probe.move({p = at - 1e-4 * std::min(tick, 90) * kOut});
    EXPECT_EQ(probe.flags, 0u) << law;
    VectorXd weight = VectorXd::Zero(box().body.surface_nodes);
    for (std::int32_t e = 0; e < probe.contacts->node_count; ++e) {
      const auto* node = palpate_contacts_node(probe.contacts.get(), e);
      weight[node->node] += Vector3d(node->force).norm() / force.norm();
    }
    EXPECT_NEAR(weight.sum(), 1, 1e-9);
    const Held held = held_by(probe, weight, outward);
    EXPECT_LE(held.normal.dot(outward), 0.9995) << "the normal has not turned";
    // The frame is that of the step before; at rest it is the present one but for the step's tolerance.
    EXPECT_GE(force.normalized().dot(held.normal), 0.9999) << law;
    const Seen seen(box(), false, 0);
    const LargeReference reference(seen.body);
    Eigen::MatrixXd row = Eigen::MatrixXd::Zero(1, reference.dofs());
    for (std::int32_t n = 0; n < weight.size(); ++n) row.block<1, 3>(0, 3 * n) = weight[n] * held.normal.transpose();
    const auto field = displacements(probe.scene.get(), probe.contacts, box().body.surface_nodes);
    VectorXd u = VectorXd::Zero(reference.dofs());
    const double target = held.displacement.dot(held.normal);
    VectorXd on_body;
    for (const double share : {0.25, 0.5, 0.75, 1.0})
      on_body = reference.solve(row, VectorXd::Constant(1, share * target), &u);
    EXPECT_NEAR(force.norm(), std::abs(on_body[0]), 0.02 * force.norm()) << law;
    const VectorXd found =
        Eigen::Map<const Eigen::VectorXf>(field.data(), static_cast<Eigen::Index>(field.size())).cast<double>();
    EXPECT_LE((found - u.head(found.size())).norm(), 0.01 * u.norm()) << law;
  }
}

TEST(LargeLaws, ADragSlipsAtFrictionTimesThePushAndTurnsRoundThroughSticking) {
  const double friction = 0.25;
  Probe probe(law_def(PALPATE_LAW_COULOMB), friction);
  const Vector3d begin(0.06, 0.018, 0.02);
  probe.move({begin + 1e-4 * kOut});
  for (int tick = 0; tick <= 80; ++tick) probe.move({begin - 1e-4 * tick * kOut});
  int slipped = 0, stuck = 0, behind = 0;
  for (int tick = 0; tick < 400; ++tick) {
    const double y = 5e-5 * (tick < 200 ? tick : 400 - tick);  // 10 mm and back
    const Vector3d f = probe.move({begin - 0.008 * kOut + Vector3d(0, y, 0)});
    VectorXd weight = VectorXd::Zero(box().body.surface_nodes);
    for (std::int32_t e = 0; e < probe.contacts->node_count; ++e) {
      const auto* node = palpate_contacts_node(probe.contacts.get(), e);
      weight[node->node] += Vector3d(node->force).norm() / f.norm();
    }
    const Vector3d normal = held_by(probe, weight, kOut).normal;
    const double push = f.dot(normal), hold = (f - push * normal).norm();
    ASSERT_GT(push, 0) << tick;
    // The frame of a step is that of the state before it.
    EXPECT_LE(hold, friction * push + 0.01 * f.norm()) << tick;
    if (tick > 100 && tick < 200) {
      EXPECT_GE(hold, friction * push - 0.01 * f.norm()) << tick;
      slipped += probe.state().slip_count;
    }
    if (tick >= 200 && tick < 210) stuck += probe.state().slip_count == 0;
    behind += probe.flags != 0;
  }
  EXPECT_GE(slipped, 95);
  EXPECT_GE(stuck, 5);
  EXPECT_EQ(behind, 0);
}

// The anchor goes to the place below the tool and stays there. Off the middle of a face the surface below a deep point moves across
// the normal, so that an anchor that went all of the way that the tool is off would run along the surface.
TEST(LargeLaws, WithoutFrictionADeepPushThatWaitsIsThatOfUnilateral) {
  for (const auto deformation : {PALPATE_DEFORMATION_LARGE, PALPATE_DEFORMATION_LARGE_BESIDE})
    for (const Vector3d& at : {Vector3d(0.06, 0.04, 0.028), kPlace}) {
      Vector3d force[2];
      int flagged[2] = {};
      for (const auto law : {PALPATE_LAW_UNILATERAL, PALPATE_LAW_COULOMB}) {
        SceneDef def = law_def(law);
        def.large.deformation = deformation;
        Probe probe(def, 0);
        const bool coulomb = law == PALPATE_LAW_COULOMB;
        probe.move({at + 1e-4 * kOut});
        for (int tick = 0; tick <= 300; ++tick) {
          force[coulomb] = probe.move({at - 1e-4 * std::min(tick, 120) * kOut});
          for (int i = 0; i < 20 && deformation == PALPATE_DEFORMATION_LARGE_BESIDE; ++i)
            if (palpate_scene_deform(probe.scene.get()) <= 0) break;
          flagged[coulomb] += tick > 120 && probe.flags != 0;
        }
      }
      // The tolerance of a step, and unilateral contacts whose anchors may lag by a fraction of a triangle.
      EXPECT_LE((force[0] - force[1]).norm(), 0.02 * force[0].norm()) << deformation << " " << at.transpose();
      EXPECT_EQ(flagged[1], 0) << deformation << " " << at.transpose();
    }
}

// Around a disc that is pressed by more than its radius the surface turns with the force. A frame that followed it at once swings for
// ever, by 14 % of the force, and each step is flagged.
TEST(LargeLaws, ADeepDiscThatWaitsDoesNotSwing) {
  for (const auto law : {PALPATE_LAW_SLIDING, PALPATE_LAW_UNILATERAL}) {
    Probe probe(law_def(law), 0, 0.010);
    double least = INFINITY, most = 0;
    for (int tick = -1; tick <= 100; ++tick) {
      const double force = probe.move({kPlace - 2e-4 * std::min(tick, 60) * kOut}).norm();
      if (tick <= 80) continue;
      EXPECT_EQ(probe.flags, 0u) << law << tick;
      least = std::min(least, force), most = std::max(most, force);
    }
    EXPECT_GT(least, 0);
    EXPECT_LE(most - least, 1e-3 * most) << law;
  }
}

TEST(LargeLaws, WithMuchFrictionADragIsThatOfAStickingContact) {
  Probe sticking(law_def(PALPATE_LAW_STICKING), 0), coulomb(law_def(PALPATE_LAW_COULOMB), 50);
  for (Probe* probe : {&sticking, &coulomb}) {
    probe->move({kPlace + 1e-4 * kOut});
    for (int tick = 0; tick <= 80; ++tick) probe->move({kPlace - 1e-4 * tick * kOut + Vector3d(0, 0.5e-4 * tick, 0)});
    for (int tick = 0; tick <= 10; ++tick) probe->move({kPlace - Vector3d(0.008, -0.004, 0)});
    EXPECT_EQ(probe->state().slip_count, 0);
  }
  const Vector3d a(sticking.state().force_raw), b(coulomb.state().force_raw);
  EXPECT_LE((a - b).norm(), 0.01 * a.norm());  // the tolerance of a step
}

// A shallow point beside a deep one: the surface leaves it, so that it carries nothing, and comes back.
TEST(LargeLaws, APointThatTheSurfaceHasLeftCarriesNothingAndTakesTheForceBack) {
  for (const auto law : {PALPATE_LAW_UNILATERAL, PALPATE_LAW_COULOMB}) {
    Probe probe(law_def(law), 0.3, 0.004);
    const Vector3d deep(0.06, 0.02, 0.02), shallow(0.06, 0.034, 0.02);
    probe.move({deep + 1e-4 * kOut, shallow + 1e-4 * kOut});
    probe.move({deep + 5e-5 * kOut, shallow - 3e-4 * kOut});
    EXPECT_GT(probe.force_of(1)[0], 0);
    for (int tick = 0; tick <= 120; ++tick) {
      probe.move({deep - 1e-4 * tick * kOut, shallow - 3e-4 * kOut});
      EXPECT_GE(probe.force_of(1)[0], 0) << tick;
      EXPECT_GE(probe.force_of(0)[0], 0) << tick;
    }
    EXPECT_EQ(probe.flags, 0u);
    EXPECT_EQ(probe.force_of(1).norm(), 0);
    EXPECT_EQ(probe.state().release_count, 1);
    for (int tick = 119; tick >= -10; --tick) probe.move({deep - 1e-4 * tick * kOut, shallow - 3e-4 * kOut});
    EXPECT_GT(probe.force_of(1)[0], 0);
    EXPECT_EQ(probe.state().release_count, 0);
  }
}

TEST(LargeLaws, AToolThatIsPulledOutNeverPullsAndTheOrganComesToRest) {
  for (const auto law : {PALPATE_LAW_UNILATERAL, PALPATE_LAW_COULOMB}) {
    Probe probe(law_def(law), 0.4);
    probe.move({kPlace + 1e-4 * kOut});
    for (int tick = 0; tick <= 100; ++tick) probe.move({kPlace - 1e-4 * tick * kOut});
    for (int tick = 100; tick >= -5; tick -= 5) EXPECT_GE(probe.move({kPlace - 1e-4 * tick * kOut})[0], 0) << tick;
    for (int tick = 0; tick < 60; ++tick) probe.move({kPlace + 1e-3 * kOut});
    for (const float u : displacements(probe.scene.get(), probe.contacts, box().body.surface_nodes))
      EXPECT_LE(std::abs(u), 1e-6f);
  }
}

// As where contacts that move have taken them all: a contact that moved in every step never had a force.
TEST(LargeLaws, AreSolvedThoughNoOperationsOfTheStepAreLeft) {
  const Seen seen(box(), false, 0);
  std::vector<std::int32_t> order;
  for (std::int32_t n = 0; n < seen.body.node_count; ++n)
    if (!seen.fixed[3 * static_cast<std::size_t>(n)]) order.push_back(n);
  SceneMemory memory{palpate_allocator{}};
  DeformingBody deforming;
  DeformingBody::Limits limits;
  limits.nodes = limits.constraints = 1, limits.gives_way = true;
  ASSERT_EQ(deforming.create(memory, seen.body, order.data(), static_cast<std::int32_t>(order.size()), limits, nullptr),
            LargeSolver::Created::made);
  ContactNode node = {order.back(), 0, {}, 0, 1};
  ContactConstraint constraint = {};
  constraint.node_count = 1, constraint.axes = 1, constraint.law = ContactLaw::unilateral, constraint.framed = true;
  constraint.frame.m[0][2] = -1, constraint.frame.m[1][0] = constraint.frame.m[2][1] = 1, constraint.share = 1;
  Vec3 target = {1e-3, 0, 0}, force;
  ContactConstraints set;
  set.nodes = &node, set.constraints = &constraint, set.target = &target;
  set.node_count = set.constraint_count = 1;
  StepWork work;
  work.create(1000);
  work.begin();
  work.add(1000);
  deforming.solve(set, &work, &force);
  EXPECT_LT(force.z, -1e-4);
  memory.release_all();
}

TEST(LargeLaws, ARestoredStateGoesOnWithTheSameBits) {
  const SceneDef def = law_def(PALPATE_LAW_COULOMB);
  Probe probe(def, 0.2), other(def, 0.2);
  const auto play = [&](Probe& played, int from, int to) {
    for (int tick = from; tick < to; ++tick)
      played.move({kPlace - 1e-4 * (tick - 1) * kOut + Vector3d(0, 1e-4 * tick, 0),
                   kPlace - Vector3d((tick % 30 < 20 ? 1 : -1) * 1e-4, 0.012, 0)});
  };
  play(probe, 0, 45);
  std::vector<std::uint64_t> state(palpate_scene_state_bytes(probe.scene.get()) / 8 + 1);
  palpate_error error = {};
  ASSERT_EQ(palpate_scene_save(probe.scene.get(), state.data(), 8 * state.size(), &error), PALPATE_OK) << error.text;
  ASSERT_EQ(palpate_scene_restore(other.scene.get(), state.data(), 8 * state.size(), &error), PALPATE_OK);
  play(probe, 45, 90), play(other, 45, 90);
  EXPECT_EQ(0, std::memcmp(probe.contacts.get(), other.contacts.get(), probe.contacts->used_bytes));
}

}  // namespace
}  // namespace palpate::tests
