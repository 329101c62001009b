#include "studies/validation/large_closed_forms.h"

#include <array>
#include <cmath>
#include <numbers>

namespace palpate::validation {
namespace {

using std::numbers::pi;

struct Constants {
  double mu, lambda, kappa;
};
Constants constants_of(const Material& m) {
  return {m.young / (2 * (1 + m.poisson)), m.young * m.poisson / ((1 + m.poisson) * (1 - 2 * m.poisson)),
          m.young / (3 * (1 - 2 * m.poisson))};
}

// The principal Kirchhoff stresses of the isochoric laws: of psi(x) with x = l_1^2 + l_2^2 + l_3^2 - 3, or of a sum of powers.
std::array<double, 3> kirchhoff_stress(double mu, const LawForm& form, std::array<double, 3> l) {
  const double scale = std::cbrt(l[0] * l[1] * l[2]), *const c = form.constant;
  for (double& stretch : l) stretch /= scale;
  std::array<double, 3> stress = {};
  const auto add_powers = [&](double factor, double exponent) {
    double mean = 0;
    for (const double stretch : l) mean += std::pow(stretch, exponent) / 3;
    for (std::size_t n = 0; n < 3; ++n) stress[n] += factor * (std::pow(l[n], exponent) - mean);
  };
  if (form.kind == LawForm::Kind::ogden) {
    add_powers(2 * mu * (1 - c[1]) / c[0], c[0]), add_powers(2 * mu * c[1] / c[2], c[2]);
    return stress;
  }
  const double x = l[0] * l[0] + l[1] * l[1] + l[2] * l[2] - 3;
  double slope = mu / 2;  // psi'
  if (form.kind == LawForm::Kind::exponential) slope *= std::exp(c[0] * x);
  if (form.kind == LawForm::Kind::yeoh) slope += 2 * c[0] * x + 3 * c[1] * x * x;
  add_powers(2 * slope, 2);
  return stress;
}

// dW/d(stretch) and dW/d(width) / 2 of W(stretch, width, width).
struct BarStress {
  double along, across;
};
BarStress stress_of(const StretchedBar& bar, double width) {
  const auto [mu, lambda, kappa] = constants_of(bar.material);
  const double s = bar.stretch, t = width, j = s * t * t;
  if (bar.law == LargeLaw::compressible) {
    const double pressed = lambda * std::log(j) - mu;
    return {mu * s + pressed / s, mu * t + pressed / t};
  }
  const auto shape = kirchhoff_stress(mu, bar.form, {s, t, t});
  return {shape[0] / s + kappa * (j - 1) * t * t, shape[1] / t + kappa * (j - 1) * s * t};
}

}  // namespace

double StretchedBar::width() const {
  double low = 0.2, high = 5;  // the stress across grows with the width
  for (int i = 0; i < 200; ++i) {
    const double middle = (low + high) / 2;
    (stress_of(*this, middle).across > 0 ? high : low) = middle;
  }
  return (low + high) / 2;
}
double StretchedBar::stress() const {
  return stress_of(*this, width()).along;
}

// The principal stretches are l, 1 and 1 / l with gamma = l - 1 / l, and the first axis lies along (l, 1).
double ShearedBlock::shear_stress() const {
  const double mu = constants_of(material).mu, l = gamma / 2 + std::sqrt(1 + gamma * gamma / 4);
  if (law == LargeLaw::compressible) return mu * gamma;
  const auto stress = kirchhoff_stress(mu, form, {l, 1 / l, 1});
  return (stress[0] - stress[1]) * l / (1 + l * l);
}
double ShearedBlock::normal_stress() const {
  const double mu = constants_of(material).mu, l = gamma / 2 + std::sqrt(1 + gamma * gamma / 4);
  if (law == LargeLaw::compressible) return 0;
  const auto stress = kirchhoff_stress(mu, form, {l, 1 / l, 1});
  return (stress[0] + stress[1] * l * l) / (1 + l * l);
}

double TwistedCylinder::torque() const {
  return pi / 2 * shear * twist * std::pow(radius, 4);
}
double TwistedCylinder::axial_force() const {
  return -pi / 4 * shear * twist * twist * std::pow(radius, 4);
}

// theta'' = -alpha cos theta with theta(0) = 0 and theta'(1) = 0, by shooting on theta'(0); classical Runge-Kutta.
Elastica::Tip Elastica::tip() const {
  constexpr int steps = 2000;
  constexpr double h = 1.0 / steps;
  Tip end = {};
  const auto bend_at_end = [&](double bend) {
    double theta = 0;
    end = {0, 1};
    for (int i = 0; i < steps; ++i) {
      const double k1 = bend, l1 = -alpha * std::cos(theta);
      const double k2 = bend + h / 2 * l1, l2 = -alpha * std::cos(theta + h / 2 * k1);
      const double k3 = bend + h / 2 * l2, l3 = -alpha * std::cos(theta + h / 2 * k2);
      const double k4 = bend + h * l3, l4 = -alpha * std::cos(theta + h * k3);
      const double next = theta + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
      const double middle = (theta + next) / 2 + h / 8 * (bend - (bend + h / 6 * (l1 + 2 * l2 + 2 * l3 + l4)));
      end.down += h / 6 * (std::sin(theta) + 4 * std::sin(middle) + std::sin(next));
      end.back -= h / 6 * (std::cos(theta) + 4 * std::cos(middle) + std::cos(next));
      theta = next, bend += h / 6 * (l1 + 2 * l2 + 2 * l3 + l4);
    }
    return bend;
  };
  double low = 0, high = alpha;
  for (int i = 0; i < 100; ++i) {
    const double middle = (low + high) / 2;
    (bend_at_end(middle) > 0 ? high : low) = middle;
  }
  return end;
}

}  // namespace palpate::validation
