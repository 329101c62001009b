// The report of a step: each contact's place, force and motion, and what began, ended, slipped and stuck.
#include <map>
#include <random>
#include <set>

#include "tests/runtime/asked_scene.h"
#include "tests/runtime/played_box.h"

namespace palpate::tests {
namespace {

const TouchedBox& box() {
  static const TouchedBox shared({.cells = {5, 4, 4}});
  return shared;
}

SceneDef report_def(palpate_contact_model contact = PALPATE_CONTACT_POINT,
                    palpate_contact_law law = PALPATE_LAW_STICKING) {
  return unlimited_def(contact, law, PALPATE_COLLISION_DEFORMED, PALPATE_REPORT_CONTACTS);
}

struct Reporting : TouchedScene {
  explicit Reporting(const SceneDef& def) : TouchedScene(box(), def) {}

  void touch(const std::vector<palpate_tool>& tools, double dt = 1e-3) {
    TouchedScene::touch(tools, dt);
    report = palpate_scene_report(scene.get());
    ASSERT_NE(report, nullptr);
    ASSERT_EQ(report->step, contacts->step);
    ASSERT_EQ(report->used_bytes,
              report->events_offset + static_cast<std::size_t>(report->event_count) * sizeof(palpate_contact_event));
  }
  const palpate_contact& contact(int i) const { return *palpate_report_contact(report, i); }
  const palpate_contact_event& event(int i) const { return *palpate_report_event(report, i); }
  std::vector<palpate_contact_event_kind> kinds() const {
    std::vector<palpate_contact_event_kind> all;
    for (int i = 0; i < report->event_count; ++i) all.push_back(event(i).kind);
    return all;
  }

  const palpate_contact_report* report = nullptr;
};

Eigen::Vector3d vector(const double* x) {
  return Eigen::Vector3d(x);
}

palpate_tool named(palpate_tool tool, std::int32_t id) {
  tool.id = id;
  return tool;
}

// The displacement of a place by the shape that the scene draws.
Eigen::Vector3d displacement_at(Reporting& reporting, std::int32_t triangle, const double* barycentric) {
  const std::vector<float> u = reporting.shape();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int v = 0; v < 3; ++v)
    sum += barycentric[v] * Eigen::Map<const Eigen::Vector3f>(&u[3 * box().body.triangles[triangle][v]]).cast<double>();
  return sum;
}

TEST(Report, PlacesForcesAndMotionsAreThoseOfTheStep) {
  for (const auto contact : kEveryContact)
    for (const auto law : kEveryLaw) {
      SCOPED_TRACE(testing::Message() << "contact " << contact << ", law " << law);
      Reporting reporting(report_def(contact, law));
      Eigen::Vector3d last_p[2];
      int compared = 0, moved = 0;
      for (int s = 0; s < 60; ++s) {
        const Eigen::Vector3d p[2] = {{.031 + 5e-5 * s, .022, .0405 - 5e-5 * s}, {.0601 - 4e-5 * s, .031, .018}};
        const palpate_grip grip = grip_at_place(box().far_triangle(2), {.2, .5, .3}, {1e-5 * s, 0, 0});
        palpate_tool tools[2] = {point_tool(p[0].data(), 1, .004, .2), point_tool(p[1].data(), 1, .004, .2)};
        tools[1].grips = &grip, tools[1].grip_count = 1;
        const std::vector<float> before =
            s == 0 ? std::vector<float>(3 * static_cast<std::size_t>(box().body.surface_nodes)) : reporting.shape();
        reporting.touch({named(tools[0], 5), named(tools[1], 9)});
        Eigen::Vector3d sum[2] = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
        int count[2] = {}, slips[2] = {}, releases[2] = {};
        for (int c = 0; c < reporting.report->contact_count; ++c) {
          const palpate_contact& made = reporting.contact(c);
          ASSERT_EQ(made.tool_id, made.tool == 0 ? 5 : 9);
          sum[made.tool] += vector(made.force), ++count[made.tool];
          slips[made.tool] += made.state == PALPATE_CONTACT_SLIPS;
          releases[made.tool] += made.state == PALPATE_CONTACT_RELEASED;
          ASSERT_GE(made.triangle, 0);
          EXPECT_EQ(made.node, -1);
          // Displacements are summed in single precision for the shape: 3 mm to 1e-9 m, and in differences over 1 ms to 1e-5 m/s.
          const Eigen::Vector3d u = displacement_at(reporting, made.triangle, made.barycentric);
          const Eigen::Vector3d rest = box().place(made.triangle, vector(made.barycentric));
          EXPECT_LT((vector(made.place) - rest - u).norm(), 1e-8);
          EXPECT_NEAR(vector(made.normal).norm(), 1, 1e-12);
          EXPECT_GT(vector(made.normal).dot(box().outward(made.triangle)), .5);
          const bool is_grip = made.point == 1;
          const Eigen::Vector3d holder = is_grip ? rest + vector(grip.displacement) : p[made.tool];
          EXPECT_NEAR(made.depth, (rest - holder).dot(box().outward(made.triangle)), 1e-12);
          EXPECT_NEAR(made.gap, (holder - vector(made.place)).dot(vector(made.normal)), 1e-12);
          if (contact == PALPATE_CONTACT_POINT && law != PALPATE_LAW_UNILATERAL && law != PALPATE_LAW_COULOMB) {
            EXPECT_LT(std::abs(made.gap), law == PALPATE_LAW_STICKING ? 1e-9 : 5e-4);
          }
          if (s > 0) {
            Eigen::Vector3d was = Eigen::Vector3d::Zero();
            for (int v = 0; v < 3; ++v)
              was +=
                  made.barycentric[v] *
                  Eigen::Map<const Eigen::Vector3f>(&before[3 * box().body.triangles[made.triangle][v]]).cast<double>();
            const Eigen::Vector3d tool =
                is_grip ? Eigen::Vector3d(1e-5, 0, 0) : Eigen::Vector3d(p[made.tool] - last_p[made.tool]);
            EXPECT_LT((vector(made.velocity) - (tool - (u - was)) / 1e-3).norm(), 3e-5) << made.point;
            moved += vector(made.velocity).norm() > .01;
            ++compared;
          }
        }
        for (int t = 0; t < 2; ++t) {
          const palpate_tool_state& state = reporting.tool(t);
          // Rounding of the sums of the nodes' forces, which cancel under TRIANGLE.
          double nodes = 0;
          for (int n = 0; n < reporting.contacts->node_count; ++n)
            nodes += vector(reporting.contacts.nodes()[n].force).norm();
          EXPECT_LT((sum[t] - vector(state.force_raw)).norm(), 1e-13 + 1e-13 * nodes);
          EXPECT_EQ(count[t], state.contact_count);
          if (contact != PALPATE_CONTACT_TRIANGLE) {  // whose counts are of its three parts
            EXPECT_EQ(slips[t], state.slip_count);
            EXPECT_EQ(releases[t], state.release_count);
          }
        }
        last_p[0] = p[0], last_p[1] = p[1];
      }
      EXPECT_GT(compared, 120);
      if (law != PALPATE_LAW_STICKING) {
        EXPECT_GT(moved, 20);
      }
    }
}

TEST(Report, VelocitiesAreFiniteInTheShortestStepAndAShorterOneIsBadInput) {
  Reporting reporting(report_def(PALPATE_CONTACT_POINT, PALPATE_LAW_STICKING));
  double depth = 0;
  const auto step = [&](double dt) {
    const Eigen::Vector3d p(.031, .022, .0405 - depth);
    depth += 1e-4;
    reporting.touch({point_tool(p.data(), 1, .004)}, dt);
    return reporting.report->contact_count > 0 ? vector(reporting.contact(0).velocity).lpNorm<Eigen::Infinity>() : 0.0;
  };
  for (int s = 0; s < 20; ++s) step(1e-3);
  const double usual = step(1e-3);
  for (const double dt : {1e-9, 1e-300}) {
    const double velocity = step(dt);
    EXPECT_TRUE(std::isfinite(velocity) && velocity > 1e5 * usual) << velocity;
    EXPECT_EQ(reporting.flags, 0u);
  }
  step(1e-3);
  for (const double dt : {1e-312, 5e-324, 9e-301, 0.0, -1e-3, double{NAN}, 2e6, HUGE_VAL}) {
    EXPECT_NEAR(step(dt), usual, 0.1 * usual) << dt << ": the last good dt is taken";
    EXPECT_TRUE(reporting.flags & PALPATE_STEP_BAD_INPUT) << dt;
  }
}

TEST(Report, MotionIsThatOfTheToolAgainstAnOrganThatMovesAndTurns) {
  Reporting reporting(report_def());
  palpate_pose pose = palpate_default_pose();
  pose.orientation[0] = pose.orientation[3] = std::sqrt(.5);  // a quarter about z: x of the organ is y of the world
  // The organ rises by 0.02 m/s against a probe that rests, and carries it 1 mm deep.
  const double on_organ[3] = {.031, .022, .0405};
  double tip[3];
  palpate_point_to_world(pose.position, pose.orientation, on_organ, tip);
  int pressed = 0;
  for (int s = 0; s < 75; ++s) {
    pose.position[2] = 2e-5 * s;
    ASSERT_EQ(palpate_scene_set_pose(reporting.scene.get(), &pose, nullptr), PALPATE_OK);
    reporting.touch({point_tool(tip)});
    if (reporting.report->contact_count == 0) continue;
    ++pressed;
    const palpate_contact& made = reporting.contact(0);
    EXPECT_NEAR(made.place[0], .031, 1e-3);
    EXPECT_NEAR(made.depth, 2e-5 * s - .0005, 1e-12);
    EXPECT_GT(made.force[2], 0);  // on the tool, up
    // The place follows the tool; in the step of the impact it had not yet moved as far.
    EXPECT_LT(vector(made.velocity).norm(), made.begun == reporting.report->step ? .0201 : 1e-6);
    double force[3];
    palpate_vector_to_world(pose.orientation, made.force, force);
    EXPECT_LT((vector(force) - reporting.force()).norm(), 1e-12);
  }
  EXPECT_GT(pressed, 45);
}

TEST(Report, TellsBeginAndEndOfATouchAndOfAGrip) {
  Reporting reporting(report_def());
  int begun = 0, ended = 0;
  for (int s = 0; s < 100; ++s) {
    const Eigen::Vector3d p(.031, .022, .0405 - 5e-5 * (s < 50 ? s : 100 - s));
    const int before = s == 0 ? 0 : reporting.tool().contact_count;
    reporting.touch({named(point_tool(p.data()), 3)});
    const int now = reporting.tool().contact_count;
    ASSERT_EQ(reporting.report->event_count, before != now) << s;
    if (before == now) continue;
    const palpate_contact_event& event = reporting.event(0);
    EXPECT_EQ(event.tool_id, 3);
    EXPECT_EQ(event.point, 0);
    EXPECT_NEAR(event.place[0], .031, 1e-3);
    if (now) {
      EXPECT_EQ(event.kind, PALPATE_EVENT_BEGIN);
      EXPECT_EQ(event.contact, 0);
      // The impact: 0.05 mm in a millisecond, downwards; the surface has given way within the step.
      EXPECT_EQ(reporting.contact(0).begun, static_cast<std::uint64_t>(s + 1));
      EXPECT_LT(reporting.contact(0).velocity[2], 0);
      ++begun;
    } else {
      EXPECT_EQ(event.kind, PALPATE_EVENT_END);
      EXPECT_EQ(event.contact, -1);
      EXPECT_GE(event.triangle, 0);
      ++ended;
    }
  }
  EXPECT_EQ(begun, 1);
  EXPECT_EQ(ended, 1);
  // A grip of a node begins with the step that sends it, and ends with the first one that does not.
  const palpate_grip grip = grip_at_node(box().touchable[3], {0, 0, -.001});
  using testing::ElementsAre;
  reporting.touch({grip_tool(&grip)});
  EXPECT_THAT(reporting.kinds(), ElementsAre(PALPATE_EVENT_BEGIN));
  EXPECT_EQ(reporting.contact(0).node, box().touchable[3]);
  EXPECT_EQ(reporting.contact(0).triangle, -1);
  EXPECT_LT((vector(reporting.contact(0).place) - box().node(box().touchable[3]) - Eigen::Vector3d(0, 0, -.001)).norm(),
            1e-9);
  reporting.touch({grip_tool(&grip)});
  EXPECT_THAT(reporting.kinds(), ElementsAre());
  reporting.touch({palpate_default_tool()});
  EXPECT_THAT(reporting.kinds(), ElementsAre(PALPATE_EVENT_END));
  EXPECT_EQ(reporting.event(0).node, box().touchable[3]);
  EXPECT_EQ(reporting.report->contact_count, 0);
}

TEST(Report, KnowsContactsByTheirToolsIdInAnyOrder) {
  Reporting reporting(report_def());
  const palpate_grip grips[3] = {grip_at_node(box().touchable[3], {0, 0, -.001}),
                                 grip_at_node(box().touchable[9], {.001, 0, 0}),
                                 grip_at_node(box().touchable[20], {0, .001, 0})};
  const palpate_tool a = named(grip_tool(&grips[0]), 10), b = named(grip_tool(&grips[1]), 20),
                     c = named(grip_tool(&grips[2]), 30);
  using testing::ElementsAre;
  reporting.touch({a, b});
  EXPECT_THAT(reporting.kinds(), ElementsAre(PALPATE_EVENT_BEGIN, PALPATE_EVENT_BEGIN));
  for (int s = 0; s < 6; ++s) {
    reporting.touch(s % 2 == 0 ? std::vector<palpate_tool>{b, a} : std::vector<palpate_tool>{a, b});
    EXPECT_THAT(reporting.kinds(), ElementsAre());
    ASSERT_EQ(reporting.report->contact_count, 2);
    for (int i = 0; i < 2; ++i) {
      EXPECT_EQ(reporting.contact(i).begun, 1u);
      EXPECT_EQ(reporting.contact(i).tool, (reporting.contact(i).tool_id == 10) == (s % 2 == 0));
      EXPECT_LT(vector(reporting.contact(i).velocity).norm(), 1e-6);
    }
  }
  // Another tool takes the place of the first one in the same step.
  reporting.touch({c, b});
  EXPECT_THAT(reporting.kinds(), ElementsAre(PALPATE_EVENT_END, PALPATE_EVENT_BEGIN));
  EXPECT_EQ(reporting.event(0).tool_id, 10);
  EXPECT_EQ(reporting.event(1).tool_id, 30);
  reporting.touch({b});
  EXPECT_THAT(reporting.kinds(), ElementsAre(PALPATE_EVENT_END));
  EXPECT_EQ(reporting.event(0).tool_id, 30);
  reporting.touch({});
  EXPECT_THAT(reporting.kinds(), ElementsAre(PALPATE_EVENT_END));
  EXPECT_EQ(reporting.event(0).tool_id, 20);
  // A reset tells nothing; what is held after it begins anew.
  reporting.touch({a, b});
  palpate_scene_reset_tool(reporting.scene.get(), 10);
  reporting.touch({a, b});
  EXPECT_THAT(reporting.kinds(), ElementsAre(PALPATE_EVENT_BEGIN));
  EXPECT_EQ(reporting.event(0).tool_id, 10);
  reporting.reset();
  EXPECT_EQ(palpate_scene_report(reporting.scene.get())->step, 0u);
  EXPECT_EQ(palpate_scene_report(reporting.scene.get())->contact_count, 0);
  reporting.touch({a});
  EXPECT_THAT(reporting.kinds(), ElementsAre(PALPATE_EVENT_BEGIN));
}

TEST(Report, TellsWhereAContactBeginsToSlipAndSticksAgain) {
  for (const auto contact : {PALPATE_CONTACT_POINT, PALPATE_CONTACT_PATCH}) {
    Reporting reporting(report_def(contact, PALPATE_LAW_COULOMB));
    std::vector<palpate_contact_event_kind> all;
    bool slipping = false;
    int slipped = 0;
    // Down 2 mm, 4 mm aside, then deeper and no further aside.
    for (int s = 0; s < 200; ++s) {
      const double down = s < 40 ? 5e-5 * s : .002 + (s < 120 ? 0 : 1e-5 * (s - 120)),
                   aside = 5e-5 * std::clamp(s - 40, 0, 80);
      const Eigen::Vector3d p(.026 + aside, .022, .0401 - down);
      reporting.touch({point_tool(p.data(), 1, .004, .15)});
      for (int e = 0; e < reporting.report->event_count; ++e) {
        all.push_back(reporting.event(e).kind);
        if (reporting.event(e).kind == PALPATE_EVENT_SLIP_START) slipping = true;
        if (reporting.event(e).kind == PALPATE_EVENT_STICK_START) slipping = false;
      }
      if (reporting.report->contact_count == 0) continue;
      const palpate_contact_state state = reporting.contact(0).state;
      if (reporting.contact(0).begun == reporting.report->step) slipping = state == PALPATE_CONTACT_SLIPS;
      EXPECT_EQ(state == PALPATE_CONTACT_SLIPS, slipping) << s;
      slipped += slipping;
    }
    ASSERT_GE(all.size(), 3u);
    EXPECT_EQ(all.front(), PALPATE_EVENT_BEGIN);
    EXPECT_THAT(all, testing::Contains(PALPATE_EVENT_SLIP_START));
    EXPECT_GT(slipped, 20);
    EXPECT_EQ(all.back(), PALPATE_EVENT_STICK_START);
    EXPECT_FALSE(slipping);
  }
}

// A run in which points and grips of tools come and go, slip and jump, in changing orders. Returns the bytes of all contacts.
std::vector<std::uint64_t> play_at_random(Reporting& reporting, const std::function<void()>& each) {
  std::mt19937 random(11);
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  std::vector<std::uint64_t> all;
  std::vector<Eigen::Vector3d> p(12, Eigen::Vector3d(.03, .02, .045));
  for (int s = 0; s < 1500; ++s) {
    for (Eigen::Vector3d& each_point : p) {
      each_point += Eigen::Vector3d(between(-1, 1), between(-1, 1), between(-1, 1)) * 1.2e-3;
      each_point = each_point.cwiseMax(Eigen::Vector3d(-.004, -.004, .028)).cwiseMin(Eigen::Vector3d(.064, .054, .046));
    }
    std::vector<palpate_tool> tools;
    std::vector<palpate_grip> grips;
    for (int t = 0; t < 4; ++t)
      grips.push_back(grip_at_node(box().touchable[7 * t + s / 300], {0, 1e-3 * std::sin(.01 * s), 0}));
    for (int t = 0; t < 4; ++t) {
      if (random() % 40 == 0) continue;
      palpate_tool tool =
          point_tool(p[3 * t].data(), static_cast<std::int32_t>(random() % 30 == 0 ? random() % 4 : 3), .003, .3);
      tool.id = static_cast<std::int32_t>(random() % 60 == 0 ? 100 + t : t);
      if (random() % 3 != 0) tool.grips = &grips[t], tool.grip_count = 1;
      tools.push_back(tool);
    }
    std::shuffle(tools.begin(), tools.end(), random);
    if (s % 400 == 399) palpate_scene_reset_tool(reporting.scene.get(), 1);
    reporting.TouchedScene::touch(tools);
    reporting.report = palpate_scene_report(reporting.scene.get());
    const auto* bytes = reinterpret_cast<const std::uint64_t*>(reporting.contacts.get());
    all.insert(all.end(), bytes, bytes + reporting.contacts->used_bytes / 8);
    each();
  }
  return all;
}

TEST(Report, EventsAreTheDifferenceBetweenTheContactsOfTwoSteps) {
  for (const auto law : {PALPATE_LAW_STICKING, PALPATE_LAW_UNILATERAL, PALPATE_LAW_COULOMB}) {
    Reporting reporting(report_def(PALPATE_CONTACT_POINT, law));
    using Key = std::pair<std::int32_t, std::int32_t>;
    std::map<Key, std::pair<std::uint64_t, palpate_contact_state>> held;
    std::map<int, int> told;
    play_at_random(reporting, [&] {
      std::map<Key, std::pair<std::uint64_t, palpate_contact_state>> now;
      for (int c = 0; c < reporting.report->contact_count; ++c) {
        const palpate_contact& contact = reporting.contact(c);
        ASSERT_TRUE(now.insert({{contact.tool_id, contact.point}, {contact.begun, contact.state}}).second);
      }
      if (reporting.contacts->step % 400 == 0)  // a reset forgets without events
        for (auto at = held.begin(); at != held.end();) at = at->first.first == 1 ? held.erase(at) : std::next(at);
      bool began = false;
      for (int e = 0; e < reporting.report->event_count; ++e) {
        const palpate_contact_event& event = reporting.event(e);
        const Key key{event.tool_id, event.point};
        ++told[event.kind];
        if (event.kind == PALPATE_EVENT_END) {
          EXPECT_FALSE(began);  // ends come first
          ASSERT_EQ(held.erase(key), 1u);
          EXPECT_EQ(event.contact, -1);
          continue;
        }
        began = true;
        const palpate_contact& contact = reporting.contact(event.contact);
        EXPECT_EQ(Key(contact.tool_id, contact.point), key);
        EXPECT_EQ(event.triangle, contact.triangle);
        if (event.kind == PALPATE_EVENT_BEGIN) {
          ASSERT_TRUE(held.insert({key, {reporting.report->step, contact.state}}).second);
        } else {
          EXPECT_NE(held.at(key).second, contact.state);
          held.at(key).second = contact.state;
        }
      }
      // What was not told: between released, free and sticking under UNILATERAL, and slipping to released.
      ASSERT_EQ(held.size(), now.size());
      for (auto& [key, was] : held) {
        ASSERT_EQ(was.first, now.at(key).first);
        if (now.at(key).second == PALPATE_CONTACT_SLIPS || now.at(key).second == PALPATE_CONTACT_STICKS) {
          EXPECT_EQ(was.second, now.at(key).second);
        }
        was.second = now.at(key).second;
      }
    });
    EXPECT_GT(told[PALPATE_EVENT_BEGIN], 300);
    EXPECT_GT(told[PALPATE_EVENT_END], 300);
    if (law == PALPATE_LAW_COULOMB) {
      EXPECT_GT(told[PALPATE_EVENT_SLIP_START], 30);
      EXPECT_GT(told[PALPATE_EVENT_STICK_START], 30);
    }
  }
}

TEST(Report, ChangesNoBitOfAStepAndTakesNothingWhereItIsOff) {
  for (const auto law : {PALPATE_LAW_STICKING, PALPATE_LAW_COULOMB}) {
    SceneDef def = report_def(PALPATE_CONTACT_PATCH, law);
    Reporting on(def);
    def.report.report = PALPATE_REPORT_OFF;
    Reporting off(def);
    const auto with = play_at_random(on, [] {}), without = play_at_random(off, [] {});
    EXPECT_EQ(with, without);
    EXPECT_EQ(palpate_scene_report(off.scene.get()), nullptr);
  }
  EXPECT_EQ(palpate_scene_report(nullptr), nullptr);
  const auto bytes = [&](palpate_report_model report) { return bytes_of(with(SceneDef(), report), box()); };
  // 64 contacts, twice as many events, 4 tools with 64 points each.
  const std::size_t more = bytes(PALPATE_REPORT_CONTACTS) - bytes(PALPATE_REPORT_OFF);
  EXPECT_GT(more, 64 * (sizeof(palpate_contact) + 2 * sizeof(palpate_contact_event)));
  EXPECT_LT(more, 200000u);
}

TEST(Report, HasRoomForEveryEventOfAStep) {
  SceneDef def = report_def();
  def.max_points = 48;
  Reporting reporting(def);
  std::vector<palpate_grip> grips;
  for (int g = 0; g < 48; ++g) grips.push_back(grip_at_node(box().touchable[g], {0, 0, 1e-4}));
  for (int s = 0; s < 20; ++s) {
    // In each step another tool holds all grips.
    reporting.touch({named(grip_tool(grips.data(), 48), s)});
    ASSERT_EQ(reporting.report->contact_count, 48);
    ASSERT_EQ(reporting.report->event_count, s == 0 ? 48 : 96);
    for (int e = 0; e < reporting.report->event_count; ++e) {
      EXPECT_EQ(reporting.event(e).kind, s > 0 && e < 48 ? PALPATE_EVENT_END : PALPATE_EVENT_BEGIN);
      EXPECT_EQ(reporting.event(e).point, e % 48);
    }
  }
}

}  // namespace
}  // namespace palpate::tests
