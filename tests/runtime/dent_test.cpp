// The dent of a disc in the render mesh: the drawn surface meets the drawn disc, sinks with it, and never jumps.
#include "runtime/skin/dent.h"

#include <cstring>
#include <functional>

#include "runtime/base/arcsine.h"
#include "tests/runtime/asked_scene.h"
#include "tests/runtime/played_box.h"
#include "tests/support/fine_body.h"

namespace palpate::tests {
namespace {

using Eigen::Vector3d;

// Edges of 12 mm: wider than any disc here.
const TouchedBox& box() {
  static const TouchedBox shared({.cells = {5, 4, 4}});
  return shared;
}

// The box's surface in triangles of 0.8 mm with bumps of 0.2 mm, and normals.
struct Drawn {
  explicit Drawn(double bump = 2e-4, int splits = 4) : fine(fine_of(box().body, splits, bump)) {
    std::vector<Vector3d> sum(static_cast<std::size_t>(fine.vertices()), Vector3d::Zero());
    for (std::size_t t = 0; t < fine.triangles.size(); t += 3) {
      const std::int32_t* n = &fine.triangles[t];
      const Vector3d area = (fine.vertex(n[1]) - fine.vertex(n[0])).cross(fine.vertex(n[2]) - fine.vertex(n[0]));
      for (int v = 0; v < 3; ++v) sum[n[v]] += area;
    }
    for (const Vector3d& n : sum)
      for (int d = 0; d < 3; ++d) normals.push_back(static_cast<float>(n.normalized()[d]));
  }
  palpate_render_mesh view(bool with_normals = true) const {
    return render_mesh(fine.positions.data(), with_normals ? normals.data() : nullptr, fine.vertices());
  }
  FineHost fine;
  std::vector<float> normals;
};
const Drawn& drawn() {
  static const Drawn shared;
  return shared;
}

SceneDef dent_def(palpate_contact_law law = PALPATE_LAW_STICKING) {
  return unlimited_def(PALPATE_COLLISION_DEFORMED, law, PALPATE_REPORT_CONTACTS, PALPATE_DENT_DISCS);
}

SceneDef drawn_def(SceneDef def, const palpate_render_mesh& mesh) {
  def.render_mesh = mesh;
  return def;
}

// A scene with a render mesh, and what it draws after each step.
struct Drawing : TouchedScene {
  explicit Drawing(const SceneDef& def = dent_def(), const Drawn& of = drawn(), const TouchedBody& body = box(),
                   bool with_normals = true)
      : TouchedScene(body, drawn_def(def, of.view(with_normals))),
        positions(of.fine.positions.size()),
        normals(with_normals ? positions.size() : 0) {
    draw(palpate_scene_report(scene.get()));
  }
  void touch(const std::vector<palpate_tool>& tools) {
    TouchedScene::touch(tools);
    draw(palpate_scene_report(scene.get()));
  }
  void touch(const Vector3d& p, double radius) { touch({point_tool(p.data(), 1, radius, .3)}); }
  void draw(const palpate_contact_report* report) {
    std::vector<float> u = shape();
    palpate_shape_out surface = shape_out(u.data(), nullptr, 0);
    surface.node_count = static_cast<std::int32_t>(u.size() / 3);
    palpate_skin_out out = skin_out(positions.data(), normals.empty() ? nullptr : normals.data(),
                                    static_cast<std::int32_t>(positions.size() / 3));
    out.report = report, out.disc_normals = disc_normals, out.disc_capacity = 8;
    flags = palpate_scene_skin(scene.get(), &surface, &out);
    discs = out.disc_count;
  }
  std::size_t vertices() const { return positions.size() / 3; }
  Vector3d position(std::size_t v) const { return Eigen::Map<const Eigen::Vector3f>(&positions[3 * v]).cast<double>(); }
  Vector3d normal(std::size_t v) const { return Eigen::Map<const Eigen::Vector3f>(&normals[3 * v]).cast<double>(); }
  Vector3d disc_normal(int c) const { return Eigen::Map<const Eigen::Vector3f>(disc_normals + 3 * c).cast<double>(); }
  const palpate_contact& contact(int c = 0) const {
    return *palpate_report_contact(palpate_scene_report(scene.get()), c);
  }

  std::vector<float> positions, normals;
  float disc_normals[24] = {};
  std::int32_t discs = 0;
};

// Over the top face, z = 40 mm: beside a node, on an edge, in a triangle, and near the face's rim.
const Vector3d kPlaces[] = {
    {.024, .025, .04}, {.030, .024, .04}, {.033, .019, .04}, {.045, .031, .04}, {.0365, .011, .04}};

// Comes down on a place in steps of `step` metres, until it is `depth` deep.
template <class Each>
void press(Drawing& drawing, const Vector3d& place, double radius, double depth, double step, Each each) {
  const Vector3d start(place[0], place[1], .0405);
  for (int s = 0; s * step <= depth + .0005 + 1e-9; ++s) {
    const Vector3d p = start - Vector3d(0, 0, s * step);
    drawing.touch(p, radius);
    each(p);
  }
}

// The vertices under the disc of a contact, and how far each of them is from its plane, m: above zero where it stands out.
struct UnderDisc {
  double worst = 0, deepest = 0;
  int count = 0;
};
UnderDisc under_disc(const Drawing& drawing, int c = 0) {
  UnderDisc found;
  const Vector3d centre(drawing.contact(c).tool_point), normal = drawing.disc_normal(c);
  for (std::size_t v = 0; v < drawing.vertices(); ++v) {
    const Vector3d from = drawing.position(v) - centre;
    const double height = from.dot(normal), rho = (from - height * normal).norm();
    if (rho > drawing.contact(c).disc_radius || std::abs(height) > .015) continue;
    found.worst = std::max(found.worst, std::abs(height)), ++found.count;
  }
  return found;
}

TEST(Dent, TheArcsineIsThatOfTheCLibraryToItsStatedError) {
  for (int i = 0; i <= 100000; ++i) {
    const double x = i / 100000.0;
    // The source states 2e-8; rounding of its coefficients adds less than half of that.
    ASSERT_NEAR(arcsine(x), std::asin(x), 3e-8) << x;
  }
}

TEST(Dent, TheDrawnSurfaceMeetsTheDrawnDiscAtFiveMillimetresOfPush) {
  for (const double radius : {.002, .003, .004, .006})
    for (const Vector3d& place : kPlaces) {
      SCOPED_TRACE(testing::Message() << "radius " << radius << ", place " << place.transpose());
      Drawing drawing;
      press(drawing, place, radius, .005, 5e-4, [](const Vector3d&) {});
      ASSERT_EQ(drawing.discs, 1);
      const UnderDisc with = under_disc(drawing);
      drawing.draw(nullptr);
      const float normal[3] = {0, 0, 1};
      std::copy_n(normal, 3, drawing.disc_normals);
      const UnderDisc without = under_disc(drawing);
      EXPECT_GT(with.count, 5);
      EXPECT_LT(with.worst, 2e-4);
      EXPECT_GT(without.worst, 5e-4) << "and the mesh alone does not";
    }
}

TEST(Dent, EveryVertexUnderTheDiscSinksWithTheTool) {
  for (const double radius : {.002, .006})
    for (const Vector3d& place : kPlaces) {
      SCOPED_TRACE(testing::Message() << "radius " << radius << ", place " << place.transpose());
      Drawing drawing;
      std::vector<float> before = drawing.positions;
      press(drawing, place, radius, .006, 2e-4, [&](const Vector3d& p) {
        for (std::size_t v = 0; v < drawing.vertices(); ++v) {
          const Vector3d now = drawing.position(v);
          if (now[2] < .03 || std::hypot(now[0] - p[0], now[1] - p[1]) > radius) continue;
          // A step of the tool turns the disc's plane a little, whose rim then lifts by its radius times that angle.
          ASSERT_LT(now[2], before[3 * v + 2] + 1e-5) << v;
        }
        before = drawing.positions;
      });
    }
}

TEST(Dent, NothingJumpsWhereAContactBeginsSlidesAndEnds) {
  for (const auto law : {PALPATE_LAW_STICKING, PALPATE_LAW_UNILATERAL, PALPATE_LAW_COULOMB})
    for (const double radius : {.002, .006}) {
      SCOPED_TRACE(testing::Message() << "law " << law << ", radius " << radius);
      Drawing drawing(dent_def(law));
      std::vector<float> before = drawing.positions;
      double worst = 0, most = 0;
      Vector3d last(.021, .019, .0405);
      const auto go = [&](const Vector3d& p) {
        const double motion = (p - last).norm();
        last = p;
        drawing.touch(p, radius);
        for (std::size_t i = 0; i < before.size(); i += 3) {
          const double moved =
              (Eigen::Map<Eigen::Vector3f>(&drawing.positions[i]) - Eigen::Map<Eigen::Vector3f>(&before[i])).norm();
          if (motion > 0) worst = std::max(worst, moved / motion);
          most = std::max(most, moved);
        }
        before = drawing.positions;
      };
      const double step = 5e-5;
      for (int s = 0; s < 80; ++s) go(last - Vector3d(0, 0, step));
      for (int s = 0; s < 300 && law != PALPATE_LAW_STICKING; ++s)
        go(last + step * Vector3d(.8, .5, .1 * std::sin(.05 * s)));
      for (int s = 0; s < 100; ++s) go(last + Vector3d(0, 0, step));
      // Where a disc begins, bumps sink up to twice as fast as D grows, beside the tool's own way. The closed form's rim without its
      // rounding makes 8.9 of a slide at 2 mm radius; measured: 2.9.
      EXPECT_LT(worst, 3.5);
    }
}

TEST(Dent, AHollowIsMetUpToHalfOfWhatTheMeshShowsOfTheDent) {
  DentDisc disc;
  disc.normal = {0, 0, 1};
  measure_disc(.006, .011, .3, &disc);
  for (const double indentation : {.004, -.004}) {
    disc.indentation = indentation;
    const double most = .5 * disc.share * indentation;
    for (const double rho : {0., .003, .0059})
      for (const double part : {.2, .9, 1.2, 2.}) {
        SCOPED_TRACE(testing::Message() << indentation << " " << rho << " " << part);
        const Vec3 place{rho, 0, -part * most};
        const DentAt dent = dent_at(disc, place, {0, 0, 1});
        EXPECT_NEAR(dent.sunk, -std::min(part, 1.) * most, 1e-12)
            << "half a hollow rises no more, and M does not sink it";
        // Central differences of a smooth function: their error is of the order of the step's square.
        constexpr double step = 1e-7;
        for (int d = 0; d < 3; ++d) {
          Vec3 before = place, after = place;
          before[d] -= step, after[d] += step;
          if (rho == 0 && d < 2) continue;  // the rim's distance has a corner on the axis
          const double slope =
              (dent_at(disc, after, {0, 0, 1}).sunk - dent_at(disc, before, {0, 0, 1}).sunk) / (2 * step);
          EXPECT_NEAR(dent.gradient[d], slope, 1e-5) << d;
        }
      }
  }
}

TEST(Dent, AtTheAxisTheContactsOwnComplianceIsDrawn) {
  for (const double radius : {.002, .004}) {
    Drawing drawing;
    press(drawing, kPlaces[2], radius, .005, 1e-4, [](const Vector3d&) {});
    const palpate_contact& contact = drawing.contact();
    EXPECT_GT(contact.indentation, .003);
    EXPECT_LT(contact.indentation, .005) << "which is all of the push";
    // b' on this box is 14.7 mm. The row holds the mean over the wide disc, and the gap is that of its middle, which differs little.
    const double lacking = contact.indentation * (1 - radius / .0147);
    EXPECT_NEAR(-contact.gap, lacking, .02 * contact.indentation);
  }
}

TEST(Dent, WithoutAReportTheSkinHasEveryBitOfASceneWithoutDents) {
  SceneDef def = dent_def();
  Drawing with;
  def.dent.dent = PALPATE_DENT_OFF;
  Drawing off(def);
  for (Drawing* drawing : {&with, &off}) press(*drawing, kPlaces[0], .003, .004, 2e-4, [](const Vector3d&) {});
  EXPECT_NE(with.positions, off.positions);
  EXPECT_EQ(off.discs, 0);
  with.draw(nullptr);
  EXPECT_EQ(with.discs, 0);
  EXPECT_EQ(with.positions, off.positions);
  EXPECT_EQ(with.normals, off.normals);
}

TEST(Dent, FarAwayAndOnOtherSidesOfTheOrganNothingMoves) {
  const Drawn flat(0, 4);
  Drawing drawing(dent_def(), flat);
  const Vector3d place(.018, .019, .04);
  press(drawing, place, .003, .005, 1e-4, [](const Vector3d&) {});
  const std::vector<float> with = drawing.positions;
  drawing.draw(nullptr);
  double on_top = 0, elsewhere = 0, far = 0;
  for (std::size_t v = 0; v < drawing.vertices(); ++v) {
    const Vector3d rest = flat.fine.vertex(static_cast<std::int32_t>(v));
    const double moved = (Eigen::Map<const Eigen::Vector3f>(&with[3 * v]).cast<double>() - drawing.position(v)).norm();
    (rest[2] > .0399 ? on_top : elsewhere) = std::max(rest[2] > .0399 ? on_top : elsewhere, moved);
    if ((rest - place).norm() > .048) far = std::max(far, moved);
  }
  EXPECT_GT(on_top, .002);
  EXPECT_EQ(elsewhere, 0) << "the sides and the bottom look elsewhere";
  EXPECT_EQ(far, 0) << "b' is 15 mm, and three of them end before";
}

TEST(Dent, NormalsAreThoseOfTheDrawnTriangles) {
  const Drawn flat(0, 5);
  Drawing drawing(dent_def(), flat);
  press(drawing, kPlaces[2], .006, .005, 2e-4, [](const Vector3d&) {});
  const Vector3d disc = drawing.disc_normal(0), centre(drawing.contact().tool_point);
  std::vector<Vector3d> sum(drawing.vertices(), Vector3d::Zero());
  for (std::size_t t = 0; t < flat.fine.triangles.size(); t += 3) {
    const std::int32_t* n = &flat.fine.triangles[t];
    const auto at = [&](int v) { return drawing.position(static_cast<std::size_t>(n[v])); };
    const Vector3d area = (at(1) - at(0)).cross(at(2) - at(0));
    for (int v = 0; v < 3; ++v) sum[n[v]] += area;
  }
  int under = 0, beside = 0;
  for (std::size_t v = 0; v < drawing.vertices(); ++v) {
    const Vector3d from = drawing.position(v) - centre;
    const double height = from.dot(disc), rho = (from - height * disc).norm();
    if (drawing.position(v)[2] < .03 || std::abs(height) > .01) continue;
    if (rho < .005) {
      EXPECT_LT((drawing.normal(v) - disc).norm(), 1e-3) << "the disc is flat";
      ++under;
    } else if (rho > .0085 && rho < .014) {
      // Beside the rounded rim: triangles of 0.4 mm know the slope to some hundredths; the mesh's own normals bend at its edges.
      EXPECT_GT(drawing.normal(v).dot(sum[v].normalized()), .985) << rho;
      ++beside;
    }
  }
  EXPECT_GT(under, 100);
  EXPECT_GT(beside, 200);
}

TEST(Dent, TwoDiscsSideBySideAreBothMet) {
  Drawing drawing;
  for (int s = 0; s <= 50; ++s) {
    const Vector3d p[2] = {{.026, .025, .0402 - 1e-4 * s}, {.034, .025, .0402 - 1e-4 * s}};
    drawing.touch({point_tool(p[0].data(), 1, .003), point_tool(p[1].data(), 1, .003)});
  }
  ASSERT_EQ(drawing.discs, 2);
  // The mean of both moves leaves some per cent of the other disc's dent in each.
  for (int c = 0; c < 2; ++c) EXPECT_LT(under_disc(drawing, c).worst, 3e-4) << c;
}

TEST(Dent, ATurnedOrganAndAPreloadTurnTheDiscAlong) {
  for (const bool preload : {false, true}) {
    static const TouchedBox loaded({.cells = {5, 4, 4}}, add_everything);
    SceneDef def = dent_def();
    def.preload = preload ? PALPATE_PRELOAD_ON : PALPATE_PRELOAD_OFF;
    Drawing drawing(def, drawn(), loaded);
    // The surface as it rests now, under the place.
    std::size_t under = 0;
    for (std::size_t v = 0; v < drawing.vertices(); ++v)
      if (drawn().fine.vertex(static_cast<std::int32_t>(v))[2] > .0395 &&
          (drawing.position(v) - kPlaces[0]).head<2>().norm() < (drawing.position(under) - kPlaces[0]).head<2>().norm())
        under = v;
    const Vector3d start = drawing.position(under);
    for (int s = -5; s < 8; ++s) {
      const Vector3d p = start - Vector3d(0, 0, 1e-4 * s);
      drawing.touch(p, .003);
    }
    ASSERT_EQ(drawing.discs, 1) << preload;
    // A millimetre of push turns the surface there by a degree or two.
    EXPECT_GT(drawing.disc_normal(0).dot(Vector3d(drawing.contact().disc_normal)), .999) << preload;
    EXPECT_LT(under_disc(drawing).worst, 3e-4) << preload;
  }
}

TEST(Dent, AMeshWithoutNormalsIsDentedAlike) {
  Drawing with, without(dent_def(), drawn(), box(), false);
  for (Drawing* drawing : {&with, &without}) press(*drawing, kPlaces[1], .004, .005, 2e-4, [](const Vector3d&) {});
  EXPECT_LT(under_disc(without).worst, 2e-4);
  double most = 0;
  for (std::size_t i = 0; i < with.positions.size(); ++i)
    most = std::max(most, static_cast<double>(std::abs(with.positions[i] - without.positions[i])));
  // On bumps of 0.2 mm the normals of both differ, and with them which side of the box a vertex near an edge belongs to.
  EXPECT_LT(most, 1e-3);
}

TEST(Dent, ADamagedReportMakesNoDentAndSaysSo) {
  Drawing drawing;
  press(drawing, kPlaces[0], .003, .004, 2e-4, [](const Vector3d&) {});
  const palpate_contact_report* good = palpate_scene_report(drawing.scene.get());
  std::vector<std::uint64_t> copy(good->used_bytes / 8 + 1);
  auto* bad = reinterpret_cast<palpate_contact_report*>(copy.data());
  drawing.draw(nullptr);
  const std::vector<float> flat = drawing.positions;
  auto* contact = reinterpret_cast<palpate_contact*>(bad + 1);
  const std::function<void()> faults[] = {
      [&] { bad->struct_bytes += 8; },
      [&] { bad->contact_bytes -= 8; },
      [&] { bad->contact_count = -1; },
      [&] { bad->contact_count = 1 << 20; },
      [&] { bad->used_bytes = 48; },
      [&] { contact->triangle = -1; },
      [&] { contact->triangle = 1 << 20; },
      [&] { contact->barycentric[1] = NAN; },
      [&] { contact->tool_point[2] = INFINITY; },
      [&] { contact->disc_normal[0] = NAN; },
      [&] { contact->disc_radius = -1; },
      [&] { contact->disc_radius = NAN; },
      [&] { contact->indentation = NAN; },
  };
  for (const auto& fault : faults) {
    std::memcpy(bad, good, good->used_bytes);
    drawing.draw(bad);
    EXPECT_EQ(drawing.flags, 0u);
    EXPECT_NE(drawing.positions, flat);
    fault();
    drawing.draw(bad);
    EXPECT_EQ(drawing.flags, static_cast<palpate_step_flags>(PALPATE_STEP_BAD_INPUT)) << (&fault - faults);
    EXPECT_EQ(drawing.positions, flat) << (&fault - faults);
  }
}

TEST(Dent, NeedsARenderMeshAReportAndDiscs) {
  const palpate_render_mesh mesh = drawn().view();
  const std::function<void(SceneDef&)> lacks[] = {
      [](SceneDef& def) { def.render_mesh = palpate_default_render_mesh(); },
      [](SceneDef& def) { def.report.report = PALPATE_REPORT_OFF; },
      [](SceneDef& def) { def.contact = PALPATE_CONTACT_POINT; },
      [](SceneDef& def) { def.dent.dent = static_cast<palpate_dent_model>(2); },
  };
  for (const auto& lack : lacks) {
    SceneDef def = drawn_def(dent_def(), mesh);
    lack(def);
    EXPECT_EQ(refusal_of(box(), def).status, PALPATE_ERROR_ARGUMENT);
  }
}

TEST(Dent, IsAPassOfThePlanWithACost) {
  Drawing drawing;
  const auto plan = plan_of(drawing.scene.get());
  EXPECT_EQ(std::string(plan.back().name), "dent: discs");
  EXPECT_GT(plan.back().memory_bytes, 0u);
  palpate_step_load load = palpate_default_step_load();
  load.tools = load.points = load.contacts = 1;
  EXPECT_GT(palpate_predict_pass(drawing.scene.get(), static_cast<std::int32_t>(plan.size()) - 1, &load).steps, 0);
}

}  // namespace
}  // namespace palpate::tests
