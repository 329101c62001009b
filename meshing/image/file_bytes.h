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

// A part of a file, and how many bytes there are from its start to the file's end.
struct FileBytes {
  std::string bytes;
  std::uint64_t present = 0;
};

// Reads at most most bytes from offset on. Takes no memory where fewer than most are there. Errors: InputError.
FileBytes bytes_from(const std::filesystem::path& file, std::uint64_t offset, std::uint64_t most);

// Decompresses the gzip or zlib stream that starts at offset, to its end. Leaves out the first skipped bytes and keeps at most
// most of the others. Errors: InputError when the stream is cut off or corrupt.
FileBytes inflated_bytes(const std::filesystem::path& file, std::uint64_t offset, std::uint64_t skipped,
                         std::uint64_t most);

// True when the file begins with gzip's two magic bytes.
bool is_gzip(const std::filesystem::path& file);

}  // namespace palpate
