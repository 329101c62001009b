// Reads the header of an image: where its voxels lie in the patient, and where and how the file stores them. Takes no memory
// of the size that a header states.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "meshing/image/label_image.h"
#include "meshing/image/stored_voxels.h"
#include "meshing/image/text_header.h"

namespace palpate {

constexpr double kLargestVoxel = 1e6;            // mm, length of one side
constexpr std::size_t kLongestHeader = 1 << 20;  // bytes; 3D Slicer writes about 1 kB for each segment

struct ImageHeader {
  VoxelGrid grid;  // in LPS mm, whatever axes and unit the file has
  StoredVoxels voxels;
};

// Errors of all four: InputError with the field, the expected value and the found value. A header that leaves out where the
// axes point, or how large the voxels are, gets a warning that says what is assumed. INR has no field for axes: its axes are
// taken as LPS.
ImageHeader read_inr_header(const std::filesystem::path& file);
ImageHeader read_nifti_header(const std::filesystem::path& file);
ImageHeader read_nrrd_header(const std::filesystem::path& file);
ImageHeader read_meta_header(const std::filesystem::path& file);

// ---- what the readers share ----------------------------------------------------------------------------------------

// Returns the three sizes of an image. Accepts more than three numbers when each further one is 1. Errors: InputError unless
// each is a whole number from 1 to 2^31 - 1 and the bytes of all voxels fit 64 bits.
std::array<int, 3> three_sizes(const std::filesystem::path& file, const std::vector<double>& sizes);

// Errors: InputError unless all three voxel sizes are finite and above 0.
void check_spacing(const std::filesystem::path& file, const std::array<double, 3>& spacing);

// Returns the first three of the numbers. Errors: InputError that names the field, for fewer.
std::array<double, 3> first_three(const std::filesystem::path& file, const std::string& field,
                                  const std::vector<double>& numbers);

// Returns the first bytes of the file as they are, at most kLongestHeader. Errors: InputError where the file is missing or
// empty.
std::string head_of(const std::filesystem::path& file);

// Warns that the file does not say where the axes point. taken: as which ones they are taken.
void warn_of_no_orientation(const std::filesystem::path& file, const char* taken);

// The length of the file's unit in mm: "mm", "cm" ...; no text or "?" is taken as mm. Errors: InputError for another unit.
double millimetres_of_unit(const std::filesystem::path& file, const std::string& field, const std::string& unit);

// Returns the path of the data file that a header names: relative to the folder of the header unless the name is absolute.
std::filesystem::path beside(const std::filesystem::path& header, const std::string& name);

// A number of the binary header, with the bytes of another byte order swapped. bytes: at least offset + sizeof(T).
template <class T>
T number_at(const std::string& bytes, std::size_t offset, bool swap) {
  std::array<char, sizeof(T)> raw;
  std::memcpy(raw.data(), bytes.data() + offset, sizeof(T));
  if (swap) std::reverse(raw.begin(), raw.end());
  return std::bit_cast<T>(raw);
}

}  // namespace palpate
