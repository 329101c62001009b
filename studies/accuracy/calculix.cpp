#include "studies/accuracy/calculix.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/resource.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "formats/errors.h"
#include "studies/accuracy/command.h"

namespace palpate::accuracy {
namespace {

// Processor time of all child processes that have ended, s.
double children_seconds() {
  rusage used{};
  ::getrusage(RUSAGE_CHILDREN, &used);
  return static_cast<double>(used.ru_utime.tv_sec + used.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(used.ru_utime.tv_usec + used.ru_stime.tv_usec);
}

// Lines "  node  ux  uy  uz" of the .dat file.
std::vector<std::array<double, 3>> read_displacements(const std::filesystem::path& file, std::size_t count) {
  std::vector<std::array<double, 3>> u(count, {NAN, NAN, NAN});
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    std::istringstream cells(line);
    std::size_t n = 0;
    std::array<double, 3> v{};
    if (cells >> n >> v[0] >> v[1] >> v[2] && n >= 1 && n <= count) u[n - 1] = v;
  }
  for (std::size_t n = 0; n < count; ++n)
    if (std::isnan(u[n][0]))
      throw OperationError(fmt::format("{}: expected the displacement of node {}, found none", file.string(), n + 1));
  return u;
}

}  // namespace

std::string elastic_words(const Material& material) {
  return fmt::format("*ELASTIC\n{:.12e},{:.12e}\n", material.young, material.poisson);
}

CalculixModel linear_model(const ElasticBody& body, std::function<std::string(const Material&)> words) {
  CalculixModel model = {body.nodes, body.fixed, {}, std::move(words)};
  for (const auto& t : body.tetrahedra) model.cells.emplace_back(t.begin(), t.end());
  return model;
}

void write_calculix_model(fmt::ostream& out, const ElasticBody& body, const CalculixModel& model) {
  if (!body.foundations.empty() || !body.springs.empty())
    throw InputError(
        "the comparison with CalculiX knows no soft supports: expected a boundary set of [[fixed]] alone, found "
        "[[foundation]] or [[spring]]; name another set, for example BC=right-side");
  // CalculiX reads only the first 20 characters of a number and does not warn.
  out.print("*NODE, NSET=ALL\n");
  for (std::size_t n = 0; n < model.nodes.size(); ++n)
    out.print("{},{:.12e},{:.12e},{:.12e}\n", n + 1, model.nodes[n][0], model.nodes[n][1], model.nodes[n][2]);
  std::vector<std::int32_t> numbers;
  for (std::size_t r = 0; r < body.materials.size(); ++r) {
    out.print("*ELEMENT, TYPE=C3D{}, ELSET=R{}\n", model.cells.at(0).size(), r);
    for (std::size_t e = 0; e < model.cells.size(); ++e) {
      if (body.region[e] != static_cast<std::int32_t>(r)) continue;
      numbers.clear();
      for (const auto n : model.cells[e]) numbers.push_back(n + 1);
      out.print("{},{}\n", e + 1, fmt::join(numbers, ","));
    }
    out.print("*MATERIAL, NAME=M{0}\n{1}*SOLID SECTION, ELSET=R{0}, MATERIAL=M{0}\n", r,
              model.words(body.materials[r]));
  }
  out.print("*BOUNDARY\n");
  for (std::size_t n = 0; n < model.fixed.size(); ++n)
    for (std::size_t d = 0; d < 3; ++d)
      if (model.fixed[n][d]) out.print("{},{},{}\n", n + 1, d + 1, d + 1);
}

void run_calculix(const std::filesystem::path& folder, const std::string& name) {
  run_command({"env", "-C", folder.string(), "OMP_NUM_THREADS=1", "ccx", name}, folder / "log.txt");
}

CalculixAnswer solve_by_calculix(const std::filesystem::path& folder, const ElasticBody& body,
                                 const CalculixModel& model, std::span<const double> load) {
  std::filesystem::create_directories(folder);
  {
    auto out = fmt::output_file((folder / "body.inp").string());
    write_calculix_model(out, body, model);
    out.print("*STEP\n*STATIC\n*CLOAD\n");
    for (std::size_t i = 0; i < load.size(); ++i)
      if (load[i] != 0) out.print("{},{},{:.12e}\n", i / 3 + 1, i % 3 + 1, load[i]);
    out.print("*NODE PRINT, NSET=ALL\nU\n*END STEP\n");
  }
  const double begun = children_seconds();
  run_calculix(folder, "body");
  CalculixAnswer answer = {read_displacements(folder / "body.dat", model.nodes.size()), children_seconds() - begun};
  std::filesystem::remove_all(folder);
  return answer;
}

}  // namespace palpate::accuracy
