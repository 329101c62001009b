// Points measured so far: a JSON file each, named by the fingerprint of all that decides it, written atomically.
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
  // Errors: InputError where the file is no measured point.
  std::optional<MeasuredPoint> find(const std::string& key) const;
  // Errors: OperationError.
  void add(const std::string& key, const MeasuredPoint& point) const;

 private:
  std::filesystem::path folder_;
};

}  // namespace palpate::accuracy
