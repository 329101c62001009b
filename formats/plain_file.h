// An open file with reads and writes at a given byte. Each one finishes, or throws an OperationError that names the file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace palpate {

class PlainFile {
 public:
  // flags: those of open(2).
  PlainFile(std::filesystem::path path, int flags);
  PlainFile(PlainFile&& other) noexcept;
  PlainFile& operator=(PlainFile&&) = delete;
  ~PlainFile();

  void write(std::uint64_t offset, const void* bytes, std::uint64_t count) const;
  // Returns how many bytes were read: fewer than count at the end of the file only.
  std::uint64_t read(std::uint64_t offset, void* bytes, std::uint64_t count) const;

  std::uint64_t size() const;
  void resize(std::uint64_t bytes) const;
  // Takes the disk space of the whole file at once where the file system can.
  void reserve() const;
  void sync_data() const;  // fdatasync
  void sync() const;       // fsync

  int descriptor() const { return descriptor_; }
  const std::filesystem::path& path() const { return path_; }
  // Throws with the reason in errno.
  [[noreturn]] void fail(const std::string& what) const;

 private:
  std::filesystem::path path_;
  int descriptor_;
};

// fsync of a folder, so that names made or removed in it last; a no-op where the file system has none.
void sync_folder_of(const std::filesystem::path& file);

}  // namespace palpate
