#include "formats/plain_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "formats/errors.h"

namespace palpate {
namespace {

constexpr std::uint64_t kMostAtOnce = 1u << 30;  // Linux moves less than 2 GiB in one call

std::filesystem::path folder_of(const std::filesystem::path& file) {
  return file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
}

}  // namespace

PlainFile::PlainFile(std::filesystem::path path, int flags)
    : path_(std::move(path)), descriptor_(::open(path_.c_str(), flags | O_CLOEXEC, 0666)) {
  if (descriptor_ < 0) fail("cannot be opened");
}

PlainFile::PlainFile(PlainFile&& other) noexcept
    : path_(std::move(other.path_)), descriptor_(std::exchange(other.descriptor_, -1)) {}

PlainFile::~PlainFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void PlainFile::fail(const std::string& what) const {
  throw OperationError(fmt::format("{}: {}: {}", path_.string(), what, std::strerror(errno)));
}

void PlainFile::write(std::uint64_t offset, const void* bytes, std::uint64_t count) const {
  const char* from = static_cast<const char*>(bytes);
  while (count > 0) {
    const ssize_t written = ::pwrite(descriptor_, from, std::min(count, kMostAtOnce), static_cast<off_t>(offset));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) fail(fmt::format("writing at byte {} failed", offset));
    from += written;
    offset += static_cast<std::uint64_t>(written);
    count -= static_cast<std::uint64_t>(written);
  }
}

std::uint64_t PlainFile::read(std::uint64_t offset, void* bytes, std::uint64_t count) const {
  char* to = static_cast<char*>(bytes);
  std::uint64_t done = 0;
  while (done < count) {
    const ssize_t got =
        ::pread(descriptor_, to + done, std::min(count - done, kMostAtOnce), static_cast<off_t>(offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail(fmt::format("reading at byte {} failed", offset + done));
    if (got == 0) break;
    done += static_cast<std::uint64_t>(got);
  }
  return done;
}

std::uint64_t PlainFile::size() const {
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0) fail("its size cannot be found");
  return static_cast<std::uint64_t>(status.st_size);
}

void PlainFile::resize(std::uint64_t bytes) const {
  if (::ftruncate(descriptor_, static_cast<off_t>(bytes)) != 0)
    fail(fmt::format("cannot be made {} bytes long", bytes));
}

void PlainFile::reserve() const {
  const std::uint64_t bytes = size();
  if (::fallocate(descriptor_, 0, 0, static_cast<off_t>(bytes)) != 0 && (errno == ENOSPC || errno == EDQUOT))
    fail(fmt::format("needs {} bytes; free some space", bytes));
}

void PlainFile::sync_data() const {
  if (::fdatasync(descriptor_) != 0) fail("cannot be made safe on the disk");
}

void PlainFile::sync() const {
  if (::fsync(descriptor_) != 0) fail("cannot be made safe on the disk");
}

void sync_folder_of(const std::filesystem::path& file) {
  const PlainFile folder(folder_of(file), O_RDONLY | O_DIRECTORY);
  // Some file systems have no fsync of folders; a rename is then as safe as they can make it.
  if (::fsync(folder.descriptor()) != 0 && errno != EINVAL) folder.fail("cannot be made safe on the disk");
}

}  // namespace palpate
