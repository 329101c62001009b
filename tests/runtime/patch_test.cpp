// The disc of a tool: its weights, its local compliance, and that a dragged disc feels no element boundaries.
#include "runtime/contact/contact_patch.h"

#include <numbers>
#include <numeric>
#include <random>

#include "runtime/contact/thinned_disc.h"
#include "tests/runtime/asked_scene.h"
#include "tests/runtime/many_discs.h"

namespace palpate::tests {
namespace {

// The surface of a box of gel, with what a patch needs of it.
class Patch : public testing::Test {
 protected:
  Patch() : memory_(palpate_allocator{}), body_(surface_first(box_mesh({8, 8, 3}, {0.08, 0.08, 0.03}, 0.25))) {
    for (const auto& node : body_.mesh.nodes) position_.insert(position_.end(), node.begin(), node.end());
    for (const auto& triangle : body_.triangles) triangles_.insert(triangles_.end(), triangle.begin(), triangle.end());
    const auto count = static_cast<std::int32_t>(body_.triangles.size());
    EXPECT_TRUE(surface_.build(memory_, position_.data(), triangles_.data(), count) &&
                measure_.build(memory_, position_.data(), body_.surface_nodes, triangles_.data(), count) &&
                patch_.create(memory_, &surface_, &measure_, triangles_.data(), body_.surface_nodes));
    tissue_ = local_compliance(3000, 0.45, StoredElement::p1);
    measure_.set_tissue(tissue_);
  }
  ~Patch() override { memory_.release_all(); }

  // The surface point of the top at x, y.
  SurfacePoint top(double x, double y) const {
    SurfacePoint place;
    double least = INFINITY;
    for (std::size_t t = 0; t < body_.triangles.size(); ++t) {
      double k[3];
      const auto corner = [&](int v) { return surface_.corner(static_cast<std::int32_t>(t), v); };
      const double distance = closest_on_triangle({x, y, 0.03}, corner(0), corner(1), corner(2), k);
      if (distance >= least) continue;
      least = distance;
      place.triangle = static_cast<std::int32_t>(t);
      std::copy(k, k + 3, place.barycentric);
    }
    return place;
  }
  void press(double x, double y, double a) {
    const Vec3 up{0, 0, 1};
    patch_.press(top(x, y), up, across(up, {}), a);
  }
  // The patch's weighted mean of a function of the nodes' positions.
  template <class Function>
  double mean(Function f) const {
    double sum = 0;
    for (int e = 0; e < patch_.count(); ++e) sum += patch_.weights()[e] * f(&position_[3 * patch_.nodes()[e]]);
    return sum;
  }

  SceneMemory memory_;
  SurfaceFirst body_;
  std::vector<double> position_;
  std::vector<std::int32_t> triangles_;
  SurfaceIndex surface_;
  SurfaceMeasure measure_;
  ContactPatch patch_;
  LocalCompliance tissue_;
};

TEST_F(Patch, HasWeightsThatSumToOneAndReproduceAPlane) {
  for (const double a : {0.0005, 0.004, 0.012, 0.025}) {
    press(0.041, 0.037, a);
    EXPECT_NEAR(mean([](const double*) { return 1; }), 1, 1e-14);
    EXPECT_NEAR(mean([](const double* p) { return p[0]; }), 0.041, 1e-12);  // a flat top: exact but for rounding
    EXPECT_NEAR(mean([](const double* p) { return p[1]; }), 0.037, 1e-12);
  }
}

TEST_F(Patch, FollowsThePressureUnderAPunch) {
  // Mean of r^2 under 1 / (2 pi a^2 sqrt(1 - r^2 / a^2)) is 2 a^2 / 3; linear interpolation over edges of 10 mm adds
  // about a sixth of their square.
  const double a = 0.025;
  press(0.04, 0.04, a);
  const double square = mean([](const double* p) { return std::pow(p[0] - 0.04, 2) + std::pow(p[1] - 0.04, 2); });
  EXPECT_NEAR(square, 2 * a * a / 3 + 0.01 * 0.01 / 6 * 1.5, 0.05 * square);
}

TEST_F(Patch, AddsWhatASmallDiscHasBeyondTheMesh) {
  const double s = measure_.spacing(top(0.04, 0.04)), b = ContactPatch::kResolved * s;
  press(0.04, 0.04, 0.001);
  const Mat3& local = patch_.local();
  EXPECT_NEAR(local.m[2][2], tissue_.normal * (1 / 0.001 - 1 / (b + tissue_.normal_blur * s)), 1e-12);
  EXPECT_NEAR(local.m[0][0], tissue_.tangent * (1 / 0.001 - 1 / (b + tissue_.tangent_blur * s)), 1e-12);
  EXPECT_NEAR(local.m[1][1], local.m[0][0], 1e-12);
  EXPECT_NEAR(local.m[0][1] + local.m[0][2] + local.m[1][2], 0, 1e-12);
  // The local compliance falls with the radius, is never negative, and does not jump where the mesh begins to resolve the disc.
  double before = INFINITY;
  for (double a = 0.0005; a < 0.05; a *= 1.02) {
    press(0.04, 0.04, a);
    EXPECT_GT(local.m[2][2], 0);
    EXPECT_LT(local.m[2][2], before);
    if (before < INFINITY) {
      EXPECT_GT(local.m[2][2], 0.9 * before) << a;
    }
    before = local.m[2][2];
  }
}

TEST_F(Patch, SharesWhatItHasBeyondTheMeshWithOneLikeItAtItsPlaceBut0Point8PercentOfItsWhole) {
  for (const double a : {0.0005, 0.002, 0.006, 0.012}) {
    press(0.041, 0.037, a);
    const Mat3 shared = compliance_between(patch_.disc(), patch_.disc());
    for (int i = 0; i < 3; ++i) {
      const double own = patch_.local().m[i][i] - shared.m[i][i],
                   whole = (i < 2 ? tissue_.tangent : tissue_.normal) / a;
      EXPECT_NEAR(own, 0.008 * whole, 1e-9 * whole) << a;
    }
  }
}

TEST_F(Patch, StaysOnItsSideOfAnEdge) {
  press(0.04, 0.079, 0.006);  // a millimetre from the edge between the top and a side
  EXPECT_GT(mean([](const double*) { return 1; }), 0.5);
  for (int e = 0; e < patch_.count(); ++e) EXPECT_NEAR(position_[3 * patch_.nodes()[e] + 2], 0.03, 1e-12);
}

TEST(LocalCompliance, OfACurvedSurfaceIsTheEnergyOfTheLayerThatABulgeLacks) {
  // Cerruti: u_x = c ((1 - nu) / r + nu x^2 / r^3), u_y = c nu x y / r^3, c = (1 + nu) / (pi E), for a unit force along x.
  // Its in-plane strains on the unit circle by differences, their plane stress energy times kappa(theta) / 2 summed.
  constexpr double kStep = 1e-5;
  for (const double nu : {-0.2, 0.0, 0.3, 0.45, 0.49}) {
    const double young = 2000, c = (1 + nu) / (std::numbers::pi * young);
    const auto ux = [&](double x, double y) {
      const double r = std::hypot(x, y);
      return c * ((1 - nu) / r + nu * x * x / (r * r * r));
    };
    const auto uy = [&](double x, double y) { return c * nu * x * y / std::pow(std::hypot(x, y), 3); };
    double along = 0, across = 0;
    constexpr int kAngles = 64;
    for (int k = 0; k < kAngles; ++k) {
      const double x = std::cos(2 * std::numbers::pi * k / kAngles), y = std::sin(2 * std::numbers::pi * k / kAngles);
      const auto by_x = [&](const auto& f) { return (f(x + kStep, y) - f(x - kStep, y)) / (2 * kStep); };
      const auto by_y = [&](const auto& f) { return (f(x, y + kStep) - f(x, y - kStep)) / (2 * kStep); };
      const double xx = by_x(ux), yy = by_y(uy), shear = by_y(ux) + by_x(uy);
      const double energy =
          young / (1 - nu * nu) * (xx * xx + yy * yy + 2 * nu * xx * yy + (1 - nu) / 2 * shear * shear);
      along += 0.5 * x * x * energy * 2 * std::numbers::pi / kAngles;
      across += 0.5 * y * y * energy * 2 * std::numbers::pi / kAngles;
    }
    const LocalCompliance local = local_compliance(young, nu, StoredElement::p1);
    EXPECT_NEAR(local.curved + local.curved_trace, along, 1e-8 * along) << nu;  // the differences' error
    EXPECT_NEAR(local.curved_trace, across, 1e-8 * along) << nu;
  }
}

// The force for a displacement of 1 mm of a disc on the far face.
double force_at(const TouchedBox& box, palpate_scene* scene, double y, double radius, Eigen::Vector3d direction) {
  Contacts contacts(scene);
  SurfacePoint place;
  double least = INFINITY;
  const auto vec = [](Eigen::Vector3d v) { return Vec3{v[0], v[1], v[2]}; };
  for (std::size_t t = 0; t < box.body.triangles.size(); ++t) {
    double k[3];
    const auto corner = [&](int v) { return vec(box.node(box.body.triangles[t][v])); };
    const double distance = closest_on_triangle({0.06, y, 0.021}, corner(0), corner(1), corner(2), k);
    if (distance >= least) continue;
    least = distance;
    place.triangle = static_cast<std::int32_t>(t);
    std::copy(k, k + 3, place.barycentric);
  }
  const std::vector<palpate_grip> grips = {
      grip_at_place(place.triangle, Eigen::Vector3d(place.barycentric), 0.001 * direction)};
  palpate_tool tool = tool_of(grips);
  tool.disc_radius = radius;
  EXPECT_EQ(palpate_scene_touch(scene, &tool, 1, 1e-3, contacts.get(), contacts.bytes()), 0u);
  return -Eigen::Vector3d(palpate_contacts_tool(contacts, 0)->force_raw).dot(direction);
}

TEST(PatchContact, ChangesSmoothlyAsItIsDraggedOverElements) {
  TinyBox form;
  form.cells = {3, 6, 5};
  const TouchedBox box(form);
  const ScenePointer scene = box.scene(unlimited_def());
  // Over two cells of 8.3 mm in steps of 0.05 mm; a point's force goes up and down over each.
  const auto roughness = [&](double radius, Eigen::Vector3d direction) {
    std::vector<double> force;
    for (double y = 0.017; y < 0.033; y += 5e-5) force.push_back(force_at(box, scene.get(), y, radius, direction));
    const auto [low, high] = std::minmax_element(force.begin(), force.end());
    double jump = 0;
    for (std::size_t i = 1; i < force.size(); ++i) jump = std::max(jump, std::abs(force[i] / force[i - 1] - 1));
    return std::pair{*high / *low - 1, jump};
  };
  for (const Eigen::Vector3d& direction : {Eigen::Vector3d(-1, 0, 0), Eigen::Vector3d(0, 1, 0)}) {
    const auto point = roughness(0, direction), disc = roughness(0.004, direction);
    RecordProperty("range_and_jump", std::to_string(point.first) + " " + std::to_string(point.second) + " / " +
                                         std::to_string(disc.first) + " " + std::to_string(disc.second));
    EXPECT_GT(point.first, 2.5 * disc.first);  // of which some is real: the edges of the block are near
    EXPECT_LT(disc.first, 0.04);               // over two cells
    EXPECT_LT(disc.second, 4e-4);              // per 0.05 mm: it has a slope, and no steps
  }
}

// What a disc gives way below the mesh's resolution moves no node. A disc that creeps along hardly changes the field, so that a point that
// hovers elsewhere is not tested in every step.
TEST(PatchContact, ThatCreepsLeavesAHoveringPointAlone) {
  TinyBox form;
  form.cells = {3, 6, 5};
  const TouchedBox box(form);
  SceneDef def = unlimited_def(PALPATE_COLLISION_DEFORMED);
  const auto operations = [&](double per_step) {
    TouchedScene scene(box, def);
    std::int64_t sum = 0;
    for (int s = 0; s < 200; ++s) {
      const PlaceOnFace place = place_at(box, {1, 0, 0}, {0.06, 0.02 + per_step * s, 0.021});
      const std::vector<palpate_grip> grips = {grip_at_place(place.triangle, place.weights, {-0.002, 0, 0})};
      palpate_tool tools[2] = {tool_of(grips), palpate_default_tool()};
      tools[0].disc_radius = 0.004;
      const double hovers[3] = {0.064, 0.04, 0.04};
      tools[1].points = hovers, tools[1].point_count = 1;
      EXPECT_EQ(scene.touch(tools), 0u);
      if (s >= 100) sum += scene.contacts.get()->operations;
    }
    return sum;
  };
  EXPECT_LT(operations(0), 100 * (50 + 2 * 25));  // 25 for the point and 25 for the grip, whatever they do
  EXPECT_LT(operations(1e-7),
            100 * 6000);  // the disc and its rows take 4,100 a step; 7,900 where its own compliance counts as motion
}

TEST(PatchContact, OfALargerDiscIsStifferAndAPointIsThePointModel) {
  const TouchedBox box;
  const ScenePointer scene = box.scene(unlimited_def());
  double before = 0;
  for (double radius = 0.0002; radius < 0.02; radius *= 1.3) {
    const double force = force_at(box, scene.get(), 0.024, radius, {-1, 0, 0});
    EXPECT_GT(force, before);
    before = force;
  }
  const ScenePointer point = box.scene(unlimited_def(PALPATE_CONTACT_POINT));
  EXPECT_EQ(force_at(box, scene.get(), 0.024, 0, {-1, 0, 0}), force_at(box, point.get(), 0.024, 0, {-1, 0, 0}));
  EXPECT_EQ(force_at(box, point.get(), 0.024, 0.003, {-1, 0, 0}), force_at(box, point.get(), 0.024, 0, {-1, 0, 0}));
}

TEST(PatchContact, TakesWhatTheMeshBlursFromTheElement) {
  // The same tensors under three element names: the force differs by the blur of each element.
  const auto compliance = [](const char* element, Eigen::Vector3d direction) {
    TinyBox form;
    form.cells = {3, 6, 5};
    const TouchedBox named(form, [&](BundleParts& parts) {
      const std::size_t at = parts.provenance.find("\"p1\"");
      parts.provenance.replace(at, 4, std::string("\"") + element + "\"");
    });
    const ScenePointer scene = named.scene(unlimited_def());
    return 0.001 / force_at(named, scene.get(), 0.024, 0.001, direction);
  };
  const double s = std::sqrt(0.05 / 6 * 0.04 / 5), b = ContactPatch::kResolved * s;  // of the far face
  const auto local = [&](StoredElement element) { return local_compliance(5400, 0.45, element); };
  const auto softer = [&](double over_radius, double more, double less) {
    return over_radius * (1 / (b + less * s) - 1 / (b + more * s));
  };
  const LocalCompliance anp = local(StoredElement::p1_anp), p2 = local(StoredElement::p2_p0),
                        p1 = local(StoredElement::p1);
  const Eigen::Vector3d in(-1, 0, 0), along(0, 1, 0);
  const double expected = softer(anp.normal, p2.normal_blur, anp.normal_blur);
  EXPECT_GT(expected, 0);
  EXPECT_NEAR(compliance("p2-p0", in) - compliance("p1-anp", in), expected,
              0.02 * expected);  // 2 %: the directions that it leaves held couple a little
  const double across = softer(anp.tangent, p2.tangent_blur, anp.tangent_blur);
  EXPECT_NEAR(compliance("p2-p0", along) - compliance("p1-anp", along), across, 0.02 * across);
  const double plain = softer(anp.normal, p1.normal_blur, anp.normal_blur);
  EXPECT_NEAR(compliance("p1", in) - compliance("p1-anp", in), plain, 0.02 * plain);
}

TEST(PatchContact, TakesItsStiffnessFromTheRegionUnderIt) {
  // Two regions: the material of the half y > 25 mm is stated ten times as stiff, while the tensors stay the same.
  const auto two_regions = [](BundleParts& parts) {
    const auto nodes = parts.get<double>(formats::SectionId::nodes);
    const auto tetrahedra = parts.get<std::int32_t>(formats::SectionId::tetrahedra);
    std::vector<std::int32_t> region(tetrahedra.size() / 4);
    for (std::size_t e = 0; e < region.size(); ++e) {
      double y = 0;
      for (int v = 0; v < 4; ++v) y += nodes[3 * tetrahedra[4 * e + v] + 1] / 4;
      region[e] = y > 0.025;
    }
    parts.set(formats::SectionId::region, {region.size()}, region);
    parts.set(formats::SectionId::young, {2}, std::vector<double>{5400, 54000});
    parts.set(formats::SectionId::poisson, {2}, std::vector<double>{0.45, 0.45});
    parts.set_text(formats::SectionId::region_names, "soft\nstiff\n");
  };
  TinyBox form;
  form.cells = {3, 6, 5};
  const TouchedBox one(form), two(form, two_regions);
  const ScenePointer uniform = one.scene(unlimited_def()), parted = two.scene(unlimited_def());
  const double soft = force_at(two, parted.get(), 0.008, 0.001, {-1, 0, 0}),
               stiff = force_at(two, parted.get(), 0.042, 0.001, {-1, 0, 0});
  EXPECT_NEAR(soft, force_at(one, uniform.get(), 0.008, 0.001, {-1, 0, 0}), 1e-12);
  EXPECT_GT(stiff, 2 * force_at(one, uniform.get(), 0.042, 0.001, {-1, 0, 0}));
}

// ---- more discs than there are nodes for ---------------------------------------------------------------------------

// Many more discs than nodes, as those of an instrument with close points. What the mesh does not resolve below them is the larger part of
// their compliance: the force is that of all discs, four times that of one, where each has that part of its own.
class DiscsAtOnePlace : public TouchedScene {
 public:
  DiscsAtOnePlace(int discs, palpate_contact_law law, palpate_collision collision)
      : TouchedScene(ManyDiscs::box(), unlimited_def(law, collision)), points_(discs) {}
  // N, at a depth of 1 mm and after a drag by so much, m, in steps.
  Eigen::Vector3d press(double drag) {
    for (int step = -2; step <= 20; ++step) touch(5e-5 * step, 0);
    for (int step = 1; step <= 10; ++step) touch(1e-3, 0.1 * step * drag);
    return force();
  }
  void touch(double depth, double along) {
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const double apart = 2e-6 * static_cast<double>(i);
      points_[i] = Eigen::Vector3d(0.06 - depth, 0.0201 + along + apart, 0.0203 - apart);
    }
    TouchedScene::touch({point_tool(points_[0].data(), static_cast<std::int32_t>(points_.size()), 0.001, 0.3)});
  }

 private:
  std::vector<Eigen::Vector3d> points_;
};

TEST(Discs, OfThirtySixClosePointsPressAndDragLikeOneUnderEveryLaw) {
  for (const auto collision : {PALPATE_COLLISION_REST, PALPATE_COLLISION_DEFORMED})
    for (const auto law : kEveryLaw) {
      DiscsAtOnePlace one(1, law, collision), many(36, law, collision);
      const Eigen::Vector3d expected = one.press(1e-4), found = many.press(1e-4);
      EXPECT_EQ(many.flags, 0u) << law;
      // 0.8 % that discs keep to themselves, and what 36 discs within a tenth of their radius cover more than one.
      EXPECT_GT(found.norm(), 0.99 * expected.norm()) << law;
      EXPECT_LT(found.norm(), 1.04 * expected.norm()) << law;
      EXPECT_LT((found / found.norm() - expected / expected.norm()).norm(), 0.05) << law;
    }
}

TEST(Discs, ThatOverlapGoOnWithTheSameBitsAfterARestore) {
  for (const auto law : {PALPATE_LAW_STICKING, PALPATE_LAW_COULOMB}) {
    DiscsAtOnePlace played(5, law, PALPATE_COLLISION_DEFORMED), restored(5, law, PALPATE_COLLISION_DEFORMED);
    played.press(5e-5);
    restored.touch(-1e-3, 0);  // it has been elsewhere
    restored.touch(2e-3, 0);
    restore_from(played.get(), restored.get());
    for (int step = 0; step < 20; ++step) {
      const double depth = 1e-3 - 2e-5 * step, along = 5e-5 + 2e-6 * step;
      played.touch(depth, along), restored.touch(depth, along);
      EXPECT_EQ(played.force(), restored.force()) << step;
    }
    EXPECT_EQ(state_of(played.get()), state_of(restored.get()));
  }
}

TEST(Discs, AreThinnedWhereNodesAreShortAndNoContactIsDropped) {
  ManyDiscs all(3000);
  for (const std::int32_t nodes : {512, 256, 192, 128, 64}) {
    ManyDiscs some(nodes);
    EXPECT_EQ(some.tool().contact_count, 64) << nodes;
    EXPECT_EQ(some.flags & PALPATE_STEP_CONTACTS_DROPPED, 0u) << nodes;
    EXPECT_LE(some.contacts->node_count, nodes);
    // A disc is softer on fewer nodes, and on two or one it is a poor disc.
    const double share = some.force()[0] / all.force()[0];
    EXPECT_LT(share, 1.01) << nodes;
    EXPECT_GT(share, nodes >= 192 ? 0.95 : 0.9) << nodes;
    EXPECT_EQ((some.flags & PALPATE_STEP_DISCS_THINNED) != 0, nodes < 512) << nodes;
    // At rest: the same nodes, the same bits.
    const Eigen::Vector3d force = some.force();
    some.press(1e-3);
    EXPECT_EQ(some.force(), force) << nodes;
  }
}

TEST(Discs, ThatAreThinnedWithoutAFlagKeepTheirForce) {
  int trusted = 0, flagged = 0;
  for (const double radius : {0.001, 0.004, 0.008})
    for (std::int32_t nodes = 1; nodes < 16; ++nodes) {
      const auto press = [&](std::int32_t limit, palpate_step_flags* flags) {
        SceneDef def = unlimited_def();
        def.max_points = 1, def.max_contact_nodes = limit;
        TouchedScene scene(ManyDiscs::box(), def);
        const std::vector<palpate_grip> grips = {
            grip_at_place(ManyDiscs::box().far_triangle(37), {.5, .3, .2}, {-0.001, 0.0005, 0})};
        palpate_tool tool = tool_of(grips);
        tool.disc_radius = radius;
        *flags = scene.touch({tool});
        return scene.force();
      };
      palpate_step_flags flags = 0, of_all = 0;
      const Eigen::Vector3d thinned = press(nodes, &flags), all = press(3000, &of_all);
      EXPECT_EQ(of_all, 0u);
      EXPECT_TRUE(flags == 0 || flags == PALPATE_STEP_DISCS_THINNED);
      if (flags == 0) {
        EXPECT_LT((thinned - all).norm(), 0.05 * all.norm()) << radius << " " << nodes;  // as palpate.h states
      }
      trusted += flags == 0, flagged += flags != 0;
    }
  EXPECT_GT(trusted, 10);
  EXPECT_GT(flagged, 10);
}

TEST(ThinnedDisc, KeepsItsWeightAndItsMean) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(0, 1);
  const Vec3 u = {1, 0, 0}, v = {0, 1, 0};
  int moved = 0;
  for (int disc = 0; disc < 200; ++disc) {
    const int count = 4 + static_cast<int>(random() % 20), most = 1 + static_cast<int>(random() % (count - 1));
    std::vector<double> rest(3 * count), weight(count);
    std::vector<std::int32_t> node(count);
    double sum = 0;
    for (double& x : rest) x = any(random);
    for (int e = 0; e < count; ++e) node[e] = e, sum += weight[e] = 0.01 + any(random) * any(random);
    for (double& w : weight) w /= sum;
    const auto mean = [&](int nodes) {
      Eigen::Vector3d m = Eigen::Vector3d::Zero();
      for (int e = 0; e < nodes; ++e) m += weight[e] * Eigen::Vector3d(1, rest[3 * node[e]], rest[3 * node[e] + 1]);
      return m;
    };
    const Eigen::Vector3d before = mean(count);
    std::vector<double> sorted = weight;
    std::sort(sorted.rbegin(), sorted.rend());
    WeightedNodes nodes = {node.data(), weight.data(), count};
    const double kept = thin_nodes(rest.data(), u, v, most, &nodes);
    EXPECT_EQ(nodes.count, most);
    EXPECT_NEAR(kept, std::accumulate(sorted.begin(), sorted.begin() + most, 0.0), 1e-14);
    EXPECT_TRUE(std::is_sorted(node.begin(), node.begin() + most));
    const Eigen::Vector3d after = mean(most);
    EXPECT_NEAR(after[0], 1, 1e-14);
    for (int e = 0; e < most; ++e) EXPECT_GT(weight[e], 0);
    moved += (after - before).norm() > 1e-9;
    if (most > count / 2 && most > 5) {
      EXPECT_LT((after - before).norm(), 1e-12) << count << " to " << most;
    }
  }
  EXPECT_GT(moved, 0);  // a node or two cannot keep the mean
}

}  // namespace
}  // namespace palpate::tests
