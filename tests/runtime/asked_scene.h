// What tests ask of a scene: why it is refused, the memory that it holds, and its state in another scene.
#pragma once

#include <palpate/palpate_scene_def.hpp>

#include <map>

#include "tests/runtime/touched_box.h"

namespace palpate::tests {

// Why a scene is refused; status PALPATE_OK and no text where it is made.
inline palpate_error refusal_of(const TouchedBody& body, const palpate_scene_def& def) {
  palpate_scene* scene = nullptr;
  palpate_error error = {};
  const palpate_status status = palpate_scene_create(body.bundle(), &def, &scene, &error);
  EXPECT_EQ(scene != nullptr, status == PALPATE_OK);
  EXPECT_EQ(error.text[0] == '\0', status == PALPATE_OK);
  EXPECT_EQ(error.status, status);
  palpate_scene_destroy(scene);
  return error;
}

// Bytes that a scene holds of its allocator. planned: those that its plan states.
inline std::size_t bytes_of(SceneDef def, const TouchedBody& on, std::uint64_t* planned = nullptr) {
  static std::map<void*, std::size_t> held;
  held.clear();
  def.allocator.allocate = [](void*, std::size_t count, std::size_t alignment) -> void* {
    void* memory = std::aligned_alloc(alignment, (count + alignment - 1) / alignment * alignment);
    held[memory] = count;
    return memory;
  };
  def.allocator.release = [](void*, void* memory) { held.erase(memory), std::free(memory); };
  const ScenePointer scene = on.scene(def);
  std::size_t sum = 0;
  for (const auto& [memory, count] : held) sum += count;
  if (planned) *planned = 0;
  for (const palpate_plan_pass& pass : plan_of(scene.get())) planned ? * planned += pass.memory_bytes : 0;
  return sum;
}

// Each pass of a plan with its half and its sections, one a line.
inline std::string plan_text(const palpate_scene* scene) {
  std::string text;
  for (const palpate_plan_pass& pass : plan_of(scene))
    text += std::string(pass.half) + " " + pass.name + " [" + pass.sections + "]\n";
  return text;
}

inline std::vector<std::uint64_t> state_of(const palpate_scene* scene) {
  std::vector<std::uint64_t> state(palpate_scene_state_bytes(scene) / 8);
  palpate_error error = {};
  EXPECT_EQ(palpate_scene_save(scene, state.data(), 8 * state.size(), &error), PALPATE_OK) << error.text;
  return state;
}

// `to` goes on from the state of `from`.
inline void restore_from(const palpate_scene* from, palpate_scene* to) {
  const std::vector<std::uint64_t> state = state_of(from);
  palpate_error error = {};
  ASSERT_EQ(palpate_scene_restore(to, state.data(), 8 * state.size(), &error), PALPATE_OK) << error.text;
}

}  // namespace palpate::tests
