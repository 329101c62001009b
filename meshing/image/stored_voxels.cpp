#include "meshing/image/stored_voxels.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <string>

#include "formats/errors.h"
#include "formats/program.h"
#include "meshing/image/file_bytes.h"

namespace palpate {
namespace {

struct Extent {
  std::array<int, 3> size;
  std::uint64_t voxels() const { return slice() * static_cast<std::uint64_t>(size[2]); }
  std::uint64_t slice() const { return static_cast<std::uint64_t>(size[0]) * static_cast<std::uint64_t>(size[1]); }
  std::string place(std::uint64_t voxel) const {
    const auto row = static_cast<std::uint64_t>(size[0]);
    return fmt::format("({}, {}, {})", voxel % row, voxel / row % static_cast<std::uint64_t>(size[1]), voxel / slice());
  }
};

// In bytes; found: how many there are.
void expect(const StoredVoxels& stored, std::uint64_t needed, std::uint64_t found, std::uint64_t slice) {
  if (found < needed) {
    throw InputError(fmt::format(
        "{}: the header asks for {} bytes of voxels, the file has {}; it is cut off, or its header is wrong",
        stored.header.string(), needed, found));
  }
  if (found - needed >= slice) {
    warn(fmt::format(
        "{}: the header asks for {} bytes of voxels, the file has {}; the rest is not read: compare the sizes "
        "in the header with the image",
        stored.header.string(), needed, found));
  }
}

// Labels that single precision cannot tell apart would become one.
template <class Number>
float as_float(Number value, const StoredVoxels& stored, const Extent& extent, std::uint64_t voxel) {
  const auto rounded = static_cast<float>(value);
  if constexpr (sizeof(Number) >= 4 && !std::is_same_v<Number, float>) {
    const auto exact = static_cast<long double>(value);
    if (static_cast<long double>(rounded) != exact && std::floor(exact) == exact) {
      throw InputError(fmt::format(
          "{}: expected labels up to 16777216, found {} in voxel {}, which would become {:.0f}; renumber the labels",
          stored.header.string(), value, extent.place(voxel), rounded));
    }
  }
  return rounded;
}

template <class Number>
void decode_as(const std::string& bytes, const StoredVoxels& stored, const Extent& extent, std::vector<float>& values) {
  const bool swap = stored.big_endian != (std::endian::native == std::endian::big);
  for (std::uint64_t v = 0; v < values.size(); ++v) {
    std::array<char, sizeof(Number)> raw;
    std::memcpy(raw.data(), bytes.data() + v * sizeof(Number), sizeof(Number));
    if (swap) std::reverse(raw.begin(), raw.end());
    values[v] = as_float(std::bit_cast<Number>(raw), stored, extent, v);
  }
}

// Calls with a zero of the number's type.
template <class Call>
auto with_type_of(VoxelNumber number, const Call& call) {
  switch (number) {
    case VoxelNumber::int8:
      return call(std::int8_t{});
    case VoxelNumber::uint8:
      return call(std::uint8_t{});
    case VoxelNumber::int16:
      return call(std::int16_t{});
    case VoxelNumber::uint16:
      return call(std::uint16_t{});
    case VoxelNumber::int32:
      return call(std::int32_t{});
    case VoxelNumber::uint32:
      return call(std::uint32_t{});
    case VoxelNumber::int64:
      return call(std::int64_t{});
    case VoxelNumber::uint64:
      return call(std::uint64_t{});
    case VoxelNumber::float32:
      return call(float{});
    default:
      return call(double{});
  }
}

}  // namespace

std::uint64_t bytes_of(VoxelNumber number) {
  return with_type_of(number, [](auto zero) -> std::uint64_t { return sizeof zero; });
}

std::vector<float> read_voxels(const StoredVoxels& stored, const std::array<int, 3>& size) {
  const Extent extent{size};
  const std::uint64_t width = bytes_of(stored.number), needed = extent.voxels() * width;
  const FileBytes found = stored.compressed ? inflated_bytes(stored.data, stored.first, stored.skipped, needed)
                                            : bytes_from(stored.data, stored.first, needed);
  expect(stored, needed, found.present, extent.slice() * width);
  std::vector<float> values(extent.voxels());
  with_type_of(stored.number, [&](auto zero) { decode_as<decltype(zero)>(found.bytes, stored, extent, values); });
  if (stored.slope != 1 || stored.intercept != 0)
    for (float& value : values) value = stored.slope * value + stored.intercept;
  return values;
}

}  // namespace palpate
