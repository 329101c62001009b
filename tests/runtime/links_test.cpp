// Sutures, clips, ligaments and springs against the dense body: the ends stand where linear elasticity takes them under the forces that
// the links report, and these forces are those that the links' laws ask for at these places. Both together are the equilibrium.
#include <Eigen/Dense>
#include <random>
#include <utility>

#include "tests/runtime/asked_scene.h"
#include "tests/runtime/linked_scene.h"
#include "tests/runtime/played_box.h"
#include "tests/support/box_corridor.h"

namespace palpate::tests {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// [3N][3N] m/N, zero on fixed dofs.
const MatrixXd& compliance() {
  static const MatrixXd shared = dense_compliance(dense_box({}));
  return shared;
}

// Two places of the far face, 27 mm apart.
palpate_link thread_of(double rest_length, double stiffness = INFINITY) {
  return link_of(PALPATE_LINK_THREAD, on_surface(tiny_box().far_triangle(0)), on_surface(tiny_box().far_triangle(14)),
                 rest_length, stiffness);
}
double apart_at_rest(const palpate_link& link) {
  return (tiny_box().place(link.ends[0].triangle, Vector3d(link.ends[0].barycentric)) -
          tiny_box().place(link.ends[1].triangle, Vector3d(link.ends[1].barycentric)))
      .norm();
}

SceneDef linked_def() {
  SceneDef def = unlimited_def(PALPATE_CONTACT_POINT, PALPATE_COLLISION_OFF);
  def.links.max_links = 16;
  return def;
}

// A scene with its links and the tools of its steps.
struct Linked : LinkedScene {
  explicit Linked(const SceneDef& def = linked_def(), const TouchedBox& of = tiny_box()) : LinkedScene(of, def) {}

  // The dense body under the forces of all contact nodes.
  VectorXd field() {
    VectorXd force = VectorXd::Zero(tiny_box().dofs());
    for (std::int32_t n = 0; n < contacts->node_count; ++n)
      force.segment<3>(3 * contacts.nodes()[n].node) += Vector3d(contacts.nodes()[n].force);
    return compliance() * force;
  }
  // Columns are stored in single precision: 6e-8 of a displacement of centimetres.
  void expect_equilibrium(double within) { expect_laws(field(), 1e-8, within); }
};

// N: tension and direction of one link of length L and softness s whose ends are x0 apart at rest. Its force T t moves them by -M T t,
// M the compliance of one end against the other; they are x = (L + T s) t apart in the end, so that (L + T s + T M) t = x0.
struct OneLink {
  double tension;
  Vector3d along;
};
OneLink solve_one(const palpate_link& link) {
  MatrixXd h = MatrixXd::Zero(3, tiny_box().dofs());
  Vector3d x0 = Vector3d::Zero();
  for (int e = 0; e < 2; ++e)
    for (int v = 0; v < 3 && link.ends[e].kind == PALPATE_END_SURFACE_POINT; ++v) {
      const auto n = tiny_box().body.triangles[link.ends[e].triangle][v];
      h.block<3, 3>(0, 3 * n) += (e ? 1 : -1) * link.ends[e].barycentric[v] * Matrix3d::Identity();
      x0 += (e ? 1 : -1) * link.ends[e].barycentric[v] * tiny_box().node(n);
    }
  for (int e = 0; e < 2; ++e)
    if (link.ends[e].kind == PALPATE_END_WORLD) x0 += (e ? 1 : -1) * Vector3d(link.ends[e].point);
  const Matrix3d m = h * compliance() * h.transpose();
  const auto along = [&](double t) {
    return Vector3d(((link.rest_length + t / link.stiffness) * Matrix3d::Identity() + t * m).inverse() * x0);
  };
  double low = 0, high = 100;
  for (int i = 0; i < 200; ++i) (along(0.5 * (low + high)).norm() > 1 ? low : high) = 0.5 * (low + high);
  return {high, along(high)};
}

TEST(Links, ThreadsPullAsADirectSolveOfTheTurningLine) {
  for (const double share : {0.95, 0.7, 0.3, 0.05})
    for (const double stiffness : {double(INFINITY), 200.0, 10.0}) {
      Linked linked;
      palpate_link link = thread_of(1, stiffness);
      link.rest_length = share * apart_at_rest(link);
      linked.set({link});
      EXPECT_EQ(linked.steps(60), 0u);
      const OneLink expected = solve_one(link);
      const palpate_link_state& found = linked.state();
      EXPECT_EQ(found.condition, PALPATE_LINK_TAUT);
      // The line keeps its row within 0.1 milliradian. Where the ends are a twentieth of their distance at rest apart, that error of the
      // force turns the line itself by twenty times as much.
      EXPECT_NEAR(found.tension, expected.tension, 1e-3 * expected.tension) << share << " " << stiffness;
      EXPECT_LT((Vector3d(found.force) - expected.tension * expected.along).norm(), 2e-3 * expected.tension);
      linked.expect_equilibrium(2e-3 * expected.tension);
    }
}

TEST(Links, LigamentsToTheWorldTurnWithTheTissue) {
  // To a point beside the far face, so that the line turns as the tissue gives way.
  const std::int32_t triangle = tiny_box().far_triangle(4);
  const Vector3d anchor = tiny_box().place(triangle, kMiddle) + Vector3d(0.01, 0.03, -0.01);
  for (const auto kind : {PALPATE_LINK_THREAD, PALPATE_LINK_SPRING}) {
    Linked linked;
    const palpate_link link = link_of(kind, on_surface(triangle), in_world(anchor), 0.02, 60);
    linked.set({link});
    linked.steps(60);
    const OneLink expected = solve_one(link);
    EXPECT_NEAR(linked.state().tension, expected.tension, 1e-3 * expected.tension);
    linked.expect_equilibrium(2e-3 * expected.tension);
    EXPECT_GT(std::acos(expected.along.dot((anchor - tiny_box().place(triangle, kMiddle)).normalized())), 0.02)
        << "the case must turn the line";
  }
}

TEST(Links, SpringsPushWhereTheyAreShorterThanTheirLength) {
  Linked linked;
  palpate_link link = thread_of(0, 150);
  link.kind = PALPATE_LINK_SPRING, link.rest_length = 1.2 * apart_at_rest(link);
  linked.set({link});
  linked.steps(60);
  EXPECT_LT(linked.state().tension, -0.05);
  linked.expect_equilibrium(2e-3 * -linked.state().tension);
}

TEST(Links, StiffnessAndLengthChangeAtRunTime) {
  Linked linked, fresh;
  palpate_link link = thread_of(0.02, 20);
  linked.set({link});
  linked.steps(60);
  const double soft = linked.state().tension;
  link.stiffness = 300, link.rest_length = 0.015;
  linked.set({link}), fresh.set({link});
  linked.steps(60), fresh.steps(60);
  EXPECT_GT(linked.state().tension, 1.3 * soft);
  // Each has turned its line to within 0.1 milliradian, on its own way.
  EXPECT_NEAR(linked.state().tension, fresh.state().tension, 1e-4 * fresh.state().tension);
}

TEST(Links, ClipsBringTheirEndsTogether) {
  for (const double stiffness : {double(INFINITY), 400.0}) {
    Linked linked;
    const palpate_link clip = link_of(PALPATE_LINK_CLIP, on_surface(tiny_box().far_triangle(0)),
                                      on_surface(tiny_box().far_triangle(14)), 0, stiffness);
    linked.set({clip});
    EXPECT_EQ(linked.touch(), 0u);
    linked.expect_equilibrium(0);
    EXPECT_GT(linked.state().tension, 0.1);
    if (stiffness == INFINITY) {
      EXPECT_LT(linked.state().length, 1e-7);
    }
  }
}

TEST(Links, ActAndReact) {
  Linked linked;
  linked.set({thread_of(0.005), link_of(PALPATE_LINK_CLIP, on_surface(tiny_box().far_triangle(3)),
                                        on_surface(tiny_box().far_triangle(9)))});
  linked.steps(10);
  for (std::int32_t link = 0; link < 2; ++link) {
    Vector3d sum = Vector3d::Zero();
    double size = 0;
    std::int32_t nodes = 0;
    for (std::int32_t n = 0; n < linked.contacts->node_count; ++n) {
      if (linked.contacts.nodes()[n].index != link) continue;
      EXPECT_EQ(linked.contacts.nodes()[n].source, PALPATE_SOURCE_LINK);
      sum += Vector3d(linked.contacts.nodes()[n].force);
      size += Vector3d(linked.contacts.nodes()[n].force).norm(), ++nodes;
    }
    EXPECT_EQ(nodes, 6);
    EXPECT_GT(size, 0.1);
    EXPECT_LT(sum.norm(), 1e-14 * size);
  }
}

// A tool that plays beside them, with and without links. What is counted of a slack link changes nothing of a step.
TEST(Links, SlackOnesLeaveEveryBitAsItIs) {
  SceneDef def = unlimited_def(PALPATE_COLLISION_DEFORMED, PALPATE_LAW_COULOMB, PALPATE_REPORT_CONTACTS);
  // The defaults of a scene without links: a link adds to the contact nodes that it may have.
  def.max_contact_nodes = 600;
  Linked without(def);
  def.links.max_links = 4;
  Linked with(def);
  palpate_link loose = thread_of(0.05);
  with.set({loose, thread_of(0.04)});
  std::vector<std::vector<unsigned char>> runs[2];
  std::vector<std::int32_t> operations[2];
  for (Linked* linked : {&without, &with})
    play(tiny_box(), linked->scene.get(), linked->contacts, 120, [&](palpate_step_flags) {
      const std::int32_t counted = std::exchange(linked->contacts->operations, 0);
      operations[linked == &with].push_back(counted);
      const auto* bytes = reinterpret_cast<const unsigned char*>(linked->contacts.get());
      runs[linked == &with].emplace_back(bytes, bytes + linked->contacts->used_bytes);
      if (linked == &with) {
        EXPECT_EQ(with.state().condition, PALPATE_LINK_SLACK);
      }
    });
  EXPECT_TRUE(runs[0] == runs[1]);
  for (std::size_t s = 0; s < operations[0].size(); ++s)
    EXPECT_GT(operations[1][s], operations[0][s]) << "a step looks at each link";
}

// What a bound says of a thread's ends is never less than what they move: a thread that was stretched has its row in the next step.
TEST(Links, BecomeTautOneStepAfterTheyWereStretchedHoweverLongTheyRested) {
  palpate_link link = thread_of(0);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> draw(-1, 1);
  int stretched = 0, rested = 0;
  for (int round = 0; round < 20; ++round) {
    Linked linked;
    link.rest_length = (1.002 + 0.03 * std::fabs(draw(random))) * apart_at_rest(link);
    linked.set({link});
    linked.touch();
    bool taut_next = false;
    // A tool that wanders, and now and then jumps.
    Vector3d way = Vector3d::Zero(), speed = Vector3d::Zero();
    for (int s = 0; s < 120; ++s) {
      if (s % 20 == 0) speed = 4e-5 * Vector3d(draw(random), draw(random), draw(random));
      way += (s % 37 == 36 ? 30 : 1) * speed;
      const palpate_grip grip = grip_at_place(link.ends[1].triangle, {.1, .1, .8}, {way[0], way[1], way[2]});
      linked.touch({grip_tool(&grip)});
      const bool taut = linked.state().condition == PALPATE_LINK_TAUT;
      // The row of a thread that was stretched bears a force, unless the tool has come back meanwhile.
      if (taut_next) {
        EXPECT_TRUE(taut || linked.state().length <= link.rest_length) << round << " " << s;
      } else {
        EXPECT_FALSE(taut) << round << " " << s;
      }
      const VectorXd u = linked.field();
      const double length = (linked.place_of(link.ends[1], u) - linked.place_of(link.ends[0], u)).norm();
      EXPECT_NEAR(linked.state().length, length, 2e-8)
          << "the state is that of the step, whether the bound spared it or not";
      taut_next = taut || length > link.rest_length;
      stretched += taut, rested += !taut;
    }
  }
  EXPECT_GT(stretched, 100);
  EXPECT_GT(rested, 100);
}

TEST(Links, TellTheReportWhenTheyBecomeTautAndSlackAndBreak) {
  Linked linked(with(linked_def(), PALPATE_REPORT_CONTACTS));
  palpate_link link = thread_of(0);
  link.id = 9, link.rest_length = 1.01 * apart_at_rest(link);
  palpate_link clip = link_of(PALPATE_LINK_CLIP, in_world(tiny_box().place(tiny_box().far_triangle(4), kMiddle)),
                              on_surface(tiny_box().far_triangle(4)));
  std::vector<palpate_contact_event> told;
  const auto step = [&](double way) {
    const palpate_grip grip = grip_at_place(link.ends[1].triangle, {.1, .1, .8}, {0, way, way});
    linked.touch({grip_tool(&grip)});
    const palpate_contact_report* report = palpate_scene_report(linked.scene.get());
    told.clear();
    for (std::int32_t e = 0; e < report->event_count; ++e)
      if (const palpate_contact_event& event = *palpate_report_event(report, e); event.kind >= PALPATE_EVENT_LINK_TAUT)
        told.push_back(event);
  };
  const auto kinds = [&] {
    std::vector<int> all;
    for (const auto& event : told) all.push_back(event.kind);
    return all;
  };
  linked.set({link, clip});
  step(0);
  ASSERT_EQ(kinds(), std::vector<int>{PALPATE_EVENT_LINK_TAUT}) << "of the clip, whose id is its index";
  EXPECT_EQ(told[0].point, 1);
  EXPECT_EQ(told[0].triangle, tiny_box().far_triangle(4)) << "of its end on the surface";
  for (int s = 1; s <= 60; ++s) step(1e-4 * s);
  EXPECT_TRUE(kinds().empty());
  EXPECT_EQ(linked.state().condition, PALPATE_LINK_TAUT);
  std::vector<int> all;
  for (int s = 60; s >= 0; --s) {
    step(1e-4 * s);
    for (const auto& event : told) {
      all.push_back(event.kind);
      EXPECT_EQ(event.point, 9);
    }
  }
  ASSERT_FALSE(all.empty());
  EXPECT_EQ(all.back(), PALPATE_EVENT_LINK_SLACK);
  link.breaking_force = 1e-3, link.rest_length = 0.01;
  linked.set({link, clip});
  // Drawn so short at once, it is taut and breaks in the same step, which tells the end alone.
  step(0);
  EXPECT_EQ(kinds(), std::vector<int>{PALPATE_EVENT_LINK_BROKE});
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].tool_id, -1);
  EXPECT_EQ(told[0].contact, -1);
  EXPECT_LT((Vector3d(told[0].place) - Vector3d(linked.state().ends[0])).norm(), 1e-12);
  step(0);
  EXPECT_TRUE(kinds().empty());
}

TEST(Links, BreakBeyondTheirForceAndStayBroken) {
  Linked linked;
  palpate_link link = thread_of(0.02);
  link.id = 7, link.breaking_force = 0.3;
  linked.set({link});
  std::uint64_t step = 0;
  for (int s = 1; s <= 200 && step == 0; ++s) {
    link.rest_length -= 0.1e-3;
    linked.set({link});
    const palpate_step_flags flags = linked.touch();
    if (flags & PALPATE_STEP_LINK_BROKE)
      step = s;
    else
      EXPECT_LE(linked.state().tension, 0.3);
  }
  ASSERT_GT(step, 0u);
  EXPECT_EQ(linked.state().condition, PALPATE_LINK_BROKEN);
  EXPECT_EQ(linked.state().broken, step);
  EXPECT_GT(linked.state().tension, 0.3);
  for (int s = 0; s < 3; ++s) {
    EXPECT_EQ(linked.touch(), 0u);
    EXPECT_EQ(linked.state().tension, 0);
    EXPECT_EQ(linked.contacts->node_count, 0);
    linked.set({link});  // given again under its id it stays broken
  }
  EXPECT_EQ(linked.state().broken, step);
  linked.reset();
  EXPECT_EQ(linked.state().condition, PALPATE_LINK_SLACK);
}

// Four stitches of one thread, of which the first part is shorter than the others.
TEST(Links, OfOneThreadShareItsLengthUntilTheirTensionsAreEqual) {
  Linked linked;
  const int places[] = {0, 5, 9, 14};
  std::vector<palpate_link> links;
  double whole = 0;
  for (int i = 0; i < 3; ++i) {
    palpate_link link = link_of(PALPATE_LINK_THREAD, on_surface(tiny_box().far_triangle(places[i])),
                                on_surface(tiny_box().far_triangle(places[i + 1])));
    link.rest_length = (i == 0 ? 0.5 : 0.95) * apart_at_rest(link), link.runs_on = i < 2;
    whole += link.rest_length;
    links.push_back(link);
  }
  linked.set(links);
  linked.touch();
  EXPECT_EQ(linked.state(0).tension, linked.state(2).tension);
  EXPECT_GT(linked.state(0).rest_length, 1.05 * links[0].rest_length)
      << "the part that was too short gets from the others";
  linked.steps(100);
  double sum = 0;
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(linked.state(i).tension, linked.state(0).tension);
    sum += linked.state(i).rest_length;
  }
  EXPECT_GT(linked.state(0).tension, 0.1);
  EXPECT_NEAR(sum, whole, 1e-15);
  linked.expect_equilibrium(3e-3 * linked.state(0).tension);
  // Pulled tight: the thread is shortened in one part, and all parts share it.
  const double before = linked.state(0).tension;
  links[2].rest_length -= 0.004;
  linked.set(links);
  linked.steps(100);
  EXPECT_GT(linked.state(0).tension, 1.05 * before);
  EXPECT_EQ(linked.state(0).tension, linked.state(2).tension);
}

struct ThreadForm {
  double shortest = 0.75, stiffness = 500;  // of each part: least share of the distance of its places; N/m
};

// A thread of 16 parts through places some 10 mm apart on the far face, each drawn to `shortest` of its length or up to .2 less short.
std::vector<palpate_link> random_thread(std::mt19937& random, ThreadForm form) {
  constexpr int kParts = 16;
  std::uniform_real_distribution<double> draw(0, 1);
  std::vector<std::int32_t> far;
  for (std::size_t t = 0; t < tiny_box().body.triangles.size(); ++t)
    if (tiny_box().outward(static_cast<std::int32_t>(t))[0] > 0.99) far.push_back(static_cast<std::int32_t>(t));
  const auto any_place = [&] {
    const double a = draw(random), b = (1 - a) * draw(random);
    const auto which = static_cast<std::size_t>(draw(random) * static_cast<double>(far.size()));
    return on_surface(far[std::min(which, far.size() - 1)], {a, b, 1 - a - b});
  };
  const auto at = [](const palpate_link_end& end) { return tiny_box().place(end.triangle, Vector3d(end.barycentric)); };
  std::vector<palpate_link> links;
  palpate_link_end last = any_place();
  for (int i = 0; i < kParts; ++i) {
    palpate_link_end next = any_place();
    while (std::fabs((at(next) - at(last)).norm() - 0.010) > 0.002) next = any_place();
    palpate_link link = link_of(PALPATE_LINK_THREAD, last, next, 0, form.stiffness);
    link.rest_length = (form.shortest + 0.2 * draw(random)) * apart_at_rest(link), link.runs_on = i + 1 < kParts;
    links.push_back(link), last = next;
  }
  return links;
}

// Neighbours that lie in one triangle or beside it act on one another as much as on themselves. One row for each part, whose lengths made
// the tensions equal afterwards, swung for ever where parts became slack and taut again, or lines turned with the tissue.
TEST(Links, OfOneThreadOfManyPartsHaveOneTensionInEachStepAndRestAfterTwenty) {
  for (const ThreadForm form : {ThreadForm{}, ThreadForm{0.75, INFINITY}}) {
    std::mt19937 random(11);
    for (int round = 0; round < 20; ++round) {
      SCOPED_TRACE(testing::Message() << "round " << round << ", stiffness " << form.stiffness);
      Linked linked;
      linked.set(random_thread(random, form));
      double least = INFINITY, most = 0;
      for (int s = 0; s < 40; ++s) {
        EXPECT_EQ(linked.touch(), 0u);
        const double tension = linked.state().tension;
        for (std::int32_t i = 1; i < 16; ++i) ASSERT_EQ(linked.state(i).tension, tension);
        if (s >= 20) least = std::min(least, tension), most = std::max(most, tension);
      }
      EXPECT_GT(most, 0.01);
      // Places that come near one another still turn their line by some degrees.
      EXPECT_LT(most - least, 0.02 * most);
      linked.expect_equilibrium(0.02 * most);
    }
  }
}

// Drawn to a third of its length, a thread brings places together. It holds them so with less than its tension: their line has no direction
// then, and one that turned for ever made all tensions swing.
TEST(Links, OfOneThreadThatBringsItsPlacesTogetherComeToRest) {
  std::mt19937 random(11);
  double nearest = INFINITY;
  for (int round = 0; round < 6; ++round) {
    SCOPED_TRACE(round);
    Linked linked;
    linked.set(random_thread(random, {0.3, 500}));
    double least = INFINITY, most = 0;
    for (int s = 0; s < 45; ++s) {
      linked.touch();
      for (std::int32_t i = 0; i < 16 && s >= 25; ++i) {
        const palpate_link_state& state = linked.state(i);
        least = std::min(least, state.tension), most = std::max(most, state.tension);
        nearest = std::min(nearest, state.length);
        EXPECT_LE(Vector3d(state.force).norm(), state.tension * (1 + 1e-12));
      }
    }
    EXPECT_GT(most, 0.1);
    EXPECT_LT(most - least, 0.02 * most);
  }
  EXPECT_LT(nearest, 1e-3) << "the case must bring places together";
}

// In a straight line between two points of the world no tension makes a thread shorter: the force stays bounded, and the step says so.
TEST(Links, OfOneThreadThatNothingCanShortenHaveABoundedForce) {
  Linked linked;
  const palpate_link_end middle = on_surface(tiny_box().far_triangle(5));
  const Vector3d at = tiny_box().place(middle.triangle, kMiddle), way(0, 0.05, 0);
  palpate_link one = link_of(PALPATE_LINK_THREAD, in_world(at - way), middle, 0.04), next = one;
  next.ends[0] = middle, next.ends[1] = in_world(at + way), one.runs_on = 1;
  linked.set({one, next});
  EXPECT_TRUE(linked.touch() & PALPATE_STEP_REGULARISED);
  const palpate_link_state& state = linked.state();
  EXPECT_TRUE(std::isfinite(state.tension));
  // The 20 mm that it is too short, over 1/1,000 (kLeastOfJoined) of the compliance of one part. The place between them gives way along y by the
  // weighted compliance of its three nodes, which is no more than that of the softest, and no less than a tenth of it here.
  double softest = 0;
  for (const std::int32_t n : tiny_box().body.triangles[middle.triangle])
    softest = std::max(softest, compliance()(3 * n + 1, 3 * n + 1));
  EXPECT_LT(state.tension, 1000 * 0.02 / (0.1 * softest));
  // What both parts do to the place between them is nothing.
  EXPECT_LT((Vector3d(state.ends[1]) - at).norm(), 1e-6);
}

TEST(Links, OfOneThreadRunOutWhereAPartBreaks) {
  Linked linked;
  const int places[] = {0, 5, 9, 14};
  std::vector<palpate_link> links;
  for (int i = 0; i < 3; ++i) {
    palpate_link link = link_of(PALPATE_LINK_THREAD, on_surface(tiny_box().far_triangle(places[i])),
                                on_surface(tiny_box().far_triangle(places[i + 1])));
    link.rest_length = 0.8 * apart_at_rest(link), link.runs_on = i < 2;
    links.push_back(link);
  }
  linked.set(links);
  linked.steps(60);
  const double before = linked.state(2).tension;
  EXPECT_GT(before, 0.1);
  links[0].breaking_force = 0.5 * linked.state(0).tension;
  linked.set(links);
  EXPECT_EQ(linked.touch() & PALPATE_STEP_LINK_BROKE, palpate_step_flags{PALPATE_STEP_LINK_BROKE});
  linked.steps(60);
  EXPECT_EQ(linked.state(0).condition, PALPATE_LINK_BROKEN);
  // Its tension halves in each step, and the last part follows through the middle one within some 20 steps.
  for (const int part : {1, 2}) EXPECT_LT(linked.state(part).tension, 1e-3 * before) << part;
}

// The force for a displaced point falls as the mesh is refined; that of a disc belongs to the body.
TEST(Links, WithARadiusHaveAForceThatDoesNotFollowTheMesh) {
  double tension[2][2];  // [radius][mesh]
  const Vector3d places[2] = {{0.06, 0.0131, 0.0207}, {0.06, 0.0371, 0.0207}};
  for (int mesh = 0; mesh < 2; ++mesh) {
    TinyBox form;
    form.cells = mesh ? std::array<int, 3>{7, 7, 6} : std::array<int, 3>{3, 3, 3};
    form.interior = false, form.poisson = 0.3;
    const TouchedBox body(form);
    palpate_link link = palpate_default_link();
    link.kind = PALPATE_LINK_THREAD, link.rest_length = 0.020;
    for (int e = 0; e < 2; ++e) {
      double nearest = INFINITY;
      for (std::size_t t = 0; t < body.body.triangles.size(); ++t) {
        const auto triangle = static_cast<std::int32_t>(t);
        if (body.outward(triangle)[0] < 0.99) continue;
        // The barycentric weights of the place in the triangle's plane; inside where the least is above zero.
        Matrix3d corners;
        for (int v = 0; v < 3; ++v) corners.col(v) = body.node(body.body.triangles[t][v]);
        const Vector3d k = corners.fullPivLu().solve(places[e]);
        if (k.minCoeff() >= 0 && nearest == INFINITY) nearest = 0, link.ends[e] = on_surface(triangle, k);
      }
      ASSERT_EQ(nearest, 0);
    }
    for (int radius = 0; radius < 2; ++radius) {
      Linked linked(with(linked_def(), PALPATE_CONTACT_PATCH), body);
      link.radius = radius ? 0.003 : 0;
      linked.set({link});
      linked.steps(20);
      tension[radius][mesh] = linked.state().tension;
    }
  }
  EXPECT_LT(tension[0][1], 0.7 * tension[0][0]) << "the case must follow the mesh without a radius";
  EXPECT_NEAR(tension[1][1], tension[1][0], 0.12 * tension[1][0]) << "as two discs on these meshes agree";
}

TEST(Links, GoOnFromASavedStateWithTheSameBits) {
  const auto links = [] {
    palpate_link link = thread_of(0.012, 500), next = link;
    next.ends[0] = link.ends[1], next.ends[1] = on_surface(tiny_box().far_triangle(9));
    link.runs_on = 1;
    return std::vector<palpate_link>{link, next, thread_of(0.05)};
  }();
  Linked one, other;
  one.set(links);
  one.steps(7);
  restore_from(one.scene.get(), other.scene.get());
  for (int s = 0; s < 20; ++s) {
    one.touch(), other.touch();
    for (int i = 0; i < 3; ++i) ASSERT_EQ(std::memcmp(&one.state(i), &other.state(i), sizeof(palpate_link_state)), 0);
  }
}

TEST(Links, FollowTheOrgansPose) {
  const std::int32_t triangle = tiny_box().far_triangle(4);
  const Vector3d anchor = tiny_box().place(triangle, kMiddle) + Vector3d(0.03, 0.01, 0);
  Linked resting, moved;
  const palpate_link link = link_of(PALPATE_LINK_SPRING, on_surface(triangle), in_world(anchor), 0.02, 50);
  resting.set({link});
  resting.steps(30);
  // The organ moves away from the world's point by 5 mm: as if the point had moved against the organ.
  palpate_pose pose = palpate_default_pose();
  pose.position[0] = -0.005;
  ASSERT_EQ(palpate_scene_set_pose(moved.scene.get(), &pose, nullptr), PALPATE_OK);
  palpate_link nearer = link;
  nearer.ends[1].point[0] -= 0.005;
  moved.set({nearer});
  moved.steps(30);
  EXPECT_NEAR(moved.state().tension, resting.state().tension, 1e-9);
}

TEST(Links, BadOnesAreRefusedWithASentenceAndChangeNothing) {
  Linked linked;
  linked.set({thread_of(0.02)});
  const auto refused = [&](const std::function<void(palpate_link&)>& change, const char* text) {
    palpate_link two[2] = {thread_of(0.02), thread_of(0.01)};
    change(two[1]);
    palpate_error error = {};
    EXPECT_EQ(palpate_scene_set_links(linked.scene.get(), two, 2, &error), PALPATE_ERROR_ARGUMENT) << text;
    EXPECT_NE(std::string(error.text).find(text), std::string::npos) << error.text;
    EXPECT_EQ(palpate_scene_link_state(linked.scene.get(), 1), nullptr);
  };
  refused([](palpate_link& l) { l.kind = PALPATE_LINK_UNSAID; }, "kind THREAD, SPRING or CLIP");
  refused([](palpate_link& l) { l.ends[0].kind = PALPATE_END_UNSAID; }, "kind SURFACE_POINT or WORLD");
  refused([](palpate_link& l) { l.ends[0].triangle = 1 << 20; }, "triangle from 0 to F-1");
  refused([](palpate_link& l) { l.ends[1].barycentric[0] = NAN; }, "barycentric");
  refused([](palpate_link& l) { l.ends[1].barycentric[0] = 0; }, "sum to 1");
  refused([](palpate_link& l) { l.ends[0] = l.ends[1] = in_world({0, 0, 0}); }, "at least one end");
  refused([](palpate_link& l) { l.ends[0] = in_world({0, INFINITY, 0}); }, "within 1e6 m");
  refused([](palpate_link& l) { l.rest_length = -1e-9; }, "rest_length");
  refused([](palpate_link& l) { l.kind = PALPATE_LINK_CLIP; }, "CLIP of rest_length 0");
  for (const double bad : {0.0, -1.0, double(NAN)}) {
    refused([&](palpate_link& l) { l.stiffness = bad; }, "stiffness");
    refused([&](palpate_link& l) { l.breaking_force = bad; }, "breaking_force");
  }
  refused([](palpate_link& l) { l.radius = NAN; }, "radius");
  refused([](palpate_link& l) { l.radius = 0.002; }, "contact is not PATCH");
  refused([](palpate_link& l) { l.runs_on = 1; }, "behind one that runs on");
  refused([](palpate_link& l) { l.id = 0; }, "another id");
  refused([](palpate_link& l) { l.id = -2; }, "id of 0 or more");
  refused([](palpate_link& l) { l.struct_bytes -= 8; }, "struct_bytes");
  palpate_error error = {};
  EXPECT_EQ(palpate_scene_set_links(linked.scene.get(), nullptr, 17, &error), PALPATE_ERROR_ARGUMENT);
  EXPECT_NE(std::string(error.text).find("max_links (16)"), std::string::npos) << error.text;
  linked.steps(5);
  EXPECT_GT(linked.state().tension, 0);
  linked.set({});
  linked.touch();
  EXPECT_EQ(linked.contacts->node_count, 0);
}

TEST(Links, OnFixedTissueStandWhereItStands) {
  std::int32_t fixed = -1;
  for (std::size_t t = 0; t < tiny_box().body.triangles.size() && fixed < 0; ++t)
    if (tiny_box().outward(static_cast<std::int32_t>(t))[0] < -0.99) fixed = static_cast<std::int32_t>(t);
  Linked linked;
  const palpate_link link = link_of(PALPATE_LINK_THREAD, on_surface(fixed), on_surface(tiny_box().far_triangle(4)),
                                    0.055, 1000),
                     without_effect = link_of(PALPATE_LINK_THREAD, on_surface(fixed), on_surface(fixed, {1, 0, 0}));
  linked.set({link, without_effect});
  EXPECT_EQ(linked.steps(60), 0u);
  EXPECT_NEAR(linked.state().tension, solve_one(link).tension, 1e-3 * linked.state().tension);
  EXPECT_EQ(linked.state(1).tension, 0);
}

}  // namespace
}  // namespace palpate::tests
