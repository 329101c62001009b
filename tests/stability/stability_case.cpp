#include "tests/stability/stability_case.h"

namespace palpate::tests {

void StabilityCase::hold(const std::string& figure, double measured, double bound, const std::string& reason) {
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

void StabilityCase::point(const std::string& sweep, const std::string& curve, double x, double y) {
  nlohmann::ordered_json line = named("point");
  line["sweep"] = sweep, line["curve"] = curve, line["x"] = number(x), line["y"] = number(y);
  print(line);
}

nlohmann::ordered_json StabilityCase::named(const char* kind) {
  const auto* test = testing::UnitTest::GetInstance()->current_test_info();
  nlohmann::ordered_json line;
  line["stability"] = kind, line["group"] = test->test_suite_name(), line["case"] = test->name();
  return line;
}

double StabilityCase::processor_seconds() {
  double sum = 0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage used = {};
    ::getrusage(who, &used);
    for (const timeval& t : {used.ru_utime, used.ru_stime})
      sum += static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  }
  return sum;
}

nlohmann::ordered_json StabilityCase::number(double x) {
  if (std::isfinite(x)) return x;
  return std::isnan(x) ? "nan" : x > 0 ? "inf" : "-inf";
}

void StabilityCase::print(const nlohmann::ordered_json& line) {
  std::printf("%s\n", line.dump().c_str());
  std::fflush(stdout);
}

}  // namespace palpate::tests
