// law_errors CURVES.csv...: which usual error of laws (programs/fit/model_error.h) the measured curves of compressed cylinders make most likely.
// The files are those of studies/reality. Each silicone is fitted with each law between sliding plates from 5 to 50 % of compression; the evidence of
// all is summed for each correlation length.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>

#include "formats/csv_lines.h"
#include "formats/program.h"
#include "tests/programs/fit/made_curves.h"

namespace palpate::fit {
namespace {

constexpr double kLeastStrain = 0.05, kMostStrain = 0.5;
constexpr double kUsual[] = {0.05, 0.07, 0.1, 0.12, 0.14, 0.16, 0.18, 0.2, 0.22, 0.24,
                             0.26, 0.28, 0.3, 0.35, 0.4,  0.5,  0.7,  1,   1.5};

struct Silicone {
  CurveData data;
  std::vector<std::string> specimens;
};

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells(1);
  for (const char c : line) c == ',' ? void(cells.emplace_back()) : cells.back().push_back(c);
  return cells;
}

void read(const std::string& file, std::map<std::string, Silicone>* silicones) {
  CsvLines lines(file, "measured curves");
  std::map<std::string, std::size_t> column;
  while (lines.next()) {
    const auto cells = cells_of(lines.text());
    if (column.empty()) {
      for (std::size_t c = 0; c < cells.size(); ++c) column[cells[c]] = c;
      for (const char* name : {"silicone", "specimen", "strain", "force_N"})
        if (!column.count(name)) lines.refuse(std::string("a column ") + name, lines.text());
      continue;
    }
    const auto cell = [&](const char* name) { return cells.at(column.at(name)); };
    const double strain = std::atof(cell("strain").c_str()), force = std::atof(cell("force_N").c_str());
    if (strain < kLeastStrain - 1e-9 || strain > kMostStrain + 1e-9) continue;
    Silicone& of = (*silicones)[cell("silicone")];
    auto at = std::find(of.specimens.begin(), of.specimens.end(), cell("specimen"));
    if (at == of.specimens.end()) at = of.specimens.insert(at, cell("specimen"));
    const int unit = static_cast<int>(at - of.specimens.begin());
    of.data.units = static_cast<int>(of.specimens.size());
    of.data.force.push_back(force), of.data.strain.push_back(strain);
    of.data.curve.push_back(unit), of.data.unit.push_back(unit);
  }
}

void print_evidence(const char* name, const std::vector<std::vector<double>>& evidence) {
  std::printf("%-12s", name);
  double best = evidence[0][0];
  for (const auto& row : evidence)
    for (const double value : row) best = std::max(best, value);
  for (std::size_t l = 0; l < std::size(kErrorLengths); ++l) {
    std::size_t most = 0;
    for (std::size_t k = 0; k < evidence.size(); ++k)
      if (evidence[k][l] > evidence[most][l]) most = k;
    std::printf("  %g: %g (%.1f)", kErrorLengths[l], kUsual[most], evidence[most][l] - best);
  }
  std::printf("\n");
}

void study(int count, char** files) {
  std::map<std::string, Silicone> silicones;
  for (int f = 0; f < count; ++f) read(files[f], &silicones);
  std::printf(
      "%zu silicones. Correlation length over the largest strain: the usual error of the largest likelihood (its "
      "logarithm less the largest)\n",
      silicones.size());
  std::vector<std::vector<double>> all(std::size(kUsual), std::vector<double>(std::size(kErrorLengths)));
  for (const FittedLaw law : {FittedLaw::neo_hookean, FittedLaw::stiffening, FittedLaw::yeoh, FittedLaw::ogden}) {
    const LawFamily family(law, {});
    std::vector<std::vector<double>> of_law(std::size(kUsual), std::vector<double>(std::size(kErrorLengths)));
    for (std::size_t k = 0; k < std::size(kUsual); ++k)
      for (const auto& [name, silicone] : silicones) {
        CurveOptions options;
        options.usual_error = kUsual[k], options.repetitions = 200;
        const auto found = fit_curves(silicone.data, family, shape_model(silicone.data), options, name).law_evidence;
        for (std::size_t l = 0; l < found.size(); ++l) of_law[k][l] += found[l], all[k][l] += found[l];
      }
    print_evidence(family.name(), of_law);
  }
  print_evidence("all", all);
}

}  // namespace
}  // namespace palpate::fit

int main(int argc, char** argv) {
  if (argc < 2) return std::fputs("usage: law_errors CURVES.csv...\n", stderr), 2;
  try {
    palpate::fit::study(argc - 1, argv + 1);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
