// What each stage of a run took: a line on the screen when the stage ends, and all stages as JSON at the end.
#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "precompute/ranks/ranks.h"
#include "precompute/solver/memory_left.h"

namespace palpate {

class RunReport {
 public:
  explicit RunReport(Ranks& ranks) : ranks_(ranks) {}

  // Runs step on every rank by Ranks::together(), so that the error of one rank is thrown on all. Prints how long the stage
  // took and how much memory all ranks together have held at most so far. Returns what step returns. Collective.
  template <class Step>
  std::invoke_result_t<Step> stage(const std::string& name, const Step& step) {
    std::optional<std::invoke_result_t<Step>> result;
    time(name, [&] { result.emplace(step()); });
    return std::move(*result);
  }

  double seconds() const;                            // of all stages
  double seconds_of(const std::string& name) const;  // of one stage
  double peak_bytes() const { return peak_bytes_; }
  OwnPeak& own_peak() { return own_peak_; }  // of this rank

  // Stages, seconds and bytes as JSON, for the report to add to.
  nlohmann::ordered_json json() const;

 private:
  struct Stage {
    std::string name;
    double seconds, peak_bytes;
  };
  void time(const std::string& name, const std::function<void()>& work);

  Ranks& ranks_;
  std::vector<Stage> stages_;
  OwnPeak own_peak_;
  double peak_bytes_ = 0;
};

}  // namespace palpate
