// The tensors against references of others: CalculiX on the same mesh, and the closed form of a pressed cylinder.
#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <numbers>

#include "studies/accuracy/calculix.h"
#include "studies/validation/closed_forms.h"
#include "studies/validation/shapes.h"
#include "studies/validation/tensor_answer.h"
#include "tests/precompute/support.h"

namespace palpate::tests {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using validation::displacement_under;

void expect_agreement_with_calculix(double poisson) {
  TetrahedralMesh mesh = box_mesh({5, 4, 4}, {0.10, 0.08, 0.06}, 0.2);
  mesh.region_names = {"soft", "stiff"};
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) mesh.region[t] = t % 7 == 0;
  ElasticBody body = body_of(mesh, {{5400, poisson, 0}, {60000, 0.3, 0}});
  hold(body, [](const auto& p) { return p[0] == 0 ? 7 : p[2] == 0 ? 4 : 0; });
  const std::int32_t node = body.touchable.back();
  const Vector3d force(0.3, -0.2, 0.5);

  std::vector<double> load(3 * body.nodes.size(), 0.0);
  std::copy(force.begin(), force.end(), load.begin() + 3 * node);
  const auto folder = std::filesystem::temp_directory_path() / fmt::format("palpate_ccx_{}", ::getpid());
  const auto reference =
      accuracy::solve_by_calculix(folder, body, accuracy::linear_model(body, accuracy::elastic_words), load).u;

  const auto tensors = solve_node_tensors(body, Element::p1, std::vector<std::int32_t>{node});
  double largest = 0, worst = 0;
  for (std::size_t n = 0; n < body.nodes.size(); ++n) {
    const Vector3d u = displacement_under(tensors[0], force, static_cast<std::int32_t>(n));
    largest = std::max(largest, u.norm());
    const double difference = (u - Vector3d(reference[n].data())).norm();
    worst = std::isnan(difference) ? difference : std::max(worst, difference);
  }
  // CalculiX prints seven digits of each number.
  EXPECT_LE(worst, 1e-6 * largest);
  EXPECT_GT(largest, 0);
}

TEST(Reference, AgreesWithCalculixOnTheSameMeshOfTwoMaterials) {
  expect_agreement_with_calculix(0.45);
}
TEST(Reference, AgreesWithCalculixNearIncompressibility) {
  expect_agreement_with_calculix(0.499);
}

TEST(Reference, ACompressedCylinderHasItsClosedForm) {
  // A cylinder of 30 mm diameter and 13 mm height, E 3 kPa, nu 0.45, pressed by 1 mm without friction: F = E A x / h and d_r =
  // nu R x / h = 0.5192 mm; stress and strain are uniform.
  const validation::PressedCylinder exact = {0.015, 0.013, 1e-3, {3000, 0.45, 0}};
  const double radius = exact.radius, height = exact.height, pressed = exact.pressed;
  ElasticBody body = body_of(validation::cylinder_mesh(radius, height, 5, 4), {exact.material});
  hold(body, [&](const auto& p) {
    const bool bottom = p[2] == 0;
    if (bottom && p[0] == 0 && p[1] == 0) return 7;
    if (bottom && p[1] == 0 && p[0] == radius) return 6;  // y and z: prevents the rotation about the axis
    return bottom ? 4 : 0;
  });
  std::vector<std::int32_t> top;
  for (std::int32_t n = 0; n < body.surface_count; ++n)
    if (std::abs(body.nodes[n][2] - height) < 1e-12) top.push_back(n);
  const auto tensors = solve_node_tensors(body, Element::p1, top);

  // Only the axial dofs of the top are imposed: W f = u*, W_ij = the zz entry of C_{k_i k_j}.
  const auto count = static_cast<Eigen::Index>(top.size());
  MatrixXd w(count, count);
  for (Eigen::Index j = 0; j < count; ++j)
    for (Eigen::Index i = 0; i < count; ++i) w(i, j) = displacement_under(tensors[j], {0, 0, 1}, top[i])[2];
  const VectorXd force = w.llt().solve(VectorXd::Constant(count, -pressed));
  const double area =
      0.5 * 30 * radius * radius *
      std::sin(2 * std::numbers::pi / 30);  // area of the polygon that the mesh has in place of the circle
  EXPECT_NEAR(-force.sum() / exact.force(area), 1, 1e-6);
  // The solution is affine, so p1 is exact up to rounding times the condition of K.
  for (std::size_t n = 0; n < body.nodes.size(); ++n) {
    Vector3d u = Vector3d::Zero();
    for (Eigen::Index j = 0; j < count; ++j)
      u += displacement_under(tensors[j], {0, 0, force[j]}, static_cast<std::int32_t>(n));
    ASSERT_LE((u - exact.displacement(Vector3d(body.nodes[n].data()))).norm(), 1e-6 * pressed);
  }
}

}  // namespace
}  // namespace palpate::tests
