// libFuzzer driver: damages a bundle at a few positions, makes the checksum fit, creates a scene with any effects and steps it
// with any tools. The input does not contain a bundle; it chooses the form, the damage, the effects and the steps. So 50 bytes
// of input stand for a bundle of 100,000 bytes.
#include <cstdio>
#include <cstdlib>

#include "tests/fuzz/fuzzed_scene.h"
#include "tests/support/bundle_forms.h"
#include "tests/support/hostile_play.h"
#include "tests/support/sealed_index.h"

namespace palpate::tests {
namespace {

using formats::ElementType;

struct Base {
  std::string bytes;
  formats::BundleIndex index;
};

const std::vector<Base>& bases() {
  static const std::vector<Base> all = [] {
    std::vector<Base> made;
    for (const BundleForm& form : bundle_forms(std::filesystem::temp_directory_path())) {
      made.push_back({form.bytes, {}});
      if (formats::read_bundle_index(form.bytes.data(), form.bytes.size(), &made.back().index, nullptr) !=
          formats::BundleStatus::ok)
        std::abort();
    }
    return made;
  }();
  return all;
}

template <class Number>
void put(unsigned char* at, Number number) {
  std::memcpy(at, &number, sizeof number);
}

// Replaces one number of a section, or several in a row, by an extreme value of its type or by any bits.
void damage_section(const Base& base, FuzzInput& input, unsigned char* bytes) {
  const formats::SectionEntry& entry = base.index.entries[input.below(base.index.header.section_count)];
  const auto type = static_cast<ElementType>(entry.type);
  const std::uint64_t size = formats::element_bytes(type), count = entry.bytes / size;
  const std::uint64_t first = input.raw<std::uint16_t>() * count / 65536;
  const std::uint64_t run = input.below(4) > 0 ? 1 : 1 + input.raw<std::uint16_t>() * (count - first - 1) / 65536;
  const double number = input.number(1);
  const auto integer = input.integer(static_cast<std::int32_t>(base.index.counts.surface_nodes));
  const auto half =
      static_cast<std::uint16_t>(input.raw<std::uint8_t>() << 8 | 1);  // for example 0x7c01 and 0xff01, which are NaN
  for (std::uint64_t i = first; i < first + run; ++i) {
    unsigned char* at = bytes + entry.offset + i * size;
    if (type == ElementType::f64) put(at, number);
    if (type == ElementType::f32) put(at, static_cast<float>(number));
    if (type == ElementType::f16) put(at, half);
    if (type == ElementType::i32) put(at, integer);
    if (size == 1) put(at, static_cast<std::uint8_t>(integer));
  }
}

// Replaces a word of the index by another of its words, an extreme value, or any bits.
void damage_index(const Base& base, FuzzInput& input, unsigned char* bytes) {
  const std::uint32_t words = 8 + 9 * base.index.header.section_count;
  unsigned char* at = bytes + 8 * input.below(words);
  std::uint64_t old = 0, other = 0;
  std::memcpy(&old, at, 8);
  std::memcpy(&other, bytes + 8 * input.below(words), 8);
  const std::uint64_t edges[] = {
      0,       1,        UINT64_MAX, INT64_MAX,  UINT32_MAX,        INT32_MAX,
      old - 1, old + 1,  old + 4096, old - 64,   base.bytes.size(), base.bytes.size() - 1,
      other,   old << 1, old >> 1,   1ull << 62, UINT64_MAX - 4095, input.raw<std::uint8_t>()};
  put(at, edges[input.below(std::size(edges))]);
}

std::string damaged(const Base& base, FuzzInput& input) {
  std::string bytes = base.bytes;
  auto* begin = reinterpret_cast<unsigned char*>(bytes.data());
  bool sealed = true;
  for (std::uint32_t left = input.below(6); left > 0; --left) {
    const std::uint32_t kind = input.below(8);
    if (kind < 5) damage_section(base, input, begin);
    if (kind == 5 || kind == 6) damage_index(base, input, begin);
    if (kind == 7) sealed = false;
  }
  if (input.below(32) == 1) bytes.resize(input.raw<std::uint32_t>() % bytes.size());
  if (sealed && bytes.size() >= formats::kUserBlockBytes) seal_index(bytes.data(), bytes.size());
  return bytes;
}

void keep(const std::string& broken) {
  if (broken.empty()) return;
  std::fprintf(stderr, "broken promise: %s\n", broken.c_str());
  std::abort();
}

void play(FuzzInput& input) {
  const Base& base = bases()[input.below(static_cast<std::uint32_t>(bases().size()))];
  const SceneDef def = fuzzed_effects(input);
  AlignedBytes bytes(damaged(base, input));

  palpate_bundle* opened = nullptr;
  palpate_error error = {};
  const palpate_status status = palpate_bundle_open(bytes.data(), bytes.size(), nullptr, &opened, &error);
  const BundlePointer bundle(opened);
  keep(broken_by_error(status, error, bytes.size()));
  if (!bundle) return;
  palpate_scene* created = nullptr;
  const palpate_status made = palpate_scene_create(bundle.get(), &def, &created, &error);
  const ScenePointer scene(created);
  keep(broken_by_error(made, error, bytes.size()));
  if (!scene) return;

  const palpate_bundle_info info = palpate_bundle_describe(bundle.get());
  HeldPlay held(scene.get(), def, info.node_count);
  const bool is_long = base.index.counts.regions == 1;  // bundle_forms
  const double middle[3] = {is_long ? 0.15 : 0.03, is_long ? 0.01 : 0.025, is_long ? 0.01 : 0.02};
  FuzzedTools tools;
  for (int s = 0; s < 24 && !input.empty(); ++s) {
    tools.take(input, info.surface_node_count, info.triangle_count, middle, middle[0]);
    keep(held.touch(tools.tools.data(), tools.count, tools.dt));
    keep(held.shape(held.contacts()));
    if (input.below(16) == 1) held.reset();
  }
}

}  // namespace
}  // namespace palpate::tests

// Done before the first input, so that libFuzzer does not count its time.
extern "C" int LLVMFuzzerInitialize(int*, char***) {
  palpate::tests::bases();
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  palpate::tests::FuzzInput input(data, size);
  palpate::tests::play(input);
  return 0;
}
