// Opens any bytes as a bundle, creates a scene, steps it, and checks what palpate.h promises for any input. Tests and fuzzers
// use it. A broken promise is returned as a sentence; an empty string means that all were kept.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <vector>

#include "runtime/include/palpate/palpate_scene_def.hpp"
#include "tests/support/open_bundle.h"
#include "tests/support/tools.h"

namespace palpate::tests {

// Checks that an error has a sentence and a byte offset within the file.
std::string broken_by_error(palpate_status status, const palpate_error& error, std::uint64_t file_bytes);

bool all_finite(const double* x, std::size_t count);

// Steps one scene and checks the promises after each step.
class HeldPlay {
 public:
  HeldPlay(palpate_scene* scene, const SceneDef& def, std::int32_t nodes);

  palpate_contacts* contacts() { return reinterpret_cast<palpate_contacts*>(memory_.data()); }
  palpate_step_flags flags() const { return flags_; }  // of the last touch and shape

  std::string touch(const palpate_tool* tools, std::int32_t tool_count, double dt);

  std::string shape(const palpate_contacts* of);

  void reset();

 private:
  std::string look_inside(const palpate_shape_out& shape);

  palpate_scene* scene_;
  SceneDef def_;
  std::vector<std::uint64_t> memory_;
  std::vector<float> displacements_, positions_, skin_, stresses_, principal_;
  std::map<std::int32_t, std::array<double, 3>> last_;  // N, of each tool by its id
  palpate_step_flags flags_ = 0;
};

// The result of playing some bytes.
struct Played {
  std::string broken;  // the broken promise, or empty
  palpate_status opened = PALPATE_OK, created = PALPATE_OK;
  std::uint64_t byte_offset = 0;  // of the error
  palpate_step_flags flags = 0;   // of all steps, joined
};

// Opens the bytes. If the runtime accepts them, plays one scene: a tool point presses each surface node in turn while a grip
// holds another node.
Played play_bytes(AlignedBytes& bytes, const SceneDef& def, int steps);

}  // namespace palpate::tests
