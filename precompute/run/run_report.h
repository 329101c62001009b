// What the stages of a run took: a line for each as it ends, and all as JSON.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "precompute/ranks/ranks.h"

namespace palpate {

class RunReport {
 public:
  explicit RunReport(Ranks& ranks) : ranks_(ranks) {}

  // Collective: work, then its line: how long it took and how much memory all ranks have had at most so far.
  void stage(const std::string& name, const std::function<void()>& work);

  double seconds() const;                            // of all stages
  double seconds_of(const std::string& name) const;  // of one
  double peak_bytes() const { return peak_bytes_; }

  // Stages, seconds and bytes as JSON, for the report to add to.
  nlohmann::ordered_json json() const;

 private:
  struct Stage {
    std::string name;
    double seconds, peak_bytes;
  };
  Ranks& ranks_;
  std::vector<Stage> stages_;
  double peak_bytes_ = 0;
};

}  // namespace palpate
