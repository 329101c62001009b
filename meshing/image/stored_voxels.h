// Where and how a file stores the voxels of an image, and the one function that reads them, whatever the format.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace palpate {

enum class VoxelNumber { int8, uint8, int16, uint16, int32, uint32, int64, uint64, float32, float64 };

std::uint64_t bytes_of(VoxelNumber number);

struct StoredVoxels {
  std::filesystem::path header;  // the file that the user gave, for sentences
  std::filesystem::path data;    // the file that holds the voxels, often the same one
  std::uint64_t first = 0;       // byte of data where the voxels, or their compressed stream, begin
  std::uint64_t skipped = 0;     // bytes of the decompressed stream in front of the voxels
  bool compressed = false;       // by gzip or zlib
  VoxelNumber number = VoxelNumber::uint8;
  bool big_endian = false;
  float slope = 1, intercept = 0;  // value = slope * number + intercept
};

// Returns the values [voxels], x fastest. Takes memory only for bytes that the file has. Warns where the file holds at least
// one slice more than the size says. Errors: InputError for fewer numbers than the size says, damaged data, and a whole
// number that single precision cannot hold, because two such labels would become one.
std::vector<float> read_voxels(const StoredVoxels& stored, const std::array<int, 3>& size);

}  // namespace palpate
