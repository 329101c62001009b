// Makes label images of known shapes and writes them in each format that the program reads.
#pragma once

#include <zlib.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "meshing/image/label_image.h"
#include "meshing/surface/triangle_surface.h"

namespace palpate::tests {

// Makes an image whose voxels have the value shape(centre), the centre in mm relative to the middle of the image.
struct ShapeImage {
  VoxelGrid grid;
  std::vector<std::uint8_t> values;
};

ShapeImage shape_image(std::array<int, 3> size, std::array<Point, 3> axis, Point middle,
                       const std::function<int(const Point&)>& shape);

// Of voxels of 1 mm, without a turn, whose middle is the origin.
ShapeImage upright_image(std::array<int, 3> size, const std::function<int(const Point&)>& shape);

LabelImage labels_of(const ShapeImage& image);

// Returns axes of the given spacings, turned by an angle about z, then about x.
std::array<Point, 3> turned_axes(Point spacing, double degrees);

std::function<int(const Point&)> ellipsoid(double a, double b, double c, int label = 1);

void write_bytes(const std::filesystem::path& file, const std::string& bytes);

std::string gzipped(const std::string& bytes);

std::string voxel_bytes(const ShapeImage& image);

std::string triple(const Point& p);

std::string sizes_of(const ShapeImage& image);

// Writes NRRD. ras writes the same positions in RAS, with x and y reversed.
std::string as_nrrd(const ShapeImage& image, bool ras, bool gzip);

std::string as_meta(const ShapeImage& image);

// Writes NIfTI-1 with an sform, which is RAS. unit: 1 = m, 2 = mm, 3 = um; the numbers in the file have this unit.
std::string as_nifti(const ShapeImage& image, int unit);

// Writes INR, which has no directions: the axes must lie along x, y and z.
std::string as_inr(const ShapeImage& image);

}  // namespace palpate::tests
