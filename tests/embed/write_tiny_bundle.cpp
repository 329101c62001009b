// write_tiny_bundle FILE [long | nodule | healthy | large | motions | corridor | cut]: writes the box bundle of tests/support; long: a box so long that
// blocks have low rank; nodule: a larger box with a cube ten times as stiff inside; healthy: the same, as stiff as the rest; large: with what large deformation needs; motions: with
// those of box_motions.h; corridor: a box of 6 x 7 x 7 cells of frame LPS, with a corridor of all nodes inside it; cut: the box, all of which may be cut.
#include <algorithm>
#include <functional>
#include <string_view>

#include "tests/support/box_corridor.h"
#include "tests/support/box_motions.h"

namespace {

using namespace palpate;
using namespace palpate::tests;

// The stiff tetrahedra have no node on the surface and lie above z = 20 mm, so that the face z = 60 mm is the nearest one.
BundleParts bundle_with_nodule(double stiffer) {
  const TinyBox box{.cells = {5, 5, 5}, .size = {0.06, 0.06, 0.06}};
  DenseBody dense = dense_box(box);
  TetrahedralMesh& mesh = dense.body.mesh;
  const auto is_stiff = [&](const std::array<std::int32_t, 4>& tetrahedron) {
    return std::ranges::all_of(
        tetrahedron, [&](std::int32_t node) { return node >= dense.body.surface_nodes && mesh.nodes[node][2] > 0.02; });
  };
  TetrahedralMesh nodule = mesh;
  std::erase_if(nodule.tetrahedra, std::not_fn(is_stiff));
  std::ranges::transform(mesh.tetrahedra, mesh.region.begin(), is_stiff);
  dense.stiffness =
      dense_stiffness(mesh, box.young, box.poisson) + dense_stiffness(nodule, (stiffer - 1) * box.young, box.poisson);
  BundleParts parts = dense_bundle(dense);
  parts.set(formats::SectionId::young, {2}, std::vector<double>{box.young, stiffer * box.young});
  parts.set(formats::SectionId::poisson, {2}, std::vector<double>{box.poisson, box.poisson});
  parts.set_text(formats::SectionId::region_names, "box\nnodule\n");
  return parts;
}

BundleParts bundle_with_corridor() {
  const DenseBody dense = dense_box({.cells = {6, 7, 7}, .poisson = 0.4});
  BundleParts parts = dense_bundle(dense);
  add_whole_corridor(parts, dense);
  const std::string frame = R"("frame":"none")";
  parts.provenance.replace(parts.provenance.find(frame), frame.size(), R"("frame":"LPS")");
  return parts;
}

BundleParts bundle_to_cut() {
  constexpr std::int32_t reserve = 12;
  const DenseBody dense = box_that_can_be_cut(reserve);
  BundleParts parts = dense_bundle(dense);
  add_cut_region(parts, dense, reserve);
  return parts;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view form = argc == 3 ? argv[2] : "";
  const bool known = form == "" || form == "long" || form == "nodule" || form == "healthy" || form == "large" ||
                     form == "motions" || form == "corridor" || form == "cut";
  if (argc < 2 || argc > 3 || !known) return 2;
  const TinyBox long_box{.cells = {14, 3, 3}, .size = {0.28, 0.06, 0.06}};
  BundleParts parts = form == "nodule"     ? bundle_with_nodule(10)
                      : form == "healthy"  ? bundle_with_nodule(1)
                      : form == "corridor" ? bundle_with_corridor()
                      : form == "cut"      ? bundle_to_cut()
                                           : tiny_bundle(form == "long" ? long_box : TinyBox{});
  if (form == "large") add_large_deformation(parts);
  if (form == "motions") add_motions(parts, box_on_supports(false));
  write_bundle(argv[1], parts);
}
