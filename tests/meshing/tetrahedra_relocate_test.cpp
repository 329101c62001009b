#include <gtest/gtest.h>

#include <set>

#include "meshing/tetrahedra/mesh_quality.h"
#include "meshing/tetrahedra/relocate_vertices.h"
#include "studies/bodies/box_mesh.h"

namespace palpate {
namespace {

constexpr double kGoal = 20;
constexpr int kMiddle = 62;  // node (2, 2, 2) of a box of 4 x 4 x 4 cells

// Cells of side 1; one interior vertex lies almost in its neighbour.
TetrahedralMesh box_with_slivers() {
  TetrahedralMesh mesh = box_mesh({4, 4, 4}, {4, 4, 4});
  mesh.nodes[kMiddle] = {2.95, 2.02, 1.98};
  return mesh;
}

std::set<std::int32_t> nodes_of_region(const TetrahedralMesh& mesh, std::int32_t region) {
  std::set<std::int32_t> nodes;
  for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e)
    if (mesh.region[e] == region) nodes.insert(mesh.tetrahedra[e].begin(), mesh.tetrahedra[e].end());
  return nodes;
}

TEST(ImproveWorstElements, ASliverBesideAMovableVertexIsImprovedBeyondTheGoal) {
  TetrahedralMesh mesh = box_with_slivers();
  const TetrahedralMesh before = mesh;
  ASSERT_LT(measure_quality(mesh).dihedral.value, 5);
  const Improvement improvement = improve_worst_elements(mesh, kGoal);
  EXPECT_GE(measure_quality(mesh).dihedral.value, kGoal);
  EXPECT_GT(measure_quality(mesh).volume.value, 0);
  EXPECT_GT(improvement.below_before, 0u);
  EXPECT_EQ(improvement.below_after, 0u);
  EXPECT_GE(improvement.vertices_moved, 1u);
  EXPECT_EQ(mesh.tetrahedra, before.tetrahedra);
  EXPECT_EQ(mesh.region, before.region);
  for (std::size_t p = 0; p < mesh.patches.size(); ++p)
    EXPECT_EQ(mesh.patches[p].triangles, before.patches[p].triangles);
}

TEST(ImproveWorstElements, VerticesOfTheOuterSurfaceStayToTheBit) {
  TetrahedralMesh mesh = box_mesh({4, 4, 4}, {4, 4, 4});
  mesh.patches.clear();                           // the elements alone show which nodes are on the surface
  mesh.nodes[kMiddle - 25] = {2.02, 1.98, 0.05};  // node (2, 2, 1), almost in the lower face
  mesh.nodes[2 + 5 * (2 + 5 * 0)] = {2.4, 2, 0};  // a surface vertex whose move would improve elements
  const TetrahedralMesh before = mesh;
  const Improvement improvement = improve_worst_elements(mesh, kGoal);
  EXPECT_GT(improvement.vertices_moved, 0u);
  for (const auto& triangle : boundary_triangles(before))
    for (const auto v : triangle) ASSERT_EQ(mesh.nodes[v], before.nodes[v]);
}

TEST(ImproveWorstElements, VerticesBetweenRegionsAndOfInnerPatchesStayToTheBit) {
  TetrahedralMesh split = box_with_slivers();
  split.region_names = {"left", "right"};
  for (std::size_t e = 0; e < split.tetrahedra.size(); ++e)  // six elements per cell, cells in order of x first
    split.region[e] = (e / 6) % 4 >= 2;
  const TetrahedralMesh before = split;
  const double worst = measure_quality(split).dihedral.value;
  improve_worst_elements(split, kGoal);
  const std::set<std::int32_t> left = nodes_of_region(split, 0), right = nodes_of_region(split, 1);
  ASSERT_TRUE(left.contains(kMiddle) && right.contains(kMiddle));
  for (const auto v : left)
    if (right.contains(v)) {
      ASSERT_EQ(split.nodes[v], before.nodes[v]);
    }
  EXPECT_NE(split.nodes, before.nodes);  // other vertices moved
  EXPECT_GT(measure_quality(split).dihedral.value, worst);

  TetrahedralMesh patched = box_with_slivers();
  const auto& t = patched.tetrahedra[0];
  patched.patches.push_back({"inner", {{t[1], t[2], kMiddle}}});
  improve_worst_elements(patched, kGoal);
  EXPECT_EQ(patched.nodes[kMiddle], box_with_slivers().nodes[kMiddle]);
}

TEST(ImproveWorstElements, CountsElementsWhoseCornersAllLieOnTheSurface) {
  TetrahedralMesh mesh = box_mesh({1, 1, 1}, {10, 1, 1});
  const TetrahedralMesh before = mesh;
  const Improvement improvement = improve_worst_elements(mesh, 40);
  EXPECT_GT(improvement.out_of_reach, 0u);
  EXPECT_EQ(improvement.out_of_reach, improvement.below_after);
  EXPECT_EQ(mesh.nodes, before.nodes);
}

TEST(ImproveWorstElements, TheSameMeshGivesTheSameResultAndNeverAWorseOne) {
  TetrahedralMesh mesh = box_mesh({8, 8, 8}, {8, 8, 8}, 0.2);
  const double worst = measure_quality(mesh).dihedral.value;
  TetrahedralMesh again = mesh;
  const Improvement improvement = improve_worst_elements(mesh, 30);
  improve_worst_elements(again, 30);
  EXPECT_EQ(mesh.nodes, again.nodes);
  EXPECT_LT(improvement.below_after, improvement.below_before);
  EXPECT_GT(measure_quality(mesh).dihedral.value, worst);
  EXPECT_GT(measure_quality(mesh).volume.value, 0);
}

TEST(ImproveWorstElements, LeavesAMeshAloneThatMeetsTheGoal) {
  TetrahedralMesh mesh = box_mesh({3, 3, 3}, {3, 3, 3}, 0.05);
  const TetrahedralMesh before = mesh;
  EXPECT_EQ(improve_worst_elements(mesh, kGoal).vertices_moved, 0u);
  EXPECT_EQ(mesh.nodes, before.nodes);
}

}  // namespace
}  // namespace palpate
