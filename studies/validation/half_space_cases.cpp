// Cases on a half-space: a point force, a flat punch and Hertz' sphere. A quarter of a finite piece is meshed. On the cut
// faces, the point force gets the stress of the closed form; the punch and the sphere get its displacement, because with a
// stress there, equilibrium alone would give their force, however poor the elements. Material: brain, as in the paper, E 3
// kPa, nu 0.45.
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

#include "formats/errors.h"
#include "studies/bodies/bodies.h"
#include "studies/validation/cases.h"
#include "studies/validation/shapes.h"
#include "studies/validation/solved_body.h"

namespace palpate::validation {
namespace {

constexpr double kYoung = 3000, kPoisson = 0.45;
const Material kGel = {kYoung, kPoisson, 0};

int symmetric(const Point& p) {
  return (p[0] == 0 ? 1 : 0) | (p[1] == 0 ? 2 : 0);
}

// The load of the cut faces: the closed form's stress there.
std::vector<double> cut_load(const DiscreteBody& discrete, const Where& cut, const Material& material,
                             const VectorField& displacement) {
  return traction_load(discrete, cut, [&](const Vector3d& x, const Vector3d& outward) {
    return Vector3d(stress_of(material, displacement, x) * outward);
  });
}

// ---- a point force ----

constexpr double kLoad = 0.1, kSide = 0.020,
                 kNear =
                     0.010;  // N; m: side of the box, and of the cube at the force that the field's error leaves out

Matrix3d no_gradient(const Vector3d&) {
  return Matrix3d::Identity();
}

Measured measure_point_force(const Variant& variant, int level) {
  const DiscreteBody discrete =
      discretise_body(held_body(box_mesh({level, level, level}, {kSide, kSide, kSide}), {kGel},
                                [](const Point& p) { return symmetric(p) | (p[2] == kSide ? 4 : 0); }),
                      variant.element);
  const auto exact = [](const Vector3d& x) -> Vector3d {
    return x.norm() == 0 ? Vector3d::Zero() : point_load(kGel, kLoad, x);
  };
  std::vector<double> load(3 * discrete.node_count(), 0.0);
  for (int axis = 0; axis < 3; ++axis) {
    const auto one = cut_load(
        discrete, [axis](const Point& p) { return p[axis] == kSide; }, kGel, exact);
    std::transform(load.begin(), load.end(), one.begin(), load.begin(), std::plus<>());
  }
  load[3 * static_cast<std::size_t>(node_at(discrete, {0, 0, 0})) + 2] += kLoad / 4;
  const Answer answer = solve(discrete, exact, load);
  Measured measured = measured_on(discrete, answer, {});
  for (const double mm : {5, 10, 20}) {
    const Point at = {1e-3 * mm, 0, 0};
    const double sinks = answer.at(static_cast<std::size_t>(node_at(discrete, at)))[2];
    const std::string name = mm == 5 ? "u_z at 5 mm, m" : mm == 10 ? "u_z at 10 mm, m" : "u_z at 20 mm, m";
    measured.quantities.push_back(compared(name, sinks, exact(Vector3d(at.data()))[2]));
  }
  const auto away = [](const Point& p) { return p[0] > kNear || p[1] > kNear || p[2] > kNear; };
  measured.quantities.push_back(error_alone("displacement beyond 10 mm, L2",
                                            field_error(discrete, answer, exact, no_gradient, away).displacement));
  return measured;
}

// ---- indenters ----

bool is_cut(const Point& p, double a) {
  return p[2] > (5 - 1e-9) * a || std::hypot(p[0], p[1]) > (5 - 1e-9) * a;
}

Measured measure_punch(TowardsEdge cells, const Variant& variant, int level) {
  const FlatPunch exact = {0.005, 1e-3, {kYoung, variant.poisson, 0}};
  const double a = exact.radius;
  const auto under = [a](const Point& p) { return p[2] == 0 && std::hypot(p[0], p[1]) < (1 + 1e-9) * a; };
  const auto held = [&](const Point& p) { return is_cut(p, a) ? 7 : symmetric(p) | (under(p) ? 4 : 0); };
  const DiscreteBody discrete =
      discretise_body(held_body(indented_quarter(a, level, cells), {exact.material}, held), variant.element);
  const Answer answer = solve(discrete, [&](const Vector3d& x) -> Vector3d {
    return under({x[0], x[1], x[2]}) ? Vector3d(0, 0, exact.depth) : exact.displacement(x);
  });
  const FieldError off = field_error(
      discrete, answer, [&](const Vector3d& x) { return exact.displacement(x); },
      [&](const Vector3d& x) { return exact.gradient(x); });
  return measured_on(discrete, answer,
                     {compared(kForce, 4 * total_force(discrete, answer, under)[2], exact.force()),
                      error_alone(kGradient, off.gradient)});
}

// The force's error is h^order ln(1 / h)^logarithms; the gradient's error is the square root of that.
Case flat_punch(const char* id, TowardsEdge cells, const char* title, const char* theory, double order, double bound) {
  const double logarithms = cells == TowardsEdge::even ? 0 : 1;
  return {id,
          title,
          "F = 2 E a d / (1 - nu^2) = 37.62 mN (a 5 mm, d 1 mm, E 3 kPa, nu 0.45)",
          "Boussinesq; Johnson 1985, eq. 3.36",
          theory,
          {{Element::p1, kPoisson, {4, 6, 8, 12}},
           {Element::p1_anp, kPoisson, {4, 6, 8, 12}},
           {Element::p2_p0, kPoisson, {2, 3, 4, 6}}},
          [cells](const Variant& variant, int level) { return measure_punch(cells, variant, level); },
          [order, bound, logarithms](const std::string& quantity, const Variant& variant) {
            const bool quadratic = variant.element == Element::p2_p0;
            // 0.68: the order that h ln(1 / h)^1/2 shows between 4 and 6 cells.
            if (quantity == kGradient && quadratic && logarithms > 0)
              return Expectation{.order = Expectation::Order{0.68, 1}};
            if (quantity == kGradient)
              return Expectation{.order = Expectation::Order{order / 2, order / 2}, .logarithms = logarithms / 2};
            if (quadratic) return Expectation{0.02};
            return Expectation{bound, Expectation::Order{order, order}, logarithms};
          }};
}

// Finds the vertices of the top that touch the sphere. Each round releases the vertices that the sphere would pull, and adds
// those that have entered the sphere, until a round changes none.
class HertzContact {
 public:
  HertzContact(const HertzSphere& exact, DiscreteBody discrete) : exact_(exact), discrete_(std::move(discrete)) {
    held_ = discrete_.discretisation.fixed;
    for (const auto& p : discrete_.body.nodes) touches_.push_back(candidate(p) && gap(p) > 0);
  }

  Answer find() {
    double seconds = 0;
    for (int round = 0; round < 40; ++round) {
      hold_touching();
      Answer answer = solve(discrete_, [this](const Vector3d& x) -> Vector3d {
        const Point p = {x[0], x[1], x[2]};
        return candidate(p) ? Vector3d(0, 0, gap(p)) : exact_.displacement(x);
      });
      seconds += answer.seconds;
      answer.seconds = seconds;
      if (!exchange(answer)) return answer;
    }
    throw OperationError("the contact of a sphere did not settle in 40 rounds");
  }

  const DiscreteBody& discrete() const { return discrete_; }

  // int phi p dA for the linear hat function phi of each vertex of the top under the sphere, towards +z, N. The force on a
  // vertex of a quadratic mesh itself may be negative under a positive pressure.
  std::vector<double> hat_forces(const Answer& answer) const {
    std::vector<double> force(discrete_.body.nodes.size(), 0.0);
    for (std::size_t n = 0; n < force.size(); ++n)
      if (candidate(discrete_.body.nodes[n])) force[n] = answer.force[3 * n + 2];
    std::vector<char> added(discrete_.node_count(), 0);
    for (const auto& t : discrete_.triangles)
      for (std::size_t i = 3; i < t.size(); ++i)
        if (candidate(discrete_.discretisation.coordinates[t[i]]) && !std::exchange(added[t[i]], 1))
          for (const auto end : {t[i - 3], t[(i - 2) % 3]}) force[end] += answer.force[3 * t[i] + 2] / 2;
    return force;
  }

 private:
  double gap(const Point& p) const { return exact_.depth - (p[0] * p[0] + p[1] * p[1]) / (2 * exact_.radius); }
  bool candidate(const Point& p) const { return p[2] == 0 && std::hypot(p[0], p[1]) < 2 * exact_.contact_radius(); }

  // The middle of an edge touches if both ends touch.
  void hold_touching() {
    auto& fixed = discrete_.discretisation.fixed;
    fixed = held_;
    for (std::size_t n = 0; n < touches_.size(); ++n) fixed[n][2] |= static_cast<std::uint8_t>(touches_[n]);
    for (const auto& t : discrete_.triangles)
      for (std::size_t i = 3; i < t.size(); ++i)
        fixed[t[i]][2] |= static_cast<std::uint8_t>(touches_[t[i - 3]] && touches_[t[(i - 2) % 3]]);
  }

  bool exchange(const Answer& answer) {
    const auto force = hat_forces(answer);
    bool any = false;
    for (std::size_t n = 0; n < touches_.size(); ++n) {
      const Point& p = discrete_.body.nodes[n];
      if (!candidate(p)) continue;
      const bool now = touches_[n] ? force[n] > 0 : answer.u[3 * n + 2] < gap(p);
      any |= now != static_cast<bool>(touches_[n]);
      touches_[n] = now;
    }
    return any;
  }

  const HertzSphere& exact_;
  DiscreteBody discrete_;
  std::vector<std::array<std::uint8_t, 3>> held_;
  std::vector<char> touches_;  // [vertices]
};

Measured measure_hertz(const Variant& variant, int level) {
  const HertzSphere exact = {0.0127, 1e-3, kGel};
  // On every mesh the contact's edge lies midway between two rings of vertices. Otherwise its position between the rings
  // would decide the measured order.
  const double ring = exact.contact_radius() * level / (level - 0.5);
  const auto held = [&](const Point& p) { return is_cut(p, ring) ? 7 : symmetric(p); };
  HertzContact contact(exact, discretise_body(held_body(indented_quarter(ring, level, TowardsEdge::even), {kGel}, held),
                                              variant.element));
  const Answer answer = contact.find();
  double force = 0, moment = 0;
  const auto hats = contact.hat_forces(answer);
  for (std::size_t n = 0; n < hats.size(); ++n) {
    const Point& p = contact.discrete().body.nodes[n];
    force += 4 * hats[n], moment += 4 * hats[n] * std::hypot(p[0], p[1]);
  }
  // Under Hertz' pressure the mean distance of the force from the axis is 3 pi / 16 of the contact radius.
  const double radius = moment / force * 16 / (3 * std::numbers::pi);
  return measured_on(
      contact.discrete(), answer,
      {compared(kForce, force, exact.force()), compared("contact radius, m", radius, exact.contact_radius())});
}

}  // namespace

Case point_force() {
  return {"point-force",
          "Point force on a half-space",
          "u_z = P (1 - nu^2) / (pi E r): 1.692, 0.846, 0.423 mm at 5, 10, 20 mm (0.1 N, E 3 kPa, nu 0.45)",
          "Boussinesq; Johnson 1985, eq. 3.18",
          "singular: u is proportional to 1 / r, and its energy is infinite. Over the whole body the order is 1/2 at "
          "best (Casas 1985). Away from the force the error is h^2 ln(1/h) (Koeppl and Wohlmuth 2014); the logarithm "
          "is divided out of the stated order, except for p2-p0, whose error may have it or not",
          {{Element::p1, kPoisson, {8, 12, 16, 24, 32}},
           {Element::p1_anp, kPoisson, {8, 12, 16, 20}},
           {Element::p2_p0, kPoisson, {4, 8, 12, 16}}},
          measure_point_force,
          [](const std::string& quantity, const Variant& variant) {
            const bool locks_a_little = variant.element == Element::p1, quadratic = variant.element == Element::p2_p0;
            if (!quantity.starts_with("displacement")) return Expectation{0.03};
            // 1.62: the order that h^2 ln(1 / h) shows between 12 and 16 cells.
            if (quadratic) return Expectation{0.01, Expectation::Order{1.62, 2}};
            return Expectation{locks_a_little ? 0.02 : 0.01, Expectation::Order{2, 2}, 1};
          }};
}

Case flat_punch_even() {
  return flat_punch("flat-punch-even", TowardsEdge::even, "Rigid flat punch, even cells",
                    "singular: near the edge the pressure is proportional to the distance to the power -1/2. Every "
                    "element then has order 1/2 in the gradient and 1 in the force, whose error is that of the energy "
                    "(Grisvard 1985; Strang and Fix 1973, chapter 8). With p2-p0, force errors of opposite sign "
                    "cancel, below 2 % on every mesh here: a bound is checked, no order",
                    1, 0.15);
}

Case flat_punch_squared() {
  return flat_punch(
      "flat-punch", TowardsEdge::squared, "Rigid flat punch, cells squared towards its edge",
      "singular, as with even cells. Cells whose size is proportional to the root of the distance from the edge "
      "restore the error h^2 ln(1/h) of the force and its square root for the gradient (Apel 1999, chapter 4). The "
      "logarithm is divided out of the stated orders; the force of p2-p0 has a bound only, as with even cells",
      2, 0.03);
}

Case hertz_contact() {
  return {
      "hertz",
      "Sphere pressed into a half-space",
      "F = 4/3 E* sqrt(R) d^1.5 = 17.87 mN, contact radius sqrt(R d) = 3.564 mm (R 12.7 mm, d 1 mm, E 3 kPa, nu 0.45)",
      "Hertz; Johnson 1985, eq. 4.22 to 4.24",
      "near the edge the pressure is proportional to the root of the distance. The order of the force lies between 3/2 "
      "(duality with the singular solution of the punch on even cells) and 2 (the contact's edge is known to half a "
      "cell, and the force is stationary with respect to it)",
      {{Element::p1, kPoisson, {4, 6, 8, 10}},
       {Element::p1_anp, kPoisson, {4, 6, 8}},
       {Element::p2_p0, kPoisson, {3, 4, 5}}},
      measure_hertz,
      [](const std::string& quantity, const Variant&) {
        return quantity == kForce ? Expectation{0.05, Expectation::Order{1.5, 2}} : Expectation{0.05};
      }};
}

}  // namespace palpate::validation
