// What moves the organ from outside: supports, pressure, gravity. The bundle's motions are the rows of the organ's offset (offset.h), and
// this decides their amounts q in each step.
// Where the volume of a pressure is held in place of the pressure, its amount follows from
//     V q + B^T f = v,      V_ij: the volume that motion j makes the surface of pressure i sweep; f: the contacts' forces,
// as offset.h eliminates it: q is V^-1 v without contacts, which this decides, less V^-1 B^T f.
#pragma once

#include <cstdint>

#include "runtime/base/passes.h"
#include "runtime/contact/offset.h"
#include "runtime/contact/step_part.h"
#include "runtime/include/palpate/palpate_motions.h"

namespace palpate {

class Motions final : public StepPart {
 public:
  // All borrowed. volume: [count][count] m^3, or nullptr where no motion is a pressure.
  struct Source {
    Offset* offset = nullptr;
    std::int32_t count = 0;  // the first rows of the offset
    const double* volume = nullptr;
    const std::int32_t* kind = nullptr;  // [count]
    bool is_linear = true;               // the organ; else it tells pressures and volumes itself (RowVolume)
    bool is_whole = true;                // else volumes do not follow from those of the bundle: none is told or held
    bool has_surfaces = false;  // the pressures' pieces of the surface are known, which a body that is not linear needs
    Pass pass = Pass::input;
  };
  bool create(SceneMemory& memory, const Source& source);

  std::int32_t count() const { return source_.count; }

  // palpate_scene_set_motions and palpate_scene_hold_volume state the contract.
  palpate_status set(const double* amounts, std::int32_t count, palpate_error* error);
  palpate_status hold_volume(std::int32_t motion, bool holds, double volume, palpate_error* error);
  // What was set stays; the next step takes it at once.
  void forget_rest() override;

  // The amounts go to what was set, by no more than tools may move at any node, but the first step takes them all.
  void begin_step(TouchStep& step) override;
  void take_reactions(TouchStep& step, bool solved) override;

  const palpate_motion_state* state(std::int32_t motion) const {
    return motion >= 0 && motion < count() ? &state_[motion] : nullptr;
  }

 private:
  const OffsetRows& rows() const { return source_.offset->rows(); }
  // m^3 per unit of the amount of `by`, of any row of the offset. A pressure sweeps of a load's displacement what the load works along its own.
  double swept(std::int32_t motion, std::int32_t by) const {
    return by < count() ? source_.volume[motion * count() + by] : rows().work(motion, by);
  }
  bool is_pressure(std::int32_t motion) const {
    return static_cast<formats::MotionKind>(source_.kind[motion]) == formats::MotionKind::pressure;
  }
  double volume_of(std::int32_t motion, const ContactConstraints& set, const Vec3* force) const;
  void hold(const double* volumes, double* amounts) const;
  void change_held();
  void begin_held();
  bool move_volumes(double most);
  // The volume of the pressure is held in this step.
  bool holds(std::int32_t motion) const {
    return source_.is_linear ? source_.offset->followers().follows(motion) : holds_[motion] != 0;
  }
  bool is_told(std::int32_t motion) const { return !source_.is_linear && is_pressure(motion); }
  bool go_to(const double* to, bool followers, double* most);
  std::uint32_t take(double most);

  Source source_;
  // [count] each:
  double* wanted_ = nullptr;
  double* held_ = nullptr;         // m^3, where a volume is held
  std::int32_t* holds_ = nullptr;  // 1: a volume is held
  palpate_motion_state* state_ = nullptr;
  std::int32_t first_ = 1;
  std::int32_t changed_ = 0;  // 1: volumes are held, or not any more, since the last step
};

}  // namespace palpate
