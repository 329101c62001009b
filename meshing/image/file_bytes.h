// Bytes of a file, plain or compressed, in bounded memory.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace palpate {

// The size of a regular file. Errors: InputError when there is none or it cannot be read.
std::uint64_t file_bytes(const std::filesystem::path& file);

// The first bytes of a file (decompressed when it is gzip), at most limit. Errors: InputError.
std::string read_head(const std::filesystem::path& file, std::size_t limit);

// How many bytes the gzip or zlib stream at offset decompresses to, counted by decompressing it to its end.
// Errors: InputError when it is cut off or corrupt.
std::uint64_t inflated_bytes(const std::filesystem::path& file, std::uint64_t offset);

// True when the file begins with gzip's two magic bytes.
bool is_gzip(const std::filesystem::path& file);

}  // namespace palpate
