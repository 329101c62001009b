// A stability case: its threat, its figures with their bounds, and the points of its sweep. Each figure and each point is one
// line of JSON on stdout, which stability_report.py collects.
#pragma once

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>

namespace palpate::tests {

// PALPATE_STABILITY_LONG=1 asks for the long form: make -f Makefile.data stability LONG=1.
template <class Count>
Count quick_or_long(Count quick, Count longer) {
  const char* set = std::getenv("PALPATE_STABILITY_LONG");
  return set && *set && *set != '0' ? longer : quick;
}

class StabilityCase {
 public:
  // threat: what could go wrong, and why.
  explicit StabilityCase(std::string threat) : threat_(std::move(threat)), begin_(processor_seconds()) {}

  // Passes if measured <= bound, which NaN never is. reason: where the bound comes from. The seconds of a figure are processor
  // time since the figure before.
  void hold(const std::string& figure, double measured, double bound, const std::string& reason);

  // A point of a curve that the report draws.
  void point(const std::string& sweep, const std::string& curve, double x, double y);

 private:
  static nlohmann::ordered_json named(const char* kind);
  // Processor time of this process and of the programs that it has run.
  static double processor_seconds();
  // JSON has no NaN and no infinity.
  static nlohmann::ordered_json number(double x);
  static void print(const nlohmann::ordered_json& line);

  std::string threat_;
  double begin_;
};

}  // namespace palpate::tests
