// Reads PNG, by libpng. Callers use read_label_image (label_image.h).
#pragma once

#include "meshing/image/label_image.h"

namespace palpate {

// Reads one slice as an image of depth 1 whose voxel size is 1; the caller sets the voxel size. Grey values of any number of bits
// keep their numbers. Errors: InputError.
LabelImage read_png_slice(const std::filesystem::path& file);

}  // namespace palpate
