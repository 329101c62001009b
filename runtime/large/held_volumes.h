// What volumes that are held add to the metric of the method: with the factor M, the metric M + sum of k a a^T, where a is the derivative of a
// volume and k its stiffness (surface_pressures.h). Its inverse is M^-1 - Y S^-1 Y^T, Y = M^-1 a, S = diag(1 / k) + a^T Y (Sherman, Morrison and
// Woodbury).
#pragma once

#include <cstddef>
#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/bundle/offset_rows.h"

namespace palpate {

class HeldVolumes {
 public:
  // most: volumes. length: of vectors. False where memory ends.
  bool create(SceneMemory& memory, std::int32_t most, std::size_t length);
  // A saved state has the gradients. After it is restored, the caller fills in Y and calls factor().
  void keep(SceneMemory& memory) {
    memory.keep(count_);
    memory.keep_array(gradient_, static_cast<std::size_t>(most_) * length_);
  }
  void clear() { count_ = 0; }
  std::int32_t count() const { return count_; }
  // Of volume i: a, [length] m^2, and Y, [length] m/Pa. The caller fills both in between add() and factor().
  float* gradient(std::int32_t i) const { return gradient_ + static_cast<std::size_t>(i) * length_; }
  float* response(std::int32_t i) const { return response_ + static_cast<std::size_t>(i) * length_; }
  // One more volume.
  void add() { ++count_; }
  // m^3/Pa, a^T Y.
  double compliance(std::int32_t i, std::int32_t j) const;
  // stiffness: [count()] Pa/m^3. Volumes that follow from others are left out of S. After all have a and Y.
  void factor(const double* stiffness);

  // For the solution x of (metric) x = b: before() gives amounts, [count()] S^-1 Y^T b; after() takes x = M^-1 b and subtracts Y amounts from it.
  void before(const float* b, double* amounts) const;
  void after(const double* amounts, float* x) const;
  // amounts <- S^-1 amounts
  void solve(double* amounts) const;

 private:
  std::size_t length_ = 0;
  std::int32_t most_ = 0, count_ = 0;
  float *gradient_ = nullptr, *response_ = nullptr;  // [most][length]
  double* factor_ = nullptr;                         // [most][most] Cholesky factor of S
};

}  // namespace palpate
