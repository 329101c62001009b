// Voxel mask -> smooth scalar field -> closed triangle surface at the resolution of the voxels.
#pragma once

#include <vector>

#include "meshing/image/voxel_mask.h"
#include "meshing/surface/triangle_surface.h"

namespace palpate {

// Convolves the mask with a Gaussian of width sigma_mm (its standard deviation). The weights are exact averages of
// the Gaussian over a voxel, so a width far below the voxel size leaves the mask unchanged. Values: 0 .. 1; voxels
// outside the grid count as 0. Cost: six passes over the grid.
std::vector<float> smooth_mask(const VoxelMask& mask, double sigma_mm);

// Each point of the surface lies on the line between two neighbouring voxel centres, one inside and one outside.
struct Isosurface {
  TriangleSurface surface;
  std::vector<std::size_t> inside_voxel, outside_voxel;  // [points]
};

// Returns the surface between field > 0.5 and field <= 0.5, in mm, with its triangles outward. The surface is a
// closed manifold for every field, for two reasons. The four signs of a face between two cubes alone decide how the
// surface crosses it (inside corners that are diagonal stay apart), so both cubes agree. No diagonal of a polygon
// inside a cube lies in a face. Points keep 2 % of a voxel edge away from voxel centres, so no triangle is
// degenerate. The outermost voxels of the grid must be outside. Errors: InputError when the surface has more than 40
// million triangles.
Isosurface isosurface(const VoxelGrid& grid, const std::vector<float>& field);

// Returns the number of handles (genus) of each closed shell, (2 - Euler number) / 2, in the order of
// shell_of_triangle.
std::vector<std::int64_t> handles_of_shells(const TriangleSurface& surface);

}  // namespace palpate
