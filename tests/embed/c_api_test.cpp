// c_api_test BUNDLE.h5 MOTIONS.h5 CUT.h5: every function of the C API, on the bundles of tests/embed/write_tiny_bundle. Built and run here and,
// against the installed library, on other platforms. It includes the public headers alone.
#include <gtest/gtest.h>
#include <palpate/palpate_scene_def.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

namespace {

std::string bundle_path, motions_path, cut_path;

constexpr double kTick = 1e-3;
// Above the face z = 40 mm, far from the fixed nodes at x = 0.
constexpr double kAbove[3] = {0.046, 0.024, 0.045};

struct BundleOwner {
  palpate_bundle* bundle = nullptr;
  explicit BundleOwner(const std::string& path) {
    palpate_error error = {};
    EXPECT_EQ(palpate_bundle_open_file(path.c_str(), nullptr, &bundle, &error), PALPATE_OK) << error.text;
  }
  ~BundleOwner() { palpate_bundle_close(bundle); }
  BundleOwner(const BundleOwner&) = delete;
  BundleOwner& operator=(const BundleOwner&) = delete;
};

// A scene with what a test needs to look at it, and memory for its contacts.
struct SceneOwner {
  palpate_scene* scene = nullptr;
  std::vector<std::uint64_t> memory;
  SceneOwner(palpate_bundle* bundle, const palpate::SceneDef& def) {
    palpate_error error = {};
    EXPECT_EQ(palpate_scene_create(bundle, &def, &scene, &error), PALPATE_OK) << error.text;
    if (scene) memory.resize(palpate_contacts_bytes(scene) / 8 + 1);
  }
  ~SceneOwner() { palpate_scene_destroy(scene); }
  SceneOwner(const SceneOwner&) = delete;
  SceneOwner& operator=(const SceneOwner&) = delete;

  palpate_contacts* contacts() { return reinterpret_cast<palpate_contacts*>(memory.data()); }
  palpate_step_flags touch(const palpate_tool* tools, std::int32_t count) {
    return palpate_scene_touch(scene, tools, count, kTick, contacts(), 8 * memory.size());
  }
  // From above the face to `depth` m below it, 0.5 mm in a step.
  palpate_step_flags press(palpate_tool tool, double depth) {
    double point[3] = {kAbove[0], kAbove[1], kAbove[2]};
    tool.points = point, tool.point_count = 1;
    palpate_step_flags flags = 0;
    for (; point[2] > 0.04 - depth; point[2] -= 5e-4) flags |= touch(&tool, 1);
    return flags;
  }
};

palpate::SceneDef full_def() {
  palpate::SceneDef def;
  def.collision = PALPATE_COLLISION_DEFORMED, def.report.report = PALPATE_REPORT_CONTACTS,
  def.queries.queries = PALPATE_QUERIES_ON;
  return def;
}
palpate_tool disc() {
  palpate_tool tool = palpate_default_tool();
  tool.id = 7, tool.disc_radius = 0.006, tool.has_torque = 1;
  return tool;
}
double length(const double v[3]) {
  return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

TEST(CApi, NamesItsVersion) {
  std::int32_t numbers[4] = {};
  EXPECT_STREQ(palpate_version(numbers), "0.1.0");
  EXPECT_EQ(numbers[0], PALPATE_API_VERSION);
  EXPECT_EQ(numbers[1], PALPATE_VERSION_MAJOR);
  EXPECT_STREQ(palpate_version(nullptr), "0.1.0");
}

TEST(CApi, OpensABundleAndRefusesWhatIsNone) {
  palpate_error error = {};
  palpate_bundle* bundle = nullptr;
  EXPECT_EQ(palpate_bundle_open_file("no such file.h5", nullptr, &bundle, &error), PALPATE_ERROR_FILE);
  EXPECT_NE(std::strstr(error.text, "no such file.h5"), nullptr) << error.text;
  EXPECT_EQ(palpate_bundle_open_file(bundle_path.c_str(), nullptr, nullptr, &error), PALPATE_ERROR_ARGUMENT);

  std::vector<std::uint64_t> read(1 << 20);
  std::FILE* file = std::fopen(bundle_path.c_str(), "rb");
  ASSERT_NE(file, nullptr);
  auto* const bytes = reinterpret_cast<char*>((reinterpret_cast<std::uintptr_t>(read.data()) + 63) / 64 * 64);
  const std::size_t count = std::fread(bytes, 1, 8 * read.size() - 64, file);
  std::fclose(file);
  ASSERT_GT(count, 1000u);
  EXPECT_EQ(palpate_bundle_open(bytes, count / 2, nullptr, &bundle, &error), PALPATE_ERROR_TRUNCATED) << error.text;
  EXPECT_EQ(palpate_bundle_open(bytes + 1, count - 1, nullptr, &bundle, &error), PALPATE_ERROR_ARGUMENT) << error.text;
  ASSERT_EQ(palpate_bundle_open(bytes, count, nullptr, &bundle, &error), PALPATE_OK) << error.text;
  EXPECT_EQ(palpate_bundle_check(bundle, &error), PALPATE_OK) << error.text;
  EXPECT_EQ(palpate_bundle_prefault(bundle, 0, &error), PALPATE_OK) << error.text;
  palpate_bundle_close(bundle);
  palpate_bundle_close(nullptr);
  const std::string text = "not a bundle";
  std::memcpy(bytes, text.c_str(), text.size());
  EXPECT_EQ(palpate_bundle_open(bytes, count, nullptr, &bundle, &error), PALPATE_ERROR_MAGIC) << error.text;
  EXPECT_EQ(bundle, nullptr);
}

// What the allocator and the log of a host are told.
struct Host {
  std::vector<void*> given;
  std::int32_t returned = 0, lines = 0;
  static void* allocate(void* user, std::size_t bytes, std::size_t alignment) {
    auto& host = *static_cast<Host*>(user);
    void* const memory = std::malloc(bytes + alignment);
    host.given.push_back(memory);
    const auto at = (reinterpret_cast<std::uintptr_t>(memory) + alignment - 1) / alignment * alignment;
    return reinterpret_cast<void*>(at);
  }
  static void release(void* user, void* memory) { static_cast<Host*>(user)->returned += memory != nullptr; }
  static void log(void* user, palpate_log_level, const char* text) {
    static_cast<Host*>(user)->lines += std::strlen(text) > 0;
  }
  ~Host() {
    for (void* memory : given) std::free(memory);
  }
};

TEST(CApi, CopiesAFileIntoTheHostsMemoryAndLogs) {
  Host host;
  palpate_bundle_options options = palpate_default_bundle_options();
  options.file_access = PALPATE_FILE_COPY;
  options.allocator = {Host::allocate, Host::release, &host};
  options.log = Host::log, options.log_user = &host;
  palpate_bundle* bundle = nullptr;
  palpate_error error = {};
  ASSERT_EQ(palpate_bundle_open_file(bundle_path.c_str(), &options, &bundle, &error), PALPATE_OK) << error.text;
  palpate::SceneDef def;
  def.allocator = options.allocator;
  { SceneOwner scene(bundle, def); }
  palpate_bundle_close(bundle);
  EXPECT_GT(host.lines, 0);
  EXPECT_GT(host.returned, 1);
  EXPECT_EQ(static_cast<std::size_t>(host.returned), host.given.size());
}

TEST(CApi, ShowsWhatABundleHolds) {
  BundleOwner owner(bundle_path);
  const palpate_bundle_info info = palpate_bundle_describe(owner.bundle);
  EXPECT_EQ(info.node_count, 64);
  EXPECT_EQ(info.surface_node_count, 56);
  EXPECT_EQ(info.triangle_count, 108);
  EXPECT_NE(info.identity, 0u);
  const double* nodes = palpate_bundle_nodes(owner.bundle);
  double high = 0;
  for (std::int32_t n = 0; n < info.node_count; ++n) high = std::max(high, nodes[3 * n + 2]);
  EXPECT_DOUBLE_EQ(high, 0.04);
  for (std::int32_t t = 0; t < 3 * info.triangle_count; ++t)
    EXPECT_LT(palpate_bundle_triangles(owner.bundle)[t], info.surface_node_count);
  for (std::int32_t t = 0; t < 4 * info.tetrahedron_count; ++t)
    EXPECT_LT(palpate_bundle_tetrahedra(owner.bundle)[t], info.node_count);
  for (std::int32_t s = 0; s < info.touchable_count; ++s)
    EXPECT_EQ(palpate_bundle_fixed(owner.bundle)[3 * palpate_bundle_touchable(owner.bundle)[s]], 0);
  std::size_t bytes = 0;
  const char* text = palpate_bundle_provenance(owner.bundle, &bytes);
  EXPECT_EQ(std::string(text, bytes).front(), '{');
  palpate_motion_info motion = {};
  EXPECT_EQ(palpate_bundle_motion(owner.bundle, 0, &motion, sizeof motion, nullptr), PALPATE_ERROR_ARGUMENT);
  BundleOwner moved(motions_path);
  EXPECT_EQ(palpate_bundle_describe(moved.bundle).motion_count, 4);
  EXPECT_EQ(palpate_bundle_motion(moved.bundle, 2, &motion, sizeof motion, nullptr), PALPATE_OK);
  EXPECT_STREQ(motion.name, "filling");
  EXPECT_EQ(motion.kind, PALPATE_MOTION_PRESSURE);
}

TEST(CApi, SetsAndReadsTheFieldsOfAScene) {
  palpate::SceneDef def;
  int numbers = 0;
  for (int32_t k = 0; const palpate_key* key = palpate_scene_key(k); ++k) {
    if (key->type == PALPATE_KEY_POINTER) {
      EXPECT_EQ(palpate_set_key(key, &def, 1), 0) << key->name;
      continue;
    }
    const double other = key->most < 100 ? key->most : 2 * palpate_key_number(key, &def) + 1;
    ASSERT_EQ(palpate_set_key(key, &def, other), 1) << key->name;
    EXPECT_EQ(palpate_key_number(key, &def), other) << key->name;
    ++numbers;
  }
  EXPECT_GT(numbers, 20);
  EXPECT_EQ(def.law, PALPATE_LAW_COULOMB);
  EXPECT_EQ(def.force_limit, 101);
  // Of an earlier host's struct, which ends before its newest field.
  def.needles.part.struct_bytes = offsetof(palpate_needles_def, needle_places);
  const auto newest = [] {
    for (int32_t k = 0; const palpate_key* key = palpate_scene_key(k); ++k)
      if (std::strcmp(key->name, "needle_places") == 0) return key;
    return static_cast<const palpate_key*>(nullptr);
  }();
  ASSERT_NE(newest, nullptr);
  EXPECT_EQ(palpate_set_key(newest, &def, 8), 0);
  EXPECT_EQ(palpate_key_number(newest, &def), 0);
}

TEST(CApi, PlansAndPredictsAScene) {
  BundleOwner owner(bundle_path);
  SceneOwner made(owner.bundle, full_def());
  std::int32_t passes = 0;
  while (palpate_scene_plan(made.scene, passes)) ++passes;
  EXPECT_GT(passes, 3);
  EXPECT_GE(palpate_scene_most_operations(made.scene), palpate::SceneDef().max_operations);
  palpate_step_load load = palpate_default_step_load();
  load.tools = load.points = load.contacts = 1, load.rows = 3, load.nodes = 12;
  double steps = 0;
  for (std::int32_t pass = 0; pass < passes; ++pass) steps += palpate_predict_pass(made.scene, pass, &load).steps;
  EXPECT_GT(steps, 0);
  EXPECT_EQ(palpate_predict_pass(made.scene, passes, nullptr).steps, 0);
  EXPECT_GT(palpate_operations_in(300), 0);
  EXPECT_EQ(palpate_operations_in(-1), 0);
  std::int32_t watched = 0;
  palpate_watch_passes(
      made.scene, [](void* user, std::int32_t) { ++*static_cast<std::int32_t*>(user); }, &watched);
  const palpate_tool tool = disc();
  made.touch(&tool, 1);
  EXPECT_GT(watched, 2);
  palpate_watch_passes(made.scene, nullptr, nullptr);

  palpate::SceneDef bad;
  bad.max_tools = 0;
  palpate_scene* none = made.scene;
  palpate_error error = {};
  EXPECT_EQ(palpate_scene_create(owner.bundle, &bad, &none, &error), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(none, nullptr);
  EXPECT_NE(std::strstr(error.text, "max_tools"), nullptr) << error.text;
  palpate_scene_destroy(nullptr);
}

TEST(CApi, PressesReportsAndDraws) {
  BundleOwner owner(bundle_path);
  palpate::SceneDef def = full_def();
  const float square[12] = {0.04f, 0.02f, 0.04f, 0.05f, 0.02f, 0.04f, 0.05f, 0.03f, 0.04f, 0.04f, 0.03f, 0.04f};
  palpate_render_mesh render = palpate_default_render_mesh();
  render.vertex_count = 4, render.positions = square, render.normals = square;
  def.render_mesh = render;
  SceneOwner made(owner.bundle, def);
  EXPECT_EQ(made.press(disc(), 0.004), 0u);
  const palpate_tool_state* tool = palpate_contacts_tool(made.contacts(), 0);
  EXPECT_EQ(tool->id, 7);
  EXPECT_EQ(tool->contact_count, 1);
  EXPECT_GT(tool->force[2], 0.01);
  EXPECT_GT(length(tool->torque), 0);
  double sum = 0;
  for (std::int32_t n = 0; n < made.contacts()->node_count; ++n)
    sum += palpate_contacts_node(made.contacts(), n)->force[2];
  EXPECT_NEAR(sum, -tool->force_raw[2], 1e-9 * std::abs(sum));

  const palpate_contact_report* report = palpate_scene_report(made.scene);
  ASSERT_EQ(report->contact_count, 1);
  EXPECT_EQ(palpate_report_contact(report, 0)->tool_id, 7);
  EXPECT_NEAR(palpate_report_contact(report, 0)->depth, 0.004, 6e-4);

  const palpate_bundle_info info = palpate_bundle_describe(owner.bundle);
  std::vector<float> moved(3 * static_cast<std::size_t>(info.node_count)), at(moved), normals(moved);
  palpate_shape_out shape = palpate_default_shape_out();
  shape.node_capacity = info.node_count, shape.displacements = moved.data(), shape.positions = at.data();
  EXPECT_EQ(palpate_scene_shape(made.scene, made.contacts(), &shape), 0u);
  EXPECT_EQ(shape.node_count, info.surface_node_count);
  float deepest = 0;
  for (std::int32_t n = 0; n < shape.node_count; ++n)
    deepest = std::min(deepest, moved[3 * static_cast<std::size_t>(n) + 2]);
  EXPECT_LT(deepest, -0.001f);
  EXPECT_EQ(palpate_scene_normals(made.scene, &shape, normals.data(), info.node_count), 0u);
  EXPECT_NEAR(std::hypot(normals[0], normals[1], normals[2]), 1, 1e-5);
  float skin_at[12], skin_normals[12];
  palpate_skin_out skin = palpate_default_skin_out();
  skin.vertex_capacity = 4, skin.positions = skin_at, skin.normals = skin_normals;
  EXPECT_EQ(palpate_scene_skin(made.scene, &shape, &skin), 0u);
  EXPECT_EQ(skin.vertex_count, 4);
  EXPECT_LT(skin_at[2], 0.0399f);

  // A step that has nowhere to write does nothing.
  EXPECT_EQ(palpate_scene_touch(made.scene, nullptr, 0, kTick, made.contacts(), 8), PALPATE_STEP_BAD_INPUT);
  palpate_tool bad = disc();
  const double nowhere[3] = {NAN, 0, 0};
  bad.points = nowhere, bad.point_count = 1;
  EXPECT_TRUE(made.touch(&bad, 1) & PALPATE_STEP_BAD_INPUT);
  EXPECT_GT(palpate_contacts_tool(made.contacts(), 0)->force[2], 0.01);  // its last good input
  palpate_scene_reset_tool(made.scene, 7);
  palpate_scene_reset(made.scene);
  EXPECT_EQ(made.touch(nullptr, 0), 0u);
  EXPECT_EQ(made.contacts()->step, 1u);
  EXPECT_EQ(palpate_scene_deform(made.scene), -1);
}

TEST(CApi, TellsStrainAndStressInsideAndCarriesAPoint) {
  BundleOwner owner(bundle_path);
  palpate::SceneDef def = full_def();
  def.shape = PALPATE_SHAPE_VOLUME, def.inside.inside = PALPATE_INSIDE_ON, def.radial = PALPATE_RADIAL_OFF;
  SceneOwner made(owner.bundle, def);
  EXPECT_EQ(made.press(disc(), 0.004), 0u);
  const palpate_bundle_info info = palpate_bundle_describe(owner.bundle);
  std::vector<float> moved(3 * static_cast<std::size_t>(info.node_count)), at(moved), stress(2 * moved.size());
  palpate_shape_out shape = palpate_default_shape_out();
  shape.node_capacity = info.node_count, shape.displacements = moved.data(), shape.positions = at.data();
  EXPECT_EQ(palpate_scene_shape(made.scene, made.contacts(), &shape), 0u);
  palpate_inside_out field = palpate_default_inside_out();
  field.capacity = info.node_count, field.stresses = stress.data();
  EXPECT_EQ(palpate_scene_inside(made.scene, &shape, &field), 0u);
  EXPECT_EQ(field.count, info.node_count);
  // Below the disc the tissue is under compression along z.
  const double below[6] = {kAbove[0], kAbove[1], 0.035, 9, 9, 9};
  palpate_inside_place places[2];
  EXPECT_EQ(palpate_scene_locate(made.scene, below, 2, 0.001, places), 1);
  EXPECT_EQ(places[1].tetrahedron, -1);
  float at_place[6], pressure = 0, point[3];
  palpate_inside_out there = palpate_default_inside_out();
  there.capacity = 1, there.stresses = at_place, there.pressures = &pressure;
  EXPECT_EQ(palpate_scene_inside_at(made.scene, places, 1, &there), 0u);
  EXPECT_LT(at_place[2], -1);
  EXPECT_GT(pressure, 1);
  EXPECT_EQ(palpate_scene_carry(made.scene, &shape, places, 1, point), 0u);
  EXPECT_LT(point[2], 0.0349f);
}

TEST(CApi, AnswersQueries) {
  BundleOwner owner(bundle_path);
  SceneOwner made(owner.bundle, full_def());
  made.press(disc(), 0.004);
  const double down[3] = {0, 0, -1}, inside[3] = {0.03, 0.025, 0.02}, nan[3] = {NAN, 0, 0};
  palpate_surface_hit hit = palpate_default_surface_hit();
  EXPECT_EQ(palpate_scene_cast_ray(made.scene, nullptr, kAbove, down, 1, &hit), 0u);
  EXPECT_EQ(hit.hit, 1);
  EXPECT_NEAR(hit.distance, 0.005, 1e-12);
  EXPECT_NEAR(hit.normal[2], 1, 1e-12);
  EXPECT_EQ(palpate_scene_cast_ray(made.scene, made.contacts(), kAbove, down, 1, &hit), 0u);
  EXPECT_GT(hit.distance, 0.006);
  EXPECT_EQ(palpate_scene_closest_point(made.scene, nullptr, kAbove, 1, &hit), 0u);
  EXPECT_NEAR(hit.distance, 0.005, 1e-12);
  double distance = 0;
  EXPECT_EQ(palpate_scene_signed_distance(made.scene, nullptr, inside, &distance), 0u);
  EXPECT_NEAR(distance, -0.02, 1e-12);
  EXPECT_EQ(palpate_scene_signed_distance(made.scene, nullptr, nan, &distance), PALPATE_STEP_BAD_INPUT);
}

TEST(CApi, MeetsAFinerSurface) {
  BundleOwner owner(bundle_path);
  const palpate_bundle_info info = palpate_bundle_describe(owner.bundle);
  std::vector<float> positions;
  for (std::int32_t n = 0; n < 3 * info.surface_node_count; ++n)
    positions.push_back(static_cast<float>(palpate_bundle_nodes(owner.bundle)[n]));
  palpate_fine_surface fine = palpate_default_fine_surface();
  fine.vertex_count = info.surface_node_count, fine.positions = positions.data();
  fine.triangle_count = info.triangle_count, fine.triangles = palpate_bundle_triangles(owner.bundle);
  palpate::SceneDef def = full_def();
  def.fine_surface = fine;
  SceneOwner made(owner.bundle, def);
  EXPECT_EQ(made.press(disc(), 0.004), 0u);
  EXPECT_GT(palpate_contacts_tool(made.contacts(), 0)->force[2], 0.01);
}

TEST(CApi, FollowsAPose) {
  BundleOwner owner(bundle_path);
  SceneOwner made(owner.bundle, full_def());
  palpate_pose pose = palpate_default_pose();
  const double half = std::sqrt(0.5);
  pose.position[0] = 1, pose.orientation[0] = half, pose.orientation[3] = half;  // a quarter turn about z
  EXPECT_EQ(palpate_scene_set_pose(made.scene, &pose, nullptr), PALPATE_OK);
  double world[3], back[3], matrix[16];
  palpate_point_to_world(pose.position, pose.orientation, kAbove, world);
  EXPECT_NEAR(world[0], 1 - kAbove[1], 1e-15);
  EXPECT_NEAR(world[1], kAbove[0], 1e-15);
  palpate_point_to_organ(pose.position, pose.orientation, world, back);
  for (int d = 0; d < 3; ++d) EXPECT_NEAR(back[d], kAbove[d], 1e-15);
  palpate_vector_to_world(pose.orientation, kAbove, world);
  palpate_vector_to_organ(pose.orientation, world, back);
  for (int d = 0; d < 3; ++d) EXPECT_NEAR(back[d], kAbove[d], 1e-15);
  palpate_pose_matrix(pose.position, pose.orientation, matrix);
  EXPECT_EQ(matrix[12], 1);
  EXPECT_NEAR(matrix[1], 1, 1e-15);
  made.touch(nullptr, 0);
  EXPECT_EQ(made.contacts()->organ_position[0], 1);
  pose.orientation[0] = 2;
  EXPECT_EQ(palpate_scene_set_pose(made.scene, &pose, nullptr), PALPATE_ERROR_ARGUMENT);
}

TEST(CApi, HoldsGripsLinksAndGrasps) {
  BundleOwner owner(bundle_path);
  palpate::SceneDef def = full_def();
  def.links.max_links = 1, def.grasps.grasps = 1;
  SceneOwner made(owner.bundle, def);
  palpate_surface_hit hit = palpate_default_surface_hit();
  const double down[3] = {0, 0, -1};
  palpate_scene_cast_ray(made.scene, nullptr, kAbove, down, 1, &hit);

  palpate_grip grip = palpate_default_grip();
  grip.kind = PALPATE_GRIP_SURFACE_POINT, grip.triangle = hit.triangle, grip.displacement[2] = 0.002;
  std::memcpy(grip.barycentric, hit.barycentric, sizeof grip.barycentric);
  palpate_tool tool = disc();
  tool.grips = &grip, tool.grip_count = 1;
  EXPECT_EQ(made.touch(&tool, 1), 0u);
  EXPECT_LT(palpate_contacts_tool(made.contacts(), 0)->force[2], -0.01);  // tissue pulls back
  grip.kind = PALPATE_GRIP_UNSAID;
  EXPECT_TRUE(made.touch(&tool, 1) & PALPATE_STEP_BAD_INPUT);

  palpate_link link = palpate_default_link();
  link.kind = PALPATE_LINK_THREAD, link.id = 3, link.radius = 0.006;
  link.ends[0].kind = PALPATE_END_SURFACE_POINT, link.ends[0].triangle = hit.triangle;
  std::memcpy(link.ends[0].barycentric, hit.barycentric, sizeof link.ends[0].barycentric);
  link.ends[1].kind = PALPATE_END_WORLD, std::memcpy(link.ends[1].point, kAbove, sizeof kAbove);
  link.rest_length = 0.003;
  EXPECT_EQ(palpate_scene_set_links(made.scene, &link, 2, nullptr), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(palpate_scene_set_links(made.scene, &link, 1, nullptr), PALPATE_OK);
  made.touch(nullptr, 0);
  ASSERT_NE(palpate_scene_link_state(made.scene, 0), nullptr);
  EXPECT_EQ(palpate_scene_link_state(made.scene, 0)->condition, PALPATE_LINK_TAUT);
  EXPECT_GT(palpate_scene_link_state(made.scene, 0)->tension, 0);
  EXPECT_EQ(palpate_scene_link_state(made.scene, 1), nullptr);
  EXPECT_EQ(palpate_scene_set_links(made.scene, nullptr, 0, nullptr), PALPATE_OK);

  palpate_grasp grasp = palpate_default_grasp();
  grasp.triangle = hit.triangle, grasp.radius = 0.006;
  std::memcpy(grasp.barycentric, hit.barycentric, sizeof grasp.barycentric);
  palpate_tool jaws = disc();
  jaws.parts = &grasp.part;
  made.touch(&jaws, 1);
  grasp.position[2] = 0.002;
  made.touch(&jaws, 1);
  ASSERT_NE(palpate_scene_grasp_state(made.scene, 7), nullptr);
  EXPECT_EQ(palpate_scene_grasp_state(made.scene, 7)->condition, PALPATE_GRASP_HOLDS);
  EXPECT_LT(palpate_scene_grasp_state(made.scene, 7)->force[2], -0.01);
}

// The bundle has no corridor.
TEST(CApi, RefusesNeedlesWithoutACorridor) {
  BundleOwner owner(bundle_path);
  palpate::SceneDef def = full_def();
  {
    SceneOwner made(owner.bundle, def);
    palpate_needle needle = palpate_default_needle();
    EXPECT_EQ(needle.part.struct_bytes, sizeof needle);
    needle.triangle = 0, needle.barycentric[0] = 1, needle.radius = 5e-4, needle.direction[2] = -1;
    palpate_tool tool = disc();
    tool.parts = &needle.part;
    made.touch(&tool, 1);
    EXPECT_TRUE(made.contacts()->flags & PALPATE_STEP_BAD_INPUT);
    EXPECT_EQ(palpate_scene_needle_state(made.scene, 7), nullptr);
  }
  def.needles.needles = 1;
  palpate_scene* scene = nullptr;
  palpate_error error = {};
  EXPECT_EQ(palpate_scene_create(owner.bundle, &def, &scene, &error), PALPATE_ERROR_EFFECT);
  EXPECT_NE(std::strstr(error.text, "corridor/nodes"), nullptr) << error.text;
}

TEST(CApi, MovesByMotions) {
  BundleOwner owner(motions_path);
  palpate::SceneDef def = full_def();
  def.motions.motions = 1;
  SceneOwner made(owner.bundle, def);
  const double amounts[4] = {0.001, 0, 0, 0};
  EXPECT_EQ(palpate_scene_set_motions(made.scene, amounts, 3, nullptr), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(palpate_scene_set_motions(made.scene, amounts, 4, nullptr), PALPATE_OK);
  made.touch(nullptr, 0);
  EXPECT_EQ(palpate_scene_motion_state(made.scene, 0)->amount, 0.001);
  EXPECT_EQ(palpate_contacts_amounts(made.contacts())[0], 0.001);
  EXPECT_EQ(palpate_contacts_field(made.contacts()), nullptr);
  EXPECT_EQ(palpate_scene_hold_volume(made.scene, 0, 1, 1e-7, nullptr), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(palpate_scene_hold_volume(made.scene, 2, 1, 1e-7, nullptr), PALPATE_OK);
  for (int step = 0; step < 100; ++step) made.touch(nullptr, 0);
  EXPECT_NEAR(palpate_scene_motion_state(made.scene, 2)->volume, 1e-7, 1e-13);
  EXPECT_EQ(palpate_scene_motion_state(made.scene, 4), nullptr);
}

TEST(CApi, BearsLoads) {
  BundleOwner owner(bundle_path);
  palpate::SceneDef def = full_def();
  def.loads.count = 1;
  def.loads.centre[0][0] = 0.06, def.loads.centre[0][1] = 0.025, def.loads.centre[0][2] = 0.02;
  def.loads.radius[0] = 0.01;
  SceneOwner made(owner.bundle, def);
  const double force[3] = {0, 0, -0.001};
  EXPECT_EQ(palpate_scene_set_load(made.scene, 1, PALPATE_LOAD_FORCE, force, nullptr), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(palpate_scene_set_load(made.scene, 0, PALPATE_LOAD_FORCE, force, nullptr), PALPATE_OK);
  made.touch(nullptr, 0);
  const palpate_load_state& state = *palpate_scene_load_state(made.scene, 0);
  EXPECT_EQ(state.force[2], -0.001);
  EXPECT_LT(state.displacement[2], 0);
  EXPECT_EQ(palpate_contacts_amounts(made.contacts())[2], -0.001);
  EXPECT_EQ(palpate_scene_load_state(made.scene, 1), nullptr);
}

TEST(CApi, PressesTheOrganByAnObstacle) {
  BundleOwner owner(bundle_path);
  palpate::SceneDef def = full_def();
  palpate_obstacle plate = palpate_default_obstacle();
  plate.kind = PALPATE_OBSTACLE_DISC, plate.size[0] = 0.05;
  plate.position[2] = 0.05, plate.orientation[0] = 0, plate.orientation[1] = 1;  // looks down
  def.collision = PALPATE_COLLISION_DEFORMED, def.obstacles.count = 1, def.obstacles.list = &plate;
  SceneOwner made(owner.bundle, def);
  palpate_pose pose = palpate_default_pose();
  pose.orientation[0] = 0, pose.orientation[1] = 1;
  for (int step = 0; step < 30; ++step) {
    pose.position[0] = 0.04, pose.position[1] = 0.02, pose.position[2] = 0.0405 - 5e-5 * step;
    EXPECT_EQ(palpate_scene_set_obstacle_pose(made.scene, 0, &pose, nullptr), PALPATE_OK);
    made.touch(nullptr, 0);
  }
  const palpate_obstacle_state& state = *palpate_scene_obstacle_state(made.scene, 0);
  EXPECT_GT(state.nodes, 0);
  EXPECT_GT(state.force[2], 0);
  EXPECT_EQ(palpate_scene_obstacle_state(made.scene, 1), nullptr);
}

TEST(CApi, TellsThatAFoldedSurfaceCrossesItself) {
  BundleOwner owner(bundle_path);
  palpate::SceneDef def = full_def();
  def.crossings.crossings = PALPATE_CROSSINGS_ON, def.crossings.crossings_calls = 1;
  def.crossings.crossings_operations = 100'000'000;
  SceneOwner made(owner.bundle, def);
  const palpate_bundle_info info = palpate_bundle_describe(owner.bundle);
  std::vector<float> positions(3 * static_cast<std::size_t>(info.surface_node_count));
  const double* const nodes = palpate_bundle_nodes(owner.bundle);
  for (std::size_t i = 0; i < positions.size(); ++i) positions[i] = static_cast<float>(nodes[i]);
  palpate_shape_out shape = palpate_default_shape_out();
  shape.positions = positions.data(), shape.node_capacity = shape.node_count = info.surface_node_count;
  palpate_crossing place = {};
  palpate_crossings_out found = palpate_default_crossings_out();
  found.crossings = &place, found.capacity = 1;
  EXPECT_EQ(palpate_scene_crossings(made.scene, &shape, &found), 0u);
  EXPECT_EQ(found.pairs, 0);
  for (std::size_t i = 0; i < positions.size(); i += 3)  // the far half lies in the near half
    positions[i + 2] += 0.1f * positions[i],
        positions[i] = positions[i] > 0.027f ? 0.054f - positions[i] : positions[i];
  EXPECT_EQ(palpate_scene_crossings(made.scene, &shape, &found), unsigned{PALPATE_STEP_SURFACE_CROSSES});
  EXPECT_GT(found.pairs, 0);
  EXPECT_EQ(found.count, 1);
  EXPECT_LT(place.triangle[0], place.triangle[1]);
}

TEST(CApi, CutsTheOrganAndRemovesTissue) {
  BundleOwner owner(cut_path);
  palpate::SceneDef def;
  def.collision = PALPATE_COLLISION_DEFORMED, def.cut.cut = PALPATE_CUT_ON;
  SceneOwner made(owner.bundle, def);
  const std::int32_t whole = palpate_scene_cut_surface(made.scene, nullptr, nullptr, 0);
  palpate_blade blade = palpate_default_blade();
  palpate_error error = {};
  for (int step = 0; step < 40; ++step) {
    const double edge[6] = {0.0205, -0.002 + 5e-4 * step, -0.005, 0.0205, -0.002 + 5e-4 * step, 0.045};
    blade.points = edge, blade.point_count = 2, blade.direction[1] = 1, blade.toughness = 2;
    blade.friction = 20, blade.width = 0.01;
    ASSERT_EQ(palpate_scene_set_blade(made.scene, 0, &blade, &error), PALPATE_OK) << error.text;
    made.touch(nullptr, 0);
  }
  const palpate_cut_state& state = *palpate_scene_cut_state(made.scene);
  EXPECT_GT(state.faces, 0);
  EXPECT_GT(state.nodes, 0);
  EXPECT_GT(palpate_scene_blade_state(made.scene, 0)->work, 0);
  EXPECT_GT(palpate_scene_blade_state(made.scene, 0)->friction_work, 0);
  const double line[6] = {0, 0, 0, 0, 0, 0.01};
  blade.points = line, blade.width = 0;
  EXPECT_EQ(palpate_scene_set_blade(made.scene, 0, &blade, &error), PALPATE_ERROR_ARGUMENT)
      << "friction without a width";
  std::vector<std::int32_t> triangles(3 * 400);
  std::vector<std::uint8_t> is_lip(400);
  const std::int32_t count = palpate_scene_cut_surface(made.scene, triangles.data(), is_lip.data(), 400);
  EXPECT_EQ(count, whole + 2 * state.faces);
  EXPECT_EQ(std::count(is_lip.begin(), is_lip.end(), 1), 2 * state.faces);
  std::vector<std::int32_t> pairs(2 * 400);
  EXPECT_EQ(palpate_scene_cut_nodes(made.scene, pairs.data(), 400), state.nodes);
  EXPECT_NE(pairs[0], pairs[1]);
  const double corner[3] = {0.06, 0.05, 0.04};
  EXPECT_EQ(palpate_scene_remove_tissue(made.scene, corner, 0.02, 0, 0, &error), PALPATE_OK) << error.text;
  made.touch(nullptr, 0);
  EXPECT_GT(state.removed, 0);
  EXPECT_EQ(palpate_scene_remove_tissue(made.scene, corner, 0, 0, 0, &error), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(palpate_scene_remove_tissue(made.scene, corner, 0.02, -1, 1, &error), PALPATE_ERROR_ARGUMENT);
}

TEST(CApi, PressesWithAGivenForce) {
  BundleOwner owner(bundle_path);
  palpate::SceneDef def = full_def();
  def.force_control.force_control = 1, def.collision = PALPATE_COLLISION_DEFORMED, def.law = PALPATE_LAW_STICKING;
  SceneOwner made(owner.bundle, def);
  palpate_given_force given = palpate_default_given_force();
  given.force[2] = -0.05;
  const double point[3] = {0.041, 0.026, 0.0405};
  palpate_tool tool = palpate_default_tool();
  tool.points = point, tool.point_count = 1;
  palpate_add_part(&tool.parts, &given.part);
  for (int step = 0; step < 60; ++step) made.touch(&tool, 1);
  const palpate_given_force_state& state = *palpate_scene_given_force_state(made.scene, 0);
  EXPECT_EQ(state.condition, PALPATE_GIVEN_FORCE_CARRIED);
  EXPECT_NEAR(state.force[2], -0.05, 1e-6);
  EXPECT_LT(state.displacement[2], -0.0005);
  EXPECT_EQ(palpate_scene_given_force_state(made.scene, 1), nullptr);
}

TEST(CApi, GoesOnFromASavedStateWithTheSameBits) {
  BundleOwner owner(bundle_path);
  SceneOwner one(owner.bundle, full_def()), other(owner.bundle, full_def());
  one.press(disc(), 0.003);
  std::vector<std::uint64_t> state(palpate_scene_state_bytes(one.scene) / 8 + 1);
  palpate_error error = {};
  EXPECT_EQ(palpate_scene_save(one.scene, state.data(), 8, &error), PALPATE_ERROR_ARGUMENT);
  ASSERT_EQ(palpate_scene_save(one.scene, state.data(), 8 * state.size(), &error), PALPATE_OK) << error.text;
  ASSERT_EQ(palpate_scene_restore(other.scene, state.data(), palpate_scene_state_bytes(one.scene), &error), PALPATE_OK)
      << error.text;
  const double deeper[3] = {kAbove[0], kAbove[1], 0.036};
  palpate_tool tool = disc();
  tool.points = deeper, tool.point_count = 1;
  EXPECT_EQ(one.touch(&tool, 1), other.touch(&tool, 1));
  ASSERT_EQ(one.contacts()->used_bytes, other.contacts()->used_bytes);
  EXPECT_EQ(std::memcmp(one.contacts(), other.contacts(), one.contacts()->used_bytes), 0);
  state[state.size() / 2] ^= 1;
  EXPECT_NE(palpate_scene_restore(other.scene, state.data(), palpate_scene_state_bytes(one.scene), &error), PALPATE_OK);
}

TEST(CApi, HandsContactsFromLoopToLoop) {
  BundleOwner owner(bundle_path);
  SceneOwner made(owner.bundle, full_def());
  const std::size_t bytes = palpate_contacts_bytes(made.scene);
  std::vector<std::uint64_t> memory(palpate_mailbox_bytes(bytes) / 8 + 8);
  auto* const aligned = reinterpret_cast<void*>((reinterpret_cast<std::uintptr_t>(memory.data()) + 63) / 64 * 64);
  EXPECT_EQ(palpate_mailbox_create(nullptr, bytes), nullptr);
  palpate_mailbox* const box = palpate_mailbox_create(aligned, bytes);
  ASSERT_NE(box, nullptr);
  std::int32_t fresh = 1;
  EXPECT_EQ(palpate_mailbox_newest(box, &fresh), nullptr);
  EXPECT_EQ(palpate_scene_touch(made.scene, nullptr, 0, kTick, palpate_mailbox_slot(box), bytes), 0u);
  palpate_mailbox_publish(box);
  ASSERT_NE(palpate_mailbox_newest(box, &fresh), nullptr);
  EXPECT_EQ(fresh, 1);
  EXPECT_EQ(palpate_mailbox_newest(box, &fresh)->step, 1u);
  EXPECT_EQ(fresh, 0);
}

TEST(CApi, MakesPointsOfAShape) {
  palpate_tool_shape_def def = palpate_default_tool_shape_def();
  def.kind = PALPATE_TOOL_SPHERE, def.radius = 0.004, def.spacing = 0.003;
  palpate_tool_shape* shape = nullptr;
  palpate_error error = {};
  ASSERT_EQ(palpate_tool_shape_create(&def, &shape, &error), PALPATE_OK) << error.text;
  const std::int32_t count = palpate_tool_shape_point_count(shape);
  EXPECT_GT(count, 8);
  for (std::int32_t p = 0; p < count; ++p) EXPECT_NEAR(length(palpate_tool_shape_points(shape) + 3 * p), 0.004, 1e-12);
  EXPECT_GT(palpate_tool_shape_patch_radius(shape), 0);
  palpate_tool tool = palpate_default_tool();
  const double turn[4] = {1, 0, 0, 0};
  palpate_tool_shape_place(shape, kAbove, turn, &tool);
  EXPECT_EQ(tool.point_count, count);
  EXPECT_EQ(tool.reference[2], kAbove[2]);
  palpate_tool_shape_destroy(shape);
  def.max_points = 1;
  EXPECT_EQ(palpate_tool_shape_create(&def, &shape, &error), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(shape, nullptr);
}

TEST(CApi, StandsBetweenDeviceAndScene) {
  palpate_device device = palpate_default_device();
  palpate_error error = {};
  palpate_coupling coupling;
  EXPECT_EQ(palpate_coupling_init(&coupling, &device, nullptr, &error), PALPATE_ERROR_ARGUMENT);  // no mass, no damping
  device.mass = 0.1, device.damping = 2;
  const palpate_coupling_def def = palpate_default_coupling_def(&device);
  EXPECT_LE(palpate_required_damping(def.stiffness, def.damping, device.tick, device.delay_ticks), device.damping);
  ASSERT_EQ(palpate_coupling_init(&coupling, &device, &def, &error), PALPATE_OK) << error.text;
  palpate_passivity passivity;
  const palpate_passivity_def observe = palpate_default_passivity_def();
  ASSERT_EQ(palpate_passivity_init(&passivity, &device, &observe, &error), PALPATE_OK) << error.text;
  palpate_watchdog watchdog;
  const palpate_watchdog_def guard = palpate_default_watchdog_def();
  ASSERT_EQ(palpate_watchdog_init(&watchdog, &guard, &error), PALPATE_OK) << error.text;
  double at[3] = {}, tool[3], force[3] = {};
  for (int tick = 0; tick < 50; ++tick) {  // into a wall of 200 N/m, 5 mm deep
    at[2] = -1e-4 * tick;
    const double organ[3] = {0, 0, tick > 0 ? -200 * coupling.tool_position[2] : 0};
    EXPECT_EQ(palpate_coupling_step(&coupling, at, organ, tool, force), 0u);
    EXPECT_EQ(palpate_watchdog_step(&watchdog, static_cast<std::uint64_t>(tick + 1), force, kTick, force) &
                  PALPATE_DEVICE_SILENT,
              0u);
    EXPECT_EQ(palpate_passivity_step(&passivity, at, force, coupling.energy, force), 0u);
  }
  EXPECT_GT(force[2], 0.2);
  palpate_device_flags flags = 0;
  for (int tick = 0; tick < 200; ++tick) flags |= palpate_watchdog_step(&watchdog, 50, force, kTick, force);
  EXPECT_TRUE(flags & PALPATE_DEVICE_SILENT);
  EXPECT_EQ(length(force), 0);
  palpate_coupling_reset(&coupling);
}

TEST(CApi, TouchesAWorldOfTwoOrgans) {
  BundleOwner owner(bundle_path);
  const palpate::SceneDef def = full_def();
  palpate_pose beside = palpate_default_pose();
  beside.position[1] = 0.2;
  palpate_world_organ organs[2] = {palpate_default_world_organ(), palpate_default_world_organ()};
  for (palpate_world_organ& organ : organs) organ.bundle = owner.bundle, organ.def = &def;
  organs[1].pose = &beside;
  palpate_world_def world_def = palpate_default_world_def();
  world_def.organs = organs, world_def.organ_count = 2, world_def.max_links = 1;
  palpate_world* world = nullptr;
  palpate_error error = {};
  ASSERT_EQ(palpate_world_create(&world_def, &world, &error), PALPATE_OK) << error.text;
  EXPECT_EQ(palpate_world_organ_count(world), 2);
  EXPECT_EQ(palpate_world_scene(world, 2), nullptr);
  std::int32_t last = 0, pass = 0;
  palpate_step_load load = palpate_default_step_load();
  load.tools = load.points = 1;
  for (std::int32_t organ = 0; palpate_world_plan(world, pass, &organ); ++pass) last = organ;
  EXPECT_EQ(last, -1);  // of the world itself
  EXPECT_GT(palpate_world_predict_pass(world, pass - 1, &load).steps, 0);
  std::int32_t latest = -1;
  palpate_world_watch_passes(
      world, [](void* user, std::int32_t ended) { *static_cast<std::int32_t*>(user) = ended; }, &latest);
  std::vector<std::uint64_t> memory(palpate_world_contacts_bytes(world) / 8 + 1);
  auto* const contacts = reinterpret_cast<palpate_world_contacts*>(memory.data());
  double point[3] = {kAbove[0], kAbove[1] + 0.2, kAbove[2]};  // above the second one
  palpate_tool tool = disc();
  tool.points = point, tool.point_count = 1;
  for (; point[2] > 0.036; point[2] -= 5e-4)
    EXPECT_EQ(palpate_world_touch(world, &tool, 1, kTick, contacts, 8 * memory.size()), 0u);
  EXPECT_GT(palpate_world_contacts_tool(contacts, 0)->force[2], 0.01);
  EXPECT_EQ(palpate_world_contacts_organ(contacts, 0)->node_count, 0);
  EXPECT_GT(palpate_world_contacts_organ(contacts, 1)->node_count, 0);
  EXPECT_LT(palpate_world_contacts_state(contacts, 1)->force[2], -0.01);
  EXPECT_EQ(contacts->pair_count, 0);
  EXPECT_EQ(latest, pass - 1);
  palpate_world_watch_passes(world, nullptr, nullptr);
  palpate_world_link link = palpate_default_world_link();
  link.kind = PALPATE_LINK_SPRING, link.rest_length = 0.19, link.stiffness = 5;
  palpate_surface_hit hit = palpate_default_surface_hit();
  EXPECT_EQ(palpate_scene_closest_point(palpate_world_scene(world, 0), nullptr, kAbove, 1, &hit), 0u);
  for (int e = 0; e < 2; ++e) {
    link.organ[e] = e, link.ends[e].kind = PALPATE_END_SURFACE_POINT, link.ends[e].triangle = hit.triangle;
    std::memcpy(link.ends[e].barycentric, hit.barycentric, sizeof hit.barycentric);
  }
  EXPECT_EQ(palpate_world_set_links(world, &link, 2, &error), PALPATE_ERROR_ARGUMENT);
  EXPECT_EQ(palpate_world_set_links(world, &link, 1, &error), PALPATE_OK) << error.text;
  palpate_world_touch(world, &tool, 1, kTick, contacts, 8 * memory.size());
  ASSERT_NE(palpate_world_link_state(world, 0), nullptr);
  EXPECT_EQ(palpate_world_link_state(world, 0)->condition, PALPATE_LINK_TAUT);
  EXPECT_EQ(palpate_world_link_state(world, 1), nullptr);
  EXPECT_EQ(palpate_world_set_links(world, nullptr, 0, &error), PALPATE_OK) << error.text;
  palpate_world_touch(world, &tool, 1, kTick, contacts, 8 * memory.size());
  const std::size_t bytes = palpate_world_state_bytes(world);
  std::vector<std::uint64_t> state(bytes / 8 + 1);
  EXPECT_EQ(palpate_world_save(world, state.data(), 8 * state.size(), &error), PALPATE_OK) << error.text;
  palpate_world_reset_tool(world, 7);
  palpate_world_reset(world);
  palpate_world_touch(world, &tool, 1, kTick, contacts, 8 * memory.size());
  EXPECT_EQ(palpate_world_contacts_tool(contacts, 0)->contact_count, 0);  // it is inside when it is first seen
  EXPECT_EQ(palpate_world_restore(world, state.data(), bytes, &error), PALPATE_OK) << error.text;
  palpate_world_touch(world, &tool, 1, kTick, contacts, 8 * memory.size());
  EXPECT_EQ(palpate_world_contacts_tool(contacts, 0)->contact_count, 1);
  palpate_world_destroy(world);
  palpate_world_destroy(nullptr);
}

// Each is on in the struct that a host begins with, but for those that need a number.
TEST(CApi, PartsHaveDefaults) {
  EXPECT_EQ(palpate_default_large_def().deformation, PALPATE_DEFORMATION_LARGE);
  EXPECT_EQ(palpate_default_grasps_def().grasps, 1);
  EXPECT_EQ(palpate_default_needles_def().needles, 1);
  EXPECT_EQ(palpate_default_needles_def().needle_places, 32);
  EXPECT_EQ(palpate_default_motions_def().motions, 1);
  EXPECT_EQ(palpate_default_links_def().max_links, 0);
  EXPECT_EQ(palpate_default_relaxation_def().terms, 0);
  EXPECT_EQ(palpate_default_loads_def().count, 0);
  EXPECT_EQ(palpate_default_force_control_def().force_control, 1);
  EXPECT_EQ(palpate_default_crossings_def().crossings, PALPATE_CROSSINGS_ON);
  EXPECT_EQ(palpate_default_crossings_out().struct_bytes, sizeof(palpate_crossings_out));
  EXPECT_EQ(palpate_default_cut_def().cut, PALPATE_CUT_ON);
  EXPECT_EQ(palpate_default_blade().struct_bytes, sizeof(palpate_blade));
  EXPECT_EQ(palpate_default_obstacles_def().count, 0);
  EXPECT_EQ(palpate_default_obstacles_def().max_nodes, 256);
  EXPECT_EQ(palpate_default_dent_def().dent, PALPATE_DENT_DISCS);
  EXPECT_EQ(palpate_default_inside_def().inside, PALPATE_INSIDE_ON);
  EXPECT_EQ(palpate_default_inside_def().part.struct_bytes, sizeof(palpate_inside_def));
}

// The parts of a definition may have any order, and each effect has one. Those by their names are the parts of palpate_add_all_parts.
TEST(CApi, PartsOfADefinition) {
  const BundleOwner owner(bundle_path);
  palpate_scene_def def = palpate_default_scene_def();
  palpate_scene* scene = nullptr;
  palpate_error error = {};
  palpate_queries_def queries = palpate_default_queries_def();
  palpate_report_def report = palpate_default_report_def();
  palpate_add_part(&def.parts, &report.part);
  palpate_add_part(&def.parts, &queries.part);
  EXPECT_EQ(palpate_scene_create(owner.bundle, &def, &scene, &error), PALPATE_OK) << error.text;
  EXPECT_NE(palpate_scene_report(scene), nullptr);
  palpate_scene_destroy(scene);
  const auto refused = [&](const char* words) {
    EXPECT_EQ(palpate_scene_create(owner.bundle, &def, &scene, &error), PALPATE_ERROR_ARGUMENT);
    EXPECT_NE(std::strstr(error.text, words), nullptr) << error.text;
    EXPECT_EQ(scene, nullptr);
  };
  palpate_queries_def again = palpate_default_queries_def();
  palpate_add_part(&def.parts, &again.part);
  refused("palpate_queries_def twice");
  again.part.next = &again.part, again.queries = PALPATE_QUERIES_OFF;  // a chain without an end
  refused("add each part once");
  again.part.next = nullptr, again.part.effect = nullptr;
  refused("part 1 of the chain");
  again = palpate_default_queries_def(), again.part.struct_bytes = 8;
  refused("palpate_queries_def: struct_bytes is 8");
  // In the other order, by their names, and as an organ of a world: the same bits.
  palpate::SceneDef whole;
  whole.relaxation.terms = 1;
  whole.relaxation.share[0] = 0.5, whole.relaxation.time[0] = 0.1, whole.links.max_links = 2, whole.grasps.grasps = 1;
  palpate_scene_def named = palpate_default_scene_def();
  std::vector<std::uint64_t> memory(palpate_all_parts_bytes() / 8);
  palpate_add_all_parts(&named, memory.data());
  for (int32_t k = 0; const palpate_key* key = palpate_scene_key(k); ++k)
    if (key->type != PALPATE_KEY_POINTER) palpate_set_key(key, &named, palpate_key_number(key, &whole));
  SceneOwner all(owner.bundle, whole), by_name(owner.bundle, whole);
  palpate_scene_destroy(by_name.scene);
  ASSERT_EQ(palpate_scene_create(owner.bundle, &named, &by_name.scene, &error), PALPATE_OK) << error.text;
  for (SceneOwner* each : {&all, &by_name}) each->press(disc(), 0.003);
  EXPECT_GT(palpate_contacts_tool(all.contacts(), 0)->force[2], 0.01);
  EXPECT_EQ(std::memcmp(all.contacts(), by_name.contacts(), all.contacts()->used_bytes), 0);
}

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  if (argc != 4) {
    std::fprintf(stderr, "expected BUNDLE.h5 MOTIONS.h5 CUT.h5\n");
    return 2;
  }
  bundle_path = argv[1], motions_path = argv[2], cut_path = argv[3];
  return RUN_ALL_TESTS();
}
