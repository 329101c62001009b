// Saving and restoring what the touch steps have left in a scene: the values and arrays that its memory marks as kept.
#include "runtime/scene/state.h"
#include "runtime/base/alignment.h"
#include "runtime/base/error_text.h"
#include "runtime/contact/touch.h"
#include "runtime/include/palpate/palpate_state.h"
#include "runtime/scene/scene.h"

namespace palpate {
namespace {

// In front of the kept bytes.
struct StateHead {
  char magic[8];
  std::uint64_t bytes;       // with this head
  std::uint64_t checksum;    // XXH64 of the bytes behind this field
  std::uint64_t definition;  // of palpate_scene
  std::uint64_t bundle;      // its identity
};
constexpr char kMagic[8] = {'P', 'A', 'L', 'P', 'S', 'T', 'A', 'T'};
constexpr std::size_t kCheckedFrom = offsetof(StateHead, definition);

std::uint64_t checksum_of(const void* state, std::uint64_t bytes) {
  return formats::xxh64(static_cast<const unsigned char*>(state) + kCheckedFrom,
                        static_cast<std::size_t>(bytes) - kCheckedFrom);
}

// Every value takes whole words, so that each begins aligned.
std::size_t whole_words(std::size_t bytes) {
  return (bytes + 7) / 8 * 8;
}

std::int32_t used_of(const SceneMemory::Kept& kept) {
  return kept.used ? *kept.used : static_cast<std::int32_t>(kept.count);
}

std::size_t bytes_of_state(const SceneMemory& memory) {
  std::size_t bytes = sizeof(StateHead);
  for (int k = 0; k < memory.kept_count(); ++k) {
    const SceneMemory::Kept& kept = memory.kept()[k];
    bytes += whole_words(kept.bytes * static_cast<std::size_t>(used_of(kept)));
  }
  return bytes;
}

// Writes the kept values behind the head. Returns the bytes of the state.
std::size_t write_kept(const SceneMemory& memory, unsigned char* state) {
  std::size_t at = sizeof(StateHead);
  for (int k = 0; k < memory.kept_count(); ++k) {
    const SceneMemory::Kept& kept = memory.kept()[k];
    const std::size_t bytes = kept.bytes * static_cast<std::size_t>(used_of(kept)), whole = whole_words(bytes);
    std::memcpy(state + at, kept.memory(), bytes);
    std::memset(state + at + bytes, 0, whole - bytes);
    at += whole;
  }
  return at;
}

// Whether a state of so many bytes holds exactly what the memory keeps. The number of elements in use stands in the state itself,
// before the array.
bool fits(const SceneMemory& memory, const unsigned char* state, std::size_t bytes) {
  std::size_t at = sizeof(StateHead), begin[SceneMemory::kMaxKept];
  for (int k = 0; k < memory.kept_count(); ++k) {
    const SceneMemory::Kept& kept = memory.kept()[k];
    std::int32_t used = static_cast<std::int32_t>(kept.count);
    for (int earlier = 0; kept.used && earlier < k; ++earlier)
      if (const std::ptrdiff_t inside = memory.kept()[earlier].find(kept.used); inside >= 0)
        std::memcpy(&used, state + begin[earlier] + inside, sizeof used);
    if (used < 0 || static_cast<std::size_t>(used) > kept.count) return false;
    begin[k] = at;
    const std::size_t whole = whole_words(kept.bytes * static_cast<std::size_t>(used));
    if (bytes - at < whole) return false;
    at += whole;
  }
  return at == bytes;
}

// Of a state that fits. The number of elements in use is read before the array, because it was marked before.
void read_kept(const SceneMemory& memory, const unsigned char* state) {
  std::size_t at = sizeof(StateHead);
  for (int k = 0; k < memory.kept_count(); ++k) {
    const SceneMemory::Kept& kept = memory.kept()[k];
    const std::size_t bytes = kept.bytes * static_cast<std::size_t>(used_of(kept));
    std::memcpy(kept.memory(), state + at, bytes);
    at += whole_words(bytes);
  }
}

// Field by field, because the padding between fields has any bits. Pointers stand for what their effects made of it.
void add_fields(std::span<const EffectKey> keys, const void* fields, Digest& digest) {
  for (const EffectKey& key : keys)
    if (key.type != PALPATE_KEY_POINTER)
      digest.add(key.offset)
          .add_bytes(static_cast<const unsigned char*>(fields) + key.offset, static_cast<std::size_t>(key.bytes));
}

}  // namespace

std::uint64_t definition_of(const palpate_scene& scene) {
  const palpate_scene_def& def = scene.def;
  const SceneMemory& memory = scene.memory;
  Digest digest;
  std::int32_t version[4];
  palpate_version(version);
  digest.add(version);
  add_fields(core_keys(), &def, digest);
  digest.add(scene.touch.surface.bound ? scene.touch.surface.bound->identity() : std::uint64_t{0});
  for (std::int32_t e = 0; e < scene.effect_count; ++e) {
    const Effect& effect = *scene.effects[e].effect;
    if (effect.pass.half == Half::touch) add_fields(effect.keys, find_part(def, effect), digest);
  }
  for (int k = 0; k < memory.kept_count(); ++k) digest.add(memory.kept()[k].bytes, memory.kept()[k].count);
  return digest.value();
}

std::size_t SceneState::bytes() const {
  return bytes_of_state(memory);
}

std::size_t SceneState::write(unsigned char* state) const {
  const std::size_t bytes = write_kept(memory, state);
  StateHead head = {};
  std::memcpy(head.magic, kMagic, sizeof head.magic);
  head.bytes = bytes;
  head.definition = definition;
  head.bundle = bundle;
  std::memcpy(state, &head, sizeof head);
  head.checksum = checksum_of(state, bytes);
  std::memcpy(state, &head, sizeof head);
  return bytes;
}

palpate_status SceneState::check(const unsigned char* state, std::size_t state_bytes, std::size_t* bytes,
                                 palpate_error* error) const {
  StateHead head = {};
  if (state_bytes < sizeof head)
    return fail(error, PALPATE_ERROR_TRUNCATED, 0, "state has %llu bytes; expected those that palpate_scene_save wrote",
                static_cast<unsigned long long>(state_bytes));
  std::memcpy(&head, state, sizeof head);
  if (std::memcmp(head.magic, kMagic, sizeof head.magic) != 0)
    return fail(error, PALPATE_ERROR_MAGIC, 0, "these bytes are not a state that palpate_scene_save wrote");
  if (head.bytes > state_bytes || head.bytes < sizeof head)
    return fail(error, PALPATE_ERROR_TRUNCATED, 0, "state has %llu bytes; expected %llu, as its head says",
                static_cast<unsigned long long>(state_bytes), static_cast<unsigned long long>(head.bytes));
  if (head.checksum != checksum_of(state, head.bytes))
    return fail(error, PALPATE_ERROR_CHECKSUM, 0, "state differs from what palpate_scene_save wrote; save it again");
  if (head.bundle != bundle)
    return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                "state is of bundle %016llx; expected %016llx, the bundle of this scene",
                static_cast<unsigned long long>(head.bundle), static_cast<unsigned long long>(bundle));
  if (head.definition != definition)
    return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                "state is of a scene with another palpate_scene_def, or of another version of the library; create this "
                "scene as that one was created");
  if (!fits(memory, state, static_cast<std::size_t>(head.bytes)))
    return fail(error, PALPATE_ERROR_CONTENT, 0, "state contradicts itself, although its checksum fits; save it again");
  *bytes = static_cast<std::size_t>(head.bytes);
  return PALPATE_OK;
}

void SceneState::read(const unsigned char* state) const {
  read_kept(memory, state);
}

SceneState state_of(const palpate_scene& scene) {
  return {scene.memory, scene.definition, scene.context.bundle.index.header.index_checksum};
}

}  // namespace palpate

using palpate::fail;

size_t palpate_scene_state_bytes(const palpate_scene* scene) {
  return scene ? palpate::state_of(*scene).bytes() : 0;
}

namespace {

palpate_status refuse_part(const palpate_scene& scene, palpate_error* error) {
  return fail(error, PALPATE_ERROR_ARGUMENT, 0, "%s", scene.not_alone);
}

}  // namespace

palpate_status palpate_scene_save(const palpate_scene* scene, void* state, size_t state_bytes, palpate_error* error) {
  if (!scene || !state) return fail(error, PALPATE_ERROR_ARGUMENT, 0, "scene and state must not be NULL");
  if (scene->not_alone) return refuse_part(*scene, error);
  if (!palpate::is_aligned(static_cast<const std::uint64_t*>(state)))
    return fail(error, PALPATE_ERROR_ARGUMENT, 0, "state must be 8-byte aligned");
  if (const size_t needed = palpate_scene_state_bytes(scene); state_bytes < needed)
    return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                "state has %llu bytes; expected %llu, as palpate_scene_state_bytes returns now",
                static_cast<unsigned long long>(state_bytes), static_cast<unsigned long long>(needed));
  palpate::state_of(*scene).write(static_cast<unsigned char*>(state));
  return palpate::succeed(error);
}

palpate_status palpate_scene_restore(palpate_scene* scene, const void* state, size_t state_bytes,
                                     palpate_error* error) {
  if (!scene || !state) return fail(error, PALPATE_ERROR_ARGUMENT, 0, "scene and state must not be NULL");
  if (scene->not_alone) return refuse_part(*scene, error);
  if (!palpate::is_aligned(static_cast<const std::uint64_t*>(state)))
    return fail(error, PALPATE_ERROR_ARGUMENT, 0, "state must be 8-byte aligned");
  const auto* const from = static_cast<const unsigned char*>(state);
  std::size_t bytes = 0;
  if (const palpate_status status = palpate::state_of(*scene).check(from, state_bytes, &bytes, error)) return status;
  palpate::state_of(*scene).read(from);
  palpate::touch_restored(scene->context, scene->touch);
  return palpate::succeed(error);
}
