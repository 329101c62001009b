// Voxel mask -> a checked surface: smooth, with the wanted number of triangles and the volume of the voxels.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "formats/errors.h"
#include "meshing/image/voxel_mask.h"
#include "meshing/surface/triangle_surface.h"

namespace palpate {

// No attempt gave a valid surface.
struct NoValidSurface : InputError {
  using InputError::InputError;
};

struct SurfaceTarget {
  enum class Spread { even, curvature } spread = Spread::even;
  std::optional<std::size_t> triangles;
  std::optional<double> edge_mm;  // instead: the number of equilateral triangles of this edge that cover the surface
};

struct ExtractedSurface {
  TriangleSurface surface;
  TriangleSurface voxel_surface;  // of the unsmoothed mask; its points lie midway between voxel centres
  std::uint64_t vanished_pieces = 0, closed_cavities = 0;  // smoothing removed these
  double vanished_mm3 = 0;
  double thin_mm3 = 0;   // volume of the thin parts that smoothing removed
  Point thin_place{};    // the first voxel of these parts, mm
  double smooth_mm = 0;  // the Gaussian width that was used
  int attempts = 1;
};

// Smooths the mask, takes the isosurface, remeshes each shell, restores each shell's volume, and checks the result.
// If the result intersects itself, the function tries again with more regular and more numerous triangles, then twice with
// less smoothing, at most a quarter of the thickness of the organ's thinnest parts, and says so in a warning. Errors:
// InputError when smoothing leaves nothing, the label looks like noise, or no attempt gives a valid surface.
ExtractedSurface extract_surface(const VoxelMask& mask, double smooth_mm, const SurfaceTarget& target,
                                 const std::string& image_name);

// Divides the wanted number of triangles among the shells by their areas, remeshes every shell and restores the
// volumes: groups[s] is the group of shell s; the shells of group g together enclose the signed volume volumes[g]
// (mm^3). what names the surface in messages. Errors: NoValidSurface when no attempt gives a valid surface.
TriangleSurface remesh_shells(const std::vector<TriangleSurface>& shells, const std::vector<std::size_t>& groups,
                              const std::vector<double>& volumes, const SurfaceTarget& target, const std::string& what,
                              int* attempts);

// remesh_shells for a closed surface, each of whose shells keeps its volume. too_far_out_mm: the surface lies that far
// outside of the wanted one (as a wrap does), and the shells lose as much volume.
TriangleSurface remesh_surface(const TriangleSurface& surface, const SurfaceTarget& target, const std::string& what,
                               int* attempts, double too_far_out_mm = 0);

// Splits a surface into its connected shells.
std::vector<TriangleSurface> split_shells(const TriangleSurface& surface);
TriangleSurface join_shells(const std::vector<TriangleSurface>& shells);

}  // namespace palpate
