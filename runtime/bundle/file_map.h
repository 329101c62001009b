// Read-only maps of a file whose loss does not kill the host.
//
// A page of a mapped file that has been truncated raises SIGBUS when it is read. As libwayland does for shared memory,
// a handler puts a page of zeros in its place and notes the loss; any other SIGBUS goes to the handler that was there
// before.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

namespace palpate {

struct FileMap {
  void* base = nullptr;  // page-aligned start of the map
  std::size_t bytes = 0;
  const unsigned char* data = nullptr;  // the wanted first byte
};

// True where files can be mapped at all.
bool file_maps_are_supported();

// Opens a regular file for reading. Returns a descriptor, or -1 with *reason a static sentence part.
int open_for_map(const char* path, std::uint64_t* file_bytes, const char** reason);
void close_file(int descriptor);
// Reads exactly count bytes from the start; false otherwise.
bool read_head(int descriptor, void* out, std::size_t count);

// Maps [offset, offset + count). *lost becomes true when a page is lost, at any time until unmap. False on failure.
bool map_range(int descriptor, std::uint64_t offset, std::uint64_t count, std::atomic<bool>* lost, FileMap* map);
void unmap(FileMap* map);

// Two places of a file that cannot stay as they were when the file is cut or written over, kept mapped: eight bytes that
// stand for the whole (a checksum), and the last byte that is not zero. A cut leaves zeros, to the end of its page, and no
// pages beyond: it takes that byte, or nothing but zeros.
class FileWitness {
 public:
  // stamp: what was read at stamp_offset, a multiple of 8. As map_range. False on failure; the witness then holds for ever.
  bool call(int descriptor, std::uint64_t file_bytes, std::uint64_t stamp_offset, std::uint64_t stamp,
            std::atomic<bool>* lost);
  void dismiss();
  // Cost: two reads of mapped memory.
  bool holds() const { return !stamp_ || (*stamp_ == stamp_was_ && *last_ == last_was_); }
  const FileMap& stamp_map() const { return stamp_map_; }
  const FileMap& last_map() const { return last_map_; }

 private:
  FileMap stamp_map_, last_map_;
  const volatile std::uint64_t* stamp_ = nullptr;
  const volatile unsigned char* last_ = nullptr;
  std::uint64_t stamp_was_ = 0;
  unsigned char last_was_ = 0;
};

// Reads every page of a map once.
void read_pages(const FileMap& map);
// Asks the system to keep a map in memory until it is unmapped. False with *limit, bytes, where it refuses.
bool lock_pages(const FileMap& map, std::uint64_t* limit);

}  // namespace palpate
