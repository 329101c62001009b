// Read-only maps of a file. A guarded map does not kill the host when the file is cut.
//
// Reading a page beyond the end of a mapped file that was truncated raises SIGBUS. For guarded maps a handler then maps a page of
// zeros at that address and notes the loss, as libwayland does for shared memory. Any other SIGBUS goes to the handler that was
// installed before. The handler is there as long as a guarded map is. On Windows nobody can cut a file that is mapped
// (file_map_windows.cpp).
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

namespace palpate {

struct FileMap {
  void* base = nullptr;  // start of the map, page-aligned
  std::size_t bytes = 0;
  const unsigned char* data = nullptr;  // first byte of the range that was asked for
};

// True on POSIX systems and on Windows.
bool file_maps_are_supported();

// Opens a regular file for reading. Returns a descriptor, or -1 with *reason: a part of a sentence, a string constant.
int open_for_map(const char* path, std::uint64_t* file_bytes, const char** reason);
void close_file(int descriptor);
// Reads exactly count bytes from offset on; false otherwise.
bool read_range(int descriptor, std::uint64_t offset, void* out, std::size_t count);

// Maps the bytes [offset, offset + count). lost: nullptr, or guards the map: *lost becomes true when a page is lost, at any time
// until unmap. False on failure.
bool map_range(int descriptor, std::uint64_t offset, std::uint64_t count, std::atomic<bool>* lost, FileMap* map);
void unmap(FileMap* map);

// Notices that a mapped file was cut or written over, without a system call. It keeps two parts of the file mapped: eight bytes
// that stand for the whole (a checksum), and the last byte that is not zero. Cutting the file makes the rest of its last page
// read as zeros and removes the pages beyond, so it changes that last byte unless it removes nothing but zeros.
class FileWitness {
 public:
  // stamp: the eight bytes that were read at stamp_offset, a multiple of 8. Other parameters as map_range. On failure: false,
  // and holds() stays true.
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

// Reads one byte of every page of a map.
void read_pages(const FileMap& map);
// What an error tells the host to raise where lock_pages is refused.
#ifdef _WIN32
inline constexpr char kLockLimit[] = "the least working set (SetProcessWorkingSetSize)";
#else
inline constexpr char kLockLimit[] = "RLIMIT_MEMLOCK (ulimit -l)";
#endif
// Asks the system to keep a map in memory until it is unmapped. Where it refuses: false, and *limit is what it allows, in bytes.
bool lock_pages(const FileMap& map, std::uint64_t* limit);

}  // namespace palpate
