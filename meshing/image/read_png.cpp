#include "meshing/image/read_png.h"

#include <fmt/format.h>
#include <itkImage.h>
#include <itkImageFileReader.h>
#include <itkPNGImageIO.h>

#include "formats/errors.h"
#include "meshing/image/image_header.h"

namespace palpate {
namespace {

// The description of an ITK exception has several lines. The last line states the cause.
std::string one_line(const itk::ExceptionObject& error) {
  std::string text = error.GetDescription();
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.pop_back();
  const auto last = text.find_last_of('\n');
  return last == std::string::npos ? text : text.substr(last + 1);
}

}  // namespace

LabelImage read_png_slice(const std::filesystem::path& file) {
  using Slice = itk::Image<float, 2>;
  const PngHeader header = read_png_header(file);
  try {
    const auto io = itk::PNGImageIO::New();
    io->SetFileName(file.string());
    io->ReadImageInformation();
    if (io->GetNumberOfComponents() != 1) {
      throw InputError(fmt::format("{}: expected one value per voxel, found {}; extract one", file.string(),
                                   io->GetNumberOfComponents()));
    }
    const auto reader = itk::ImageFileReader<Slice>::New();
    reader->SetImageIO(io);
    reader->SetFileName(file.string());
    reader->Update();
    const Slice* slice = reader->GetOutput();
    const auto extent = slice->GetLargestPossibleRegion().GetSize();
    if (extent[0] != static_cast<std::size_t>(header.width) || extent[1] != static_cast<std::size_t>(header.height)) {
      throw InputError(fmt::format("{}: expected {} x {} pixels, as the header states, found {} x {}", file.string(),
                                   header.width, header.height, extent[0], extent[1]));
    }
    LabelImage image;
    image.grid.size = {header.width, header.height, 1};
    image.grid.axis = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    image.values.assign(slice->GetBufferPointer(), slice->GetBufferPointer() + image.grid.voxels());
    for (float& value : image.values) value /= static_cast<float>(header.factor);
    return image;
  } catch (const itk::ExceptionObject& error) {
    throw InputError(fmt::format("{}: cannot be read: {}", file.string(), one_line(error)));
  }
}

}  // namespace palpate
