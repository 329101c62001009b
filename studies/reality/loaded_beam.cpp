#include "studies/reality/loaded_beam.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

#include "studies/bodies/bodies.h"
#include "studies/hyperelastic/large_body.h"
#include "studies/hyperelastic/large_reference.h"
#include "studies/validation/shapes.h"
#include "studies/validation/solved_body.h"

namespace palpate::reality {
namespace {

using Eigen::Vector2d;
using Eigen::VectorXd;
using validation::DiscreteBody;
using validation::Point;

constexpr double kSagTolerance = 1e-4;  // of the measured sag

// Half of the beam: y from the plane of symmetry to the side. E = 1 Pa, so that loads count over Young's modulus.
DiscreteBody half_beam(const BeamTest& test, Element element) {
  const auto [length, width, height] = test.size;
  const auto cells = [&](double side) {
    return std::max(1, static_cast<int>(std::lround(test.cells * side / height)));
  };
  return validation::discretise_body(
      held_body(box_mesh({cells(length), cells(width / 2), test.cells}, {length, width / 2, height}),
                {{1, test.poisson, 0}}, [](const Point& p) { return (p[0] == 0 ? 7 : 0) | (p[1] == 0 ? 2 : 0); }),
      element);
}

VectorXd weight_of(const DiscreteBody& half, const BeamTest& test) {
  const double down = test.density * test.gravity;
  const auto load = validation::body_load(half, [&](const Eigen::Vector3d&) { return Eigen::Vector3d(0, 0, -down); });
  return VectorXd::Map(load.data(), static_cast<Eigen::Index>(load.size()));
}

bool at_end(const Point& p, const BeamTest& test) {
  return p[0] > test.size[0] * (1 - 1e-9);
}

// 1 N on the upper edge of the whole beam's free end, each node with the length of edge that it stands for.
VectorXd load_of(const DiscreteBody& half, const BeamTest& test) {
  const auto& nodes = half.discretisation.coordinates;
  std::vector<std::pair<double, std::size_t>> edge;
  for (std::size_t n = 0; n < nodes.size(); ++n)
    if (at_end(nodes[n], test) && nodes[n][2] > test.size[2] * (1 - 1e-9)) edge.emplace_back(nodes[n][1], n);
  std::sort(edge.begin(), edge.end());
  VectorXd load = VectorXd::Zero(3 * static_cast<Eigen::Index>(nodes.size()));
  for (std::size_t i = 0; i + 1 < edge.size(); ++i)
    for (const std::size_t end : {i, i + 1})
      load[3 * static_cast<Eigen::Index>(edge[end].second) + 2] -=
          (edge[i + 1].first - edge[i].first) / 2 / test.size[1];
  return load;
}

// The rigid motion that is nearest to that of the end's nodes.
EndMotion motion_of(const DiscreteBody& half, const BeamTest& test, const VectorXd& u) {
  const auto& nodes = half.discretisation.coordinates;
  std::vector<std::pair<Vector2d, Vector2d>> pairs;
  Vector2d before = Vector2d::Zero(), after = Vector2d::Zero();
  for (std::size_t n = 0; n < nodes.size(); ++n)
    if (at_end(nodes[n], test)) {
      const Vector2d place(nodes[n][0], nodes[n][2]);
      pairs.emplace_back(
          place, place + Vector2d(u[3 * static_cast<Eigen::Index>(n)], u[3 * static_cast<Eigen::Index>(n) + 2]));
      before += place, after += pairs.back().second;
    }
  before /= static_cast<double>(pairs.size()), after /= static_cast<double>(pairs.size());
  double cosine = 0, sine = 0;
  for (const auto& [place, moved] : pairs) {
    const Vector2d a = place - before, b = moved - after;
    cosine += a.dot(b), sine += a[0] * b[1] - a[1] * b[0];
  }
  const double turn = std::atan2(sine, cosine);
  const Vector2d base(test.size[0], 0), shifted = after + Eigen::Rotation2Dd(turn) * (base - before) - base;
  return {shifted[0], -shifted[1], turn};
}

double sag_of(const EndMotion& motion, const BeamTest& test) {
  const Vector2d arm(test.beyond, test.above);
  return motion.down - (Eigen::Rotation2Dd(motion.turn) * arm - arm)[1];
}

// solve(load) with E = 1 Pa, from the last solution on. Secants for 1 / E.
LoadedBeam find_young(const DiscreteBody& half, const BeamTest& test,
                      const std::function<const VectorXd&(const VectorXd& load)>& solve) {
  const VectorXd weight = weight_of(half, test), load = load_of(half, test);
  const auto sag_at = [&](double softness) { return sag_of(motion_of(half, test, solve(softness * weight)), test); };
  double softness = 1e-6, sag = sag_at(softness), last = 0, last_sag = 0;
  for (int i = 0; std::abs(sag / test.sag - 1) > kSagTolerance; ++i) {
    if (i == 30) throw std::runtime_error("no Young's modulus gives the measured sag");
    const double next = softness + (test.sag - sag) * (softness - last) / (sag - last_sag);
    last = softness, last_sag = sag, softness = std::min(next, 3 * softness), sag = sag_at(softness);
  }
  LoadedBeam result;
  result.nodes = half.body.nodes.size(), result.young = 1 / softness;
  result.moved.push_back(motion_of(half, test, solve(softness * weight)));
  for (const double newton : test.loads)
    result.moved.push_back(motion_of(half, test, solve(softness * (weight + newton * load))));
  return result;
}

}  // namespace

LoadedBeam load_beam(const BeamTest& test, Element element) {
  const DiscreteBody half = half_beam(test, element);
  const LargeBody body(half.body, element);
  const LargeReference reference(body.get());
  VectorXd u = VectorXd::Zero(reference.dofs()), now = u;
  return find_young(half, test, [&](const VectorXd& load) -> const VectorXd& {
    constexpr int shares = 2;
    const VectorXd from = now;
    for (int i = 1; i <= shares; ++i)
      reference.balance(from + (load - from) * i / shares, &u, i < shares ? 1e-3 : 1e-8);
    now = load;
    return u;
  });
}

LoadedBeam load_beam_linearly(const BeamTest& test, Element element) {
  const DiscreteBody half = half_beam(test, element);
  VectorXd u;
  return find_young(half, test, [&](const VectorXd& load) -> const VectorXd& {
    const validation::Answer answer = validation::solve(half, std::vector<double>(load.begin(), load.end()));
    u = VectorXd::Map(answer.u.data(), static_cast<Eigen::Index>(answer.u.size()));
    return u;
  });
}

}  // namespace palpate::reality
