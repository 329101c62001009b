// The points measured so far, one JSON file each. The file's name is a fingerprint of everything that decides the result;
// files are written atomically.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "studies/accuracy/bake.h"
#include "studies/accuracy/exercises.h"
#include "studies/accuracy/setting.h"

namespace palpate::accuracy {

struct MeasuredPoint {
  Setting setting;
  BakeCost cost;
  Observation seen;
};

class MeasuredPoints {
 public:
  explicit MeasuredPoints(std::filesystem::path folder);
  // Errors: InputError if the file is not a measured point.
  std::optional<MeasuredPoint> find(const std::string& key) const;
  // Errors: OperationError.
  void add(const std::string& key, const MeasuredPoint& point) const;

 private:
  std::filesystem::path folder_;
};

}  // namespace palpate::accuracy
