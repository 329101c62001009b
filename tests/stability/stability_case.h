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
  void hold(const std::string& figure, double measured, double bound, const std::string& reason) {
    const bool held = measured <= bound;
    const double now = processor_seconds();
    nlohmann::ordered_json line = named("figure");
    line["threat"] = threat_, line["figure"] = figure;
    line["measured"] = number(measured), line["bound"] = number(bound), line["reason"] = reason, line["held"] = held;
    line["seconds"] = now - begin_;
    print(line);
    EXPECT_TRUE(held) << figure << ": " << measured << " is not within " << bound << ", " << reason;
    begin_ = processor_seconds();
  }

  // A point of a curve that the report draws.
  void point(const std::string& sweep, const std::string& curve, double x, double y) {
    nlohmann::ordered_json line = named("point");
    line["sweep"] = sweep, line["curve"] = curve, line["x"] = number(x), line["y"] = number(y);
    print(line);
  }

 private:
  static nlohmann::ordered_json named(const char* kind) {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    nlohmann::ordered_json line;
    line["stability"] = kind, line["group"] = test->test_suite_name(), line["case"] = test->name();
    return line;
  }
  // Processor time of this process and of the programs that it has run.
  static double processor_seconds() {
    double sum = 0;
    for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
      rusage used = {};
      ::getrusage(who, &used);
      for (const timeval& t : {used.ru_utime, used.ru_stime})
        sum += static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    }
    return sum;
  }
  // JSON has no NaN and no infinity.
  static nlohmann::ordered_json number(double x) {
    if (std::isfinite(x)) return x;
    return std::isnan(x) ? "nan" : x > 0 ? "inf" : "-inf";
  }
  static void print(const nlohmann::ordered_json& line) {
    std::printf("%s\n", line.dump().c_str());
    std::fflush(stdout);
  }

  std::string threat_;
  double begin_;
};

}  // namespace palpate::tests
