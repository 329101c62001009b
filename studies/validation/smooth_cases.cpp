// Cases with a smooth solution: a manufactured one, and Lame's thick sphere.
#include <cmath>

#include "studies/bodies/bodies.h"
#include "studies/validation/cases.h"
#include "studies/validation/manufactured.h"
#include "studies/validation/shapes.h"
#include "studies/validation/solved_body.h"

namespace palpate::validation {
namespace {

std::vector<Quantity> field_quantities(const FieldError& error) {
  return {error_alone(kDisplacement, error.displacement), error_alone(kGradient, error.gradient)};
}

Measured measure_manufactured(double pressure, const Variant& variant, int level) {
  const Material material = {1, variant.poisson, 0};
  const Manufactured exact(material, pressure);
  const DiscreteBody discrete = discretise_body(
      held_body(box_mesh({level, level, level}, {1, 1, 1}), {material}, faces_of_unit_cube), variant.element);
  const auto displacement = [&](const Vector3d& x) { return exact.displacement(x); };
  const Answer answer =
      solve(discrete, displacement, body_load(discrete, [&](const Vector3d& x) { return exact.force(x); }));
  return measured_on(discrete, answer,
                     field_quantities(field_error(discrete, answer, displacement,
                                                  [&](const Vector3d& x) { return exact.gradient(x); })));
}

Measured measure_sphere(const Variant& variant, int level) {
  const ThickSphere exact = {1, 2, 1, {1000, variant.poisson, 0}};
  const DiscreteBody discrete = discretise_body(
      held_body(shell_octant(exact.inner, exact.outer, level), {exact.material}, across_symmetry_planes),
      variant.element);
  const auto at_radius = [](double r) {
    return [r](const Point& p) { return std::abs(std::hypot(p[0], p[1], p[2]) - r) < 1e-9; };
  };
  const auto load = traction_load(discrete, at_radius(exact.inner), [&](const Vector3d&, const Vector3d& outward) {
    return Vector3d(-exact.pressure * outward);
  });
  const Answer answer = solve(discrete, load);
  Measured measured = measured_on(discrete, answer,
                                  field_quantities(field_error(
                                      discrete, answer, [&](const Vector3d& x) { return exact.displacement(x); },
                                      [&](const Vector3d& x) { return exact.gradient(x); })));
  for (const double r : {exact.inner, exact.outer}) {
    double sum = 0, count = 0;
    for (std::size_t n = 0; n < discrete.body.nodes.size(); ++n)
      if (at_radius(r)(discrete.body.nodes[n]))
        sum += answer.at(n).dot(Vector3d(discrete.body.nodes[n].data())) / r, count += 1;
    measured.quantities.push_back(compared(r == exact.inner ? "u(a), m" : "u(b), m", sum / count, exact.radial(r)));
  }
  return measured;
}

// Linear elements: order 2 for the displacement and 1 for its gradient. Quadratic elements: one more if their space contains
// the exact pressure, and between the two for nu close to one half.
Expectation::Order order_of(const std::string& quantity, const Variant& variant, bool has_exact_pressure) {
  const double linear = quantity == kDisplacement ? 2 : 1;
  if (variant.element != Element::p2_p0 || !has_exact_pressure) return {linear, linear};
  return {variant.poisson > 0.499 ? linear : linear + 1, linear + 1};
}

}  // namespace

Case manufactured(double pressure) {
  const bool none = pressure == 0;
  std::vector<Variant> variants = {{Element::p1, 0.3, {8, 12, 18, 24}}};
  for (const double poisson : {0.3, 0.49, 0.4999}) variants.push_back({Element::p1_anp, poisson, {8, 12, 18}});
  for (const double poisson : {0.3, 0.49, 0.4999}) variants.push_back({Element::p2_p0, poisson, {4, 8, 12, 16}});
  if (!none) variants.push_back({Element::p1, 0.4999, {8, 12, 18}});
  return {none ? "manufactured-no-pressure" : "manufactured",
          none ? "Manufactured displacement without pressure" : "Manufactured displacement with pressure",
          none ? "u = (s(x) c(y) s(z), -c(x) s(y) s(z), 0), free of divergence, on the unit box"
               : "the same plus a gradient of pressure that stays of order one as nu -> 1/2",
          "method of manufactured solutions, Roache 2002",
          none ? "linear 2 and 1 (Brenner and Scott 2008, theorems 5.4.4 and 5.4.8; p1-anp: Lamichhane 2009 for the "
                 "pressure on dual cells); p2-p0 3 and 2, because its space contains the exact pressure, zero; at nu "
                 "0.4999 at least 2 and 1, because a quadratic tetrahedron has no bubble functions on its faces, which "
                 "a stable element with one pressure for each cell needs (Diening, Storn and Tscherpel 2021)"
               : "linear 2 and 1; p2-p0 2 and 1 too, because its pressure is constant in each cell (Boffi, Brezzi and "
                 "Fortin 2013, section 8.4)",
          variants,
          [pressure](const Variant& variant, int level) { return measure_manufactured(pressure, variant, level); },
          [none](const std::string& quantity, const Variant& variant) {
            if (variant.element == Element::p1 && variant.poisson > 0.4) return Expectation{.locks = true};
            return Expectation{quantity == kDisplacement ? 0.03 : 0.2, order_of(quantity, variant, none)};
          }};
}

Case thick_sphere() {
  std::vector<Variant> variants;
  for (const double poisson : {0.3, 0.49, 0.4999}) variants.push_back({Element::p1, poisson, {8, 12, 16, 24}});
  for (const double poisson : {0.3, 0.49, 0.4999}) variants.push_back({Element::p1_anp, poisson, {8, 12, 16, 24}});
  for (const double poisson : {0.3, 0.49, 0.4999}) variants.push_back({Element::p2_p0, poisson, {8, 12, 16, 20}});
  return {
      "thick-sphere",
      "Thick sphere under pressure",
      "u = A r + B / r^2; a 1, b 2, p 1, E 1000: u(a) 8.000e-4, u(b) 3.000e-4 at nu 0.3; 8.543e-4, 2.186e-4 at 0.49",
      "Lame; Timoshenko and Goodier 1970, art. 136",
      "linear 2 and 1; p2-p0 3 and 2: the exact pressure is constant, so that its space contains it, and its surface "
      "is curved to second order (Ciarlet 1978, section 4.4); at nu 0.4999 at least 2 and 1, as in the case before",
      variants,
      measure_sphere,
      [](const std::string& quantity, const Variant& variant) {
        const bool quadratic = variant.element == Element::p2_p0;
        if (variant.element == Element::p1 && variant.poisson > 0.4) return Expectation{.locks = true};
        if (quantity != kDisplacement && quantity != kGradient) return Expectation{quadratic ? 1e-3 : 0.01};
        const double bound = quantity == kDisplacement ? 0.01 : 0.1;
        return Expectation{quadratic ? bound / 10 : bound, order_of(quantity, variant, true)};
      }};
}

}  // namespace palpate::validation
