// Output that is whole or absent: written as NAME.part, then fsync, rename, fsync of the folder.
#pragma once

#include <filesystem>
#include <string_view>

namespace palpate {

// Where to write; nothing exists under target until commit(). Leaving scope without commit removes the part file.
class AtomicFile {
 public:
  // Errors: InputError when the target's folder does not exist or cannot be written.
  explicit AtomicFile(std::filesystem::path target);
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  ~AtomicFile();

  const std::filesystem::path& part() const { return part_; }

  // fsyncs part(), renames it onto the target, fsyncs the folder. Errors: OperationError.
  void commit();

 private:
  std::filesystem::path target_, part_;
  bool committed_ = false;
};

// Whole text in one call. Errors: as AtomicFile.
void write_text_atomically(const std::filesystem::path& target, std::string_view text);

}  // namespace palpate
