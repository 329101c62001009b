// recorded_run BUNDLE PATH: plays a recorded path on a bundle and prints, scene by scene, hashes of all that came out.
// One build of the runtime is one such program; it uses nothing but the C API, so that it can be built by one command.
#include "tests/runtime/recorded_path.h"

#include <cinttypes>
#include <cstdio>
#include <vector>

#include "formats/checksum.h"
#include "runtime/include/palpate/palpate.h"

namespace {

using palpate::formats::Xxh64;
using palpate::tests::RecordedStep;

struct Played {
  Xxh64 contacts, forces, shape;
  long contact_nodes = 0;
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

// Both structs are without padding: every byte is a result.
static_assert(sizeof(palpate_contact_node) == 4 * sizeof(std::int32_t) + 6 * sizeof(double));
static_assert(sizeof(palpate_tool_state) == 4 * sizeof(std::int32_t) + 9 * sizeof(double));

Played play(palpate_scene* scene, const palpate_bundle* bundle, const std::vector<RecordedStep>& path) {
  const palpate_bundle_info info = palpate_bundle_describe(bundle);
  std::vector<std::uint64_t> memory(palpate_contacts_bytes(scene) / 8 + 1);
  auto* contacts = reinterpret_cast<palpate_contacts*>(memory.data());
  std::vector<float> displacements(3 * static_cast<std::size_t>(info.node_count)), positions(displacements.size());
  Played played;
  for (const RecordedStep& step : path) {
    palpate_grip grip = {palpate_bundle_touchable(bundle)[4], -1, {0, 0, 0}, {0, 0, 0}, 5};  // x and z
    for (int d = 0; d < 3; ++d) grip.displacement[d] = step.pull[d];
    const palpate_tool tools[3] = {{step.press[0], 3, nullptr, 0, 0, 0.004, 0.3},
                                   {step.pinch[0], 2, nullptr, 0, 1, 0, 0.5},
                                   {nullptr, 0, &grip, 1, 0, 0, 0}};
    played.flags |= palpate_touch(scene, tools, 3, 1e-3, contacts);
    played.contacts.update(palpate_contacts_nodes(contacts), contacts->node_count * sizeof(palpate_contact_node));
    played.forces.update(contacts->tools, 3 * sizeof(palpate_tool_state));
    palpate_shape_out out = {displacements.data(), positions.data(), info.node_count, 0};
    played.flags |= palpate_shape(scene, contacts, &out);
    const std::size_t bytes = 3 * sizeof(float) * static_cast<std::size_t>(out.node_count);
    played.shape.update(displacements.data(), bytes);
    played.shape.update(positions.data(), bytes);
    played.contact_nodes += contacts->node_count;
  }
  return played;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const std::vector<RecordedStep> path = read_path(argv[2]);
  palpate_bundle* bundle = nullptr;
  palpate_error error = {};
  if (path.empty() || palpate_bundle_open_file(argv[1], &bundle, &error) != PALPATE_OK) {
    std::fprintf(stderr, "recorded_run: %s\n", path.empty() ? "no path" : error.text);
    return 3;
  }
  for (const auto collision : {PALPATE_COLLISION_REST, PALPATE_COLLISION_DEFORMED})
    for (const auto contact :
         {PALPATE_CONTACT_NODE, PALPATE_CONTACT_TRIANGLE, PALPATE_CONTACT_POINT, PALPATE_CONTACT_PATCH})
      for (const bool corrected : {false, true}) {
        palpate_scene_def def = palpate_default_scene_def();
        def.collision = collision, def.contact = contact, def.shape = PALPATE_SHAPE_VOLUME;
        def.force_limit = 20;  // N, reached by the pinch
        if (corrected)
          def.law = contact == PALPATE_CONTACT_NODE       ? PALPATE_LAW_SLIDING
                    : contact == PALPATE_CONTACT_TRIANGLE ? PALPATE_LAW_UNILATERAL
                                                          : PALPATE_LAW_COULOMB,
          def.radial = PALPATE_RADIAL_RESPONSE, def.force = PALPATE_FORCE_RESPONSE, def.preload = PALPATE_PRELOAD_ON;
        palpate_scene* scene = nullptr;
        if (palpate_scene_create(bundle, &def, &scene, &error) != PALPATE_OK) {
          std::fprintf(stderr, "recorded_run: %s\n", error.text);
          return 3;
        }
        const Played played = play(scene, bundle, path);
        palpate_scene_destroy(scene);
        std::printf("collision %d contact %d corrected %d: contact_nodes %ld flags %u contacts %016" PRIx64
                    " forces %016" PRIx64 " shape %016" PRIx64 "\n",
                    collision, contact, corrected, played.contact_nodes, played.flags, played.contacts.digest(),
                    played.forces.digest(), played.shape.digest());
      }
  palpate_bundle_close(bundle);
}
