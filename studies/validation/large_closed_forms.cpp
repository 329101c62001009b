#include "studies/validation/large_closed_forms.h"

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

// psi'(x)
double slope(double mu, double stiffening, double x) {
  return mu / 2 * std::exp(stiffening * x);
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
  const double i = s * s + 2 * t * t, scale = std::pow(j, -2.0 / 3), p = slope(mu, bar.stiffening, scale * i - 3);
  return {2 * p * scale * (s - i / (3 * s)) + kappa * (j - 1) * t * t,
          2 * p * scale * (t - i / (3 * t)) + kappa * (j - 1) * s * t};
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

double ShearedBlock::shear_stress() const {
  const double mu = constants_of(material).mu;
  return (law == LargeLaw::split ? 2 * slope(mu, stiffening, gamma * gamma) : mu) * gamma;
}
double ShearedBlock::normal_stress() const {
  const double mu = constants_of(material).mu;
  return law == LargeLaw::split ? -2 * slope(mu, stiffening, gamma * gamma) * gamma * gamma / 3 : 0;
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
