#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <memory>
#include <numbers>

#include "formats/errors.h"
#include "meshing/tetrahedra/fill_with_tetrahedra.h"
#include "meshing/tetrahedra/mesh_quality.h"
#include "meshing/tetrahedra/mesh_report.h"
#include "meshing/tetrahedra/repeatable_heap.h"
#include "meshing/tetrahedra/shells.h"
#include "tests/support/closed_surfaces.h"

namespace palpate {
namespace {

using tests::box_surface;
using tests::sphere_surface;

VolumeBoundary one_region(const TriangleSurface& surface) {
  return regions_of_shells({{surface, "body.off", ""}}, false, {});
}

TEST(FillWithTetrahedra, KeepsEveryTriangleOfASphere) {
  const TriangleSurface sphere = sphere_surface(3, 50);
  const VolumeBoundary boundary = one_region(sphere);
  const TetrahedralMesh mesh = fill_with_tetrahedra(boundary, {});
  EXPECT_EQ(verify_boundary_kept(boundary, mesh), sphere.triangles.size());
  EXPECT_EQ(boundary_triangles(mesh).size(), sphere.triangles.size());
  for (std::size_t v = 0; v < sphere.points.size(); ++v)
    ASSERT_EQ(mesh.nodes[v], boundary.points[v]);  // exact: all bits
  const MeshQuality quality = measure_quality(mesh);
  EXPECT_GT(quality.volume.value, 0);
  EXPECT_GE(quality.dihedral.value, 20);  // the goal, which the liver meets; a sphere is easier
  // The sums have about 5,000 terms of one sign: the tolerance is ten times eps times their number.
  EXPECT_NEAR(quality.region_volume[0] / enclosed_volume(sphere), 1, 1e-11);
  EXPECT_EQ(mesh.region_names, std::vector<std::string>{"body"});
  ASSERT_EQ(mesh.patches.size(), 1u);
  EXPECT_EQ(mesh.patches[0].name, "body-outside");
}

TEST(FillWithTetrahedra, KeepsEveryTriangleOfABoxFarFromTheOriginAndOfATinyOne) {
  for (const auto& [low, high] : {std::pair<Point, Point>{{1e7, 2e7, -1e7}, {1e7 + 100, 2e7 + 100, -1e7 + 50}},
                                  {{0, 0, 0}, {1e-5, 1e-5, 2e-5}}}) {
    const VolumeBoundary boundary = one_region(box_surface(4, low, high));
    const TetrahedralMesh mesh = fill_with_tetrahedra(boundary, {});
    EXPECT_EQ(verify_boundary_kept(boundary, mesh), 6 * 4 * 4 * 2u);
    EXPECT_GT(measure_quality(mesh).dihedral.value, 15);
  }
}

TEST(FillWithTetrahedra, MakesNestedTumoursRegionsOfTheirOwn) {
  const TriangleSurface liver = sphere_surface(3, 50), first = sphere_surface(2, 10, {20, 0, 0}),
                        second = sphere_surface(2, 8, {-20, 5, 0});
  const VolumeBoundary boundary =
      regions_of_shells({{liver, "liver.off", ""}, {first, "a.off", ""}, {second, "b.off", "tumour"}}, false, {});
  const TetrahedralMesh mesh = fill_with_tetrahedra(boundary, {});
  EXPECT_EQ(mesh.region_names, (std::vector<std::string>{"liver", "a", "tumour"}));
  const auto volume = measure_quality(mesh).region_volume;
  const double whole = enclosed_volume(liver), a = enclosed_volume(first), b = enclosed_volume(second);
  EXPECT_NEAR(volume[0] / (whole - a - b), 1, 1e-11);  // rounding of sums, as above
  EXPECT_NEAR(volume[1] / a, 1, 1e-11);
  EXPECT_NEAR(volume[2] / b, 1, 1e-11);
  std::vector<std::string> patches;
  for (const auto& patch : mesh.patches) patches.push_back(patch.name);
  EXPECT_EQ(patches, (std::vector<std::string>{"liver-outside", "a-liver", "tumour-liver"}));
}

TEST(FillWithTetrahedra, MakesTwoTumoursOfOneFileOneRegion) {
  const TriangleSurface liver = sphere_surface(3, 50);
  TriangleSurface tumours = sphere_surface(2, 10, {20, 0, 0});
  tests::append(tumours, sphere_surface(1, 6, {-20, 5, 0}));
  const VolumeBoundary boundary =
      regions_of_shells({{liver, "liver.off", ""}, {tumours, "tumours.off", "tumour"}}, false, {});
  const TetrahedralMesh mesh = fill_with_tetrahedra(boundary, {});
  EXPECT_EQ(mesh.region_names, (std::vector<std::string>{"liver", "tumour"}));
  EXPECT_EQ(verify_boundary_kept(boundary, mesh), liver.triangles.size() + tumours.triangles.size());
  const auto volume = measure_quality(mesh).region_volume;
  EXPECT_NEAR(volume[0] / (enclosed_volume(liver) - enclosed_volume(tumours)), 1, 1e-11);  // rounding of sums, as above
  EXPECT_NEAR(volume[1] / enclosed_volume(tumours), 1, 1e-11);
}

// A large piece with two cavities, one of which holds a solid again, and a small piece with one cavity.
TEST(FillWithTetrahedra, FillsARegionInSeveralPiecesWithSeveralCavities) {
  TriangleSurface body = sphere_surface(3, 50);
  for (const auto& [radius, centre] : {std::pair<double, Point>{15, {25, 0, 0}}, {9, {-25, 0, 0}}, {12, {90, 0, 0}}}) {
    TriangleSurface hole = sphere_surface(2, radius, centre);
    tests::turn_inside_out(hole);
    tests::append(body, hole);
  }
  tests::append(body, sphere_surface(1, 7, {25, 0, 0}));
  tests::append(body, sphere_surface(2, 25, {90, 0, 0}));
  const VolumeBoundary boundary = regions_of_shells({{body, "body.off", "body"}}, false, {});
  const TetrahedralMesh mesh = fill_with_tetrahedra(boundary, {});
  EXPECT_EQ(verify_boundary_kept(boundary, mesh), body.triangles.size());
  EXPECT_NEAR(measure_quality(mesh).region_volume[0] / enclosed_volume(body), 1, 1e-11);
}

TEST(FillWithTetrahedra, LeavesACavityEmpty) {
  TriangleSurface shell = sphere_surface(3, 50), hole = sphere_surface(2, 20);
  tests::turn_inside_out(hole);
  tests::append(shell, hole);
  const VolumeBoundary boundary = one_region(shell);
  const TetrahedralMesh mesh = fill_with_tetrahedra(boundary, {});
  EXPECT_EQ(verify_boundary_kept(boundary, mesh), shell.triangles.size());
  EXPECT_NEAR(measure_quality(mesh).region_volume[0] / enclosed_volume(shell), 1, 1e-11);
  EXPECT_EQ(mesh.patches[1].name, "body-cavity");
}

TEST(FillWithTetrahedra, GivesTheSameMeshTwiceWhateverTheHeapLooksLike) {
  const VolumeBoundary boundary = one_region(sphere_surface(3, 50));
  const TetrahedralMesh one = fill_with_tetrahedra(boundary, {});
  // Makes holes of many sizes in the heap, so that malloc returns other addresses than before.
  std::vector<std::string> blocks;
  for (int i = 0; i < 20000; ++i) blocks.emplace_back(20 + (i * 37) % 200, 'x');
  for (std::size_t i = 0; i < blocks.size(); i += 2) blocks[i] = std::string();
  const TetrahedralMesh two = fill_with_tetrahedra(boundary, {});
  EXPECT_TRUE(one.nodes == two.nodes);
  EXPECT_TRUE(one.tetrahedra == two.tetrahedra);
}

TEST(FillWithTetrahedra, KeepsTheFirstMeshWhenALaterTryFails) {
  // One flat tetrahedron, far below the goal of 20 degrees, whose corners cannot move.
  TetrahedralMesh flat;
  flat.nodes = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.3, 0.3, 0.05}};
  flat.tetrahedra = {{0, 1, 2, 3}};
  flat.region = {0};
  flat.region_names = {"body"};
  int calls = 0;
  const auto fill = [&](const FillOptions&) {
    if (++calls == 2) throw OperationError("gmsh crashed");
    if (calls == 3) throw VerificationError("a triangle was lost");
    return flat;
  };
  EXPECT_EQ(best_of_tries({{}, {}, {}}, fill, nullptr).tetrahedra, flat.tetrahedra);
  EXPECT_EQ(calls, 3);
  calls = 1;
  EXPECT_THROW(best_of_tries({{}, {}, {}}, fill, nullptr), OperationError) << "the first try must succeed";
}

TEST(RepeatableHeap, IsUsedUnderALimitOfAddressSpaceTooOrSaysThatItCannotBe) {
  // Only the child process has the limit; its exit status carries the answer. A limit of 4 GB leaves room for a part
  // of the 64 GB that the heap tries first. A limit 1 MB above the mapped memory leaves no room.
  const auto answer_under = [](const std::function<std::size_t(std::size_t)>& limit_of) {
    const pid_t child = fork();
    if (child == 0) {
      std::size_t pages = 0;
      std::ifstream("/proc/self/statm") >> pages;
      const rlim_t limit = limit_of(pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE)));
      const rlimit space = {limit, limit};
      setrlimit(RLIMIT_AS, &space);
      try {
        use_repeatable_heap();
      } catch (const OperationError&) {
        _exit(2);
      }
      const std::unique_ptr<int> block(new int);
      _exit(is_in_repeatable_heap(block.get()) ? 0 : 1);
    }
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  };
  EXPECT_EQ(answer_under([](std::size_t mapped) { return mapped + (std::size_t{4} << 30); }), 0);
  EXPECT_EQ(answer_under([](std::size_t mapped) { return mapped + (std::size_t{1} << 20); }), 2);
}

TEST(VerifyBoundaryKept, NamesATriangleThatNoElementHas) {
  const VolumeBoundary boundary = one_region(box_surface(2, {0, 0, 0}, {1, 1, 1}));
  TetrahedralMesh mesh = fill_with_tetrahedra(boundary, {});
  mesh.tetrahedra.pop_back();
  mesh.region.pop_back();
  EXPECT_THROW(verify_boundary_kept(boundary, mesh), VerificationError);
}

TEST(RegionsOfShells, RefusesANestedShellThatCouldBeEither) {
  TriangleSurface both = sphere_surface(2, 50);
  tests::append(both, sphere_surface(1, 20));
  EXPECT_THROW(one_region(both), InputError);
  const auto regions = regions_of_shells({{both, "body.off", ""}}, true, {"liver", "tumour"});
  EXPECT_EQ(regions.region_names, (std::vector<std::string>{"liver", "tumour"}));
  EXPECT_THROW(regions_of_shells({{both, "body.off", ""}}, true, {"liver"}), InputError);
}

TEST(RegionsOfShells, MakesAShellInACavitySolidAgain) {
  TriangleSurface body = sphere_surface(2, 50), hole = sphere_surface(2, 30), island = sphere_surface(2, 10);
  const double expected = enclosed_volume(body) - enclosed_volume(hole) + enclosed_volume(island);
  tests::turn_inside_out(hole);
  tests::append(body, hole);
  tests::append(body, island);
  const auto boundary = regions_of_shells({{body, "body.off", "body"}}, false, {});
  EXPECT_EQ(boundary.region_names, (std::vector<std::string>{"body"}));
  EXPECT_NEAR(enclosed_volumes(boundary)[0] / expected, 1, 1e-11);  // rounding of some 1,000 terms
}

TEST(RegionsOfShells, TurnsAnInvertedSurfaceOutward) {
  TriangleSurface sphere = sphere_surface(2, 50);
  const double volume = enclosed_volume(sphere);
  tests::turn_inside_out(sphere);
  EXPECT_NEAR(enclosed_volumes(one_region(sphere))[0], volume, 1e-11 * volume);
}

}  // namespace
}  // namespace palpate
