// Image headers read by us before any library trusts them: what the header claims must fit the file.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>

namespace palpate {

constexpr double kLargestVoxel = 1e6;  // mm, of a side

// Each checks the header's dimensions, voxel size and type, and that the file (decompressed where it is compressed)
// holds as many bytes as they ask for. Nothing of the claimed size is allocated. Errors: InputError with the field,
// what was expected and what was found.
void check_inr_header(const std::filesystem::path& file);
void check_nifti_header(const std::filesystem::path& file);
void check_nrrd_header(const std::filesystem::path& file);
void check_meta_header(const std::filesystem::path& file);
void check_png_header(const std::filesystem::path& file);

// At least a voxel a side, at most 2^31 - 1, and a product that fits; returns size[0] size[1] size[2] bytes_per_voxel.
std::uint64_t checked_image_bytes(const std::filesystem::path& file, const std::array<double, 3>& size,
                                  std::uint64_t bytes_per_voxel);

// Three finite positive numbers.
void check_spacing(const std::filesystem::path& file, const std::array<double, 3>& spacing);

}  // namespace palpate
