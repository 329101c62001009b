// The shipped path against other people's numbers: CalculiX on the same mesh, and the cylinder's closed form.
#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <numbers>
#include <sstream>

#include "precompute/probe_columns.h"
#include "tests/precompute/support.h"
#include "tests/support/layered_tetrahedra.h"

namespace palpate::tests {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// Displacement of node n under force f at the tensor's node: T^u_nk (T^f_k)^-1 f.
Vector3d displacement_under(const NodeTensor& tensor, const Vector3d& force, std::int32_t n, std::size_t node_count) {
  const Vector3d moved = Eigen::Map<const Eigen::Matrix3d>(tensor.force.data()).inverse() * force;
  Vector3d u = Vector3d::Zero();
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i)
      u[i] += tensor.displacement[3 * (node_count * static_cast<std::size_t>(j) + static_cast<std::size_t>(n)) +
                                  static_cast<std::size_t>(i)] *
              moved[j];
  return u;
}

void write_calculix_input(const std::filesystem::path& path, const ElasticBody& body, std::int32_t node,
                          const Vector3d& force) {
  std::ofstream out(path);
  out << "*NODE, NSET=ALL\n";
  for (std::size_t n = 0; n < body.nodes.size(); ++n)
    out << fmt::format("{},{:.12e},{:.12e},{:.12e}\n", n + 1, body.nodes[n][0], body.nodes[n][1], body.nodes[n][2]);
  for (std::size_t r = 0; r < body.materials.size(); ++r) {
    out << fmt::format("*ELEMENT, TYPE=C3D4, ELSET=R{}\n", r);
    for (std::size_t e = 0; e < body.tetrahedra.size(); ++e) {
      const auto& t = body.tetrahedra[e];
      if (body.region[e] == static_cast<std::int32_t>(r))
        out << fmt::format("{},{},{},{},{}\n", e + 1, t[0] + 1, t[1] + 1, t[2] + 1, t[3] + 1);
    }
    out << fmt::format("*MATERIAL, NAME=M{0}\n*ELASTIC\n{1:.12e},{2:.12e}\n*SOLID SECTION, ELSET=R{0}, MATERIAL=M{0}\n",
                       r, body.materials[r].young, body.materials[r].poisson);
  }
  out << "*BOUNDARY\n";
  for (std::size_t n = 0; n < body.nodes.size(); ++n)
    for (int d = 0; d < 3; ++d)
      if (body.fixed[n][d]) out << fmt::format("{},{},{}\n", n + 1, d + 1, d + 1);
  out << "*STEP\n*STATIC\n*CLOAD\n";
  for (int d = 0; d < 3; ++d) out << fmt::format("{},{},{:.12e}\n", node + 1, d + 1, force[d]);
  out << "*NODE PRINT, NSET=ALL\nU\n*END STEP\n";
}

// Lines "  node  ux  uy  uz" of the .dat file.
std::vector<Vector3d> read_calculix_displacements(const std::filesystem::path& path, std::size_t node_count) {
  std::vector<Vector3d> u(node_count, Vector3d::Constant(std::nan("")));
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    std::istringstream cells(line);
    long node = 0;
    Vector3d v;
    if (cells >> node >> v[0] >> v[1] >> v[2] && node >= 1 && node <= static_cast<long>(node_count))
      u[static_cast<std::size_t>(node - 1)] = v;
  }
  return u;
}

void expect_agreement_with_calculix(double poisson) {
  TetrahedralMesh mesh = box_mesh({5, 4, 4}, {0.10, 0.08, 0.06}, 0.2);
  mesh.region_names = {"soft", "stiff"};
  for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) mesh.region[t] = t % 7 == 0;
  ElasticBody body = body_of(mesh, {{5400, poisson, 0}, {60000, 0.3, 0}});
  hold(body, [](const auto& p) { return p[0] == 0 ? 7 : p[2] == 0 ? 4 : 0; });
  const std::int32_t node = body.touchable.back();
  const Vector3d force(0.3, -0.2, 0.5);

  const auto folder = std::filesystem::temp_directory_path() / fmt::format("palpate_ccx_{}", ::getpid());
  std::filesystem::create_directories(folder);
  write_calculix_input(folder / "box.inp", body, node, force);
  const std::string command =
      fmt::format("cd '{}' && OMP_NUM_THREADS=1 {} box > log.txt 2>&1", folder.string(), PALPATE_CCX);
  ASSERT_EQ(std::system(command.c_str()), 0) << "CalculiX did not run: install calculix-ccx; see " << folder;
  const auto reference = read_calculix_displacements(folder / "box.dat", body.nodes.size());

  const auto tensors = solve_node_tensors(body, Element::p1, std::vector<std::int32_t>{node});
  double largest = 0, worst = 0;
  for (std::size_t n = 0; n < body.nodes.size(); ++n) {
    const Vector3d u = displacement_under(tensors[0], force, static_cast<std::int32_t>(n), body.nodes.size());
    largest = std::max(largest, u.norm());
    const double difference = (u - reference[n]).norm();
    worst = std::isnan(difference) ? difference : std::max(worst, difference);
  }
  // CalculiX prints seven digits of each number.
  EXPECT_LE(worst, 1e-6 * largest);
  EXPECT_GT(largest, 0);
  std::filesystem::remove_all(folder);
}

TEST(Reference, AgreesWithCalculixOnTheSameMeshOfTwoMaterials) {
  expect_agreement_with_calculix(0.45);
}
TEST(Reference, AgreesWithCalculixNearIncompressibility) {
  expect_agreement_with_calculix(0.499);
}

// A disc of rings of triangles, pulled up into layers of prisms of three tetrahedra each. SI.
TetrahedralMesh cylinder_mesh(double radius, double height, int rings, int layers) {
  TetrahedralMesh mesh;
  std::vector<std::array<std::int32_t, 3>> triangles;
  std::vector<std::array<double, 2>> disc = {{0, 0}};
  std::vector<std::int32_t> first = {0};
  for (int ring = 1; ring <= rings; ++ring) {  // 6 r points on ring r
    first.push_back(static_cast<std::int32_t>(disc.size()));
    for (int i = 0; i < 6 * ring; ++i) {
      const double angle = 2 * std::numbers::pi * i / (6 * ring), r = radius * ring / rings;
      disc.push_back({r * std::cos(angle), r * std::sin(angle)});
    }
  }
  for (int ring = 1; ring <= rings; ++ring)
    for (int sector = 0; sector < 6; ++sector)
      for (int i = 0; i < ring; ++i) {
        const auto outer = [&](int k) { return first[ring] + (sector * ring + k) % (6 * ring); };
        const auto inner = [&](int k) {
          return ring == 1 ? 0 : first[ring - 1] + (sector * (ring - 1) + k) % (6 * (ring - 1));
        };
        triangles.push_back({outer(i), outer(i + 1), inner(i)});
        if (i + 1 < ring) triangles.push_back({inner(i), outer(i + 1), inner(i + 1)});
      }
  const auto count = static_cast<std::int32_t>(disc.size());
  for (int layer = 0; layer <= layers; ++layer)
    for (const auto& p : disc) mesh.nodes.push_back({p[0], p[1], height * layer / layers});
  tests::fill_layers(triangles, count, layers, mesh);
  mesh.region.assign(mesh.tetrahedra.size(), 0);
  mesh.region_names = {"brain"};
  return mesh;
}

TEST(Reference, ACompressedCylinderHasItsClosedForm) {
  // 30 x 13 mm, E 3 kPa, nu 0.45, frictionless, 1 mm: F = E A x / h, d_r = nu r x / h = 0.5192 mm, both uniform.
  const double radius = 0.015, height = 0.013, young = 3000, poisson = 0.45, pressed = 1e-3;
  ElasticBody body = body_of(cylinder_mesh(radius, height, 5, 4), {{young, poisson, 0}});
  hold(body, [&](const auto& p) {
    const bool bottom = p[2] == 0;
    if (bottom && p[0] == 0 && p[1] == 0) return 7;
    if (bottom && p[1] == 0 && p[0] == radius) return 6;  // y and z: stops the turn about the axis
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
    for (Eigen::Index i = 0; i < count; ++i)
      w(i, j) = displacement_under(tensors[j], {0, 0, 1}, top[i], body.nodes.size())[2];
  const VectorXd force = w.llt().solve(VectorXd::Constant(count, -pressed));
  const double area = 0.5 * 30 * radius * radius * std::sin(2 * std::numbers::pi / 30);  // the meshed polygon's
  EXPECT_NEAR(-force.sum() / (young * area * pressed / height), 1, 1e-6);
  EXPECT_NEAR(young * std::numbers::pi * radius * radius * pressed / height, 0.1631,
              5e-5);  // the round one's, as published
  EXPECT_NEAR(poisson * radius * pressed / height, 0.5192e-3, 5e-8);
  // The solution is affine, so P1 holds it to rounding times the condition.
  for (std::size_t n = 0; n < body.nodes.size(); ++n) {
    Vector3d u = Vector3d::Zero();
    for (Eigen::Index j = 0; j < count; ++j)
      u += displacement_under(tensors[j], {0, 0, force[j]}, static_cast<std::int32_t>(n), body.nodes.size());
    const auto& p = body.nodes[n];
    const double widen = poisson * pressed / height;
    ASSERT_LE((u - Vector3d(widen * p[0], widen * p[1], -pressed * p[2] / height)).norm(), 1e-6 * pressed);
  }
}

}  // namespace
}  // namespace palpate::tests
