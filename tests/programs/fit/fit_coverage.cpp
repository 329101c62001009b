// fit_coverage [REPETITIONS]: the share of made-up measurements whose 95 % interval holds the truth, for laws, numbers of specimens and kinds of
// error. Ends with exit code 3 where a share is below 95 % by more than three standard deviations of such a count.
#include <fmt/format.h>

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

// Measurements that nothing was chosen on: other shapes, depths, numbers of specimens, constants and kinds of error.
struct OtherBody {
  const char* name;
  Shape shape;
  int depths;
  double least_strain, most_strain;
};
constexpr OtherBody kOtherBodies[] = {{"squeezed between walls", Shape::squeezed, 7, 0.05, 0.35},
                                      {"sheared", Shape::sheared, 16, 0.02, 0.5},
                                      {"twisted", Shape::twisted, 9, 0.1, 0.4}};
constexpr Errors kOtherErrors[] = {{"rough along curves", 0.04, 0.02, 0, 0.002, 0.25},
                                   {"the law is off, rough", 0.04, 0.01, 0.04, 0.002, 0.4},
                                   {"the zero of depth is off", 0.04, 0.01, 0, 0.002, 0.25}};

class Table {
 public:
  explicit Table(int repetitions) : least_(0.95 - 3 * std::sqrt(0.95 * 0.05 / repetitions)) {}

  void add(const std::string& what, const Coverage& held) {
    std::printf("%s %.3f", what.c_str(), held.shear);
    std::vector<double> shares = held.constants;
    shares.push_back(held.shear);
    for (const double share : held.constants) std::printf(" %.3f", share);
    const double lowest = *std::min_element(shares.begin(), shares.end());
    std::printf("%s; widths %.3f\n", lowest >= least_ ? "" : " BELOW", held.median_width);
    below_ += lowest < least_, lowest_ = std::min(lowest_, lowest), ++cases_;
  }
  // Whether all shares hold.
  bool end(const char* name) const {
    std::printf("%s: %d cases, %d below; the lowest share %.3f\n", name, cases_, below_, lowest_);
    return below_ == 0;
  }

 private:
  double least_, lowest_ = 1;
  int cases_ = 0, below_ = 0;
};

Noise noise_of(const Errors& errors, int units) {
  Noise noise;
  // One specimen says nothing of what specimens differ by.
  noise.units = units, noise.of_units = units == 1 ? 0 : errors.of_units;
  noise.along_curves = errors.along_curves, noise.of_law = errors.of_law;
  noise.of_rows = errors.of_rows, noise.length = errors.length;
  return noise;
}

std::string title(const LawFamily& family, int units, const std::string& errors) {
  return fmt::format("{:<12} {:2} specimens, {:<26}", family.name(), units, errors);
}

bool compressed_cylinders(int repetitions) {
  const std::pair<LawFamily, std::vector<double>> laws[] = {{LawFamily(FittedLaw::neo_hookean, {}), {}},
                                                            {LawFamily(FittedLaw::stiffening, {}), {3.5}},
                                                            {LawFamily(FittedLaw::ogden, {}), {-4.7}},
                                                            {LawFamily(FittedLaw::yeoh, {}), {0.2, 0.3}}};
  Table table(repetitions);
  for (const auto& [family, constants] : laws)
    for (const int units : {1, 2, 3, 5, 6, 8, 12})
      for (const Errors& errors : kErrors)
        table.add(title(family, units, errors.name), coverage(family, constants, noise_of(errors, units), repetitions));
  return table.end("compressed cylinders");
}

bool other_bodies(int repetitions) {
  const std::pair<LawFamily, std::vector<double>> laws[] = {{LawFamily(FittedLaw::neo_hookean, {}), {}},
                                                            {LawFamily(FittedLaw::stiffening, {}), {1.2}},
                                                            {LawFamily(FittedLaw::ogden, {}), {6}},
                                                            {LawFamily(FittedLaw::yeoh, {}), {-0.05, 0.1}}};
  Table table(repetitions);
  for (const OtherBody& body : kOtherBodies)
    for (const auto& [family, constants] : laws)
      for (const int units : {1, 4, 7, 10})
        for (const Errors& errors : kOtherErrors) {
          Noise noise = noise_of(errors, units);
          noise.shape = body.shape, noise.depths = body.depths, noise.rough = true;
          noise.least_strain = body.least_strain, noise.most_strain = body.most_strain;
          noise.of_zero = &errors == &kOtherErrors[2] ? 0.01 : 0;
          table.add(title(family, units, fmt::format("{}, {}", body.name, errors.name)),
                    coverage(family, constants, noise, repetitions));
        }
  return table.end("other bodies and errors");
}

// The curves are of Ogden's law with two terms, drawn anew for each measurement, and another law is fitted. Its modulus is judged.
bool other_laws(int repetitions) {
  Table table(repetitions);
  for (const OtherBody& body : kOtherBodies)
    for (const FittedLaw law : {FittedLaw::neo_hookean, FittedLaw::stiffening, FittedLaw::ogden, FittedLaw::yeoh})
      for (const int units : {4, 10}) {
        const LawFamily family(law, {});
        Noise noise = noise_of({"", 0.04, 0.01, 0, 0.002, 0.25}, units);
        noise.shape = body.shape, noise.depths = body.depths;
        noise.least_strain = body.least_strain, noise.most_strain = body.most_strain;
        table.add(title(family, units, fmt::format("{}, of another law", body.name)),
                  coverage_of(family, {}, repetitions, [&](unsigned seed) {
                    std::mt19937_64 generator(seed + 77);
                    std::uniform_real_distribution<double> share(0, 0.6), first(2, 7), second(-7, -2);
                    const double exponent = first(generator), of_second = share(generator);
                    return MadeCurves(LawForm::ogden(exponent, of_second, second(generator)), noise, seed);
                  }));
      }
  return table.end("curves of another law");
}

int study(int repetitions) {
  std::printf("%d measurements each; shares whose interval holds the truth: modulus, constants\n", repetitions);
  bool all = compressed_cylinders(repetitions);
  all = other_bodies(repetitions) && all;
  all = other_laws(repetitions) && all;
  return all ? 0 : 3;
}

}  // namespace
}  // namespace palpate::fit

int main(int argc, char** argv) {
  return palpate::fit::study(argc > 1 ? std::max(1, std::atoi(argv[1])) : 1000);
}
