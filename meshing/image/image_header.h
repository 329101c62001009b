// Checks the header of an image before a library reads the image: the size that the header states must fit the file.
// The libraries take memory for the stated size, or return part of an image without an error.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>

namespace palpate {

constexpr double kLargestVoxel = 1e6;  // mm, length of one side

// Each function checks the dimensions, the voxel size and the number type in the header. It also checks that the
// file, after decompression, holds as many bytes as the header states. It never allocates memory of the stated size.
// Errors: InputError with the field, the expected value and the found value.
void check_inr_header(const std::filesystem::path& file);
void check_nifti_header(const std::filesystem::path& file);
void check_nrrd_header(const std::filesystem::path& file);
void check_meta_header(const std::filesystem::path& file);
void check_png_header(const std::filesystem::path& file);

// Returns size[0] size[1] size[2] bytes_per_voxel. Errors: InputError unless each size is a whole number from 1 to
// 2^31 - 1 and the product fits 64 bits.
std::uint64_t checked_image_bytes(const std::filesystem::path& file, const std::array<double, 3>& size,
                                  std::uint64_t bytes_per_voxel);

// Errors: InputError unless all three voxel sizes are finite and above 0.
void check_spacing(const std::filesystem::path& file, const std::array<double, 3>& spacing);

}  // namespace palpate
