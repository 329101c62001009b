#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "precompute/bundle_tool/bundle_commands.h"
#include "precompute/bundle_tool/bundle_file.h"
#include "precompute/bundle_tool/stored_columns.h"

namespace palpate {

using namespace formats;

namespace {

nlohmann::json counts_json(const BundleCounts& n) {
  return {{"nodes", n.nodes},
          {"surface_nodes", n.surface_nodes},
          {"tetrahedra", n.tetrahedra},
          {"triangles", n.triangles},
          {"regions", n.regions},
          {"touchable", n.touchable},
          {"motions", n.motions},
          {"corridor", n.corridor},
          {"cut", n.cut}};
}

nlohmann::json materials_json(const BundleFile& file) {
  const auto names = file.region_names();
  const auto young = file.numbers<double>(SectionId::young), poisson = file.numbers<double>(SectionId::poisson);
  nlohmann::json materials = nlohmann::json::array();
  for (std::size_t r = 0; r < young.size(); ++r)
    materials.push_back({{"name", r < names.size() ? names[r] : ""}, {"young_pa", young[r]}, {"poisson", poisson[r]}});
  return materials;
}

nlohmann::json motions_json(const BundleFile& file) {
  const auto kinds = file.numbers<std::int32_t>(SectionId::motion_kinds);
  const auto residual = file.numbers<double>(SectionId::motion_residual);
  const nlohmann::json p = file.provenance();
  nlohmann::json motions = nlohmann::json::array();
  std::istringstream names(file.text(SectionId::motion_names));
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    std::string name;
    std::getline(names, name);
    const std::string key = "motion " + name;
    const bool told = p.contains(key) && p[key].is_string();
    motions.push_back({{"name", name},
                       {"kind", kinds[i]},
                       {"is", told ? p[key].get<std::string>() : fmt::format("kind {}", kinds[i])},
                       {"residual", residual[i]}});
  }
  return motions;
}

// What a needle may hold: the nodes of all corridors, what they take, and each corridor as palpate-precompute described it.
nlohmann::json corridors_json(const BundleFile& file) {
  const auto residual = file.numbers<double>(SectionId::corridor_residual);
  std::uint64_t bytes = 0;
  for (const SectionId id : {SectionId::corridor_nodes, SectionId::corridor_compliance, SectionId::corridor_surface,
                             SectionId::corridor_interior, SectionId::corridor_residual})
    if (const SectionEntry* entry = file.find(id)) bytes += entry->bytes;
  nlohmann::json list = nlohmann::json::array();
  const nlohmann::json p = file.provenance();
  const std::string key = "corridor ";
  for (const auto& [name, value] : p.items())
    if (name.starts_with(key) && value.is_string()) list.push_back({{"name", name.substr(key.size())}, {"is", value}});
  return {{"nodes", file.index().counts.corridor},
          {"bytes", bytes},
          {"worst_residual", residual.empty() ? 0.0 : *std::max_element(residual.begin(), residual.end())},
          {"list", list}};
}

std::string text_in(const nlohmann::json& provenance, const char* key) {
  return provenance.contains(key) && provenance[key].is_string() ? provenance[key].get<std::string>() : "-";
}

// What a cut at run time may act on; null where there is nothing.
nlohmann::json cut_json(const BundleFile& file) {
  if (file.index().counts.cut == 0) return nullptr;
  const auto residual = file.numbers<double>(SectionId::cut_residual);
  std::uint64_t bytes = 0;
  for (const SectionId id : {SectionId::cut_nodes, SectionId::cut_compliance, SectionId::cut_residual})
    bytes += file.find(id)->bytes;
  return {{"nodes", file.index().counts.cut},
          {"bytes", bytes},
          {"worst_residual", *std::max_element(residual.begin(), residual.end())},
          {"is", text_in(file.provenance(), "cut")}};
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
  for (const char* key : {"solver", "tolerance", "reciprocity_error", "reciprocity_pairs", "cast_error", "stored_error",
                          "pack_error_worst", "pack_error_rms", "pack_error_entry", "reciprocal_condition", "plan",
                          "element_probes", "element_excess", "element_excess_median"})
    if (provenance.contains(key)) json[key] = provenance[key];
  for (const auto& [key, value] : provenance.items())
    if (key.starts_with("accuracy_")) json[key] = value;
  return json;
}

nlohmann::json sections_json(const BundleFile& file) {
  nlohmann::json sections = nlohmann::json::array();
  for (const SectionEntry& entry : file.entries()) {
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

using Point = std::array<double, 3>;

double area_of(const Point& a, const Point& b, const Point& c) {
  const Point u = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
  return 0.5 * std::hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]);
}

std::vector<Point> nodes_of(const BundleFile& file) {
  const auto numbers = file.numbers<double>(SectionId::nodes);
  std::vector<Point> nodes(numbers.size() / 3);
  for (std::size_t n = 0; n < nodes.size(); ++n)
    for (int d = 0; d < 3; ++d) nodes[n][d] = 1e3 * numbers[3 * n + static_cast<std::size_t>(d)];
  return nodes;
}

std::vector<double> node_areas(const BundleFile& file, const std::vector<Point>& nodes) {
  std::vector<double> areas(nodes.size());
  const auto triangles = file.numbers<std::int32_t>(SectionId::triangles);
  const auto present = [&](std::int32_t n) { return n >= 0 && static_cast<std::size_t>(n) < nodes.size(); };
  for (std::size_t t = 0; t + 2 < triangles.size(); t += 3) {
    const std::int32_t a = triangles[t], b = triangles[t + 1], c = triangles[t + 2];
    if (!present(a) || !present(b) || !present(c)) continue;
    const double third = area_of(nodes[a], nodes[b], nodes[c]) / 3;
    areas[a] += third, areas[b] += third, areas[c] += third;
  }
  return areas;
}

// {"organ": R, "touchable": R, "held": R, "supported": R} with R = {"nodes", "box_mm": [[low], [high]], "area_mm2", "share": of the surface's
// area}. A node's area is a third of that of each triangle around it, so that inner nodes have none. Held is a node that is fixed
// along at least one axis, supported one at a triangle with an elastic foundation. box_mm is null for no nodes. Nodes and triangles that a damaged bundle does not have are passed
// over.
nlohmann::json regions_json(const BundleFile& file) {
  const std::vector<Point> nodes = nodes_of(file);
  const std::vector<double> areas = node_areas(file, nodes);
  double whole = 0;
  for (const double area : areas) whole += area;

  const auto region = [&](const std::vector<char>& in) {
    Point low{}, high{};
    low.fill(std::numeric_limits<double>::infinity()), high.fill(-std::numeric_limits<double>::infinity());
    std::size_t count = 0;
    double area = 0;
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      if (!in[n]) continue;
      ++count, area += areas[n];
      for (int d = 0; d < 3; ++d) low[d] = std::min(low[d], nodes[n][d]), high[d] = std::max(high[d], nodes[n][d]);
    }
    nlohmann::json json = {{"nodes", count}, {"area_mm2", area}, {"share", whole > 0 ? area / whole : 0}};
    json["box_mm"] = count ? nlohmann::json::array({low, high}) : nlohmann::json();
    return json;
  };

  std::vector<char> touchable(nodes.size()), held(nodes.size());
  for (const std::int32_t n : file.numbers<std::int32_t>(SectionId::touchable))
    if (n >= 0 && static_cast<std::size_t>(n) < nodes.size()) touchable[n] = 1;
  const auto fixed = file.numbers<std::uint8_t>(SectionId::fixed);
  for (std::size_t i = 0; i < std::min(fixed.size(), 3 * nodes.size()); ++i) held[i / 3] |= fixed[i] != 0;
  std::vector<char> supported(nodes.size());
  const auto foundation = file.numbers<double>(SectionId::foundation);
  const auto triangles = file.numbers<std::int32_t>(SectionId::triangles);
  for (std::size_t i = 0; i < std::min(triangles.size(), 3 * (foundation.size() / 2)); ++i)
    if (foundation[2 * (i / 3)] > 0 || foundation[2 * (i / 3) + 1] > 0)
      if (const auto n = triangles[i]; n >= 0 && static_cast<std::size_t>(n) < nodes.size()) supported[n] = 1;
  return {{"organ", region(std::vector<char>(nodes.size(), 1))},
          {"touchable", region(touchable)},
          {"held", region(held)},
          {"supported", region(supported)}};
}

std::string bytes_text(std::uint64_t bytes) {
  if (bytes < 1000) return fmt::format("{} B", bytes);
  if (bytes < 1000000) return fmt::format("{:.1f} kB", 1e-3 * static_cast<double>(bytes));
  if (bytes < 1000000000) return fmt::format("{:.1f} MB", 1e-6 * static_cast<double>(bytes));
  return fmt::format("{:.2f} GB", 1e-9 * static_cast<double>(bytes));
}

// A provenance value as text; "-" where it is missing or empty.
std::string value_text(const nlohmann::json& provenance, const char* key) {
  if (!provenance.contains(key)) return "-";
  const nlohmann::json& value = provenance[key];
  const std::string text = value.is_string() ? value.get<std::string>() : json_text(value);
  return text.empty() ? "-" : printable(text);
}

// "2.8e-08", or "not measured".
std::string measured(const nlohmann::json& object, const char* key) {
  const auto number = number_of(object, key);
  return number ? fmt::format("{:.2g}", *number) : "not measured";
}

// What holds the organ: how many nodes are fixed, and each soft support as palpate-precompute described it.
void print_supports(const BundleFile& file, const nlohmann::json& p) {
  const auto fixed = file.numbers<std::uint8_t>(SectionId::fixed);
  std::size_t every_way = 0, some = 0;
  for (std::size_t n = 0; 3 * n + 2 < fixed.size(); ++n) {
    const int held = fixed[3 * n] + fixed[3 * n + 1] + fixed[3 * n + 2];
    (held == 3 ? every_way : some) += held > 0;
  }
  fmt::print("            {} nodes fixed{}\n", every_way,
             some > 0 ? fmt::format(", {} along one or two axes", some) : "");
  for (const auto& [key, value] : p.items())
    if ((key.starts_with("foundation ") || key.starts_with("spring ")) && value.is_string())
      fmt::print("            {}: {}\n", printable(key), printable(value.get<std::string>()));
}

// What moves the organ, as palpate-precompute described it, and how well each was solved.
void print_motions(const nlohmann::json& report) {
  const char* label = "motions";
  for (const auto& motion : report["motions"]) {
    fmt::print("{:<11} {}: {}; residual {:.2g}\n", label, printable(motion["name"].get<std::string>()),
               printable(motion["is"].get<std::string>()), motion["residual"].get<double>());
    label = "";
  }
}

void print_corridors(const nlohmann::json& corridors) {
  if (corridors["nodes"] == 0) return;
  fmt::print("corridors   {} nodes, {}; worst residual {:.2g}\n", corridors["nodes"].get<std::uint64_t>(),
             bytes_text(corridors["bytes"].get<std::uint64_t>()), corridors["worst_residual"].get<double>());
  for (const auto& corridor : corridors["list"])
    fmt::print("            {}: {}\n", printable(corridor["name"].get<std::string>()),
               printable(corridor["is"].get<std::string>()));
}

void print_cut(const nlohmann::json& cut) {
  if (cut.is_null()) return;
  fmt::print("cut         {} nodes, {}; worst residual {:.2g}\n            {}\n", cut["nodes"].get<std::uint64_t>(),
             bytes_text(cut["bytes"].get<std::uint64_t>()), cut["worst_residual"].get<double>(),
             printable(cut["is"].get<std::string>()));
}

// The boxes and areas of the organ, of what may be touched and of what is held.
void print_regions(const nlohmann::json& regions) {
  for (const char* name : {"organ", "touchable", "held", "supported"}) {
    const nlohmann::json& region = regions[name];
    if (std::string(name) == "supported" && region["box_mm"].is_null()) continue;
    const bool whole = std::string(name) == "organ";
    fmt::print("{:<11} ", whole ? "box" : name);
    if (region["box_mm"].is_null()) {
      fmt::print("no node\n");
      continue;
    }
    for (int d = 0; d < 3; ++d)
      fmt::print("{}{} {:.4g} .. {:.4g}", d ? ", " : "", "xyz"[d], region["box_mm"][0][d].get<double>(),
                 region["box_mm"][1][d].get<double>());
    fmt::print(" mm; area {:.4g} mm2", region["area_mm2"].get<double>());
    if (whole)
      fmt::print("\n");
    else
      fmt::print(", {:.3g} % of the surface; {} nodes\n", 100 * region["share"].get<double>(),
                 region["nodes"].get<std::size_t>());
  }
}

// The form of the displacements, and their error against the solved columns.
void print_storage(const nlohmann::json& report) {
  const nlohmann::json& p = report["provenance"];
  fmt::print("stored      {}\n", printable(report["stored"].get<std::string>()));
  if (!number_of(p, "pack_error_worst")) {
    fmt::print("            worst relative error of a column: {}\n", measured(p, "cast_error"));
    return;
  }
  const int dof = number_of(p, "pack_error_worst_dof") ? p["pack_error_worst_dof"].get<int>() : -1;
  fmt::print(
      "            error against the source: worst column {} (node {}, {}), RMS {}, entry {}; against the solve at "
      "most {}\n",
      measured(p, "pack_error_worst"), value_text(p, "pack_error_worst_node"),
      dof >= 0 && dof < 3 ? std::string(1, "xyz"[dof]) : "-", measured(p, "pack_error_rms"),
      measured(p, "pack_error_entry"), measured(p, "stored_error"));
  fmt::print("            {}\n", value_text(p, "pack_history"));
}

// Below this, a column whose relative residual is 1e-9 may have an error as large as itself.
constexpr double kLeastReciprocalCondition = 1e-12;

// PETSc's own count. With a factor as the preconditioner CG starts from the factor's solution.
std::string iterations_text(int most) {
  return fmt::format("at most {} CG iterations{}", most,
                     most == 0 ? " (its initial guess, the factor's solution, met the tolerance)" : "");
}

void print_certificate(const nlohmann::json& report) {
  const nlohmann::json &p = report["provenance"], &c = report["certificate"];
  fmt::print("solver      {}, tolerance {}\n", value_text(p, "solver"), value_text(p, "tolerance"));
  if (p.contains("plan")) fmt::print("plan        {}\n", value_text(p, "plan"));
  fmt::print("certificate worst residual {:.2g} (node {}, {}), {}\n", c["worst_residual"].get<double>(),
             c["worst_residual_node"].get<int>(), c["worst_residual_dof"].get<std::string>(),
             iterations_text(c["most_iterations"].get<int>()));
  fmt::print("            reciprocity error of far pairs: {}\n", measured(p, "reciprocity_error"));
  // 0 is written where the solver tells none.
  const double condition = number_of(p, "reciprocal_condition").value_or(0);
  const bool told = condition != 0, poor = told && !(condition >= kLeastReciprocalCondition);
  fmt::print("            reciprocal condition: {}{}\n", told ? measured(p, "reciprocal_condition") : "not measured",
             poor ? " (warning: residuals say little about columns; is the organ held, are its materials right?)" : "");
  if (number_of(p, "element_probes").value_or(0) > 0)
    fmt::print(
        "            the element makes this mesh too stiff by about {:.2g} % (median of {} loads; the largest {:.2g} "
        "%)\n",
        100 * number_of(p, "element_excess_median").value_or(0), value_text(p, "element_probes"),
        100 * number_of(p, "element_excess").value_or(0));
}

// The accuracy that palpate-accuracy measured for this setting.
void print_accuracy(const nlohmann::json& p) {
  if (!number_of(p, "accuracy_force_error") || !number_of(p, "accuracy_field_error")) return;
  const auto percent = [&](const char* key) {
    const auto number = number_of(p, key);
    return number ? fmt::format("{:.2g} %", 100 * *number) : "unknown";
  };
  fmt::print("accuracy    force {}, field {}, against {}, itself off by about {} and {}\n",
             percent("accuracy_force_error"), percent("accuracy_field_error"), value_text(p, "accuracy_reference"),
             percent("accuracy_reference_force_error"), percent("accuracy_reference_field_error"));
  fmt::print("            touch {} us, shape {} us on {}\n", measured(p, "accuracy_touch_us"),
             measured(p, "accuracy_shape_us"), value_text(p, "accuracy_machine"));
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
  print_regions(report["regions"]);
  print_supports(file, p);
  print_motions(report);
  print_corridors(report["corridors"]);
  print_cut(report["cut"]);
  const char* label = "materials";
  for (const auto& material : report["materials"]) {
    fmt::print("{:<11} {}: Young {:.6g} Pa, Poisson {:.6g}\n", label, printable(material["name"].get<std::string>()),
               material["young_pa"].get<double>(), material["poisson"].get<double>());
    label = "";
  }
  print_storage(report);
  print_certificate(report);
  print_accuracy(p);
  fmt::print("sha256      image    {}\n            mesh     {}\n            organ    {}\n            boundary {}\n",
             value_text(p, "image_sha256"), value_text(p, "mesh_sha256"), value_text(p, "organ_sha256"),
             value_text(p, "boundary_sha256"));
  if (p.contains("curve_sha256")) fmt::print("            curve    {}\n", value_text(p, "curve_sha256"));
  if (p.contains("packed_from_sha256")) fmt::print("            packed from {}\n", value_text(p, "packed_from_sha256"));
  label = "sections";
  for (const SectionEntry& entry : file.entries()) {
    fmt::print("{:<11} {:<30} {:<4} {:<20} {:>10}\n", label, section_name(entry), type_name(entry.type),
               shape_text(entry), bytes_text(entry.bytes));
    label = "";
  }
}

// The form of the displacements in words; where the tables do not hold, what is wrong: info shows as much of a damaged
// bundle as it can.
std::string stored_form(const BundleFile& file) {
  try {
    const StoredColumns columns(file);
    return columns.form() + (columns.has_interior() ? ", with the interior" : ", surface alone");
  } catch (const InputError& error) {
    return error.what();
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
                           {"regions", regions_json(file)},
                           {"materials", materials_json(file)},
                           {"motions", motions_json(file)},
                           {"corridors", corridors_json(file)},
                           {"cut", cut_json(file)},
                           {"stored", stored_form(file)},
                           {"certificate", certificate_json(file)},
                           {"sections", sections_json(file)}};
  if (json)
    fmt::print("{}\n", json_text(report));
  else
    print_report(file, report);
}

}  // namespace palpate
