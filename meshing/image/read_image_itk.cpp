#include "meshing/image/read_image_itk.h"

#include <fmt/format.h>
#include <itkImage.h>
#include <itkImageFileReader.h>
#include <itkMetaImageIO.h>
#include <itkNrrdImageIO.h>
#include <itkPNGImageIO.h>

#include <algorithm>
#include <cmath>

#include "formats/errors.h"
#include "meshing/image/image_header.h"

namespace palpate {
namespace {

using FloatVolume = itk::Image<float, 3>;

// The description of an ITK exception has several lines. The last line states the cause.
std::string one_line(const itk::ExceptionObject& error) {
  std::string text = error.GetDescription();
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.pop_back();
  const auto last = text.find_last_of('\n');
  return last == std::string::npos ? text : text.substr(last + 1);
}

// Returns the voxels as float, which is exact for labels below 2^24. ITK gives positions in LPS mm.
LabelImage read_with(itk::ImageIOBase* io, const std::filesystem::path& file) {
  try {
    io->SetFileName(file.string());
    io->ReadImageInformation();
    if (io->GetNumberOfComponents() != 1) {
      throw InputError(fmt::format("{}: expected one value per voxel, found {}; extract one", file.string(),
                                   io->GetNumberOfComponents()));
    }
    std::array<double, 3> size{1, 1, 1}, spacing{1, 1, 1};
    for (unsigned axis = 0; axis < std::min(3u, io->GetNumberOfDimensions()); ++axis) {
      size[axis] = static_cast<double>(io->GetDimensions(axis));
      spacing[axis] = io->GetSpacing(axis);
    }
    check_spacing(file, spacing);
    checked_image_bytes(file, size, sizeof(float));

    const auto reader = itk::ImageFileReader<FloatVolume>::New();
    reader->SetImageIO(io);
    reader->SetFileName(file.string());
    reader->Update();
    const FloatVolume* volume = reader->GetOutput();

    LabelImage image;
    const auto extent = volume->GetLargestPossibleRegion().GetSize();
    const auto& direction = volume->GetDirection();
    for (unsigned axis = 0; axis < 3; ++axis) {
      image.grid.size[axis] = static_cast<int>(extent[axis]);
      image.grid.origin[axis] = volume->GetOrigin()[axis];
      for (unsigned c = 0; c < 3; ++c) image.grid.axis[axis][c] = direction[c][axis] * volume->GetSpacing()[axis];
    }
    const double volume_of_voxel = image.grid.voxel_volume();
    if (!std::isfinite(volume_of_voxel) || volume_of_voxel <= 0) {
      throw InputError(fmt::format("{}: expected directions that span space, found a voxel of volume {}", file.string(),
                                   volume_of_voxel));
    }
    for (const double c : image.grid.origin) {
      if (!std::isfinite(c)) throw InputError(fmt::format("{}: the origin is not a finite point", file.string()));
    }
    image.values.assign(volume->GetBufferPointer(), volume->GetBufferPointer() + image.grid.voxels());
    return image;
  } catch (const itk::ExceptionObject& error) {
    throw InputError(fmt::format("{}: cannot be read: {}", file.string(), one_line(error)));
  }
}

}  // namespace

LabelImage read_nrrd(const std::filesystem::path& file) {
  check_nrrd_header(file);
  return read_with(itk::NrrdImageIO::New(), file);
}

LabelImage read_meta(const std::filesystem::path& file) {
  check_meta_header(file);
  return read_with(itk::MetaImageIO::New(), file);
}

LabelImage read_png_slice(const std::filesystem::path& file) {
  return read_with(itk::PNGImageIO::New(), file);
}

}  // namespace palpate
