// Voxel mask -> smooth scalar field -> closed triangle surface at the resolution of the voxels.
#pragma once

#include <vector>

#include "meshing/image/voxel_mask.h"
#include "meshing/surface/triangle_surface.h"

namespace palpate {

// The mask convolved with a Gaussian of width sigma_mm, exact cell averages of the Gaussian as weights, so a width far
// below the voxel changes nothing. Values 0 .. 1; zero outside the grid. Cost: six passes over the grid.
std::vector<float> smooth_mask(const VoxelMask& mask, double sigma_mm);

// The surface, and for each of its points a voxel it lies between: one inside, one outside (the ends of its grid edge).
struct Isosurface {
  TriangleSurface surface;
  std::vector<std::size_t> inside_voxel, outside_voxel;  // [points]
};

// The surface between field > 0.5 and field <= 0.5, in mm, triangles outward. Each cube's face decides by its own four
// signs how its crossings join (diagonal inside corners stay apart), both cubes at a face decide alike, and no diagonal
// of a cube's polygon lies in a face: so the surface is a closed manifold whatever the field. Vertices keep 2 % of an
// edge away from voxel centres, so no triangle is degenerate. The grid's outermost voxels must be outside. Errors:
// InputError when the surface has more than 40 million triangles.
Isosurface isosurface(const VoxelGrid& grid, const std::vector<float>& field);

// Handles (genus) of each connected closed surface: (2 - Euler number) / 2, in the order of shell_of_triangle.
std::vector<std::int64_t> handles_of_shells(const TriangleSurface& surface);

}  // namespace palpate
