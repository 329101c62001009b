// Reads PNG, by ITK. Callers use read_label_image (label_image.h).
#pragma once

#include "meshing/image/label_image.h"

namespace palpate {

// Reads one slice as an image of depth 1 whose voxel size is 1; the caller sets the voxel size. Grey values of 1, 2 or 4 bits
// keep their numbers (libpng stretches them to 0 .. 255). Errors: InputError, also where ITK returns another size than the
// header states.
LabelImage read_png_slice(const std::filesystem::path& file);

}  // namespace palpate
