// Hertz' pair of spheres: two baked quarters of bodies, whose tops are parts of spheres, pressed on one another by the runtime.
// On the faces that cut them out of half-spaces they move as the closed form says; both are otherwise free.
#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "studies/validation/baked_body.h"
#include "studies/validation/cases.h"
#include "studies/validation/closed_forms.h"
#include "studies/validation/pressed_bodies.h"
#include "studies/validation/shapes.h"

namespace palpate::validation {
namespace {

constexpr double kRadius = 0.005;  // m, of the contact: the bodies are 25 mm wide and deep
// Tools and other bodies touch the top as far as so many radii of the contact.
constexpr double kTouchable = 1.6;
// Between the bodies at first, in approaches.
constexpr double kGap = 0.1;
// The faces that cut the quarter out of a half-space.
const char* const kCut = "[{ patch = \"x1\" }, { patch = \"y1\" }, { patch = \"z1\" }]";

struct Sphere {
  double radius;  // m
  Material material;
};
struct Spheres {
  Sphere first, second;
  palpate_deformation_model deformation = PALPATE_DEFORMATION_LINEAR;

  double curvature() const { return 1 / first.radius + 1 / second.radius; }
  double compliance() const { return 1 / plane_modulus(first.material) + 1 / plane_modulus(second.material); }
  double approach() const { return kRadius * kRadius * curvature(); }
  double force() const { return 4.0 / 3 * kRadius * approach() / compliance(); }
  // Of one body: it has the displacement of a half-space into which a rigid sphere is pressed by this body's part of the approach.
  HertzSphere half_space(const Sphere& of) const {
    const double depth = approach() / (plane_modulus(of.material) * compliance());
    return {kRadius * kRadius / depth, depth, of.material};
  }
};

// The material is at z > 0; the top bends away from z = 0, by less and less with depth.
TetrahedralMesh quarter_of(const Sphere& sphere, double ring, int cells) {
  TetrahedralMesh mesh = indented_quarter(ring, cells, TowardsEdge::even);
  mesh.region_names = {"gel"};
  const double deep = 5 * ring;
  for (auto& p : mesh.nodes) p[2] += (1 - p[2] / deep) * (p[0] * p[0] + p[1] * p[1]) / (2 * sphere.radius);
  return mesh;
}

// How the faces that are cut out move, as rows of a motion.
std::string far_field(const TetrahedralMesh& mesh, const HertzSphere& exact) {
  std::string rows;
  for (const auto& patch : mesh.patches) {
    if (patch.name != "x1" && patch.name != "y1" && patch.name != "z1") continue;
    for (const auto& triangle : patch.triangles)
      for (const auto n : triangle) {
        const auto& p = mesh.nodes[static_cast<std::size_t>(n)];
        const Vector3d u = exact.displacement(Vector3d(p.data()));
        rows += fmt::format("{:.12g},{:.12g},{:.12g},{:.12g},{:.12g},{:.12g}\n", p[0], p[1], p[2], u[0], u[1], u[2]);
      }
  }
  return rows;
}

std::filesystem::path bake_quarter(const Workshop& workshop, const std::string& name, const Variant& variant,
                                   const Spheres& spheres, const Sphere& of, double ring, int cells) {
  BodyToBake body = {name, quarter_of(of, ring, cells), of.material.young, of.material.poisson, variant.element, ""};
  body.boundary = fmt::format(
      "[[fixed]]\ndofs = \"xyz\"\nselect = {}\n"
      "[[fixed]]\ndofs = \"x\"\nselect = {{ patch = \"x0\" }}\n[[fixed]]\ndofs = \"y\"\nselect = {{ patch = \"y0\" }}\n"
      "[touchable]\nselect = {{ and = [{{ patch = \"z0\" }}, {{ sphere = {{ center = [0, 0, 0], radius = {} }} }}] "
      "}}\n",
      kCut, kTouchable * kRadius);
  body.moving = kCut;
  body.large = spheres.deformation != PALPATE_DEFORMATION_LINEAR;
  body.motion = far_field(body.mesh, spheres.half_space(of));
  return bake(workshop, body);
}

// The second body is turned about x = y, which exchanges x and y and keeps both in the same quarter.
palpate_pose turned_over(double z) {
  palpate_pose pose = palpate_default_pose();
  pose.position[2] = z;
  const double half = std::numbers::sqrt2 / 2;
  pose.orientation[0] = 0, pose.orientation[1] = half, pose.orientation[2] = half, pose.orientation[3] = 0;
  return pose;
}

Measured measure_spheres(const Workshop& workshop, const std::string& id, const Spheres& spheres,
                         const Variant& variant, int level) {
  // As for the rigid sphere (half_space_cases.cpp): the contact's edge lies midway between two rings of vertices. The second body has
  // one cell less to the same ring, so that its vertices lie elsewhere, and the first one's carry the contact.
  const double ring = kRadius * level / (level - 0.5), approach = spheres.approach();
  Pressing pressing;
  const Sphere* const each[2] = {&spheres.first, &spheres.second};
  for (int k = 0; k < 2; ++k)
    pressing.bodies.push_back(
        {bake_quarter(workshop, fmt::format("{}-{}", id, k), variant, spheres, *each[k], ring, level - k),
         spheres.deformation});
  pressing.last = [=](double share) { return turned_over(approach * (share - kGap * (1 - share))); };
  const PressedAnswer answer = press(pressing);
  double force = 0, moment = 0;
  for (const auto& touch : answer.touches)
    force += 4 * touch.force, moment += 4 * touch.force * std::hypot(touch.place.x(), touch.place.y());
  Measured measured;
  for (const auto& u : answer.u) measured.vertices += u.size();
  measured.unknowns = 3 * measured.vertices, measured.solve_seconds = answer.seconds;
  // Under Hertz' pressure the mean distance of the force from the axis is 3 pi / 16 of the contact radius.
  measured.quantities = {compared(kForce, force, spheres.force()),
                         compared("contact radius, m", moment / force * 16 / (3 * std::numbers::pi), kRadius)};
  return measured;
}

Case spheres_case(const Workshop& workshop, const char* id, const char* title, const char* closed_form,
                  const Spheres& spheres) {
  const double poisson = spheres.first.material.poisson;
  const bool large = spheres.deformation != PALPATE_DEFORMATION_LINEAR;
  std::vector<Variant> variants = {{Element::p1, poisson, {4, 6, 8, 10}}, {Element::p1_anp, poisson, {4, 6, 8, 10}}};
  if (large) variants = {{Element::p1_anp, poisson, {4, 6}}};
  return {id,
          title,
          closed_form,
          "Hertz; Johnson 1985, eq. 4.22 to 4.24",
          "as for the sphere on a half-space; here places of one body's vertices on the other body's triangles come to "
          "it, so that no order is known",
          variants,
          [=](const Variant& variant, int level) { return measure_spheres(workshop, id, spheres, variant, level); },
          [=](const std::string&, const Variant&) { return Expectation{large ? 0.03 : 0.05}; }};
}

}  // namespace

Case equal_spheres(const Workshop& workshop) {
  return spheres_case(workshop, "spheres-equal", "Two equal spheres",
                      "F = 4/3 E* sqrt(R) d^1.5, a = sqrt(R d) = 5 mm (radii 500 mm, E 3 kPa, nu 0.45)",
                      {{0.5, {3000, 0.45, 0}}, {0.5, {3000, 0.45, 0}}});
}

Case sphere_on_block(const Workshop& workshop) {
  return spheres_case(
      workshop, "sphere-on-block", "A sphere pressed into a block, hyperelastic bodies of a world",
      "F = 4/3 E* sqrt(R) d^1.5, a = sqrt(R d) = 5 mm (radius 500 mm, E 9 kPa; the block 3 kPa; nu 0.45)",
      {{0.5, {9000, 0.45, 0}}, {std::numeric_limits<double>::infinity(), {3000, 0.45, 0}}, PALPATE_DEFORMATION_LARGE});
}

Case unequal_spheres(const Workshop& workshop) {
  return spheres_case(workshop, "spheres-unequal", "Two spheres of other radii and materials",
                      "F = 4/3 E* sqrt(R) d^1.5, a = sqrt(R d) = 5 mm (radii 300 and 900 mm, E 3 and 9 kPa, nu 0.3)",
                      {{0.3, {3000, 0.3, 0}}, {0.9, {9000, 0.3, 0}}});
}

}  // namespace palpate::validation
