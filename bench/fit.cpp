// What palpate-fit --large saves, as a ratio: sets of constants of the stiffening law near one another, each with the points of a difference quotient,
// solved as a fit solves them and each from rest.
//   fit_bench BUNDLE.h5 MEASUREMENTS.csv [plate|sticking-plate|sliding|sticking]
#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <string>

#include "programs/fit/large_press.h"
#include "programs/fit/measurements.h"
#include "studies/timing/timing.h"

namespace palpate::fit {
namespace {

constexpr double kConstants[] = {1, 1.3, 1.25, 1.24};
constexpr double kStep = 1e-3;

void measure(const std::string& bundle_file, const std::string& file, Press press) {
  ReadOptions options;
  options.curves = true, options.plate = is_plate(press);
  const Measurements measurements = read_measurements(file, options);
  PressedBundle bundle(bundle_file);
  const double begun = studies::processor_seconds();
  const LargePress followed(bundle, measurements, press);
  for (const double b : kConstants) followed.forces({LawForm(b), LawForm(b + kStep)});
  const double of_followed = studies::processor_seconds() - begun;
  for (const double b : kConstants)
    for (const double step : {0.0, kStep}) LargePress(bundle, measurements, press).forces({LawForm(b + step)});
  const double alone = studies::processor_seconds() - begun - of_followed;
  std::printf("%.2f s as a fit solves them, %.2f s from rest: a ratio of %.2f\n", of_followed, alone,
              alone / of_followed);
}

}  // namespace
}  // namespace palpate::fit

int main(int argc, char** argv) {
  using palpate::fit::Press;
  const std::string way = argc > 3 ? argv[3] : "plate";
  if (argc < 3 || argc > 4) {
    std::fputs("usage: fit_bench BUNDLE.h5 MEASUREMENTS.csv [plate|sticking-plate|sliding|sticking]\n", stderr);
    return 2;
  }
  try {
    palpate::fit::measure(argv[1], argv[2],
                          way == "sticking-plate" ? Press::sticking_plate
                          : way == "sliding"      ? Press::sliding
                          : way == "sticking"     ? Press::sticking
                                                  : Press::plate);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
