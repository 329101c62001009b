#include "formats/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "formats/errors.h"

namespace palpate {

namespace {

std::filesystem::path folder_of(const std::filesystem::path& file) {
  return file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
}

// fsync of a file or a folder. Errors: OperationError.
void sync_to_disk(const std::filesystem::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const bool opened = descriptor >= 0;
  const bool synced = opened && ::fsync(descriptor) == 0;
  const int reason = errno;
  if (opened) ::close(descriptor);
  // Some file systems have no fsync of folders; the rename is then as safe as they can make it.
  if (!synced && !(opened && reason == EINVAL))
    throw OperationError(fmt::format("{}: cannot be made safe on the disk: {}", path.string(), std::strerror(reason)));
}

}  // namespace

AtomicFile::AtomicFile(std::filesystem::path target) : target_(std::move(target)), part_(target_) {
  part_ += ".part";
  std::error_code ignored;
  if (target_.filename().empty() || std::filesystem::is_directory(target_, ignored))
    throw InputError(fmt::format("{}: is a folder; name a file to write", target_.string()));
  const auto folder = folder_of(target_);
  if (!std::filesystem::is_directory(folder, ignored))
    throw InputError(fmt::format("{}: the folder {} does not exist; make it first", target_.string(), folder.string()));
  if (::access(folder.c_str(), W_OK | X_OK) != 0)
    throw InputError(fmt::format("{}: the folder {} cannot be written: {}", target_.string(), folder.string(),
                                 std::strerror(errno)));
}

AtomicFile::~AtomicFile() {
  std::error_code ignored;
  if (!committed_) std::filesystem::remove(part_, ignored);
}

void AtomicFile::commit() {
  sync_to_disk(part_);
  std::error_code error;
  std::filesystem::rename(part_, target_, error);
  if (error)
    throw OperationError(
        fmt::format("{}: cannot be renamed to {}: {}", part_.string(), target_.string(), error.message()));
  committed_ = true;
  sync_to_disk(folder_of(target_));
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
