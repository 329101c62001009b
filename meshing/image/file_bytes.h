// Measures and reads the bytes of a file, plain or compressed, without keeping the whole file in memory.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace palpate {

// Returns the size of a regular file. Errors: InputError when the file does not exist, is empty or cannot be read.
std::uint64_t file_bytes(const std::filesystem::path& file);

// Returns the first bytes of a file, at most limit. The bytes of a gzip file are decompressed first. Errors:
// InputError.
std::string read_head(const std::filesystem::path& file, std::size_t limit);

// Decompresses the gzip or zlib stream that starts at offset and returns its decompressed size. Keeps none of the
// decompressed bytes. Errors: InputError when the stream is cut off or corrupt.
std::uint64_t inflated_bytes(const std::filesystem::path& file, std::uint64_t offset);

// True when the file begins with gzip's two magic bytes.
bool is_gzip(const std::filesystem::path& file);

}  // namespace palpate
