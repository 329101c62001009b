// A finer mesh that follows the surface: motions that it must reproduce, and bad meshes and shapes.
#include <cstring>
#include <random>

#include "runtime/skin/skin.h"
#include "runtime/surface/surface_index.h"
#include "tests/runtime/asked_scene.h"
#include "tests/runtime/played_box.h"

namespace palpate::tests {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

const TouchedBox& box() {
  static const TouchedBox shared({}, add_everything);
  return shared;
}

// A host's vertices and normals.
struct Mesh {
  std::vector<Vector3d> places;
  std::vector<float> positions, normals;

  void add(Vector3d place, Vector3d normal) {
    for (int d = 0; d < 3; ++d) positions.push_back(static_cast<float>(place[d]));
    for (int d = 0; d < 3; ++d) normals.push_back(static_cast<float>(normal[d]));
    places.push_back(Eigen::Map<Eigen::Vector3f>(positions.data() + positions.size() - 3).cast<double>());
  }
  palpate_render_mesh view() const {
    return render_mesh(positions.data(), normals.data(), static_cast<std::int32_t>(places.size()));
  }
};

// Vertices above every triangle of a box, at a height given as a share of an edge.
Mesh mesh_over(const TouchedBox& of, double height) {
  Mesh mesh;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> share(0, 1);
  for (std::size_t t = 0; t < of.body.triangles.size(); ++t)
    for (int i = 0; i < 4; ++i) {
      const double a = share(random), b = (1 - a) * share(random);
      const Vector3d out = of.outward(static_cast<std::int32_t>(t));
      mesh.add(of.place(static_cast<std::int32_t>(t), {a, b, 1 - a - b}) + (i % 2 ? height : -height) * out, out);
    }
  return mesh;
}

struct Skinned {
  std::vector<float> positions, normals;
  palpate_step_flags flags = 0;
  Vector3d position(std::size_t v) const { return Eigen::Map<const Eigen::Vector3f>(&positions[3 * v]).cast<double>(); }
  Vector3d normal(std::size_t v) const { return Eigen::Map<const Eigen::Vector3f>(&normals[3 * v]).cast<double>(); }
};

ScenePointer scene_of(const TouchedBox& of, const Mesh& mesh, SceneDef def = SceneDef()) {
  const palpate_render_mesh view = mesh.view();
  def.render_mesh = view;
  return of.scene(def);
}

Skinned skinned(palpate_scene* scene, const Mesh& mesh, std::vector<float> displacements) {
  Skinned found;
  found.positions.assign(mesh.positions.size(), NAN), found.normals.assign(mesh.positions.size(), NAN);
  palpate_shape_out shape = shape_out(displacements.data(), nullptr, 0);
  shape.node_count = static_cast<std::int32_t>(displacements.size() / 3);
  palpate_skin_out out =
      skin_out(found.positions.data(), found.normals.data(), static_cast<std::int32_t>(mesh.places.size()));
  found.flags = palpate_scene_skin(scene, &shape, &out);
  EXPECT_EQ(out.vertex_count, out.vertex_capacity);
  return found;
}

// Every surface node moved by gradient x + shift.
std::vector<float> moved_by(const TouchedBox& of, const Matrix3d& gradient, const Vector3d& shift) {
  std::vector<float> u;
  for (int n = 0; n < of.body.surface_nodes; ++n) {
    const Vector3d moved = gradient * of.node(n) + shift;
    for (int d = 0; d < 3; ++d) u.push_back(static_cast<float>(moved[d]));
  }
  return u;
}

Matrix3d turn(double angle, Vector3d axis) {
  return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
}

// Floats of 6 cm have steps of 4e-9 m; a gradient over edges of 1.3 cm then errs by 1e-6, and here acts on 4 mm.
constexpr double kRounding = 3e-8;  // m

TEST(Skin, IsTheHostsMeshToTheBitWhereTheShapeRests) {
  const Mesh mesh = mesh_over(box(), 0.004);
  const ScenePointer scene = scene_of(box(), mesh);
  const Skinned found = skinned(scene.get(), mesh, moved_by(box(), Matrix3d::Zero(), Vector3d::Zero()));
  EXPECT_EQ(found.flags, 0u);
  EXPECT_EQ(found.positions, mesh.positions);
}

TEST(Skin, MovesAndTurnsAsTheWholeDoesHoweverFarTheVertexStandsOff) {
  const Mesh mesh = mesh_over(box(), 0.004);
  const ScenePointer scene = scene_of(box(), mesh);
  const Vector3d shift(0.01, -0.02, 0.005);
  for (const Matrix3d& rotation : {Matrix3d(Matrix3d::Identity()), turn(0.3, {1, 2, -1}), turn(2.5, {0, 1, 3})}) {
    const Skinned found = skinned(scene.get(), mesh, moved_by(box(), rotation - Matrix3d::Identity(), shift));
    EXPECT_EQ(found.flags, 0u);
    for (std::size_t v = 0; v < mesh.places.size(); ++v) {
      EXPECT_LT((found.position(v) - (rotation * mesh.places[v] + shift)).norm(), kRounding);
      const Vector3d normal = Eigen::Map<const Eigen::Vector3f>(&mesh.normals[3 * v]).cast<double>();
      EXPECT_LT((found.normal(v) - rotation * normal).norm(), 1e-5);
    }
  }
}

TEST(Skin, ReproducesAnyAffineMotionOnTheSurfaceAndBesideItByNoMoreThanItStandsOff) {
  Matrix3d gradient;
  gradient << 0.2, -0.3, 0.1, 0.15, -0.1, 0.25, -0.2, 0.1, 0.3;
  const Vector3d shift(0.001, 0.002, -0.003);
  for (const double height : {0.0, 0.004}) {
    const Mesh mesh = mesh_over(box(), height);
    const ScenePointer scene = scene_of(box(), mesh);
    const Skinned found = skinned(scene.get(), mesh, moved_by(box(), gradient, shift));
    double worst = 0;
    for (std::size_t v = 0; v < mesh.places.size(); ++v)
      worst = std::max(worst, (found.position(v) - (mesh.places[v] + gradient * mesh.places[v] + shift)).norm());
    // Across the surface nothing is known: there the offset follows the unit normal, which turns by g / (1 - g) at most, and
    // not the motion, which would move it by g.
    const double g = gradient.operatorNorm();
    EXPECT_LT(worst, kRounding + height * (g + g / (1 - g)));
    EXPECT_TRUE(height == 0 || worst > 100 * kRounding) << "and the bound above says something";
  }
}

TEST(Skin, TurnsNormalsAsThePlanesTheyStandOn) {
  const Mesh mesh = mesh_over(box(), 0);
  const ScenePointer scene = scene_of(box(), mesh);
  Matrix3d gradient = Matrix3d::Zero();
  gradient(2, 0) = 0.5;  // a shear: the plane z = const turns, x = const does not
  const Skinned found = skinned(scene.get(), mesh, moved_by(box(), gradient, Vector3d::Zero()));
  int middle = 0;
  for (std::size_t v = 0; v < mesh.places.size(); ++v) {
    EXPECT_NEAR(found.normal(v).norm(), 1, 1e-6);  // floats
    // Away from the box's edges, where a bone averages two faces.
    const bool on_top = mesh.places[v][2] > 0.0399;
    const bool inner = mesh.places[v][0] > 0.021 && mesh.places[v][0] < 0.039 && mesh.places[v][1] > 0.017 &&
                       mesh.places[v][1] < 0.033;
    if (!on_top || !inner) continue;
    ++middle;
    EXPECT_LT((found.normal(v) - Vector3d(-0.5, 0, 1).normalized()).norm(), 1e-5);
  }
  EXPECT_GT(middle, 5);
}

// What tools really do: a vertex that is a node is where palpate_scene_shape puts the node, one inside a triangle where its
// weights say.
TEST(Skin, PutsAVertexOnANodeWhereTheShapeHasItAndOthersByTheirWeights) {
  Mesh mesh;
  for (int n = 0; n < box().body.surface_nodes; ++n) mesh.add(box().node(n), {0, 0, 1});
  const Vector3d weights(0.2, 0.3, 0.5);
  for (std::size_t t = 0; t < box().body.triangles.size(); ++t)
    mesh.add(box().place(static_cast<std::int32_t>(t), weights), {0, 0, 1});
  const ScenePointer scene = scene_of(box(), mesh);
  Contacts contacts(scene.get());
  play(box(), scene.get(), contacts, 60, [](palpate_step_flags) {});
  const std::vector<float> u = displacements(scene.get(), contacts.get(), box().body.surface_nodes);
  const auto moved = [&](std::int32_t n) { return Eigen::Map<const Eigen::Vector3f>(&u[3 * n]).cast<double>(); };
  const Skinned found = skinned(scene.get(), mesh, u);
  double largest = 0;
  const auto expect = [&](std::size_t v, Vector3d by) {
    EXPECT_LT((found.position(v) - (mesh.places[v] + by)).norm(), kRounding);
    largest = std::max(largest, by.norm());
  };
  for (int n = 0; n < box().body.surface_nodes; ++n) expect(static_cast<std::size_t>(n), moved(n));
  for (std::size_t t = 0; t < box().body.triangles.size(); ++t) {
    Vector3d by = Vector3d::Zero();
    for (int v = 0; v < 3; ++v) by += weights[v] * moved(box().body.triangles[t][v]);
    expect(box().body.surface_nodes + t, by);
  }
  EXPECT_GT(largest, 5e-4) << "the tools press";
}

TEST(Skin, ScalesWithTheOrgan) {
  const TinyBox form, thousandfold = {.size = {60, 50, 40}};
  const TouchedBox small(form), large(thousandfold);
  const Mesh fine = mesh_over(small, 0.004), coarse = mesh_over(large, 4);
  const ScenePointer first = scene_of(small, fine), second = scene_of(large, coarse);
  std::vector<float> u, v;
  for (int i = 0; i < 3 * small.body.surface_nodes; ++i)
    u.push_back(0.002f * std::sin(1.7f * static_cast<float>(i))), v.push_back(1000 * u.back());
  const Skinned a = skinned(first.get(), fine, u), b = skinned(second.get(), coarse, v);
  for (std::size_t i = 0; i < a.positions.size(); ++i)
    EXPECT_NEAR(b.positions[i], 1000 * a.positions[i], 1000 * kRounding);
}

// The render mesh has the shape without preload; the preload must move it once, as it moves the nodes.
TEST(Skin, IsMovedByAPreloadAsTheNodesAre) {
  Mesh mesh;
  for (int n = 0; n < box().body.surface_nodes; ++n) mesh.add(box().node(n), {0, 0, 1});
  const ScenePointer scene = scene_of(box(), mesh, with(SceneDef(), PALPATE_PRELOAD_ON));
  const Skinned found = skinned(scene.get(), mesh, moved_by(box(), Matrix3d::Zero(), Vector3d::Zero()));
  for (std::size_t v = 0; v < mesh.places.size(); ++v)
    EXPECT_LT((found.position(v) - (mesh.places[v] - Vector3d(0, 0, 0.001 * mesh.places[v][0]))).norm(), kRounding);
}

TEST(Skin, FindsTheNearestPlaceOfTheSurfaceFromNearAndFar) {
  SceneMemory memory({});
  std::vector<double> nodes;
  std::vector<std::int32_t> triangles;
  for (int n = 0; n < box().body.surface_nodes; ++n)
    for (int d = 0; d < 3; ++d) nodes.push_back(box().node(n)[d]);
  for (const auto& t : box().body.triangles) triangles.insert(triangles.end(), t.begin(), t.end());
  const auto count = static_cast<std::int32_t>(triangles.size() / 3);
  SurfaceIndex surface;
  ASSERT_TRUE(surface.build(memory, nodes.data(), triangles.data(), count));
  std::mt19937 random(3);
  for (const double reach : {0.05, 0.3, 3.0}) {
    std::uniform_real_distribution<double> about(-reach, reach);
    for (int i = 0; i < 300; ++i) {
      const Vec3 p = {0.03 + about(random), 0.025 + about(random), 0.02 + about(random)};
      double nearest = INFINITY, k[3];
      for (std::int32_t t = 0; t < count; ++t)
        nearest = std::min(nearest,
                           closest_on_triangle(p, surface.corner(t, 0), surface.corner(t, 1), surface.corner(t, 2), k));
      const Vec3 gap = p - surface.position(surface.nearest(p));
      EXPECT_NEAR(dot(gap, gap), nearest, 1e-12 * nearest);
    }
  }
  memory.release_all();
}

TEST(Skin, RefusesAMeshThatIsNoneWithASentence) {
  const float good[3] = {0.03f, 0.02f, 0.04f}, nan[3] = {0.03f, NAN, 0.04f}, infinite[3] = {0, 0, INFINITY},
              millimetres[3] = {30, 20, 40}, just_beyond[3] = {0.2f, 0.02f, 0.04f};
  alignas(4) unsigned char odd[16] = {};
  const auto* misaligned = reinterpret_cast<const float*>(odd + 1);
  const auto refused = [&](palpate_render_mesh mesh, const char* word,
                           palpate_shape_model shape = PALPATE_SHAPE_SURFACE) {
    const palpate_error error = refusal_of(box(), with(SceneDef(), mesh, shape));
    EXPECT_EQ(error.status, PALPATE_ERROR_ARGUMENT) << word;
    EXPECT_THAT(error.text, testing::HasSubstr(word));
  };
  refused(render_mesh(nullptr, nullptr, 1), "NULL");
  refused(render_mesh(misaligned, nullptr, 1), "aligned");
  refused(render_mesh(good, misaligned, 1), "aligned");
  refused(render_mesh(good, nullptr, 0), "vertex_count");
  refused(render_mesh(good, nullptr, -5), "vertex_count");
  refused(render_mesh(nan, nullptr, 1), "vertex 0");
  refused(render_mesh(infinite, nullptr, 1), "vertex 0");
  refused(render_mesh(millimetres, nullptr, 1), "metres");
  refused(render_mesh(just_beyond, nullptr, 1), "metres");
  refused(render_mesh(good, nan, 1), "normal 0");
  refused(render_mesh(good, nullptr, 1), "shape is OFF", PALPATE_SHAPE_OFF);
}

TEST(Skin, SaysWhenAStepHasWhatItCannotUseAndFillsNothing) {
  const Mesh mesh = mesh_over(box(), 0.001);
  const ScenePointer scene = scene_of(box(), mesh), without = box().scene(SceneDef());
  Mesh bare = mesh;
  palpate_render_mesh no_normals = bare.view();
  no_normals.normals = nullptr;
  const ScenePointer plain = box().scene(with(SceneDef(), no_normals));

  const std::int32_t nodes = box().body.surface_nodes;
  std::vector<float> u(3 * nodes), x(mesh.positions.size() + 3, 7), n(x);
  palpate_shape_out shape = shape_out(u.data(), nullptr, nodes);
  shape.node_count = nodes;
  const auto bad = [&](palpate_scene* s, const palpate_shape_out* from, palpate_skin_out out) {
    out.vertex_count = 9;
    EXPECT_EQ(palpate_scene_skin(s, from, &out), PALPATE_STEP_BAD_INPUT);
    EXPECT_EQ(out.vertex_count, 0);
    EXPECT_EQ(x, std::vector<float>(x.size(), 7));
  };
  bad(nullptr, &shape, skin_out(x.data(), nullptr, 5));
  bad(scene.get(), nullptr, skin_out(x.data(), nullptr, 5));
  bad(without.get(), &shape, skin_out(x.data(), nullptr, 5));
  bad(scene.get(), &shape, skin_out(x.data(), nullptr, -1));
  bad(plain.get(), &shape, skin_out(x.data(), n.data(), 5));
  palpate_shape_out none = shape, few = shape;
  none.displacements = nullptr, few.node_count = nodes - 1;
  bad(scene.get(), &none, skin_out(x.data(), nullptr, 5));
  bad(scene.get(), &few, skin_out(x.data(), nullptr, 5));
  EXPECT_EQ(palpate_scene_skin(scene.get(), &shape, nullptr), PALPATE_STEP_BAD_INPUT);

  // Room for fewer or more vertices than there are: nothing is written beyond the array.
  palpate_skin_out out = skin_out(x.data(), nullptr, 2);
  EXPECT_EQ(palpate_scene_skin(plain.get(), &shape, &out), 0u);
  EXPECT_EQ(out.vertex_count, 2);
  EXPECT_EQ(x[6], 7);
  out.vertex_capacity = 1 << 30;
  EXPECT_EQ(palpate_scene_skin(plain.get(), &shape, &out), 0u);
  EXPECT_EQ(out.vertex_count, static_cast<std::int32_t>(mesh.places.size()));
  EXPECT_EQ(x[mesh.positions.size()], 7);
}

TEST(Skin, StaysFiniteUnderDisplacementsThatAreNot) {
  const Mesh mesh = mesh_over(box(), 0.004);
  const ScenePointer scene = scene_of(box(), mesh);
  for (const float evil : {NAN, INFINITY, -INFINITY, 3e38f, 1e6f, -1e5f, 1e-42f})
    for (const bool everywhere : {false, true}) {
      std::vector<float> u(3 * box().body.surface_nodes, 0.001f);
      for (std::size_t i = 0; i < u.size(); i += everywhere ? 2 : 40) u[i] = evil;
      const Skinned found = skinned(scene.get(), mesh, u);
      for (const float x : found.positions) ASSERT_TRUE(std::isfinite(x)) << evil;
      for (const float x : found.normals) ASSERT_LE(std::fabs(x), 1.001f) << evil;
      EXPECT_EQ((found.flags & PALPATE_STEP_BAD_INPUT) == 0, std::fabs(evil) <= 1e6f) << evil;
      if (std::fabs(evil) <= 1e6f) continue;
      for (std::size_t n = 0; n < u.size(); n += 3)  // such a node counts as one that rests
        if (!std::all_of(&u[n], &u[n] + 3, [](float x) { return std::fabs(x) <= 1e6f; })) std::fill_n(&u[n], 3, 0.0f);
      EXPECT_EQ(found.positions, skinned(scene.get(), mesh, u).positions) << evil;
    }
}

// Two faces as long as the organ and next to nothing wide, whose nodes are drawn apart: a gradient of 1e33 over 400 km.
TEST(Skin, LeavesAVertexWhereItWasBoundWhereItsMotionIsNoNumber) {
  SceneMemory memory({}), scratch({});
  const double nodes[9] = {0, 0, 0, 1e-27, 0, 0, 0, 5e5, 0};
  const std::int32_t triangles[6] = {0, 1, 2, 0, 2, 1};
  const float place[3] = {4e5f, 2e5f, 0}, apart[9] = {0, 0, 0, 1e6f, 0, 0, 0, 0, 0};
  Skin skin;
  palpate_error error = {};
  ASSERT_EQ(skin.bind(memory, scratch, render_mesh(place, nullptr, 1), nodes, 3, nullptr, triangles, 2, false, &error),
            PALPATE_OK)
      << error.text;
  float moved[3];
  palpate_skin_out out = skin_out(moved, nullptr, 1);
  EXPECT_EQ(skin.move(apart, &out), palpate_step_flags{PALPATE_STEP_UNSOLVED});
  EXPECT_EQ(std::memcmp(moved, place, sizeof place), 0);
  scratch.release_all(), memory.release_all();
}

// Nodes that have fallen together make triangles without area and without a normal, some nodes have no others.
TEST(Skin, FollowsASurfaceWhoseTrianglesHaveNoArea) {
  const TouchedBox flat({}, [](BundleParts& parts) {
    auto nodes = parts.get<double>(formats::SectionId::nodes);
    for (std::size_t n = 0; n < nodes.size() / 3; ++n)
      if (nodes[3 * n] > 0.03) nodes[3 * n] = 0.06, nodes[3 * n + 1] = nodes[3 * n + 2] = 0.02;
    parts.set(formats::SectionId::nodes, {nodes.size() / 3, 3}, nodes);
  });
  const Mesh mesh = mesh_over(box(), 0.002);
  const ScenePointer scene = scene_of(flat, mesh);
  std::vector<float> u(3 * flat.body.surface_nodes);
  for (std::size_t i = 0; i < u.size(); ++i) u[i] = 0.003f * std::sin(static_cast<float>(i));
  const Skinned found = skinned(scene.get(), mesh, u);
  EXPECT_EQ(found.flags, 0u);
  for (const float x : found.positions) ASSERT_LT(std::fabs(x), 1);
  const Skinned rest = skinned(scene.get(), mesh, std::vector<float>(u.size(), 0));
  EXPECT_EQ(rest.positions, mesh.positions);
}

}  // namespace
}  // namespace palpate::tests
