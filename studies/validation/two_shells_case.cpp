// Two concentric hollow half-spheres under a frictionless plate: hyperelastic bodies of a world that slide on one another.
#include <fmt/format.h>

#include <cmath>

#include "studies/bodies/box_mesh.h"
#include "studies/validation/baked_body.h"
#include "studies/validation/cases.h"
#include "studies/validation/pressed_bodies.h"
#include "studies/validation/shapes.h"

namespace palpate::validation {
namespace {

constexpr double kRadii[3] = {0.010, 0.012, 0.014}, kYoung = 1e6, kDeepest = 5e-3;  // m, Pa, m
constexpr double kGap = 1e-5;                                                       // m, below the plate at first
constexpr double kPlateYoung = 1e10;  // Pa: ten thousand times that of the shells
constexpr int kStepsOfMillimetre = 20, kRestSteps = 10;

// The force on the quarter at a depth, N: the least and the most of four codes.
struct Published {
  int depth;  // mm
  double least, most;

  double middle() const { return (least + most) / 2; }
  double bound() const { return (most - least) / (most + least); }
};
constexpr Published kPublished[] = {{2, 0.66, 0.80}, {3, 1.07, 1.27}, {4, 1.64, 1.82}, {5, 2.24, 2.44}};
// At 5 mm the outer shell is near the load at which it gives way: p1-ang at rest is there within 1 % of the least of the four codes, below it
// on some meshes, and p1-anp is above the most of them on every mesh. The bound leaves the mesh 2 % there.
constexpr int kNearlyBuckled = 5;
constexpr double kMeshLeaves = 0.02;

std::string named(const char* form, int depth) {
  return fmt::format("{}: force at {} mm, N", form, depth);
}

struct Form {
  const char* name;
  palpate_deformation_model deformation;
};
constexpr Form kForms[] = {{"large", PALPATE_DEFORMATION_LARGE},
                           {"large beside", PALPATE_DEFORMATION_LARGE_BESIDE},
                           {"linear", PALPATE_DEFORMATION_LINEAR}};

// Selects the nodes of the plane through the origin across an axis.
std::string plane_across(int axis) {
  Eigen::Vector3d half = Eigen::Vector3d::Ones();
  half[axis] = 1e-8;
  return fmt::format("{{ box = {{ min = [{0}, {1}, {2}], max = [{3}, {4}, {5}] }} }}", -half[0], -half[1], -half[2],
                     half[0], half[1], half[2]);
}

std::filesystem::path bake_shell(const Workshop& workshop, const Variant& variant, int k, int cells) {
  BodyToBake body = {fmt::format("shell-{}", k),
                     shell_octant(kRadii[k], kRadii[k + 1], cells, cells / 2),
                     kYoung,
                     variant.poisson,
                     variant.element,
                     ""};
  for (int axis = 0; axis < 3; ++axis)
    body.boundary += fmt::format("[[fixed]]\ndofs = \"{}\"\nselect = {}\n", "xyz"[axis], plane_across(axis));
  // The inner shell touches with its outside alone.
  if (k == 0)
    body.boundary +=
        fmt::format("[touchable]\nselect = {{ not = {{ sphere = {{ center = [0, 0, 0], radius = {} }} }} }}\n",
                    (kRadii[0] + kRadii[1]) / 2);
  body.large = true;
  return bake(workshop, body);
}

std::filesystem::path bake_plate(const Workshop& workshop) {
  constexpr double side = 0.014, thick = 0.004;
  BodyToBake body = {"plate", box_mesh({7, 7, 2}, {side, side, thick}), kPlateYoung, 0.3, Element::p1, ""};
  body.mesh.region_names = {"plate"};
  body.boundary = "[[fixed]]\ndofs = \"xyz\"\nselect = { patch = \"z1\" }\n[touchable]\nselect = { patch = \"z0\" }\n";
  return bake(workshop, body);
}

Measured measure_shells(const Workshop& workshop, const Variant& variant, int level) {
  const auto plate = bake_plate(workshop);
  // Other vertices on both sides of the surface between the shells.
  const std::filesystem::path shells[2] = {bake_shell(workshop, variant, 0, level),
                                           bake_shell(workshop, variant, 1, level + 1)};
  Measured measured;
  for (const Form& form : kForms) {
    Pressing pressing;
    pressing.bodies = {{shells[0], form.deformation}, {shells[1], form.deformation}, {plate}};
    pressing.last = [](double share) {
      palpate_pose pose = palpate_default_pose();
      pose.position[2] = kRadii[2] - share * kDeepest + (1 - share) * kGap;
      return pose;
    };
    pressing.steps = static_cast<int>(std::lround(1e3 * kDeepest)) * kStepsOfMillimetre;
    pressing.rest_steps = kRestSteps;
    // Near the load at which it gives way, a shell is still on its way after the last step, and says so (DEFORMATION_BEHIND).
    pressing.refuses_flags = false;
    std::vector<double> forces(static_cast<std::size_t>(pressing.steps) + 1);
    pressing.each_step = [&](double share, const Eigen::Vector3d& force) {
      forces[static_cast<std::size_t>(std::lround(share * pressing.steps))] = force.z();
    };
    const PressedAnswer answer = press(pressing);
    for (const Published& published : kPublished)
      measured.quantities.push_back(compared(named(form.name, published.depth),
                                             forces[static_cast<std::size_t>(published.depth * kStepsOfMillimetre)],
                                             published.middle()));
    measured.solve_seconds += answer.seconds;
    measured.vertices = answer.u[0].size() + answer.u[1].size();
  }
  measured.unknowns = 3 * measured.vertices;
  return measured;
}

}  // namespace

Case two_shells(const Workshop& workshop) {
  return {"two-shells",
          "Large strain: two concentric half-spheres under a plate",
          "four codes: 0.66 to 0.80 N on the quarter at 2 mm, 1.07 to 1.27 at 3, 1.64 to 1.82 at 4, 2.24 to 2.44 at 5 "
          "(radii 10, 12, 14 mm, E 1 MPa, nu 0.3, no friction)",
          "Puso and Laursen 2004; Areias et al. 2015; Zimmerman and Ateshian 2018; Abaqus; read off by solids4foam. "
          "Theirs: the middle of the four",
          "the four codes differ by 8 to 20 %: the bound is their spread, and no order is checked",
          {{Element::p1_anp, 0.3, {8, 12}}, {Element::p1_ang, 0.3, {8, 12}}},
          [=](const Variant& variant, int level) { return measure_shells(workshop, variant, level); },
          [](const std::string& quantity, const Variant& variant) {
            Expectation expected;
            // On the way the touch is a solution ahead of a body beside it, which makes it stiffer: that one is judged at rest.
            for (const Published& published : kPublished)
              if (quantity == named("large", published.depth) ||
                  (quantity == named("large beside", published.depth) && published.depth == kNearlyBuckled))
                expected.bound = published.bound() + (published.depth == kNearlyBuckled ? kMeshLeaves : 0);
            expected.locks = variant.element == Element::p1_anp;
            return expected;
          }};
}

}  // namespace palpate::validation
