#include "formats/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "formats/errors.h"
#include "formats/plain_file.h"

namespace palpate {

void check_target(const std::filesystem::path& target) {
  std::error_code ignored;
  if (target.filename().empty() || std::filesystem::is_directory(target, ignored))
    throw InputError(fmt::format("{}: is a folder; name a file to write", target.string()));
  const auto folder = target.has_parent_path() ? target.parent_path() : std::filesystem::path(".");
  if (!std::filesystem::is_directory(folder, ignored))
    throw InputError(fmt::format("{}: the folder {} does not exist; make it first", target.string(), folder.string()));
  if (::access(folder.c_str(), W_OK | X_OK) != 0)
    throw InputError(
        fmt::format("{}: the folder {} cannot be written: {}", target.string(), folder.string(), std::strerror(errno)));
}

void replace_durably(const std::filesystem::path& part, const std::filesystem::path& target) {
  PlainFile(part, O_RDONLY).sync();
  std::error_code error;
  std::filesystem::rename(part, target, error);
  if (error)
    throw OperationError(
        fmt::format("{}: cannot be renamed to {}: {}", part.string(), target.string(), error.message()));
  sync_folder_of(target);
}

AtomicFile::AtomicFile(std::filesystem::path target) : target_(std::move(target)), part_(target_) {
  part_ += ".part";
  check_target(target_);
}

AtomicFile::~AtomicFile() {
  std::error_code ignored;
  if (!committed_) std::filesystem::remove(part_, ignored);
}

void AtomicFile::commit() {
  replace_durably(part_, target_);
  committed_ = true;
}

void write_text_atomically(const std::filesystem::path& target, std::string_view text) {
  AtomicFile file(target);
  std::ofstream out(file.part(), std::ios::binary);
  out.write(text.data(), static_cast<std::streamsize>(text.size()));
  out.close();
  if (!out) throw OperationError(fmt::format("{}: writing {} bytes failed", file.part().string(), text.size()));
  file.commit();
}

}  // namespace palpate
