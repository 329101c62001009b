// fit_coverage [REPETITIONS]: the share of made-up measurements whose 95 % interval holds the truth, for laws, numbers of specimens and kinds of
// error. Ends with exit code 3 where a share is below 95 % by more than three standard deviations of such a count.
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "tests/programs/fit/made_curves.h"

namespace palpate::fit {
namespace {

struct Errors {
  const char* name;
  double of_units, along_curves, of_law, of_rows, length;
};
constexpr Errors kErrors[] = {{"specimens differ", 0.05, 0, 0, 0.005, 0.3},
                              {"correlated along curves", 0.03, 0.03, 0, 0.002, 0.3},
                              {"short correlation", 0.03, 0.03, 0, 0.002, 0.1},
                              {"the law is off", 0.03, 0.01, 0.03, 0.002, 0.3},
                              {"off, short correlation", 0.03, 0.01, 0.03, 0.002, 0.12},
                              {"off, long correlation", 0.03, 0.01, 0.03, 0.002, 0.6}};

int study(int repetitions) {
  const std::pair<LawFamily, std::vector<double>> laws[] = {{LawFamily(FittedLaw::neo_hookean, {}), {}},
                                                            {LawFamily(FittedLaw::stiffening, {}), {3.5}},
                                                            {LawFamily(FittedLaw::ogden, {}), {-4.7}},
                                                            {LawFamily(FittedLaw::yeoh, {}), {0.2, 0.3}}};
  const double least = 0.95 - 3 * std::sqrt(0.95 * 0.05 / repetitions);
  bool all = true;
  std::printf("%d measurements each; shares whose interval holds the truth: modulus, constants\n", repetitions);
  for (const auto& [family, constants] : laws)
    for (const int units : {1, 2, 3, 5, 6, 8, 12})
      for (const Errors& errors : kErrors) {
        // One specimen says nothing of what specimens differ by.
        Noise noise;
        noise.units = units, noise.of_units = units == 1 ? 0 : errors.of_units;
        noise.along_curves = errors.along_curves, noise.of_law = errors.of_law;
        noise.of_rows = errors.of_rows, noise.length = errors.length;
        const Coverage held = coverage(family, constants, noise, repetitions);
        std::printf("%-12s %2d specimens, %-26s %.3f", family.name(), units, errors.name, held.shear);
        bool holds = held.shear >= least;
        for (const double share : held.constants) std::printf(" %.3f", share), holds = holds && share >= least;
        std::printf("%s; widths %.3f", holds ? "" : " BELOW", held.median_width);
        std::printf("\n");
        all = all && holds;
      }
  return all ? 0 : 3;
}

}  // namespace
}  // namespace palpate::fit

int main(int argc, char** argv) {
  return palpate::fit::study(argc > 1 ? std::max(1, std::atoi(argv[1])) : 1000);
}
