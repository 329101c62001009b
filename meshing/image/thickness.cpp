#include "meshing/image/thickness.h"

#include <itkImage.h>
#include <itkSignedMaurerDistanceMapImageFilter.h>

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

// Every step-th voxel along each axis, between one layer of outside voxels.
VoxelMask thinned(const VoxelMask& mask, int step) {
  VoxelMask result;
  for (int a = 0; a < 3; ++a) {
    result.grid.size[a] = (mask.grid.size[a] + step - 1) / step + 2;
    for (int c = 0; c < 3; ++c) result.grid.axis[a][c] = step * mask.grid.axis[a][c];
  }
  result.inside.assign(result.grid.voxels(), 0);
  for (int k = 0; k < mask.grid.size[2]; k += step)
    for (int j = 0; j < mask.grid.size[1]; j += step)
      for (int i = 0; i < mask.grid.size[0]; i += step)
        result.inside[result.grid.index(i / step + 1, j / step + 1, k / step + 1)] =
            mask.inside[mask.grid.index(i, j, k)];
  return result;
}

// The distance (mm) of each voxel's centre from the nearest marked voxel's centre; 0 or below in marked ones.
std::vector<float> distance_map(const VoxelGrid& grid, const std::vector<std::uint8_t>& marked) {
  using Mask = itk::Image<unsigned char, 3>;
  using Distance = itk::Image<float, 3>;
  Mask::SizeType size;
  Mask::SpacingType spacing;
  for (unsigned a = 0; a < 3; ++a) {
    size[a] = static_cast<itk::SizeValueType>(grid.size[a]);
    spacing[a] = grid.spacing()[a];
  }
  const auto image = Mask::New();
  image->SetRegions(Mask::RegionType(size));
  image->SetSpacing(spacing);
  image->Allocate();
  std::copy(marked.begin(), marked.end(), image->GetBufferPointer());
  const auto filter = itk::SignedMaurerDistanceMapImageFilter<Mask, Distance>::New();
  filter->SetInput(image);
  filter->SetUseImageSpacing(true);
  filter->SetSquaredDistance(false);
  filter->SetInsideIsPositive(false);
  filter->Update();
  const float* first = filter->GetOutput()->GetBufferPointer();
  return {first, first + grid.voxels()};
}

}  // namespace

double local_thickness(const VoxelMask& whole, double share) {
  constexpr double kMostVoxels = 4e6;
  const auto step = static_cast<int>(std::ceil(std::cbrt(static_cast<double>(whole.grid.voxels()) / kMostVoxels)));
  const VoxelMask mask = thinned(whole, std::max(1, step));
  // Balls have their centres in voxels' centres, half a voxel from where a larger ball would have its own, and the corners of the
  // voxels' steps are half a voxel outside of a smooth border: both are forgiven.
  const auto [x, y, z] = mask.grid.spacing();
  const double half_voxel = 0.5 * (x + y + z) / 3, forgiven = std::max({x, y, z});
  const std::uint64_t count = count_inside(mask);
  if (count == 0) return 2 * half_voxel;
  std::vector<std::uint8_t> outside(mask.inside.size());
  for (std::size_t v = 0; v < outside.size(); ++v) outside[v] = !mask.inside[v];
  std::vector<float> depth = distance_map(mask.grid, outside);
  for (float& d : depth) d -= static_cast<float>(half_voxel);  // the surface is between two centres

  // the share of the organ that balls of a radius inside the organ cover
  const auto covered = [&](double radius) {
    std::vector<std::uint8_t> centres(depth.size());
    bool any = false;
    for (std::size_t v = 0; v < depth.size(); ++v) {
      centres[v] = mask.inside[v] && depth[v] >= radius;
      any |= centres[v] != 0;
    }
    if (!any) return 0.0;
    const std::vector<float> near = distance_map(mask.grid, centres);
    std::uint64_t reached = 0;
    for (std::size_t v = 0; v < depth.size(); ++v)
      reached += mask.inside[v] && (centres[v] || near[v] <= radius + forgiven);
    return static_cast<double>(reached) / static_cast<double>(count);
  };

  // The share does not fall steadily with the radius, so the search comes from above.
  constexpr double kStep = 0.85;
  double radius = *std::max_element(depth.begin(), depth.end());
  while (radius > half_voxel && covered(radius) < share) radius *= kStep;
  return 2 * std::max(radius, half_voxel);
}

}  // namespace palpate
