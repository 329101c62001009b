// Rigid shapes as tool points: where the points lie, what is refused, and that a finer sampling presses with the same force.
#include "runtime/include/palpate/palpate_complete.h"

#include <Eigen/Geometry>
#include <random>

#include "tests/runtime/touched_box.h"
#include "tests/support/grid_body.h"

namespace palpate::tests {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

struct ShapeDestroyer {
  void operator()(palpate_tool_shape* shape) const { palpate_tool_shape_destroy(shape); }
};
using ShapePointer = std::unique_ptr<palpate_tool_shape, ShapeDestroyer>;

ShapePointer make(const palpate_tool_shape_def& def) {
  palpate_tool_shape* shape = nullptr;
  palpate_error error = {};
  if (palpate_tool_shape_create(&def, &shape, &error) != PALPATE_OK) throw std::runtime_error(error.text);
  return ShapePointer(shape);
}

std::string refused(const palpate_tool_shape_def& def) {
  palpate_tool_shape* shape = nullptr;
  palpate_error error = {};
  EXPECT_EQ(palpate_tool_shape_create(&def, &shape, &error), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(shape, nullptr);
  return error.text;
}

palpate_tool_shape_def def_of(palpate_tool_shape_kind kind, double spacing, double radius = 0, double length = 0) {
  palpate_tool_shape_def def = palpate_default_tool_shape_def();
  def.kind = kind, def.radius = radius, def.length = length, def.spacing = spacing;
  def.max_points = PALPATE_MAX_TOOL_SHAPE_POINTS;
  return def;
}

std::vector<Vector3d> points_of(const palpate_tool_shape* shape) {
  std::vector<Vector3d> points;
  for (std::int32_t i = 0; i < palpate_tool_shape_point_count(shape); ++i)
    points.emplace_back(palpate_tool_shape_points(shape) + 3 * static_cast<std::ptrdiff_t>(i));
  return points;
}

double nearest(const std::vector<Vector3d>& points, const Vector3d& p) {
  double least = INFINITY;
  for (const Vector3d& q : points) least = std::min(least, (p - q).norm());
  return least;
}

// A cuboid's corners.
std::vector<double> cuboid(const Vector3d& half) {
  std::vector<double> vertices;
  for (int c = 0; c < 8; ++c)
    for (int d = 0; d < 3; ++d) vertices.push_back(c >> d & 1 ? half[d] : -half[d]);
  return vertices;
}

palpate_tool_shape_def hull_of(const std::vector<double>& vertices, double spacing) {
  palpate_tool_shape_def def = def_of(PALPATE_TOOL_HULL, spacing);
  def.vertices = vertices.data(), def.vertex_count = static_cast<std::int32_t>(vertices.size() / 3);
  return def;
}

// ---- where the points lie -----------------------------------------------------------------------------------------------

double distance_to_capsule(const Vector3d& p, double radius, double length) {
  const double along = std::clamp(p.z(), -0.5 * length, 0.5 * length);
  return std::fabs((p - Vector3d(0, 0, along)).norm() - radius);
}

TEST(ToolShape, SphereAndCapsuleAreCoveredAtTheSpacing) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-0.5, 0.5);
  for (const double length : {0.0, 0.003, 0.05})
    for (const double spacing : {0.0007, 0.002, 0.008}) {
      const double radius = 0.005;
      const auto kind = length > 0 ? PALPATE_TOOL_CAPSULE : PALPATE_TOOL_SPHERE;
      const ShapePointer shape = make(def_of(kind, spacing, radius, length));
      const std::vector<Vector3d> points = points_of(shape.get());
      for (const Vector3d& p : points) EXPECT_LT(distance_to_capsule(p, radius, length), 1e-16);
      for (int i = 0; i < 500; ++i) {
        Vector3d p = radius * Vector3d(normal(random), normal(random), normal(random)).normalized();
        if (i % 2) p = radius * Vector3d(p.x(), p.y(), 0).normalized() + Vector3d(0, 0, length * uniform(random));
        if (i % 2 == 0) p.z() += std::copysign(0.5 * length, p.z());
        EXPECT_LT(nearest(points, p), spacing);
      }
      const double area = 4 * M_PI * radius * radius + 2 * M_PI * radius * length,
                   disc = palpate_tool_shape_patch_radius(shape.get());
      EXPECT_NEAR(points.size() * M_PI * disc * disc, area, 1e-12 * area);
      // Rings of a whole number of points at most the spacing apart: at least one per spacing^2, and not many more.
      EXPECT_GE(1.0 * points.size(), 0.95 * area / (spacing * spacing));
      if (spacing < 0.4 * radius) {
        EXPECT_LE(1.0 * points.size(), 1.5 * area / (spacing * spacing));
      }
    }
}

TEST(ToolShape, HullIsThatOfTheVerticesAndIsCovered) {
  const Vector3d half(0.01, 0.004, 0.006);
  std::vector<double> vertices = cuboid(half);
  // Points inside, on faces, on edges and twice change nothing.
  for (const double p : {0.0, 0.001, 0.002, 0.01, 0.0, 0.0, 0.01, 0.004, 0.0, 0.01, 0.004, 0.006})
    vertices.push_back(p);
  const double spacing = 0.0015;
  const ShapePointer shape = make(hull_of(vertices, spacing)), plain = make(hull_of(cuboid(half), spacing));
  const std::vector<Vector3d> points = points_of(shape.get());
  for (const Vector3d& p : points) {
    EXPECT_LT(((p.cwiseAbs() - half).array() - 1e-15).maxCoeff(), 0);
    EXPECT_NEAR((half - p.cwiseAbs()).minCoeff(), 0, 1e-15) << "on a face";
  }
  for (int c = 0; c < 8; ++c)
    EXPECT_EQ(nearest(points, Vector3d(vertices.data() + 3 * c)), 0) << "the corners are points";
  const double area = 8 * (half.x() * half.y() + half.y() * half.z() + half.z() * half.x());
  for (const auto& each : {&shape, &plain}) {
    const double disc = palpate_tool_shape_patch_radius(each->get());
    EXPECT_NEAR(palpate_tool_shape_point_count(each->get()) * M_PI * disc * disc, area, 1e-12 * area)
        << "each face counts once";
  }
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int i = 0; i < 2000; ++i) {
    Vector3d p = half.cwiseProduct(Vector3d(uniform(random), uniform(random), uniform(random)));
    p[i % 3] = i % 2 ? half[i % 3] : -half[i % 3];
    EXPECT_LT(nearest(points, p), spacing);
  }
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) EXPECT_GE((points[i] - points[j]).norm(), 0.75 * spacing * (1 - 1e-12));
}

// Against the support function of the vertices: no vertex lies beyond a face, and in every direction the farthest vertex has a
// point of the shape near it.
TEST(ToolShape, HullOfRandomVertices) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (const int count : {4, 5, 9, 40, 256}) {
    std::vector<double> vertices;
    for (int i = 0; i < 3 * count; ++i) vertices.push_back(0.01 * normal(random));
    const double spacing = 0.004;
    const ShapePointer shape = make(hull_of(vertices, spacing));
    const std::vector<Vector3d> points = points_of(shape.get());
    for (int i = 0; i < 300; ++i) {
      const Vector3d direction = Vector3d(normal(random), normal(random), normal(random)).normalized();
      double farthest = -INFINITY, sampled = -INFINITY;
      Vector3d at = Vector3d::Zero();
      for (int v = 0; v < count; ++v)
        if (const Vector3d p(vertices.data() + 3 * v); p.dot(direction) > farthest) farthest = p.dot(direction), at = p;
      for (const Vector3d& p : points) sampled = std::max(sampled, p.dot(direction));
      EXPECT_LT(sampled, farthest + 1e-15);
      EXPECT_LT(nearest(points, at), spacing);
    }
  }
}

TEST(ToolShape, MeshIsCoveredTriangleByTriangle) {
  // Two triangles that share no vertex, one of them a sliver.
  const std::vector<double> vertices = {0, 0, 0, 0.02, 0, 0, 0, 0.01, 0, 0, 0, 0.05, 0.03, 0, 0.05, 0.03, 1e-5, 0.05};
  const std::int32_t triangles[6] = {0, 1, 2, 3, 4, 5};
  palpate_tool_shape_def def = def_of(PALPATE_TOOL_MESH, 0.001);
  def.vertices = vertices.data(), def.vertex_count = 6, def.triangles = triangles, def.triangle_count = 2;
  const ShapePointer shape = make(def);
  const std::vector<Vector3d> points = points_of(shape.get());
  std::mt19937 random(9);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int i = 0; i < 1000; ++i) {
    double k = uniform(random), l = uniform(random);
    if (k + l > 1) k = 1 - k, l = 1 - l;
    const auto vertex = [&](int v) { return Vector3d(vertices.data() + 3 * (v + 3 * (i % 2))); };
    EXPECT_LT(nearest(points, k * vertex(0) + l * vertex(1) + (1 - k - l) * vertex(2)), 0.001);
  }
}

TEST(ToolShape, HasTheSamePointsEveryTime) {
  const std::vector<double> vertices = cuboid({0.01, 0.004, 0.006});
  for (const palpate_tool_shape_def& def : {def_of(PALPATE_TOOL_SPHERE, 0.001, 0.005),
                                            def_of(PALPATE_TOOL_CAPSULE, 0.001, 0.005, 0.02), hull_of(vertices, 0.001)})
    EXPECT_EQ(points_of(make(def).get()), points_of(make(def).get()));
  const ShapePointer point = make(def_of(PALPATE_TOOL_POINT, 0, 0.003));
  EXPECT_EQ(points_of(point.get()), std::vector<Vector3d>{Vector3d::Zero()});
  EXPECT_EQ(palpate_tool_shape_patch_radius(point.get()), 0.003);
}

// ---- what is refused ----------------------------------------------------------------------------------------------------

TEST(ToolShape, ThatNeedsTooManyPointsSaysHowMany) {
  palpate_tool_shape_def def = def_of(PALPATE_TOOL_SPHERE, 0.001, 0.01);
  const int needed = palpate_tool_shape_point_count(make(def).get());
  def.max_points = needed - 1;
  EXPECT_THAT(refused(def), testing::HasSubstr("needs " + std::to_string(needed) + " points at a spacing of 0.001 m"));
  def.max_points = needed;
  EXPECT_EQ(palpate_tool_shape_point_count(make(def).get()), needed);
  // The spacing that the sentence names is coarse enough.
  def.max_points = 64;
  const std::string text = refused(def), before = "use a spacing of ";
  def.spacing = std::stod(text.substr(text.find(before) + before.size()));
  EXPECT_LE(palpate_tool_shape_point_count(make(def).get()), 64);
  EXPECT_GE(palpate_tool_shape_point_count(make(def).get()), 40);
  def.spacing = 1e-9;
  EXPECT_THAT(refused(def), testing::HasSubstr("needs about"));
  const std::vector<double> vertices = cuboid({1, 1, 1});
  EXPECT_THAT(refused(hull_of(vertices, 1e-6)), testing::HasSubstr("needs about"));
  EXPECT_THAT(refused(hull_of(vertices, 0.06)), testing::HasSubstr("needs more than 4096"));
}

TEST(ToolShape, ThatIsNoneIsRefused) {
  const auto expect = [](palpate_tool_shape_def def, const char* text) {
    EXPECT_THAT(refused(def), testing::HasSubstr(text));
  };
  for (const double bad : {0.0, -1.0, double(NAN), double(INFINITY)}) {
    expect(def_of(PALPATE_TOOL_SPHERE, 0.001, bad), "a radius above 0 m");
    expect(def_of(PALPATE_TOOL_SPHERE, bad, 0.001), "a spacing above 0 m");
    if (bad != 0) expect(def_of(PALPATE_TOOL_CAPSULE, 0.001, 0.001, bad), "a length of 0");
    if (bad != 0) expect(def_of(PALPATE_TOOL_POINT, 0.001, bad), "a radius of 0 to 1 m");
  }
  palpate_tool_shape_def def = def_of(PALPATE_TOOL_SPHERE, 0.001, 0.001);
  def.max_points = 0;
  expect(def, "max_points");
  const int kind = 77;
  def = def_of(PALPATE_TOOL_SPHERE, 0.001, 0.001);
  std::memcpy(&def.kind, &kind, sizeof kind);
  expect(def, "a kind");
  def = def_of(PALPATE_TOOL_SPHERE, 0.001, 0.001), def.struct_bytes = 8;
  expect(def, "struct_bytes is 8");
  std::vector<double> vertices = cuboid({0.01, 0.01, 0.01});
  def = hull_of(vertices, 0.001), def.vertex_count = 3;
  expect(def, "4 to 256 vertices");
  def = hull_of(vertices, 0.001), def.vertices = nullptr;
  expect(def, "4 to 256 vertices");
  def = hull_of(vertices, 0.001), def.vertex_count = 4;  // the corners of one face
  expect(def, "in one plane");
  vertices[4] = NAN;
  expect(hull_of(vertices, 0.001), "every vertex finite");
  vertices[4] = 0.01;
  const std::int32_t triangles[3] = {0, 1, 8}, flat[3] = {0, 0, 1};
  def = hull_of(vertices, 0.001), def.kind = PALPATE_TOOL_MESH;
  expect(def, "triangles of a mesh");
  def.triangles = triangles, def.triangle_count = 1;
  expect(def, "triangles over the mesh's vertices");
  def.triangles = flat;
  expect(def, "triangles with an area");
  EXPECT_EQ(palpate_tool_shape_create(nullptr, nullptr, nullptr), PALPATE_ERROR_ARGUMENT);
  palpate_tool_shape_destroy(nullptr);
}

// ---- pressing -------------------------------------------------------------------------------------------------------------

// 60 x 60 x 30 mm, held below, with edges of 3 mm around the middle of its top.
constexpr double kYoung = 5000, kPoisson = 0.3, kTop = 0.03;
const TouchedBody& block() {
  static const TouchedBody shared([] {
    GridBody grid;
    grid.lines[0] = {0, .012, .020, .024, .027, .030, .033, .036, .040, .048, .060};
    grid.lines[1] = grid.lines[0];
    grid.lines[2] = {0, .012, .020, .025, .028, kTop};
    grid.held = [](std::array<double, 3> p) { return p[2] == 0; };
    grid.young = kYoung, grid.poisson = kPoisson;
    return dense_grid(grid);
  }());
  return shared;
}

struct Pressed {
  Vector3d force, torque;
  int contacts = 0;
  palpate_step_flags flags = 0;
};

// Lowers the shape onto the middle of the top in steps of 0.1 mm, until its lowest place (lowest: m below its origin) would be
// `depth` below the surface.
Pressed press(const palpate_tool_shape_def& def, double lowest, double depth, const Quaterniond& turn,
              palpate_contact_law law = PALPATE_LAW_UNILATERAL) {
  const ShapePointer shape = make(def);
  SceneDef scene_def = unlimited_def(PALPATE_COLLISION_DEFORMED, law);
  scene_def.max_points = palpate_tool_shape_point_count(shape.get()),
  scene_def.max_contact_nodes = std::max(600, scene_def.max_points);
  TouchedScene scene(block(), scene_def);
  palpate_tool tool = palpate_default_tool();
  tool.friction = 0.3;
  Pressed found;
  const double orientation[4] = {turn.w(), turn.x(), turn.y(), turn.z()};
  const int steps = static_cast<int>(std::lround(depth / 1e-4));
  for (int s = -3; s <= steps + 20; ++s) {  // the last ones let deferred tests come
    const double position[3] = {0.0301, 0.0302, kTop + lowest - 1e-4 * std::min(s, steps)};
    palpate_tool_shape_place(shape.get(), position, orientation, &tool);
    found.flags = scene.touch({tool});
  }
  const palpate_tool_state& state = scene.tool();
  found.force = Vector3d(state.force_raw), found.torque = Vector3d(state.torque_raw);
  found.contacts = state.contact_count - state.release_count;
  return found;
}

// The force of each sampling against that of the one before it, which has twice its spacing.
std::vector<double> changes(const std::vector<Pressed>& of) {
  std::vector<double> changes;
  for (std::size_t i = 1; i < of.size(); ++i) changes.push_back(of[i].force.z() / of[i - 1].force.z() - 1);
  return changes;
}

// docs/method.md states these figures. A point more or less in a contact 7 mm wide is a tenth of its area, and discs of 4 mm spacing cover
// more than the contact.
TEST(ToolShape, OfASpherePressesWithTheSameForceWhenItIsSampledTwiceAsFinely) {
  const double radius = 0.008, depth = 0.0016;
  std::vector<Pressed> pressed;
  for (const double spacing : {0.004, 0.002, 0.001}) {
    const Pressed found = press(def_of(PALPATE_TOOL_SPHERE, spacing, radius), radius, depth, Quaterniond::Identity());
    EXPECT_GT(found.contacts, 4);
    EXPECT_EQ(found.flags, 0u);
    // Without friction all forces point to the centre, but for the 0.2 mm that the surface's normals turn within a triangle.
    EXPECT_LT(found.torque.norm(), 0.01 * radius * found.force.norm()) << spacing;
    EXPECT_LT(found.force.head<2>().norm(), 0.01 * found.force.z()) << spacing;
    pressed.push_back(found);
  }
  EXPECT_THAT(changes(pressed), testing::Each(testing::AllOf(testing::Gt(-0.18), testing::Lt(0.05))));
  EXPECT_NEAR(changes(pressed).back(), 0, 0.05);
  // Hertz on a half-space; the block is 30 mm thick on a rigid floor and its linear elements are too stiff: above it.
  const double hertz = 4.0 / 3 * kYoung / (1 - kPoisson * kPoisson) * std::sqrt(radius) * std::pow(depth, 1.5);
  EXPECT_GT(pressed.back().force.z(), hertz);
  EXPECT_LT(pressed.back().force.z(), 1.15 * hertz);
}

TEST(ToolShape, OfACapsuleAndAHullPressesWithTheSameForceWhenItIsSampledTwiceAsFinely) {
  const Quaterniond lying(Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitY()));
  const std::vector<double> vertices = cuboid({0.006, 0.004, 0.005});
  const Quaterniond tilted(Eigen::AngleAxisd(0.1, Vector3d(1, 1, 0).normalized()));
  double low = 0;
  for (int c = 0; c < 8; ++c) low = std::max(low, -(tilted * Vector3d(vertices.data() + 3 * c)).z());
  std::vector<Pressed> capsules, hulls;
  for (const double spacing : {0.003, 0.0015}) {
    capsules.push_back(press(def_of(PALPATE_TOOL_CAPSULE, spacing, 0.004, 0.012), 0.004, 0.0012, lying));
    hulls.push_back(press(hull_of(vertices, spacing), low, 0.002, tilted));
    // The tilted cuboid's lowest corner pushes it back: a torque that turns it flat.
    EXPECT_LT(hulls.back().torque.x(), 0);
  }
  EXPECT_THAT(changes(capsules), testing::Each(testing::AllOf(testing::Gt(-0.05), testing::Lt(0.05))));
  EXPECT_THAT(changes(hulls), testing::Each(testing::AllOf(testing::Gt(-0.17), testing::Lt(0.02))));
}

TEST(ToolShape, ThatIsPlacedNowhereIsBadInputAndKeepsItsPlace) {
  const ShapePointer shape = make(def_of(PALPATE_TOOL_SPHERE, 0.002, 0.005));
  SceneDef def = unlimited_def();
  def.max_points = palpate_tool_shape_point_count(shape.get());
  TouchedScene scene(block(), def);
  palpate_tool tool = palpate_default_tool();
  const auto touch = [&](std::array<double, 3> position, std::array<double, 4> orientation) {
    palpate_tool_shape_place(shape.get(), position.data(), orientation.data(), &tool);
    return scene.touch({tool});
  };
  touch({0.03, 0.03, 0.036}, {1, 0, 0, 0});
  touch({0.03, 0.03, 0.034}, {1, 0, 0, 0});
  const Vector3d force(scene.tool().force_raw);
  EXPECT_GT(force.z(), 0);
  EXPECT_EQ(touch({NAN, 0.03, 0.034}, {1, 0, 0, 0}), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(touch({0.03, 0.03, 0.034}, {0.9, 0, 0, 0}), PALPATE_STEP_BAD_INPUT);
  EXPECT_EQ(scene.force(), force);
}

}  // namespace
}  // namespace palpate::tests
