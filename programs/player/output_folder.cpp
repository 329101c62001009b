#include "programs/player/output_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "formats/errors.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

void refuse_foreign_entries(const fs::path& target, const std::vector<std::string>& own) {
  if (!fs::is_directory(target))
    throw InputError(
        fmt::format("{}: expected a folder to write to, found a file; name another with -o", target.string()));
  for (const auto& entry : fs::directory_iterator(target))
    if (const std::string name = entry.path().filename(); std::find(own.begin(), own.end(), name) == own.end())
      throw InputError(fmt::format(
          "{}: expected an empty folder or an earlier run's, found \"{}\" in it; name another folder with -o",
          target.string(), name));
}

// Every file below the folder is on the disk when this returns.
void sync_file_system_of(const fs::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY);
  const bool synced = descriptor >= 0 && ::syncfs(descriptor) == 0;
  const int reason = errno;
  if (descriptor >= 0) ::close(descriptor);
  if (!synced)
    throw OperationError(fmt::format("{}: cannot be written out: {}", folder.string(), std::strerror(reason)));
}

}  // namespace

OutputFolder::OutputFolder(fs::path target, const std::vector<std::string>& own) : target_(std::move(target)) {
  if (!target_.has_filename()) target_ = target_.parent_path();  // "out/"
  part_ = target_.string() + ".part";
  const fs::path parent = target_.has_parent_path() ? target_.parent_path() : fs::path(".");
  if (!fs::is_directory(parent))
    throw InputError(fmt::format("{}: expected an existing folder to write into, found none", parent.string()));
  if (fs::exists(target_)) refuse_foreign_entries(target_, own);
  if (fs::exists(part_)) refuse_foreign_entries(part_, own);  // what a killed run left
  std::error_code error;
  fs::remove_all(part_, error);
  if (!fs::create_directory(part_, error))
    throw InputError(fmt::format("{}: cannot be created: {}", part_.string(), error.message()));
}

OutputFolder::~OutputFolder() {
  std::error_code ignored;
  fs::remove_all(part_, ignored);
}

void OutputFolder::commit() {
  sync_file_system_of(part_);
  // An exchange leaves no moment without a whole folder; the old one is then at part_ and the destructor removes it.
  const unsigned how = fs::exists(target_) ? RENAME_EXCHANGE : 0;
  if (::renameat2(AT_FDCWD, part_.c_str(), AT_FDCWD, target_.c_str(), how) != 0)
    throw OperationError(fmt::format("{}: cannot be put in place: {}", target_.string(), std::strerror(errno)));
  sync_file_system_of(target_);
}

}  // namespace palpate
