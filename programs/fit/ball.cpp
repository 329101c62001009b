#include "programs/fit/ball.h"

#include <cmath>
#include <limits>

namespace palpate::fit {

double ball_stiffness(const BallPlace& place, double radius, double depth) {
  const double rest = 1 / place.disc_stiffness - 1 / (2 * place.plane_modulus * radius);
  const auto force_at = [&](double a) {
    // Below a thousandth of the radius the difference loses digits; there the ball is Hertz's paraboloid.
    if (a < 1e-3 * radius) return 4.0 / 3 * place.plane_modulus * a * a * a / radius;
    const double log = std::log((radius + a) / (radius - a));
    return place.plane_modulus * ((a * a + radius * radius) / 2 * log - a * radius);
  };
  const auto depth_at = [&](double a) { return a / 2 * std::log((radius + a) / (radius - a)) + rest * force_at(a); };
  // depth_at grows with a, because rest > -1 / (2 E* R) and dF = 2 E* a d(local depth).
  double low = 0, high = (1 - 1e-9) * radius;
  if (depth > depth_at(high)) return std::numeric_limits<double>::quiet_NaN();
  for (int halving = 0; halving < 100; ++halving) {
    const double middle = (low + high) / 2;
    (depth_at(middle) < depth ? low : high) = middle;
  }
  return force_at((low + high) / 2) / depth;
}

}  // namespace palpate::fit
