// Dead weights and tractions on patches of the surface. Each load has three rows of the organ's offset (offset.h), the displacements C f by 1 N along
// x, y and z of the organ's frame, spread over its patch; this decides their amounts, N, in each step.
#pragma once

#include <cstdint>

#include "runtime/base/passes.h"
#include "runtime/contact/offset.h"
#include "runtime/contact/step_part.h"
#include "runtime/include/palpate/palpate_loads.h"
#include "runtime/loads/load_patch.h"

namespace palpate {

class DisplacementField;
struct TouchState;

class SurfaceLoads final : public StepPart {
 public:
  // borrowed. first: of the rows of the offset; patch: [count].
  struct Source {
    TouchState* touch = nullptr;
    std::int32_t first = 0, count = 0;
    const LoadPatch* patch = nullptr;
    Pass pass = Pass::input;
  };
  bool create(SceneMemory& memory, const Source& source);

  std::int32_t count() const { return source_.count; }
  // palpate_scene_set_load states the contract.
  palpate_status set(std::int32_t load, palpate_load_kind kind, const double vector[3], palpate_error* error);
  const LoadPatch& patch(std::int32_t load) const { return source_.patch[load]; }
  const palpate_load_state* state(std::int32_t load) const {
    return load >= 0 && load < count() ? &state_[load] : nullptr;
  }

  // What was set stays; the next step takes it at once.
  void forget_rest() override;
  // The loads go to what was set, by no more than tools may move at any node, but the first step takes them all.
  void begin_step(TouchStep& step) override;
  void end_step(TouchStep& step) override;

 private:
  // What the host has set: N, or Pa, along the axes of one of the two frames.
  struct Given {
    Vec3 vector;
    std::int32_t kind = PALPATE_LOAD_FORCE, unused = 0;  // in the place of padding, which a saved state would hold
  };
  Vec3 force_of(const Given& given, std::int32_t load) const;
  double longest_of(std::int32_t load, Vec3 force) const;

  Source source_;
  Given* given_ = nullptr;               // [count]
  palpate_load_state* state_ = nullptr;  // [count]
  std::int32_t first_ = 1;
};

}  // namespace palpate
