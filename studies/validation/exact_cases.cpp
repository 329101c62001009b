// Cases that every element solves exactly, to rounding: affine fields, rigid motions, a cylinder between plates.
#include <cmath>
#include <numbers>

#include "studies/bodies/bodies.h"
#include "studies/validation/cases.h"
#include "studies/validation/rigid_motion.h"
#include "studies/validation/shapes.h"
#include "studies/validation/solved_body.h"

namespace palpate::validation {
namespace {

std::vector<Variant> every_element(std::initializer_list<double> poissons, const std::vector<int>& levels) {
  std::vector<Variant> variants;
  for (const auto element : {Element::p1, Element::p1_anp, Element::p2_p0})
    for (const double poisson : poissons) variants.push_back({element, poisson, levels});
  return variants;
}

DiscreteBody distorted_box(const Variant& variant, int level) {
  return discretise_body(
      held_body(box_mesh({level, level, level}, {1, 1, 1}, 0.2), {{5400, variant.poisson, 0}}, faces_of_unit_cube),
      variant.element);
}

Measured measure_patch(const Variant& variant, int level) {
  const DiscreteBody discrete = distorted_box(variant, level);
  Matrix3d slope;
  slope << 0.3, -0.2, 0.05, 0.15, 0.25, -0.1, -0.35, 0.1, 0.45;
  const auto affine = [&](const Vector3d& x) { return Vector3d(Vector3d(0.1, -0.4, 0.2) + slope * x); };
  const Answer answer = solve(discrete, affine);
  double worst = 0, largest = 0;
  for (std::size_t n = 0; n < discrete.node_count(); ++n) {
    const Vector3d exact = affine(Vector3d(discrete.discretisation.coordinates[n].data()));
    worst = std::max(worst, (answer.at(n) - exact).norm());
    largest = std::max(largest, exact.norm());
  }
  return measured_on(discrete, answer, {error_alone("displacement, largest", worst / largest)});
}

Measured measure_rigid(const Variant& variant, int level) {
  const DiscreteBody discrete = distorted_box(variant, level);
  return measured_on(discrete, {}, {error_alone("force, largest", rigid_motion_residual(discrete.discretisation))});
}

constexpr double kRound = std::numbers::pi * 0.015 * 0.015;  // m^2

Measured measure_cylinder(const Variant& variant, int level) {
  const PressedCylinder exact = {0.015, 0.013, 1e-3, {3000, variant.poisson, 0}};
  const auto on_top = [&](const Point& p) { return std::abs(p[2] - exact.height) < 1e-9 * exact.height; };
  const auto held = [&](const Point& p) {
    if (p[2] == 0 && p[0] == 0 && p[1] == 0) return 7;
    if (p[2] == 0 && p[1] == 0 && p[0] == exact.radius) return 6;  // prevents rotation about the axis
    return p[2] == 0 || on_top(p) ? 4 : 0;
  };
  const DiscreteBody discrete = discretise_body(
      held_body(cylinder_mesh(exact.radius, exact.height, level, level), {exact.material}, held), variant.element);
  const auto field = [&](const Vector3d& x) { return exact.displacement(x); };
  const Answer answer = solve(discrete, field);
  const double force = -total_force(discrete, answer, on_top)[2], meshed = exact.force(surface_area(discrete, on_top));
  const double widest = answer.at(static_cast<std::size_t>(node_at(discrete, {exact.radius, 0, 0})))[0];
  const double wide = exact.displacement({exact.radius, 0, 0})[0], round = exact.force(kRound);
  return measured_on(discrete, answer,
                     {compared("force, over the meshed area, N", force, meshed), compared("widening, m", widest, wide),
                      compared(kForce, force, round)});
}

}  // namespace

Case patch_test() {
  return {"patch-test",
          "Patch test",
          "any affine displacement of a distorted cube",
          "Irons and Razzaque 1972",
          "exact on every mesh: no order",
          every_element({0.3, 0.4999}, {4, 8}),
          measure_patch,
          [](const std::string&, const Variant&) { return Expectation{1e-9}; }};
}

Case rigid_motion() {
  return {"rigid-motion",
          "Rigid motion",
          "K u = 0 for three translations and three rotations",
          "no strain",
          "exact on every mesh: no order",
          every_element({0.3, 0.4999}, {4, 8}),
          measure_rigid,
          [](const std::string&, const Variant&) { return Expectation{1e-13}; }};
}

Case pressed_cylinder() {
  return {"pressed-cylinder",
          "Cylinder of brain between plates",
          "F = E A x / h = 0.1631 N, d_r = nu r x / h = 0.5192 mm (30 x 13 mm, E 3 kPa, nu 0.45, 1 mm)",
          "uniform stress; Cotin, Delingette and Ayache 1999, section 6.1",
          "the displacement is affine, and every element has it exactly; the force has the error of the meshed area: "
          "order 2 for a polygon, 4 for quadratic arcs (Ciarlet 1978, sections 4.3 and 4.4). The curved sides of p2-p0 "
          "bulge between the layers, so that its displacement is affine only to order 4",
          {{Element::p1, 0.45, {4, 6, 8, 12}},
           {Element::p1_anp, 0.45, {4, 6, 8, 12}},
           {Element::p2_p0, 0.45, {2, 4, 6, 8}}},
          measure_cylinder,
          [](const std::string& quantity, const Variant& variant) {
            const bool arcs = variant.element == Element::p2_p0;
            if (quantity == kForce)
              return Expectation{0.01, arcs ? Expectation::Order{4, 4} : Expectation::Order{2, 2}};
            return Expectation{arcs ? 5e-5 : 1e-6};
          }};
}

}  // namespace palpate::validation
