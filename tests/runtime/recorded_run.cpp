// recorded_run BUNDLE PATH THREADS: plays a recorded path on a bundle and prints, scene by scene, hashes of all results. The scenes
// are distributed over the threads, which share the bundle.
// Each build of the runtime gets such a program. It uses the C API alone, so that one compiler command can build it.
#include "tests/runtime/recorded_path.h"

#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "formats/checksum.h"
#include "runtime/include/palpate/palpate_scene_def.hpp"
#include "tests/support/guarded_device.h"
#include "tests/support/relaxation.h"
#include "tests/support/tools.h"

namespace {

using palpate::formats::Xxh64;
using palpate::tests::grip_tool;
using palpate::tests::GuardedDevice;
using palpate::tests::point_tool;
using palpate::tests::RecordedStep;
using palpate::tests::render_mesh;
using palpate::tests::shape_out;
using palpate::tests::skin_out;

struct Played {
  Xxh64 contacts, forces, shape;
  long contact_nodes = 0, slips = 0;
  unsigned flags = 0;
};

std::vector<RecordedStep> read_path(const char* file) {
  std::vector<RecordedStep> steps;
  if (std::FILE* in = std::fopen(file, "rb")) {
    for (RecordedStep step; std::fread(&step, sizeof step, 1, in) == 1;) steps.push_back(step);
    std::fclose(in);
  }
  return steps;
}

// Enough rows, two for each grip, that the widest instructions are used.
constexpr int kMostGrips = 24;

// In scenes under COULOMB the organ is turned and moves: every 16 steps a pose is sent, and the steps between move it on.
palpate_pose moving_pose() {
  palpate_pose pose = palpate_default_pose();
  // Written out: the compilers of hosts may contract a product and a sum, which has other bits.
  const double position[3] = {0.3, 0.1, -0.1}, axis[3] = {0.02, 0.01, -0.015}, velocity[3] = {-0.01, 0.005, 0.01},
               angular_velocity[3] = {0.2, -0.1, 0.15};
  std::copy_n(position, 3, pose.position);
  std::copy_n(axis, 3, pose.orientation + 1);
  std::copy_n(velocity, 3, pose.velocity);
  std::copy_n(angular_velocity, 3, pose.angular_velocity);
  return pose;
}

// These structs have no padding, so every byte is a result.
static_assert(sizeof(palpate_contact_node) == 6 * sizeof(std::int32_t) + 6 * sizeof(double));
static_assert(sizeof(palpate_tool_state) == 6 * sizeof(std::int32_t) + 15 * sizeof(double));

struct Combination {
  palpate_collision collision;
  palpate_contact_model contact;
  palpate_contact_law law;
  enum Organ { at_rest, moved, hyperelastic, loaded, cut } organ = at_rest;
};

// Comes from the free face towards the support, and is withdrawn after step 300; now and then tissue is removed at the top.
void cut_organ(palpate_scene* scene, std::size_t s, const std::function<void(double*)>& place) {
  double edge[3][3];
  for (int i = 0; i < 3; ++i) {
    edge[i][0] = 0.064 - 1.2e-4 * static_cast<double>(s), edge[i][1] = 0.023, edge[i][2] = 0.025 * i - 0.005;
    place(edge[i]);
  }
  palpate_blade blade = palpate_default_blade();
  blade.points = edge[0], blade.point_count = s < 300 ? 3 : 0;
  double middle[3] = {0.05, 0.04, 0.04};
  place(middle);
  if (palpate_scene_set_blade(scene, 0, &blade, nullptr) != PALPATE_OK ||
      (s % 100 == 50 && palpate_scene_remove_tissue(scene, middle, 0.008, 0, 0, nullptr) != PALPATE_OK))
    std::exit(3);
}

// skinned: floats of the scene's render mesh, 0 without one. looks_inside: the scene tells stress.
Played play(palpate_scene* scene, const palpate_bundle* bundle, const Combination& c, std::size_t skinned,
            bool looks_inside, const std::vector<RecordedStep>& path) {
  const int grip_count = c.law == PALPATE_LAW_STICKING ? kMostGrips : 1;
  const bool moves = c.law == PALPATE_LAW_COULOMB;
  const palpate_bundle_info info = palpate_bundle_describe(bundle);
  std::vector<std::uint64_t> memory(palpate_contacts_bytes(scene) / 8 + 1);
  auto* contacts = reinterpret_cast<palpate_contacts*>(memory.data());
  std::vector<float> displacements(3 * static_cast<std::size_t>(info.node_count)), positions(displacements.size());
  std::vector<float> drawn(skinned), discs(3 * 64), stresses(2 * displacements.size()), principal(displacements.size());
  Played played;
  GuardedDevice device;
  for (std::size_t s = 0; s < path.size(); ++s) {
    RecordedStep step = path[s];
    if (moves && s % 16 == 0) {
      const palpate_pose pose = moving_pose();
      palpate_scene_set_pose(scene, &pose, nullptr);
      std::copy_n(pose.position, 3, contacts->organ_position);
      std::copy_n(pose.orientation, 4, contacts->organ_orientation);
    }
    const auto place = [&](double* p) {
      if (moves) palpate_point_to_world(contacts->organ_position, contacts->organ_orientation, p, p);
    };
    if (c.organ == Combination::moved) {
      const double amounts[] = {0.5 * step.pull[0], 5 * step.pull[2], 1e4 * step.pull[0], 500 * step.pull[2]};
      if (palpate_scene_set_motions(scene, amounts, std::size(amounts), nullptr) != PALPATE_OK) std::exit(3);
    }
    if (c.organ == Combination::loaded) {
      const double weight[] = {20 * step.pull[0], -0.05, 20 * step.pull[2]};
      if (palpate_scene_set_load(scene, 0, PALPATE_LOAD_FORCE_IN_WORLD, weight, nullptr) != PALPATE_OK) std::exit(3);
    }
    if (c.organ == Combination::cut) cut_organ(scene, s, place);
    for (auto& p : step.press) place(p);
    for (auto& p : step.pinch) place(p);
    palpate_grip grips[kMostGrips];
    for (int g = 0; g < grip_count; ++g) {
      // The grips move on one after the other, so that rows of the contact matrix come and go.
      const auto at = static_cast<std::int32_t>(
          4 + g + (s / 4 + kMostGrips - 1 - static_cast<std::size_t>(g)) / kMostGrips * kMostGrips);
      grips[g] = palpate_default_grip();
      grips[g].kind = PALPATE_GRIP_NODE, grips[g].node = palpate_bundle_touchable(bundle)[at % info.touchable_count];
      grips[g].axes = 5;  // x and z
      for (int d = 0; d < 3; ++d) grips[g].displacement[d] = step.pull[d];
    }
    palpate_tool tools[3] = {point_tool(step.press[0], 3, 0.004, 0.3), point_tool(step.pinch[0], 2, 0, 0.5, 1),
                             grip_tool(grips, grip_count)};
    // The first tool presses with a force, from where the path has it.
    palpate_given_force given = palpate_default_given_force();
    given.force[0] = 10 * step.pull[0], given.force[2] = -0.1;
    if (c.organ == Combination::loaded) palpate_add_part(&tools[0].parts, &given.part);
    played.flags |= palpate_scene_touch(scene, tools, 3, 1e-3, contacts, memory.size() * sizeof memory[0]);
    played.contacts.update(palpate_contacts_node(contacts, 0), contacts->node_count * sizeof(palpate_contact_node));
    played.forces.update(palpate_contacts_tool(contacts, 0), 3 * sizeof(palpate_tool_state));
    // A device that stands where the first point is; its watchdog hears nothing for 40 of 100 steps.
    device.step(step.press[0], palpate_contacts_tool(contacts, 0)->force_raw, s % 100 < 60 ? s + 1 : s - s % 100 + 60);
    played.forces.update(&device, sizeof device);
    palpate_shape_out out = shape_out(displacements.data(), positions.data(), info.node_count);
    played.flags |= palpate_scene_shape(scene, contacts, &out);
    const std::size_t bytes = 3 * sizeof(float) * static_cast<std::size_t>(out.node_count);
    played.shape.update(displacements.data(), bytes);
    played.shape.update(positions.data(), bytes);
    if (const palpate_cut_state* const cut = palpate_scene_cut_state(scene)) played.shape.update(cut, sizeof *cut);
    if (skinned) {
      palpate_skin_out skin = skin_out(drawn.data(), nullptr, static_cast<std::int32_t>(skinned / 3));
      skin.report = palpate_scene_report(scene), skin.disc_normals = discs.data(), skin.disc_capacity = 64;
      played.flags |= palpate_scene_skin(scene, &out, &skin);
      played.shape.update(drawn.data(), sizeof(float) * skinned);
      played.shape.update(discs.data(), 3 * sizeof(float) * static_cast<std::size_t>(skin.disc_count));
    }
    if (looks_inside) {
      palpate_inside_out inside = palpate_default_inside_out();
      inside.capacity = info.node_count, inside.stresses = stresses.data(), inside.principal = principal.data();
      played.flags |= palpate_scene_inside(scene, &out, &inside);
      played.shape.update(stresses.data(), sizeof(float) * stresses.size());
      played.shape.update(principal.data(), sizeof(float) * principal.size());
    }
    played.contact_nodes += contacts->node_count;
    for (int t = 0; t < 3; ++t) played.slips += palpate_contacts_tool(contacts, t)->slip_count;
  }
  const palpate_cut_state* const cut = palpate_scene_cut_state(scene);
  if (cut && (cut->faces < 10 || cut->removed == 0)) {
    std::fprintf(stderr, "recorded_run: %d faces cut, %d tetrahedra removed\n", cut->faces, cut->removed);
    std::exit(3);
  }
  return played;
}

// Every contact model under every law on both surfaces, and some of them on an organ that moves, on a hyperelastic one, on one that bears a load
// and a tool with a given force, and on one that is cut; half of the linear
// scenes use all other effects too.
bool has_the_rest(const Combination& c) {
  return c.organ != Combination::hyperelastic && c.organ != Combination::cut &&
         (static_cast<int>(c.collision) + c.contact + c.law) % 2 == 0;
}

std::vector<Combination> combinations() {
  std::vector<Combination> all;
  for (const palpate_collision collision : {PALPATE_COLLISION_REST, PALPATE_COLLISION_DEFORMED})
    for (int contact = PALPATE_CONTACT_NODE; contact <= PALPATE_CONTACT_PATCH; ++contact)
      for (int law = PALPATE_LAW_STICKING; law <= PALPATE_LAW_COULOMB; ++law)
        all.push_back({collision, static_cast<palpate_contact_model>(contact), static_cast<palpate_contact_law>(law)});
  for (const palpate_contact_law law : {PALPATE_LAW_UNILATERAL, PALPATE_LAW_COULOMB}) {
    all.push_back({PALPATE_COLLISION_DEFORMED, PALPATE_CONTACT_PATCH, law, Combination::moved});
    all.push_back({PALPATE_COLLISION_DEFORMED, PALPATE_CONTACT_PATCH, law, Combination::hyperelastic});
    all.push_back({PALPATE_COLLISION_DEFORMED, PALPATE_CONTACT_PATCH, law, Combination::loaded});
    all.push_back({PALPATE_COLLISION_DEFORMED, PALPATE_CONTACT_PATCH, law, Combination::cut});
  }
  return all;
}

// A plate with friction that stands against the face x = 60 mm.
palpate_obstacle plate_beside() {
  palpate_obstacle plate = palpate_default_obstacle();
  plate.kind = PALPATE_OBSTACLE_DISC, plate.size[0] = 0.04, plate.friction = 0.3;
  plate.position[0] = 0.0602, plate.position[1] = 0.02, plate.position[2] = 0.02;
  plate.orientation[0] = 0.70710678118654752, plate.orientation[2] = -plate.orientation[0];  // looks along -x
  return plate;
}

palpate::SceneDef scene_def(const Combination& c) {
  palpate::SceneDef def;
  def.collision = c.collision, def.contact = c.contact, def.law = c.law, def.shape = PALPATE_SHAPE_VOLUME;
  def.force_limit = 20;  // N, reached by the pinch
  if (c.organ == Combination::moved) def.motions.motions = 1;
  if (c.organ == Combination::loaded) {
    const double top[3] = {0.041, 0.026, 0.04};  // m
    def.loads.count = 1, def.loads.radius[0] = 0.012;
    std::copy_n(top, 3, def.loads.centre[0]);
    def.force_control.force_control = 1;
    static const palpate_obstacle table = plate_beside();
    def.obstacles.count = 1, def.obstacles.list = &table;
  }
  if (c.organ == Combination::cut) def.shape = PALPATE_SHAPE_SURFACE, def.cut.cut = PALPATE_CUT_ON;
  if (c.organ == Combination::hyperelastic) def.large.deformation = PALPATE_DEFORMATION_LARGE;
  if (!has_the_rest(c)) return def;
  def.radial = PALPATE_RADIAL_RESPONSE, def.force = PALPATE_FORCE_RESPONSE, def.preload = PALPATE_PRELOAD_ON;
  def.relaxation = palpate::relaxation_of({{0.45, 0.005}, {0.365, 0.5}});
  def.inside.inside = PALPATE_INSIDE_ON;
  if (c.contact == PALPATE_CONTACT_PATCH)
    def.report.report = PALPATE_REPORT_CONTACTS, def.dent.dent = PALPATE_DENT_DISCS;
  return def;
}

std::string line_of(const Combination& c, const Played& played) {
  char line[256];
  std::snprintf(
      line, sizeof line,
      "collision %d contact %d law %d organ %d the rest %d: contact_nodes %ld slips %ld flags %u contacts %016" PRIx64
      " forces %016" PRIx64 " shape %016" PRIx64 "\n",
      c.collision, c.contact, c.law, c.organ, has_the_rest(c), played.contact_nodes, played.slips, played.flags,
      played.contacts.digest(), played.forces.digest(), played.shape.digest());
  return line;
}

// Returns nothing for a scene whose effects this build or bundle does not have. Any other failure ends the program.
std::string play(const Combination& c, palpate_bundle* bundle, const std::vector<RecordedStep>& path) {
  palpate::SceneDef def = scene_def(c);
  // The surface's own nodes are the render mesh of scenes with dents.
  const std::int32_t nodes = palpate_bundle_describe(bundle).surface_node_count;
  std::vector<float> vertices;
  for (std::int32_t i = 0; def.dent.dent != PALPATE_DENT_OFF && i < 3 * nodes; ++i)
    vertices.push_back(static_cast<float>(palpate_bundle_nodes(bundle)[i]));
  const palpate_render_mesh mesh = render_mesh(vertices.data(), nullptr, nodes);
  if (!vertices.empty()) def.render_mesh = mesh;
  palpate_scene* scene = nullptr;
  palpate_error error = {};
  const palpate_status status = palpate_scene_create(bundle, &def, &scene, &error);
  if (status == PALPATE_ERROR_EFFECT) return {};
  if (status != PALPATE_OK) {
    std::fprintf(stderr, "recorded_run: %s\n", error.text);
    std::exit(3);
  }
  const std::string line =
      line_of(c, play(scene, bundle, c, vertices.size(), def.inside.inside != PALPATE_INSIDE_OFF, path));
  palpate_scene_destroy(scene);
  return line;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  const std::vector<RecordedStep> path = read_path(argv[2]);
  const auto thread_count = static_cast<std::size_t>(std::atoi(argv[3]));
  palpate_bundle* bundle = nullptr;
  palpate_error error = {};
  if (path.empty() || thread_count < 1 || palpate_bundle_open_file(argv[1], nullptr, &bundle, &error) != PALPATE_OK) {
    std::fprintf(stderr, "recorded_run: %s\n", path.empty() ? "no path" : error.text);
    return 3;
  }
  const std::vector<Combination> scenes = combinations();
  std::vector<std::string> lines(scenes.size());
  std::vector<std::thread> threads;
  for (std::size_t t = 0; t < thread_count; ++t)
    threads.emplace_back([&, t] {
      for (std::size_t c = t; c < scenes.size(); c += thread_count) lines[c] = play(scenes[c], bundle, path);
    });
  for (std::thread& thread : threads) thread.join();
  palpate_bundle_close(bundle);
  for (const std::string& line : lines) std::fputs(line.c_str(), stdout);
}
