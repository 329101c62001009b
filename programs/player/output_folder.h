// A folder of results that is whole or absent: it is written as NAME.part and renamed to NAME at the end.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace palpate {

class OutputFolder {
 public:
  // own: the entries that a finished folder may hold. A target that holds anything else is refused, not replaced.
  // Errors: InputError for such a target or one whose parent does not exist.
  OutputFolder(std::filesystem::path target, const std::vector<std::string>& own);
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;
  ~OutputFolder();

  const std::filesystem::path& part() const { return part_; }

  // Writes all files to the disk (fsync), then exchanges part() and the target. Errors: OperationError.
  void commit();

 private:
  std::filesystem::path target_, part_;
};

}  // namespace palpate
