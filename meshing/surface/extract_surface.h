// Voxel mask -> the surface that is wanted of it: smoothed, so many triangles, the voxels' volume, checked.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "meshing/image/voxel_mask.h"
#include "meshing/surface/triangle_surface.h"

namespace palpate {

struct SurfaceTarget {
  enum class Spread { even, curvature } spread = Spread::even;
  std::optional<std::size_t> triangles;
  std::optional<double> edge_mm;  // as many triangles as equilateral ones of this edge
};

struct ExtractedSurface {
  TriangleSurface surface;
  TriangleSurface voxel_surface;                           // of the unsmoothed mask, midway between voxel centres
  std::uint64_t vanished_pieces = 0, closed_cavities = 0;  // lost by smoothing
  double vanished_mm3 = 0;
  double thin_mm3 = 0;  // voxels of thin parts that smoothing removed
  Point thin_place{};
  int attempts = 1;
};

// Smooths, takes the isosurface, remeshes each shell, restores each shell's volume, and checks; tries again with more
// regular or denser triangles where the result intersects itself.
// Errors: InputError when smoothing leaves nothing, the label looks like noise, or no attempt gives a valid surface.
ExtractedSurface extract_surface(const VoxelMask& mask, double smooth_mm, const SurfaceTarget& target,
                                 const std::string& image_name);

// Remeshes every shell to its share (by area) of the target and restores signed volumes: groups[s] is the group of
// shell s, volumes[g] what the shells of group g enclose together. Throws InputError, named by what, when no attempt is
// valid.
TriangleSurface remesh_shells(const std::vector<TriangleSurface>& shells, const std::vector<std::size_t>& groups,
                              const std::vector<double>& volumes, const SurfaceTarget& target, const std::string& what,
                              int* attempts);

// The shells of a surface, each on its own.
std::vector<TriangleSurface> split_shells(const TriangleSurface& surface);
TriangleSurface join_shells(const std::vector<TriangleSurface>& shells);

}  // namespace palpate
