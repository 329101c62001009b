// The fields of palpate_scene_def, and the numbers and limits of any field.
#include <cstdio>
#include <cstring>

#include "runtime/base/error_text.h"
#include "runtime/scene/build_scene.h"

namespace palpate {
namespace {

constexpr EffectKey kCoreKeys[] = {
    {PALPATE_KEY(collision), PALPATE_KEY_CHOICE, "", "off, rest, deformed", 0, PALPATE_COLLISION_DEFORMED},
    {PALPATE_KEY(contact), PALPATE_KEY_CHOICE, "", "node, triangle, point, patch", 0, PALPATE_CONTACT_PATCH},
    {PALPATE_KEY(law), PALPATE_KEY_CHOICE, "", "sticking, sliding, unilateral, coulomb", 0, PALPATE_LAW_COULOMB},
    {PALPATE_KEY(force), PALPATE_KEY_CHOICE, "", "off, linear, response", 0, PALPATE_FORCE_RESPONSE},
    {PALPATE_KEY(shape), PALPATE_KEY_CHOICE, "", "off, surface, volume", 0, PALPATE_SHAPE_VOLUME},
    {PALPATE_KEY(radial), PALPATE_KEY_CHOICE, "", "off, response", 0, PALPATE_RADIAL_RESPONSE},
    {PALPATE_KEY(preload), PALPATE_KEY_CHOICE, "", "off, on", 0, PALPATE_PRELOAD_ON},
    {PALPATE_KEY(max_tools), PALPATE_KEY_COUNT, "", "", 1, PALPATE_MAX_TOOLS},
    {PALPATE_KEY(max_points), PALPATE_KEY_COUNT, "", "", 1, 100000},
    {PALPATE_KEY(max_contact_nodes), PALPATE_KEY_COUNT, "", "a number that fits max_points", 0, kMostContactNodes},
    {PALPATE_KEY(max_operations), PALPATE_KEY_COUNT, "", "", 1, kNoLimit},
    {PALPATE_KEY(force_limit), PALPATE_KEY_NUMBER, "N", "", kAboveZero, kNoLimit},
    {PALPATE_KEY(force_slew), PALPATE_KEY_NUMBER, "N/s", "", kAboveZero, kNoLimit},
    {PALPATE_KEY(torque_limit), PALPATE_KEY_NUMBER, "N m", "", kAboveZero, kNoLimit},
    {PALPATE_KEY(torque_slew), PALPATE_KEY_NUMBER, "N m/s", "", kAboveZero, kNoLimit},
    {PALPATE_KEY(max_tool_speed), PALPATE_KEY_NUMBER, "m/s", "", kAboveZero, kNoLimit},
    {PALPATE_KEY(release_distance), PALPATE_KEY_NUMBER, "m", "a fifth of the organ's size", 0, kNoLimit},
    {PALPATE_KEY(allocator), PALPATE_KEY_POINTER, "", "", 0, 1},
};

palpate_status refuse(const EffectKey& key, palpate_error* error) {
  const auto bad = [&](const char* how, auto... limits) {
    char text[120];
    std::snprintf(text, sizeof text, how, limits...);
    return fail(error, PALPATE_ERROR_ARGUMENT, 0, "palpate_scene_def: %s %s", key.name, text);
  };
  if (key.type == PALPATE_KEY_CHOICE)
    return bad("%s", "has a value that palpate.h does not list; start from palpate_default_scene_def()");
  if (key.type == PALPATE_KEY_FLAG) return bad("%s", "must be 0 or 1");
  if (key.least == kAboveZero) return bad("must be above 0 %s", key.unit);
  if (key.most == kNoLimit) return bad("must be %.0f %s or more", key.least, key.unit);
  return bad("must be %.0f .. %.0f%s%s", key.least, key.most, key.words[0] ? "; 0 stands for " : "", key.words);
}

}  // namespace

std::span<const EffectKey> core_keys() {
  return kCoreKeys;
}

const palpate_part* find_part(const palpate_scene_def& def, const palpate_effect& effect) {
  // The chain that a host has made may be a ring.
  std::int32_t left = kMostEffects;
  for (const palpate_part* part = def.parts; part && left > 0; part = part->next, --left)
    if (part->effect == &effect) return part;
  return nullptr;
}

double key_number(const palpate_scene_def& def, const char* name) {
  const auto named = [&](const EffectKey& key) { return std::strcmp(key.name, name) == 0; };
  for (const EffectKey& key : kCoreKeys)
    if (named(key)) return palpate_key_number(&key, &def);
  for (const palpate_part* part = def.parts; part; part = part->next)
    for (const EffectKey& key : part->effect->keys)
      if (named(key)) return number_in(key, part);
  return 0;
}

palpate_status check_key(const EffectKey& key, const palpate_scene_def& def, palpate_error* error) {
  if (key.bytes > 8) return PALPATE_OK;  // an array, of which the effect knows how many numbers count
  const double number = palpate_key_number(&key, &def);
  return number >= key.least && number <= key.most ? PALPATE_OK : refuse(key, error);
}

double number_in(const EffectKey& key, const void* fields) {
  // Copied: a host in C may have stored any number in an enum.
  const auto read = [&](auto value) {
    std::memcpy(&value, static_cast<const unsigned char*>(fields) + key.offset, sizeof value);
    return value;
  };
  if (key.type == PALPATE_KEY_POINTER) return read(static_cast<const void*>(nullptr)) != nullptr;
  if (key.type == PALPATE_KEY_NUMBER) return read(0.0);
  return key.bytes == 8 ? static_cast<double>(read(std::int64_t{})) : read(std::int32_t{});
}

}  // namespace palpate

// The host's struct that has the field; nullptr where there is none.
static const void* struct_with(const palpate_key* key, const palpate_scene_def* def) {
  const void* fields = def;
  std::uint32_t bytes = def->struct_bytes;
  if (key->effect) {
    const palpate_part* const part = bytes < sizeof *def ? nullptr : palpate::find_part(*def, *key->effect);
    fields = part, bytes = part ? part->struct_bytes : 0;
  }
  return static_cast<std::int64_t>(bytes) < key->offset + key->bytes ? nullptr : fields;
}

double palpate_key_number(const palpate_key* key, const palpate_scene_def* def) {
  const void* const fields = struct_with(key, def);
  return fields ? palpate::number_in(*key, fields) : 0;
}

int32_t palpate_set_key(const palpate_key* key, palpate_scene_def* def, double number) {
  void* const fields = const_cast<void*>(struct_with(key, def));  // the host's own, as the definition is
  const auto store = [&](auto value) {
    std::memcpy(static_cast<unsigned char*>(fields) + key->offset, &value, sizeof value);
  };
  if (key->type == PALPATE_KEY_POINTER || !fields) return 0;
  if (key->type == PALPATE_KEY_NUMBER)
    store(number);
  else if (key->bytes == 8)
    store(static_cast<std::int64_t>(std::fmin(std::fmax(number, -9e18), 9e18)));
  else
    store(static_cast<std::int32_t>(std::fmin(std::fmax(number, INT32_MIN), INT32_MAX)));
  return 1;
}
