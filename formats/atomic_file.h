// Output that is whole or absent: written as NAME.part, then fsync, rename, fsync of the folder.
#pragma once

#include <filesystem>
#include <string_view>

namespace palpate {

// Call before a long computation: refuses now what would fail when the output is written. Errors: InputError when the
// target is a folder, or its own folder does not exist or cannot be written.
void check_target(const std::filesystem::path& target);

// fsyncs part, renames it onto the target, fsyncs the folder. Errors: OperationError.
void replace_durably(const std::filesystem::path& part, const std::filesystem::path& target);

// A program writes to part(); commit() renames it onto the target. Without commit() the destructor removes the part file.
class AtomicFile {
 public:
  // Errors: those of check_target.
  explicit AtomicFile(std::filesystem::path target);
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  ~AtomicFile();

  const std::filesystem::path& part() const { return part_; }

  // Errors: OperationError.
  void commit();

 private:
  std::filesystem::path target_, part_;
  bool committed_ = false;
};

// Whole text in one call. Errors: as AtomicFile.
void write_text_atomically(const std::filesystem::path& target, std::string_view text);

}  // namespace palpate
