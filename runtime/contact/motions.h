// What moves the organ from outside: supports, pressure, gravity. The organ without contacts has the displacement B q, where row m of the
// bundle's motions is column m of B and q has their amounts. A contact holds what is left of its target: (H W H^T) r = d - H B q.
// Where the volume of a pressure is held in place of the pressure, its amount follows from
//     V q + B^T f = v,      V_ij: the volume that motion j makes the surface of pressure i sweep; f: the contacts' forces.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/bundle/motion_rows.h"
#include "runtime/contact/contact_constraints.h"

namespace palpate {

class Motions {
 public:
  static constexpr std::int32_t kMost = formats::kMostMotions;
  // A step is solved so often at most until held volumes are met.
  static constexpr int kMostSolves = 4;

  // All borrowed. volume: [count][count] m^3, or nullptr where no motion is a pressure.
  struct Source {
    MotionRows surface;
    const double* volume = nullptr;
    const std::int32_t* kind = nullptr;  // [count]
  };
  // Every number of source.surface was checked to be finite; its `longest` is filled in here.
  bool create(SceneMemory& memory, const Source& source, std::int32_t constraint_capacity);

  std::int32_t count() const { return source_.surface.count; }
  const MotionRows& rows() const { return source_.surface; }

  // palpate_scene_set_motions and palpate_scene_hold_volume state the contract.
  palpate_status set(const double* amounts, std::int32_t count, palpate_error* error);
  palpate_status hold_volume(std::int32_t motion, bool holds, double volume, palpate_error* error);
  // What was set stays; the next step takes it at once.
  void forget();

  // Begins a step, before it looks for contacts: the amounts go to what was set, by no more than `most` metres at any node, but the first
  // step takes them all. Returns step flags.
  std::uint32_t begin(double most);
  // The constraints of the step with the targets that are left for contacts, until the next call. Cost: for each contact node 3
  // multiply-adds for each motion.
  const ContactConstraints& acting(const ContactConstraints& set);
  // After a solve: whether held volumes are missed. Their pressures are then new, and the step is to be solved again. After the last one:
  // false, and SOLVE_INEXACT in *flags where they are far off.
  bool follow_volumes(const ContactConstraints& set, const Vec3* force, int solve, std::uint32_t* flags);
  bool holds_volumes() const { return pumps_ > 0; }
  // After the last solve.
  void end(const ContactConstraints& set, const Vec3* force);

  // m, of a surface node: now; as this step began, without what follow_volumes() has changed; as the one before began.
  Vec3 now(std::int32_t node) const { return rows().sum_at(now_, node); }
  Vec3 begun(std::int32_t node) const { return rows().sum_at(begun_, node); }
  Vec3 before(std::int32_t node) const { return rows().sum_at(before_, node); }
  Vec3 step_of(std::int32_t node) const {
    return rows().sum_at(step_, node);
  }  // from the end of the last step to this one's begin
  const double* amounts() const { return now_; }
  // m, upper bounds over the surface: of the displacement now; of its change from the end of the last step to now, from the beginning
  // of the last step to now, and from the beginning of this step to now.
  double longest() const { return length_of(now_, nullptr); }
  double stepped() const { return stepped_; }
  double change() const { return length_of(now_, before_); }
  double pumped() const { return length_of(now_, begun_); }

  const palpate_motion_state* state(std::int32_t motion) const {
    return motion >= 0 && motion < count() ? &state_[motion] : nullptr;
  }

 private:
  double volume_of(std::int32_t motion, const ContactConstraints& set, const Vec3* force) const;
  bool solve_pumps(double* missed) const;
  double length_of(const double* amounts, const double* from) const;
  void take_all();

  Source source_;
  ContactConstraints acting_;
  // [count] each:
  double* longest_ = nullptr;
  double *wanted_ = nullptr, *now_ = nullptr, *begun_ = nullptr, *before_ = nullptr;
  double* held_ = nullptr;         // m^3, where a volume is held
  std::int32_t* holds_ = nullptr;  // 1: a volume is held
  double* step_ = nullptr;         // of the amounts, from the end of the last step to this one's begin
  double *last_now_ = nullptr,
         *last_by_ = nullptr;  // of the solve before: the amounts, and by how much they were to change
  palpate_motion_state* state_ = nullptr;
  double most_ = 0, stepped_ = 0;  // m: what a node may still move in this step
  std::int32_t first_ = 1, pumps_ = 0;
};

}  // namespace palpate
