// Amounts of an offset that follow the contacts' forces f (offset.h): g = -V^-1 B^T f, B their rows, V what a unit of each makes each of them sweep.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/base/vec3.h"
#include "runtime/bundle/offset_rows.h"

namespace palpate {

class OffsetFollowers {
 public:
  // rows: borrowed.
  bool create(SceneMemory& memory, const OffsetRows* rows);
  // For a state that is saved.
  void keep(SceneMemory& memory);

  // Of the first `of` rows. which: [of] 1 where the amount follows; v: [of][of], of which V is a part; factor: [of][of], gets L of V = L L^T. False
  // where V is not positive definite by more than rounding: follow() is not called with such.
  static bool factorise(std::int32_t of, const std::int32_t* which, const double* v, double* factor);
  void follow(std::int32_t of, const std::int32_t* which, const double* v);

  std::int32_t count() const { return count_; }
  bool follows(std::int32_t row) const;
  // amounts: [rows]. B^T f of a force on a node, subtracted; then V^-1 of it, so that zeros become g. Of all rows that follow.
  void subtract_force(std::int32_t node, Vec3 force, double* amounts) const;
  void solve(double* amounts) const;
  // response: [rows], V^-1 B^T of a unit force on a node; then B V^-1 B^T between the other node and it, m/N.
  void find_response(std::int32_t node, Vec3* response) const;
  Mat3 between(std::int32_t other, const Vec3* response) const;

 private:
  template <class Number>
  void solve_for(Number* amounts) const;

  const OffsetRows* rows_ = nullptr;
  std::int32_t* row_ = nullptr;  // the rows that follow, ascending
  double* factor_ = nullptr;     // [factored_][factored_], as factorise() leaves it
  std::int32_t count_ = 0, factored_ = 0;
};

}  // namespace palpate
