// The ball of palpate-fit --large against Hertz' solution: a quarter of a half-space, whose cells grow away from the contact. On its cuts it slides,
// on its other sides it moves as under Boussinesq's point force.
#include "programs/fit/pressed_ball.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "formats/averaged_shear.h"
#include "studies/bodies/box_mesh.h"

namespace palpate::fit {
namespace {

constexpr double kRadius = 0.01, kDepth = 0.03 * kRadius, kShear = 2000, kPoisson = 0.45;
constexpr int kGrowing = 6;  // cells along each axis, beyond those of one size below the contact

double hertz_force() {
  return 8.0 / 3 * kShear / (1 - kPoisson) * std::sqrt(kRadius * kDepth) * kDepth;
}

// Of the n-th line of cells.
double line(int n, int even) {
  const double contact = std::sqrt(kRadius * kDepth), cell = 1.2 * contact / even;
  double at = 0, size = cell;
  for (int i = 0; i < n; ++i) at += i < even ? cell : size *= 1.6;
  return at;
}

Eigen::Vector3d boussinesq(const Eigen::Vector3d& x) {
  const double r = x.head<2>().norm(), far = x.norm(), scale = hertz_force() / (4 * std::numbers::pi * kShear * far);
  const double outwards = scale * (r * x[2] / (far * far) - (1 - 2 * kPoisson) * r / (far + x[2]));
  Eigen::Vector3d u(0, 0, scale * (2 * (1 - kPoisson) + x[2] * x[2] / (far * far)));
  if (r > 0) u.head<2>() = outwards * x.head<2>() / r;
  return u;
}

// even: cells of one size along each axis. count: nodes that the ball touches in all four quarters.
double pressed_force(int even, std::size_t* count) {
  const int cells = even + kGrowing;
  const double size = cells;
  TetrahedralMesh mesh = box_mesh({cells, cells, cells}, {size, size, size});
  for (auto& node : mesh.nodes)
    for (double& x : node) x = line(static_cast<int>(std::lround(x)), even);
  const double far = line(cells, even);
  std::vector<std::uint8_t> fixed(3 * mesh.nodes.size());
  std::vector<std::int32_t> near;
  Eigen::VectorXd u = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(fixed.size()));
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
    const Eigen::Vector3d x = Eigen::Vector3d::Map(mesh.nodes[n].data());
    const bool side = x.maxCoeff() >= far;
    for (int d = 0; d < 3; ++d) fixed[3 * n + static_cast<std::size_t>(d)] = side || (d < 2 && x[d] == 0);
    if (side) u.segment<3>(3 * static_cast<Eigen::Index>(n)) = boussinesq(x);
    if (x[2] == 0 && x.norm() < kRadius) near.push_back(static_cast<std::int32_t>(n));
  }
  const TissueLaw law{kShear, 2 * kShear * (1 + kPoisson) / (3 * (1 - 2 * kPoisson))};
  HyperelasticBody body;
  body.nodes = mesh.nodes[0].data(), body.tetrahedra = mesh.tetrahedra[0].data(), body.region = mesh.region.data();
  body.fixed = fixed.data(), body.laws = &law, body.region_count = 1;
  body.node_count = static_cast<std::int32_t>(mesh.nodes.size());
  body.tetrahedron_count = static_cast<std::int32_t>(mesh.tetrahedra.size());
  body.nodal_dilatation = true, body.averaged_shear = formats::kAveragedShear;
  const LargeReference reference(body, LargeReference::shared_factor());
  std::vector<std::int32_t> touched;
  // The body lies where z is above 0; the ball comes from below.
  const double force = 4 * PressedBall(mesh.nodes[0].data(), reference, kRadius, near, 1e-7, &touched)
                               .press({0, 0, kDepth - kRadius}, {0, 0, 1}, kDepth, &u);
  // It pushes alone: the nodes that it touches are below the contact's rim.
  *count = 0;
  for (const std::int32_t node : touched) {
    const Eigen::Vector3d x = Eigen::Vector3d::Map(mesh.nodes[static_cast<std::size_t>(node)].data());
    EXPECT_LT(x.norm(), 1.2 * std::sqrt(kRadius * kDepth));
    *count += (x[0] > 0 ? 2 : 1) * (x[1] > 0 ? 2 : 1);
  }
  return force;
}

// The nodes that are held hardly reach the contact's rim, so that the force is too small by a share of the edge over the contact's radius; without this
// share, from two meshes, it is Hertz' force. The warning of palpate-fit says how large it is: .53 over the root of the number of nodes.
TEST(PressedBall, HasHertzsForceAtSmallDepths) {
  std::size_t few = 0, many = 0;
  const double coarse = pressed_force(4, &few), fine = pressed_force(7, &many);
  RecordProperty("coarse", std::to_string(coarse / hertz_force()));
  RecordProperty("fine", std::to_string(fine / hertz_force()));
  EXPECT_NEAR((7 * fine - 4 * coarse) / 3, hertz_force(), 0.03 * hertz_force());
  for (const auto& [force, count] : {std::pair{coarse, few}, {fine, many}})
    EXPECT_NEAR(1 - force / hertz_force(), 0.53 / std::sqrt(count), 0.015) << count;
}

}  // namespace
}  // namespace palpate::fit
