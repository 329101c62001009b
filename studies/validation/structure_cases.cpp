// A cantilever and NAFEMS' elliptic plate.
#include <cmath>

#include "studies/bodies/bodies.h"
#include "studies/validation/cases.h"
#include "studies/validation/shapes.h"
#include "studies/validation/solved_body.h"

namespace palpate::validation {
namespace {

constexpr const char *kTip = "tip, m", *kStress = "sigma_yy at D, Pa", *kCookCorner = "corner up, m";

Measured measure_cantilever(const Variant& variant, int level) {
  const Cantilever exact = {10, 1, 0.1, {1000, variant.poisson, 0}};
  const DiscreteBody discrete =
      discretise_body(held_body(box_mesh({10 * level, level, level}, {10, 1, 1}), {exact.material},
                                [](const Point& p) { return p[0] == 0 ? 7 : 0; }),
                      variant.element);
  const auto load = traction_load(
      discrete, [](const Point& p) { return p[0] == 10; },
      [&](const Vector3d&, const Vector3d&) { return Vector3d(0, 0, exact.force); });
  const Answer answer = solve(discrete, load);
  double work = 0;  // of the load: force times the mean deflection of the loaded end
  for (std::size_t i = 0; i < load.size(); ++i) work += answer.u[i] * load[i];
  const double tip = work / exact.force;
  return measured_on(discrete, answer, {compared(kTip, tip, exact.tip())});
}

Measured measure_le10(const Variant& variant, int level) {
  const auto outer = [](const Point& p) { return std::pow(p[0] / 3.25, 2) + std::pow(p[1] / 2.75, 2) > 1 - 1e-9; };
  const auto held = [&](const Point& p) {
    const bool middle = std::abs(p[2] - kPlateThickness / 2) < 1e-9;
    return (p[0] == 0 ? 1 : 0) | (p[1] == 0 ? 2 : 0) | (outer(p) ? (middle ? 7 : 3) : 0);
  };
  const DiscreteBody discrete =
      discretise_body(held_body(elliptic_plate(level), {{210e9, variant.poisson, 0}}, held), variant.element);
  const auto load = traction_load(
      discrete, [](const Point& p) { return p[2] == kPlateThickness; },
      [](const Vector3d&, const Vector3d& outward) { return Vector3d(-1e6 * outward); });
  const Answer answer = solve(discrete, load);
  const std::int32_t d = node_at(discrete, {2, 0, kPlateThickness});
  const double stress = recovered_stress(discrete, answer, d)(1, 1);
  return measured_on(discrete, answer, {compared(kStress, stress, kLe10Stress)});
}

Measured measure_cook(const Variant& variant, int level) {
  constexpr double published = 32.27e-3;
  const CookMembrane cook = cook_membrane_under(6.25e6, {70e6, variant.poisson, 0}, variant.element, level);
  const Answer answer = solve(cook.discrete, cook.load);
  return measured_on(cook.discrete, answer, {compared(kCookCorner, cook.rise(answer, 0.060), published)});
}

}  // namespace

CookMembrane cook_membrane_under(double traction, const Material& material, Element element, int level) {
  CookMembrane cook = {
      discretise_body(held_body(cook_membrane(level), {material}, [](const Point& p) { return p[0] == 0 ? 7 : 4; }),
                      element),
      {}};
  cook.load = traction_load(
      cook.discrete, [](const Point& p) { return p[0] > 0.048 - 1e-9; },
      [&](const Vector3d&, const Vector3d&) { return Vector3d(0, traction, 0); });
  return cook;
}

double CookMembrane::rise(const Answer& answer, double height) const {
  return answer.at(static_cast<std::size_t>(node_at(discrete, {0.048, height, 0})))[1];
}

Case cantilever() {
  return {
      "cantilever",
      "Cantilever under a force at its end",
      "P L^3 / (3 E I) + P L / (k G A) = 0.4031 (10 x 1 x 1, E 1000, nu 0.3, P 0.1)",
      "Timoshenko; k of Cowper 1966",
      "2 on coarse meshes, 1.42 on fine ones: at the clamped edges u is proportional to the distance to the power "
      "0.711 (Williams 1952, clamped and free sides at right angles), and the error of the tip's deflection is that of "
      "the energy. Timoshenko's beam does not solve the equations of elasticity, so no order is checked where the "
      "error is below 1 %",
      {{Element::p1, 0.3, {2, 4, 6, 8}}, {Element::p1_anp, 0.3, {2, 4, 6, 8}}, {Element::p2_p0, 0.3, {2, 3, 4}}},
      measure_cantilever,
      [](const std::string&, const Variant& variant) {
        return variant.element == Element::p2_p0 ? Expectation{0.01} : Expectation{0.1, Expectation::Order{1.42, 2}};
      }};
}

Case elliptic_plate_le10() {
  return {
      "le10",
      "Thick elliptic plate under pressure",
      "sigma_yy at D = -5.38 MPa (NAFEMS LE10)",
      "The Standard NAFEMS Benchmarks 1990",
      "the reference value has three digits: a bound is checked, no order",
      {{Element::p1, 0.3, {4, 6, 8, 12}}, {Element::p1_anp, 0.3, {4, 6, 8, 12}}, {Element::p2_p0, 0.3, {2, 4, 6, 8}}},
      measure_le10,
      [](const std::string&, const Variant& variant) {
        return Expectation{variant.element == Element::p2_p0 ? 0.01 : 0.06};
      }};
}

Case cook_linear() {
  constexpr double poisson = 1.0 / 3;
  return {"cook",
          "Cook's membrane",
          "the upper corner of the loaded edge moves up by 32.27 mm (E 70 MPa, shear traction 6.25 MPa, plane strain)",
          "CoFEA, benchmark 002: CalculiX 32.27 mm, Code_Aster 32.20, Elmer 32.28, quadratic tetrahedra on their "
          "finest mesh",
          "three programs differ by 0.25 %: a bound is checked, no order",
          {{Element::p1, poisson, {8, 16, 32, 64}},
           {Element::p1_anp, poisson, {8, 16, 32, 64}},
           {Element::p2_p0, poisson, {4, 8, 16, 32}}},
          measure_cook,
          [](const std::string&, const Variant& variant) {
            return Expectation{variant.element == Element::p1 ? 0.02 : 0.01};
          }};
}

}  // namespace palpate::validation
