#include "programs/player/tool_turn.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "programs/player/tool_points.h"
#include "runtime/base/sine.h"

namespace palpate {

// Rodrigues' formula.
Rotation turn_at(const std::vector<SceneConfig::KeyFrame>& turn, double time) {
  if (turn.empty()) return kNoTurn;
  SceneConfig::Vector axis = position_at(turn, time);
  const double degrees = std::sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
  if (!(degrees > 0)) return kNoTurn;
  for (double& x : axis) x /= degrees;
  const auto [sine, cosine] = sine_cosine(degrees * (std::numbers::pi / 180));
  const Rotation cross = {{{0, -axis[2], axis[1]}, {axis[2], 0, -axis[0]}, {-axis[1], axis[0], 0}}};
  Rotation result{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      result[i][j] = (i == j ? cosine : 0) + sine * cross[i][j] + (1 - cosine) * axis[i] * axis[j];
  return result;
}

// Shepperd 1978: from the largest of the four parts.
std::array<double, 4> quaternion_of(const Rotation& r) {
  const double trace = r[0][0] + r[1][1] + r[2][2];
  std::array<double, 4> q{};
  if (trace > 0) {
    const double s = 2 * std::sqrt(1 + trace);
    q = {s / 4, (r[2][1] - r[1][2]) / s, (r[0][2] - r[2][0]) / s, (r[1][0] - r[0][1]) / s};
  } else {
    std::size_t i = r[1][1] > r[0][0] ? 1 : 0;
    if (r[2][2] > r[i][i]) i = 2;
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    const double s = 2 * std::sqrt(1 + r[i][i] - r[j][j] - r[k][k]);
    q[0] = (r[k][j] - r[j][k]) / s;
    q[1 + i] = s / 4, q[1 + j] = (r[j][i] + r[i][j]) / s, q[1 + k] = (r[k][i] + r[i][k]) / s;
  }
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (double& x : q) x /= length;
  return q;
}

SceneConfig::Vector turned(const Rotation& turn, const SceneConfig::Vector& v) {
  SceneConfig::Vector out{};
  for (std::size_t d = 0; d < 3; ++d) out[d] = turn[d][0] * v[0] + turn[d][1] * v[1] + turn[d][2] * v[2];
  return out;
}

}  // namespace palpate
