// Reads the formats for which we use ITK. Callers use read_label_image (label_image.h), which chooses the reader.
#pragma once

#include "meshing/image/label_image.h"

namespace palpate {

// Each function checks the header (image_header.h) before ITK reads the file. Errors: InputError.
LabelImage read_nrrd(const std::filesystem::path& file);
LabelImage read_meta(const std::filesystem::path& file);

// Reads one slice as an image of depth 1 whose voxel size is 1. The caller checks the header and sets the voxel size.
LabelImage read_png_slice(const std::filesystem::path& file);

}  // namespace palpate
