// NIfTI-1, decoded here: ITK 5.2 scales voxel sizes by the file's unit but not the position and directions (sform), so that it
// refuses or misplaces images in metres or micrometres.
#pragma once

#include "meshing/image/label_image.h"

namespace palpate {

// Checks the header (image_header.h), then reads .nii, .nii.gz or .hdr with .img. Positions are the sform's where there is one,
// else the qform's (nifti1.h, methods 3, 2, 1), turned from RAS to LPS. Errors: InputError.
LabelImage read_nifti(const std::filesystem::path& file);

}  // namespace palpate
