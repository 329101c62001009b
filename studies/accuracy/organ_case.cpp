#include "studies/accuracy/organ_case.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <toml++/toml.h>
#include <algorithm>
#include <cmath>
#include <sstream>

#include "formats/atomic_file.h"
#include "formats/errors.h"
#include "studies/accuracy/command.h"

namespace palpate::accuracy {
namespace {

// Edges beyond the disc's rim that a contact may reach, also after a drag.
constexpr double kEdgesAround = 2.5;

std::string text_of_table(const toml::table& table) {
  std::ostringstream text;
  text << table << '\n';
  return text.str();
}

std::filesystem::path write_variant(const std::filesystem::path& file, const std::string& text) {
  std::filesystem::create_directories(file.parent_path());
  write_text_atomically(file, text);
  return file;
}

// A config names files relative to its folder; a variant lies in another one.
void make_files_absolute(toml::node& node, const std::filesystem::path& folder) {
  if (auto* list = node.as_array())
    for (auto& one : *list) make_files_absolute(one, folder);
  if (auto* table = node.as_table())
    for (auto&& [key, value] : *table) {
      auto* name = key == "image" || key == "file" ? value.as_string() : nullptr;
      if (name) *name = (folder / name->get()).string();
      make_files_absolute(value, folder);
    }
}

double mean_edge(const ElasticBody& body) {
  double sum = 0;
  for (const auto& t : body.triangles)
    for (std::size_t v = 0; v < 3; ++v)
      sum += length(load3(body.nodes[static_cast<std::size_t>(t[v])].data()) -
                    load3(body.nodes[static_cast<std::size_t>(t[(v + 1) % 3])].data()));
  return sum / (3 * static_cast<double>(body.triangles.size()));
}

}  // namespace

std::string organ_text(const std::filesystem::path& organ_toml, const std::string& element, double poisson,
                       double stiffening) {
  toml::table organ = toml::parse_file(organ_toml.string());
  organ.insert_or_assign("element", element);
  for (const auto& [key, value] : {std::pair("poisson", poisson), std::pair("stiffening", stiffening)})
    if (value != 0)
      for (auto& region : *organ["region"].as_array())
        region.as_table()->insert_or_assign(
            key, toml::table{{"value", value}, {"source", "one of those that the study compares"}});
  if (auto* response = organ["response"].as_table())
    response->insert_or_assign(
        "curve", std::filesystem::absolute(organ_toml.parent_path() / (*response)["curve"].value_or("")).string());
  return text_of_table(organ);
}

OrganCase::OrganCase(StudyOptions options) : options_(std::move(options)) {
  for (auto* path : {&options_.source, &options_.bin, &options_.data}) *path = std::filesystem::absolute(*path);
  if (!std::filesystem::exists(folder() / "organ.toml"))
    throw InputError(
        fmt::format("{}: expected an organ of the pipelines, found none; make -f Makefile.data help lists them",
                    folder().string()));
  if (!std::filesystem::exists(boundary_file()))
    throw InputError(fmt::format("{}: expected a boundary set, found none; see the folder for those there are",
                                 boundary_file().string()));
  if (options_.output.empty()) options_.output = options_.data / options_.organ / "accuracy" / options_.boundary;
  options_.output = std::filesystem::absolute(options_.output);
  std::filesystem::create_directories(options_.output / "logs");
  choose_resolutions();
}

// As the pipeline's rules find it: in the folder of the variable ORGANS_DIR first.
std::filesystem::path OrganCase::folder() const {
  const std::string variable = "ORGANS_DIR=";
  for (const std::string& given : options_.make_variables)
    if (given.rfind(variable, 0) == 0)
      if (const auto own = std::filesystem::absolute(given.substr(variable.size())) / options_.organ;
          std::filesystem::exists(own))
        return own;
  return options_.source / "pipelines" / options_.organ;
}

// target at a resolution, "" for the default.
std::vector<std::string> OrganCase::make(const std::string& resolution, const std::string& target) const {
  std::vector<std::string> command = {"make",
                                      "--no-print-directory",
                                      "-s",
                                      "-C",
                                      options_.source.string(),
                                      "-f",
                                      "pipelines/built.mk",
                                      "BIN=" + options_.bin.string(),
                                      "DATA=" + options_.data.string(),
                                      "ORGAN=" + options_.organ,
                                      "BC=" + options_.boundary};
  if (!resolution.empty()) command.push_back("RESOLUTION=" + resolution);
  command.insert(command.end(), options_.make_variables.begin(), options_.make_variables.end());
  command.push_back(target);
  return command;
}

void OrganCase::choose_resolutions() {
  std::istringstream words(output_of(make("", "show-resolutions")));
  words >> base_;
  std::vector<std::string> usual, known;  // known: the larger ones, too
  bool larger = false;
  for (std::string word; words >> word;) {
    if (word == "/") {
      larger = true;
      continue;
    }
    known.push_back(word);
    if (!larger) usual.push_back(word);
  }
  for (const auto& wanted : options_.resolutions)
    if (std::find(known.begin(), known.end(), wanted) == known.end())
      throw InputError(fmt::format("--resolutions {}: expected some of {}", wanted, fmt::join(known, ", ")));
  if (options_.resolutions.empty()) options_.resolutions = usual;
  const auto& all = options_.resolutions;
  if (std::find(all.begin(), all.end(), base_) == all.end()) base_ = all[all.size() / 2];
}

bool OrganCase::has_response() const {
  return read_organ_config(folder() / "organ.toml").response.has_value();
}

std::string OrganCase::element() const {
  return name_of(read_organ_config(folder() / "organ.toml").element);
}

double OrganCase::poisson() const {
  const auto regions = read_organ_config(folder() / "organ.toml").regions;
  const double first = regions.at(0).poisson.value;
  const bool alike = std::all_of(regions.begin(), regions.end(), [&](auto& r) { return r.poisson.value == first; });
  return alike ? first : NAN;
}

std::filesystem::path OrganCase::make_mesh(const std::string& resolution) const {
  auto& mesh = meshes_[resolution];
  if (mesh.empty()) {
    run_command(make(resolution, "mesh"), options_.output / "logs" / ("mesh-" + resolution + ".txt"));
    mesh = options_.data / options_.organ / resolution / "mesh.msh";
  }
  return mesh;
}

std::filesystem::path OrganCase::organ_file(const std::string& element, double poisson, double stiffening) const {
  const std::string name = element + (poisson != 0 ? fmt::format("-nu-{}", poisson) : "") +
                           (stiffening != 0 ? fmt::format("-stiffening-{}", stiffening) : "");
  return write_variant(options_.output / "inputs" / (name + ".toml"),
                       organ_text(folder() / "organ.toml", element, poisson, stiffening));
}

std::filesystem::path OrganCase::boundary_file() const {
  return folder() / "boundary" / (options_.boundary + ".toml");
}

std::filesystem::path OrganCase::boundary_file(const StudySites& sites, const std::string& resolution) const {
  auto& file = boundaries_[resolution];
  if (!file.empty()) return file;
  toml::table boundary = toml::parse_file(boundary_file().string());
  if (boundary.contains("touchable")) return file = boundary_file();
  make_files_absolute(boundary, boundary_file().parent_path());
  const ElasticBody mesh = body(resolution);
  const double reach = (1 + kDragDistance) * sites.radius + kEdgesAround * mean_edge(mesh);
  const double mesh_units_per_metre = 1 / read_organ_config(folder() / "organ.toml").mesh_unit.metres;
  toml::array select;
  for (const auto* list : {&sites.touch, &sites.neighbour})
    for (const auto& site : *list) {
      const Vec3 c = mesh_units_per_metre * site.at;
      select.push_back(toml::table{
          {"sphere", toml::table{{"center", toml::array{c.x, c.y, c.z}}, {"radius", mesh_units_per_metre * reach}}}});
    }
  // A selector without a node is an error, and on coarse meshes a sphere may contain none.
  toml::array nearest;
  for (const auto& site : sites.touch) {
    const Vec3 c = mesh_units_per_metre * site.at;
    nearest.push_back(toml::array{c.x, c.y, c.z});
  }
  select.push_back(toml::table{{"nearest", toml::table{{"points", nearest}}}});
  boundary.insert_or_assign("touchable", toml::table{{"select", select}});
  return file = write_variant(options_.output / "inputs" / (options_.boundary + "-near-sites-" + resolution + ".toml"),
                              text_of_table(boundary));
}

ElasticBody OrganCase::body(const std::string& resolution) const {
  const auto mesh = make_mesh(resolution), organ = folder() / "organ.toml";
  return make_elastic_body(read_mesh(mesh), read_organ_config(organ), read_boundary_config(boundary_file()),
                           {mesh, organ, boundary_file()});
}

}  // namespace palpate::accuracy
