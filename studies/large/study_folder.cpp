#include "studies/large/study_folder.h"

#include <fmt/format.h>

#include <fstream>

#include "formats/atomic_file.h"
#include "formats/checksum.h"
#include "formats/program.h"
#include "studies/accuracy/command.h"
#include "studies/accuracy/results.h"

namespace palpate::large {

using Json = nlohmann::ordered_json;

StudyFolder::StudyFolder(const accuracy::OrganCase& organ)
    // The runtime that is measured is inside the program.
    : organ_(organ), own_hash_(sha256_of_file("/proc/self/exe")) {}

std::filesystem::path StudyFolder::bake(const std::filesystem::path& mesh, const std::filesystem::path& organ,
                                        const std::string& name) const {
  const auto bundle = path() / "bundles" / (name + ".h5");
  std::filesystem::create_directories(bundle.parent_path());
  const auto command = accuracy::precompute_command(organ_.options().bin, mesh, organ, organ_.boundary_file(),
                                                    {"--large-deformation", "-o", bundle.string()});
  accuracy::run_command(command, path() / "logs" / (name + ".txt"));
  return bundle;
}

LargeBody StudyFolder::body(const std::filesystem::path& mesh, const std::filesystem::path& organ) const {
  const OrganConfig config = read_organ_config(organ);
  std::vector<LawForm> forms;
  for (const auto& region : config.regions)
    forms.push_back(region.law          ? form_of_row(region.law->numbers.data())
                    : region.stiffening ? region.stiffening->value
                                        : LawForm());
  return {make_elastic_body(read_mesh(mesh), config, read_boundary_config(organ_.boundary_file()),
                            {mesh, organ, organ_.boundary_file()}),
          config.element == Element::p1_anp, forms};
}

Json StudyFolder::kept_or_measured(const std::vector<std::filesystem::path>& files, const Json& settings,
                                   const Measure& measure) const {
  Json decides = {{"settings", settings}, {"measured_by", own_hash_}};
  for (const auto& file : files) decides["files"].push_back(sha256_of_file(file.string()));
  decides["files"].push_back(sha256_of_file(organ_.boundary_file().string()));
  const std::string key = decides.dump();
  const auto file = path() / "points" / fmt::format("{:016x}.json", formats::xxh64(key.data(), key.size()));
  if (std::ifstream in(file); in)
    if (Json known = Json::parse(in, nullptr, false); known.is_object()) return known;
  const auto parts = std::filesystem::path(file).replace_extension("parts");
  std::filesystem::create_directories(parts);
  Json point = measure(parts);
  write_text_atomically(file, point.dump(1) + "\n");
  std::filesystem::remove_all(parts);
  return point;
}

void StudyFolder::write(const std::string& name, Json study, const std::vector<Json>& rows) const {
  const accuracy::StudyOptions& options = organ_.options();
  Json all = {{"program", "large_study"},       {"program_version", PALPATE_VERSION},
              {"organ", options.organ},         {"boundary", options.boundary},
              {"radius_mm", options.radius_mm}, {"machine", accuracy::machine_json()}};
  all.update(study);
  accuracy::write_results(path(), name, all, rows);
  note(accuracy::write_report(options.python, options.source, "large", path(), name).string() + ": the report");
}

}  // namespace palpate::large
