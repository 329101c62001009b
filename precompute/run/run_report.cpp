#include "precompute/run/run_report.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "formats/program.h"
#include "precompute/run/stopwatch.h"

namespace palpate {

void RunReport::time(const std::string& name, const std::function<void()>& work) {
  double seconds = 0;
  {
    const Stopwatch watch(&seconds);
    ranks_.together(work);
  }
  peak_bytes_ = ranks_.sum(own_peak_.after_stage(peak_resident_bytes(), shared_resident_bytes(), ranks_.here()));
  stages_.push_back({name, seconds, peak_bytes_});
  say(fmt::format("{}: {:.2f} s, {:.2f} GB", name, seconds, peak_bytes_ / 1e9));
}

double RunReport::seconds() const {
  double sum = 0;
  for (const auto& stage : stages_) sum += stage.seconds;
  return sum;
}

double RunReport::seconds_of(const std::string& name) const {
  double sum = 0;
  for (const auto& stage : stages_)
    if (stage.name == name) sum += stage.seconds;
  return sum;
}

nlohmann::ordered_json RunReport::json() const {
  nlohmann::ordered_json report;
  report["ranks"] = ranks_.count();
  for (const auto& stage : stages_)
    report["stages"].push_back({{"name", stage.name}, {"seconds", stage.seconds}, {"peak_bytes", stage.peak_bytes}});
  report["seconds"] = seconds();
  report["peak_bytes"] = peak_bytes_;
  return report;
}

}  // namespace palpate
