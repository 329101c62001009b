#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "precompute/palpate_bundle_commands.h"
#include "precompute/palpate_bundle_file.h"

namespace palpate {

using namespace formats;

namespace {

nlohmann::json counts_json(const BundleCounts& n) {
  return {{"nodes", n.nodes},           {"surface_nodes", n.surface_nodes},
          {"tetrahedra", n.tetrahedra}, {"triangles", n.triangles},
          {"regions", n.regions},       {"touchable", n.touchable}};
}

nlohmann::json materials_json(const BundleFile& file) {
  const auto names = file.region_names();
  const auto young = file.numbers<double>(SectionId::young), poisson = file.numbers<double>(SectionId::poisson);
  nlohmann::json materials = nlohmann::json::array();
  for (std::size_t r = 0; r < young.size(); ++r)
    materials.push_back({{"name", r < names.size() ? names[r] : ""}, {"young_pa", young[r]}, {"poisson", poisson[r]}});
  return materials;
}

nlohmann::json certificate_json(const BundleFile& file) {
  const auto residual = file.numbers<double>(SectionId::residual);
  const auto iterations = file.numbers<std::int32_t>(SectionId::iterations);
  // A residual that is no number is the worst.
  const auto worst = std::max_element(residual.begin(), residual.end(),
                                      [](double a, double b) { return !std::isnan(a) && (std::isnan(b) || a < b); });
  const auto column = static_cast<std::size_t>(worst - residual.begin());
  nlohmann::json json = {{"worst_residual", *worst},
                         {"worst_residual_node", file.numbers<std::int32_t>(SectionId::touchable)[column / 3]},
                         {"worst_residual_dof", std::string(1, "xyz"[column % 3])},
                         {"most_iterations", *std::max_element(iterations.begin(), iterations.end())}};
  const nlohmann::json provenance = file.provenance();
  for (const char* key : {"solver", "tolerance", "reciprocity_error", "cast_error"})
    if (provenance.is_object() && provenance.contains(key)) json[key] = provenance[key];
  return json;
}

nlohmann::json sections_json(const BundleIndex& index) {
  nlohmann::json sections = nlohmann::json::array();
  for (std::uint32_t i = 0; i < index.header.section_count; ++i) {
    const SectionEntry& entry = index.entries[i];
    const SectionDescription* section = describe_section(static_cast<SectionId>(entry.id));
    sections.push_back({{"id", entry.id},
                        {"path", section_name(entry)},
                        {"type", type_name(entry.type)},
                        {"shape", std::vector(entry.shape, entry.shape + std::min(entry.rank, kMaxRank))},
                        {"unit", section ? section->unit : ""},
                        {"offset", entry.offset},
                        {"bytes", entry.bytes},
                        {"xxh64", fmt::format("{:016x}", entry.checksum)}});
  }
  return sections;
}

std::string bytes_text(std::uint64_t bytes) {
  if (bytes < 1000) return fmt::format("{} B", bytes);
  if (bytes < 1000000) return fmt::format("{:.1f} kB", 1e-3 * static_cast<double>(bytes));
  if (bytes < 1000000000) return fmt::format("{:.1f} MB", 1e-6 * static_cast<double>(bytes));
  return fmt::format("{:.2f} GB", 1e-9 * static_cast<double>(bytes));
}

// A provenance value as text; "-" where it is missing or empty.
std::string value_text(const nlohmann::json& provenance, const char* key) {
  if (!provenance.is_object() || !provenance.contains(key)) return "-";
  const nlohmann::json& value = provenance[key];
  const std::string text = value.is_string() ? value.get<std::string>() : json_text(value);
  return text.empty() ? "-" : printable(text);
}

bool has_number(const nlohmann::json& object, const char* key) {
  return object.contains(key) && object[key].is_number();
}

void print_report(const BundleFile& file, const nlohmann::json& report) {
  const nlohmann::json& p = report["provenance"];
  const BundleCounts& n = file.index().counts;
  fmt::print("{}: tensor bundle, layout {}, {}, written by palpate {}\n", file.path().string(),
             file.index().header.layout_version, bytes_text(file.index().header.file_bytes),
             value_text(p, "program_version"));
  fmt::print("organ       {}, boundary {}, element {}, frame {}\n", value_text(p, "organ"), value_text(p, "boundary"),
             value_text(p, "element"), value_text(p, "frame"));
  fmt::print("mesh        {} nodes, {} on the surface, {} touchable; {} tetrahedra, {} surface triangles\n", n.nodes,
             n.surface_nodes, n.touchable, n.tetrahedra, n.triangles);
  const char* label = "materials";
  for (const auto& material : report["materials"]) {
    fmt::print("{:<11} {}: Young {:.6g} Pa, Poisson {:.6g}\n", label, printable(material["name"].get<std::string>()),
               material["young_pa"].get<double>(), material["poisson"].get<double>());
    label = "";
  }
  fmt::print("solver      {}, tolerance {}\n", value_text(p, "solver"), value_text(p, "tolerance"));
  const auto& c = report["certificate"];
  fmt::print("certificate worst residual {:.2g} (node {}, {}), at most {} iterations",
             c["worst_residual"].get<double>(), c["worst_residual_node"].get<int>(),
             c["worst_residual_dof"].get<std::string>(), c["most_iterations"].get<int>());
  if (has_number(c, "reciprocity_error"))
    fmt::print(", reciprocity error {:.2g}", c["reciprocity_error"].get<double>());
  if (has_number(c, "cast_error")) fmt::print(", cast to f32 {:.2g}", c["cast_error"].get<double>());
  fmt::print("\nsha256      image    {}\n            mesh     {}\n            organ    {}\n            boundary {}\n",
             value_text(p, "image_sha256"), value_text(p, "mesh_sha256"), value_text(p, "organ_sha256"),
             value_text(p, "boundary_sha256"));
  label = "sections";
  for (std::uint32_t i = 0; i < file.index().header.section_count; ++i) {
    const SectionEntry& entry = file.index().entries[i];
    fmt::print("{:<11} {:<30} {:<4} {:<20} {:>10}\n", label, section_name(entry), type_name(entry.type),
               shape_text(entry), bytes_text(entry.bytes));
    label = "";
  }
}

}  // namespace

void show_bundle(const std::filesystem::path& path, bool json) {
  const BundleFile file(path);
  nlohmann::json report = {{"file", path.string()},
                           {"layout", file.index().header.layout_version},
                           {"bytes", file.index().header.file_bytes},
                           {"provenance", file.provenance()},
                           {"counts", counts_json(file.index().counts)},
                           {"materials", materials_json(file)},
                           {"certificate", certificate_json(file)},
                           {"sections", sections_json(file.index())}};
  if (json)
    fmt::print("{}\n", json_text(report));
  else
    print_report(file, report);
}

}  // namespace palpate
