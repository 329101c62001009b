#include "studies/reality/pressed_cylinder.h"

#include <cmath>
#include <stdexcept>

#include "studies/bodies/bodies.h"
#include "studies/hyperelastic/large_body.h"
#include "studies/hyperelastic/large_reference.h"
#include "studies/validation/shapes.h"

namespace palpate::reality {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kLinear = 1e-5;              // strain of the slope near rest: the curvature adds as much
constexpr double kMostStep = 0.05;            // strain between two solutions
constexpr double kShortest = kMostStep / 32;  // of that, where Newton's method does not converge

}  // namespace

PressedCylinder press_cylinder(const CylinderTest& test, const std::vector<double>& strains) {
  const bool plates = test.press != Press::disc;
  const double height = plates ? test.height / 2 : test.height;  // two plates: half of it, by symmetry
  const int layers = std::max(2, static_cast<int>(std::round(1.2 * test.cells * height / test.radius)));
  const Material material = {2 * (1 + test.poisson), test.poisson, 0};  // a shear modulus of 1 Pa
  const auto pressed = [&](const std::array<double, 3>& p) {
    return p[2] > height * (1 - 1e-9) && (plates || std::hypot(p[0], p[1]) < test.radius / 2 * (1 + 1e-9));
  };
  const LargeBody body(held_body(validation::quarter_cylinder(test.radius, height, test.cells, layers), {material},
                                 [&](const std::array<double, 3>& p) {
                                   const int base = plates ? 4 : 7, top = test.press == Press::sliding ? 4 : 7;
                                   return (p[0] == 0 ? 1 : 0) | (p[1] == 0 ? 2 : 0) | (p[2] == 0 ? base : 0) |
                                          (pressed(p) ? top : 0);
                                 }),
                       test.element, {test.law});
  const auto& nodes = body.elastic().nodes;
  const LargeReference reference(body.get());
  VectorXd u = VectorXd::Zero(3 * static_cast<Index>(nodes.size()));
  double now = 0;
  const auto push_to = [&](double strain) {
    u *= now > 0 ? strain / now : 0;
    for (std::size_t n = 0; n < nodes.size(); ++n)
      if (pressed(nodes[n])) u[3 * static_cast<Index>(n) + 2] = -strain * height;
    now = strain;
    reference.balance(VectorXd::Zero(u.size()), &u, 1e-8);
    VectorXd force;
    reference.energy(u, &force);
    double sum = 0;
    for (std::size_t n = 0; n < nodes.size(); ++n)
      if (pressed(nodes[n])) sum -= force[3 * static_cast<Index>(n) + 2];
    return 4 * sum;
  };
  PressedCylinder result;
  result.nodes = nodes.size();
  result.slope = push_to(kLinear) / kLinear;
  for (const double strain : strains) {
    const int steps = std::max(1, static_cast<int>(std::ceil((strain - now) / kMostStep)));
    double step = (strain - now) / steps, force = 0;
    while (now < strain) {
      const VectorXd before = u;
      const double from = now, to = from + 1.01 * step < strain ? from + step : strain;
      try {
        force = push_to(to);
      } catch (const std::runtime_error&) {
        u = before, now = from;
        if ((step /= 2) < kShortest) throw;
      }
    }
    result.force.push_back(force);
  }
  return result;
}

}  // namespace palpate::reality
