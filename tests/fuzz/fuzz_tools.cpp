// libFuzzer driver: an undamaged bundle and a host that passes any bits as scene definition, tools, contacts from a socket and
// shape buffers, with an allocator that fails at some point.
#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "tests/fuzz/fuzzed_scene.h"
#include "tests/support/bundle_forms.h"
#include "tests/support/hostile_play.h"

namespace palpate::tests {
namespace {

struct OpenBundle {
  std::unique_ptr<AlignedBytes> bytes;
  BundlePointer bundle;
};

const std::vector<OpenBundle>& good_bundles() {
  static const std::vector<OpenBundle> all = [] {
    std::vector<OpenBundle> made;
    for (const BundleForm& form : bundle_forms(std::filesystem::temp_directory_path())) {
      made.push_back({std::make_unique<AlignedBytes>(form.bytes), nullptr});
      palpate_bundle* opened = nullptr;
      if (palpate_bundle_open(made.back().bytes->data(), made.back().bytes->size(), nullptr, &opened, nullptr) !=
          PALPATE_OK)
        std::abort();
      made.back().bundle.reset(opened);
    }
    return made;
  }();
  return all;
}

// An allocator that fails when its bytes are used up.
struct Budget {
  std::size_t left;
};
void* take(void* user, std::size_t bytes, std::size_t alignment) {
  auto& budget = *static_cast<Budget*>(user);
  if (bytes > budget.left) return nullptr;
  budget.left -= bytes;
  return std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
}
void give_back(void*, void* memory) {
  std::free(memory);
}

// Replaces words of the object by any bits, except its pointers.
template <class Plain>
void scramble(FuzzInput& input, Plain* object, std::size_t bytes, std::uint32_t most) {
  for (std::uint32_t left = input.below(most + 1); left > 0; --left) {
    const std::size_t at = input.raw<std::uint16_t>() % (bytes / 4) * 4;
    const std::int32_t word = input.integer(8);
    std::memcpy(reinterpret_cast<unsigned char*>(object) + at, &word, sizeof word);
  }
}

// A struct that is smaller than it says would be the host's fault, like a wrong pointer.
template <class Struct>
void state_at_most_its_size(Struct& object) {
  object.struct_bytes = std::min<std::uint32_t>(object.struct_bytes, sizeof object);
}

void keep(const std::string& broken) {
  if (broken.empty()) return;
  std::fprintf(stderr, "broken promise: %s\n", broken.c_str());
  std::abort();
}

class Host : public FuzzedTools {
 public:
  // Counts that no caller should pass. The arrays have kPoints elements, more than the scene may read.
  void scramble_tools(FuzzInput& input) {
    for (std::int32_t t = 0; t < count; ++t) {
      palpate_tool& tool = tools[t];
      switch (input.below(16)) {
        case 0:
          tool.point_count = input.integer(1);
          break;
        case 1:
          tool.points = nullptr;
          break;
        case 2:
          tool.points = reinterpret_cast<const double*>(reinterpret_cast<const char*>(tool.points) + 4);
          break;
        case 3:
          tool.grip_count = -1 - static_cast<std::int32_t>(input.below(4));
          break;
        case 4:
          scramble(input, grips[t].data(), sizeof grips[t], 3);
          for (palpate_grip& grip : grips[t]) state_at_most_its_size(grip);
          break;
        case 6:
          tool.struct_bytes = input.below(sizeof tool + 1);
          break;
        case 7:
          tool.id = input.integer(kTools);
          break;
        case 5:
          tool.disc_radius = input.raw<double>(), tool.friction = input.raw<double>();
          break;
        default:
          break;
      }
    }
    if (input.below(16) == 0) count = -count;
  }
};

constexpr int kVertices = 4;

void play(FuzzInput& input) {
  const std::uint32_t forms = static_cast<std::uint32_t>(good_bundles().size());
  palpate_bundle* bundle = good_bundles()[input.below(forms)].bundle.get();
  SceneDef def = fuzzed_effects(input);
  Budget budget = {std::size_t{1} << (4 + input.below(22))};  // 16 bytes to 32 MiB
  def.max_points = Host::kPoints - 1;
  palpate_scene_def& of_core = def;
  scramble(input, &of_core, offsetof(palpate_scene_def, allocator), 2);
  scramble(input, &def.relaxation.terms, sizeof(palpate_relaxation_def) - offsetof(palpate_relaxation_def, terms), 2);
  scramble(input, &def.inside.inside, sizeof def.inside.inside, 2);
  state_at_most_its_size(of_core);
  def.allocator = {take, give_back, &budget};
  // A render mesh of any floats, with or without normals. Its pointer stays valid: the API makes that the host's duty.
  float positions[kVertices][3], normals[kVertices][3];
  palpate_render_mesh mesh = render_mesh(positions[0], input.flag() ? normals[0] : nullptr, kVertices);
  if (input.flag()) def.render_mesh = mesh;
  for (int v = 0; def.render_mesh.positions && v < kVertices; ++v)
    for (int i = 0; i < 3; ++i) {
      positions[v][i] = 0.02F + static_cast<float>(input.number(0.03));
      normals[v][i] = static_cast<float>(input.number(1));
    }
  palpate_scene* created = nullptr;
  palpate_error error = {};
  const palpate_status status = palpate_scene_create(bundle, &def, &created, &error);
  const ScenePointer scene(created);
  keep(broken_by_error(status, error, UINT64_MAX));
  if (!scene || def.max_points > Host::kPoints) return;

  const palpate_bundle_info info = palpate_bundle_describe(bundle);
  SceneDef read = def;  // the part that the library has read
  palpate_scene_def& core_read = read;
  core_read = palpate_default_scene_def();
  std::memcpy(&core_read, &of_core, def.struct_bytes);
  HeldPlay held(scene.get(), read, info.node_count);
  const double middle[3] = {0.03, 0.02, 0.02};
  Host host;
  for (int s = 0; s < 24 && !input.empty(); ++s) {
    host.take(input, info.surface_node_count, info.triangle_count, middle, 0.03);
    host.scramble_tools(input);
    keep(held.touch(host.tools.data(), host.count, host.dt));
    if (!input.flag()) {
      keep(held.shape(held.contacts()));
      continue;
    }
    std::vector<std::uint64_t> sent(palpate_contacts_bytes(scene.get()) / 8 + 1);
    std::memcpy(sent.data(), held.contacts(), held.contacts()->used_bytes);
    scramble(input, sent.data(), held.contacts()->used_bytes, 6);
    keep(held.shape(reinterpret_cast<const palpate_contacts*>(sent.data())));
  }
}

}  // namespace
}  // namespace palpate::tests

// Done before the first input, so that libFuzzer does not count its time.
extern "C" int LLVMFuzzerInitialize(int*, char***) {
  palpate::tests::good_bundles();
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  palpate::tests::FuzzInput input(data, size);
  palpate::tests::play(input);
  return 0;
}
