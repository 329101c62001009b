// A rigid flat punch through the whole chain: block of gel -> tensors -> bundle -> a tool with a disc. On one mesh, for discs
// with radii from a quarter of an edge to four edges, the force must be that of the closed form.
#include "tests/precompute/punched_block.h"

namespace palpate::tests {
namespace {

class FlatPunch : public testing::TestWithParam<std::pair<Element, double>> {};

TEST_P(FlatPunch, NeedsTheForceOfTheClosedFormWhateverTheEdge) {
  const auto [element, poisson] = GetParam();
  Punched block(flat_block(), element, poisson, 5.5 * kEdge);
  double worst = 0;
  for (const double edges : {0.25, 0.5, 1.0, 2.0, 4.0})  // edges in a radius
    for (const auto& [x, y] : {std::pair{0.0, 0.0}, {0.5, 0.25}, {0.33, 0.8}, {-0.5, 0.5}}) {
      const double a = edges * kEdge, force = block.push(x * kEdge, y * kEdge, a);
      // The closed form is F = 2 E a d / (1 - nu^2): 37.62 mN at a = 5 mm, nu = 0.45. The block is held at a distance R all
      // around, where a half-space would move by 2 a / (pi R) of d. This makes the block stiffer by 2 to 3 times that share:
      // by 4 % for the largest disc. The test subtracts it.
      const double held = 2.5 * 2 * a / (std::numbers::pi * kReach * kEdge);
      const double error = force / (2e-3 * kYoung * a / (1 - poisson * poisson)) - 1 - held;
      // Linear tetrahedra lock a little at 0.45, and the largest disc reaches down to where the cells grow.
      // p1-ang scatters more from place to place, and is softer below a wide disc.
      const double allowed = element == Element::p1_ang ? 0.1 : element == Element::p1 && edges == 4 ? 0.08 : 0.05;
      EXPECT_LT(std::abs(error), allowed) << "edge over radius " << 1 / edges << " at " << x << " " << y;
      worst = std::max(worst, std::abs(error));
    }
  RecordProperty("worst", std::to_string(worst));
}
INSTANTIATE_TEST_SUITE_P(Elements, FlatPunch,
                         testing::Values(std::pair{Element::p1, 0.45}, std::pair{Element::p1_anp, 0.45},
                                         std::pair{Element::p1_ang, 0.45}));

// The same block with the subdivision of each cell mirrored to those of its neighbours: a node of the top belongs to four triangles or
// to eight.
TetrahedralMesh mirrored_block() {
  TetrahedralMesh mesh = flat_block();
  const int nz = 12, nx = 2 * nz;  // cells
  constexpr int axes[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
  const auto node = [&](const std::array<int, 3>& at) { return at[0] + (nx + 1) * (at[1] + (nx + 1) * at[2]); };
  mesh.tetrahedra.clear();
  for (int cell = 0; cell < nx * nx * nz; ++cell) {
    const std::array<int, 3> from = {cell % nx, cell / nx % nx, cell / nx / nx};
    for (int p = 0; p < 6; ++p) {
      std::array<int, 3> at = from, end = from;
      int mirrors = 0;
      for (int d = 0; d < 3; ++d) ++(from[d] % 2 ? at : end)[d], mirrors += from[d] % 2;
      std::array<std::int32_t, 4> t = {node(at)};
      for (int step = 0; step < 3; ++step) at[axes[p][step]] = end[axes[p][step]], t[step + 1] = node(at);
      if ((p >= 3) != (mirrors % 2 == 1)) std::swap(t[2], t[3]);
      mesh.tetrahedra.push_back(t);
    }
  }
  mesh.patches.clear();
  return mesh;
}

// docs/accuracy.md states the figures. A node's share of the surface, from which the runtime takes the spacing, is 2/3 or 4/3 of a cell
// there, while the block gives way alike at all nodes; and linear elements lock less than on other meshes.
TEST(FlatPunchOnMirroredCells, IsOffTheClosedFormByAsMuchAsTheDocumentsState) {
  for (const auto& [element, allowed] : {std::pair{Element::p1_anp, 0.07}, {Element::p1, 0.12}}) {
    constexpr double kPoisson = 0.45;
    Punched block(mirrored_block(), element, kPoisson, 5.5 * kEdge);
    double low = 0, high = 0;
    for (const double edges : {0.25, 0.5, 1.0, 2.0})
      for (const auto& [x, y] : {std::pair{0.0, 0.0}, {0.5, 0.25}, {0.33, 0.8}, {1.0, 0.0}, {0.5, 0.0}, {1.0, 1.0}}) {
        const double a = edges * kEdge, held = 2.5 * 2 * a / (std::numbers::pi * kReach * kEdge),
                     error = block.push(x * kEdge, y * kEdge, a) / (2e-3 * kYoung * a / (1 - kPoisson * kPoisson)) - 1 -
                             held;
        low = std::min(low, error), high = std::max(high, error);
      }
    EXPECT_GT(low, -allowed);
    EXPECT_LT(high, allowed);
    RecordProperty(element == Element::p1 ? "p1" : "p1_anp", std::to_string(low) + " to " + std::to_string(high));
  }
}

// Moves the top so that its middle bulges (curvature above 0, 1/m) or is hollow (below 0), and is level again 60 mm away.
TetrahedralMesh curved_block(const std::vector<double>& distance, double curvature) {
  constexpr double kWidth = 0.025;
  TetrahedralMesh mesh = graded_block(distance);
  for (auto& p : mesh.nodes) {
    const double bell = std::exp(-(p[0] * p[0] + p[1] * p[1]) / (2 * kWidth * kWidth));
    p[2] += curvature * kWidth * kWidth * bell * (1 + p[2] / distance.back());
  }
  return mesh;
}

TEST(CurvedPunch, OfASmallDiscThatIsDraggedIsAsMuchSofterOnABulgeThanInAHollowOnACoarseMeshAsOnAFineOne) {
  constexpr double kRadius = 0.0025, kCurvature = 20, kPoisson = 0.3;
  std::vector<double> coarse,
      fine = {0, .0025, .005, .0075, .01, .0125, .015, .0185, .0235, .030, .040, .053, .072, .1};
  for (double x = 0; x < 0.105; x += 0.01) coarse.push_back(x);
  const auto softer = [&](const std::vector<double>& distance, double reach) {
    const auto compliance = [&](double curvature) {
      return 1e-3 / Punched(curved_block(distance, curvature), Element::p1, kPoisson, reach).drag(kRadius);
    };
    return compliance(kCurvature) - compliance(-kCurvature);
  };
  const double expected = softer(fine, 0.0105), found = softer(coarse, 0.021);
  RecordProperty("coarse_over_fine", std::to_string(found / expected));
  EXPECT_NEAR(found, expected, 0.2 * expected);
}

}  // namespace
}  // namespace palpate::tests
