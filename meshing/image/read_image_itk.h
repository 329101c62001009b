// Label images that ITK reads, behind label_image.h, which is what callers use.
#pragma once

#include "meshing/image/label_image.h"

namespace palpate {

// Each checks the header (image_header.h), then ITK reads the file. Errors: InputError.
LabelImage read_nrrd(const std::filesystem::path& file);
LabelImage read_meta(const std::filesystem::path& file);

// One slice, depth 1, grid in pixels. The header is checked by the caller.
LabelImage read_png_slice(const std::filesystem::path& file);

}  // namespace palpate
