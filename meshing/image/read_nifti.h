// Reads NIfTI-1 without ITK. ITK 5.2 applies the unit of the file to the voxel size but not to the position and the
// directions (sform). So it refuses an image in metres, and puts an image in micrometres 1,000 times too far from the
// origin.
#pragma once

#include "meshing/image/label_image.h"

namespace palpate {

// Checks the header (image_header.h), then reads .nii, .nii.gz, or .hdr with .img. Takes the positions from the sform
// if the header has one, else from the qform (methods 3 and 2 of nifti1.h), else from the voxel sizes alone, with a
// warning. Turns RAS to LPS. Errors: InputError.
LabelImage read_nifti(const std::filesystem::path& file);

}  // namespace palpate
