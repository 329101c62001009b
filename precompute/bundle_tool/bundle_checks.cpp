#include "precompute/bundle_tool/bundle_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "formats/response_check.h"
#include "formats/tetrahedral_mesh.h"

namespace palpate {

using namespace formats;

void Checks::add(const std::string& name, bool held, const std::string& detail) {
  list.push_back({{"name", name}, {"held", held}, {"detail", detail}});
}

void Checks::add_faults(const std::string& name, const std::string& wrong, const std::string& fine) {
  add(name, wrong.empty(), wrong.empty() ? fine : wrong);
}

void Checks::add_bounded(const std::string& name, bool held, const std::string& what, double found, double bound) {
  add(name, held, fmt::format("{}: {:.3g} <= {:.3g}", what, found, bound));
  list.back()["found"] = found;
  list.back()["bound"] = bound;
}

void Checks::add_stated(const std::string& name, bool held, const std::string& what, const nlohmann::json& provenance,
                        const char* key, double found, double bound) {
  const auto stated = number_of(provenance, key);
  add(name, held,
      fmt::format("{}: stated {}, found {:.3g}, bound {:.3g}", what,
                  stated ? fmt::format("{:.3g}", *stated) : "nothing", found, bound));
  if (stated) list.back()["stated"] = provenance[key];
  list.back()["found"] = found;
  list.back()["bound"] = bound;
}

bool Checks::all_held() const {
  return std::all_of(list.begin(), list.end(), [](const auto& check) { return check["held"].template get<bool>(); });
}

SmallSections read_small_sections(const BundleFile& file) {
  SmallSections s;
  s.nodes = file.numbers<double>(SectionId::nodes);
  s.young = file.numbers<double>(SectionId::young);
  s.poisson = file.numbers<double>(SectionId::poisson);
  s.stiffness = file.numbers<double>(SectionId::force);
  s.residual = file.numbers<double>(SectionId::residual);
  s.tetrahedra = file.numbers<std::int32_t>(SectionId::tetrahedra);
  s.region = file.numbers<std::int32_t>(SectionId::region);
  s.triangles = file.numbers<std::int32_t>(SectionId::triangles);
  s.touchable = file.numbers<std::int32_t>(SectionId::touchable);
  s.iterations = file.numbers<std::int32_t>(SectionId::iterations);
  s.fixed = file.numbers<std::uint8_t>(SectionId::fixed);
  s.foundation = file.numbers<double>(SectionId::foundation);
  return s;
}

void check_checksums(const BundleFile& file, const std::map<SectionId, std::uint64_t>& known, Checks& checks) {
  std::string wrong;
  for (const SectionEntry& entry : file.entries()) {
    const auto seen = known.find(static_cast<SectionId>(entry.id));
    const std::uint64_t sum = seen != known.end() ? seen->second : file.checksum(entry);
    if (sum != entry.checksum) wrong += (wrong.empty() ? "" : ", ") + section_name(entry);
  }
  if (!wrong.empty()) wrong = "changed since they were written: " + wrong;
  checks.add_faults("checksums", wrong,
                    fmt::format("{} sections hold the bytes that were written", file.entries().size()));
}

void check_finite_small(const BundleFile& file, Checks& checks) {
  std::string wrong;
  for (const SectionEntry& entry : file.entries()) {
    const auto id = static_cast<SectionId>(entry.id);
    const SectionDescription* section = describe_section(id);
    if (!section || entry.type != static_cast<std::uint32_t>(ElementType::f64)) continue;
    if (id == SectionId::cut_compliance) continue;  // large, and check_cut() reads it
    const auto values = file.numbers<double>(id);
    const auto bad = std::find_if(values.begin(), values.end(), [](double x) { return !std::isfinite(x); });
    if (bad != values.end() && wrong.empty())
      wrong = fmt::format("{}: element {} is {}", section->path, bad - values.begin(), *bad);
  }
  checks.add_faults("finite numbers", wrong, "in all sections but the displacements");
}

void check_indices(const BundleFile& file, const SmallSections& s, Checks& checks) {
  BundleError error;
  IndexedSections sections{s.tetrahedra.data(), s.region.data(), s.triangles.data(), s.touchable.data(),
                           s.fixed.data()};
  const auto scale = file.numbers<float>(SectionId::displacement_scale),
             block_scale = file.numbers<float>(SectionId::compliance_scale);
  const auto order = file.numbers<std::int32_t>(SectionId::large_order),
             supports = file.numbers<std::int32_t>(SectionId::large_support_nodes);
  const auto nodes = file.numbers<std::int32_t>(SectionId::compliance_nodes),
             clusters = file.numbers<std::int32_t>(SectionId::compliance_clusters),
             blocks = file.numbers<std::int32_t>(SectionId::compliance_blocks);
  if (!scale.empty()) sections.displacement_scale = scale.data();
  const auto kinds = file.numbers<std::int32_t>(SectionId::motion_kinds);
  if (!kinds.empty()) sections.motion_kinds = kinds.data();
  const auto pressed = file.numbers<std::uint8_t>(SectionId::motion_pressed);
  if (!pressed.empty()) sections.motion_pressed = pressed.data();
  const auto corridor = file.numbers<std::int32_t>(SectionId::corridor_nodes);
  if (!corridor.empty()) sections.corridor_nodes = corridor.data();
  const auto cut = file.numbers<std::int32_t>(SectionId::cut_nodes);
  if (!cut.empty()) sections.cut_nodes = cut.data();
  if (!order.empty()) sections.large_order = order.data();
  if (!supports.empty()) sections.large_support_nodes = supports.data();
  if (!nodes.empty()) {
    sections.compliance_nodes = nodes.data(), sections.compliance_clusters = clusters.data();
    sections.compliance_blocks = blocks.data(), sections.compliance_scale = block_scale.data();
  }
  const bool held = check_stored_indices(file.index(), sections, &error) == BundleStatus::ok;
  checks.add("stored indices", held, held ? "all point inside their targets" : error.text);
}

void check_materials(const BundleFile& file, const SmallSections& s, Checks& checks) {
  std::string wrong;
  for (std::size_t r = 0; r < s.young.size() && wrong.empty(); ++r)
    if (!(s.young[r] > 0) || !(s.poisson[r] > -1 && s.poisson[r] < 0.5))
      wrong = fmt::format("region {} has Young's modulus {} Pa and Poisson's ratio {}", r, s.young[r], s.poisson[r]);
  if (const std::size_t names = file.region_names().size(); wrong.empty() && names != s.young.size())
    wrong = fmt::format("{} regions but {} names", s.young.size(), names);
  checks.add_faults("materials", wrong, fmt::format("{} regions, Young > 0, -1 < Poisson < 0.5", s.young.size()));
}

void check_responses(const BundleFile& file, Checks& checks) {
  const auto ranges = file.numbers<double>(SectionId::response_range);
  const auto check = [&](SectionId id, std::size_t which, const char* name, const char* unit) {
    const auto coefficients = file.numbers<double>(id);
    if (coefficients.empty() || ranges.size() != 2 || ranges[which] == 0) return;
    const ResponseVerdict verdict = check_response(coefficients.data(), coefficients.size(), ranges[which]);
    char text[200];
    describe_response_fault(verdict, unit, text, sizeof text);
    checks.add(name, verdict.fault == ResponseFault::none, fmt::format("the curve {}", text));
  };
  check(SectionId::response_radial, 0, "radial response P", "m");
  check(SectionId::response_force, 1, "force response Q", "N");
}

// Volumes must be positive, the triangles must be the outer surface and wind outwards, and the first Ns nodes must be
// its nodes.
void check_mesh(const BundleFile& file, const SmallSections& s, Checks& checks) {
  TetrahedralMesh mesh;
  mesh.nodes.resize(s.nodes.size() / 3);
  mesh.tetrahedra.resize(s.tetrahedra.size() / 4);
  for (std::size_t i = 0; i < s.nodes.size(); ++i) mesh.nodes[i / 3][i % 3] = s.nodes[i];
  for (std::size_t i = 0; i < s.tetrahedra.size(); ++i) mesh.tetrahedra[i / 4][i % 4] = s.tetrahedra[i];

  std::string wrong;
  for (std::size_t e = 0; e < mesh.tetrahedra.size() && wrong.empty(); ++e) {
    const auto& t = mesh.tetrahedra[e];
    Matrix3 edges;
    for (int i = 0; i < 9; ++i) edges[i] = mesh.nodes[t[1 + i / 3]][i % 3] - mesh.nodes[t[0]][i % 3];
    const double volume = (edges[0] * (edges[4] * edges[8] - edges[5] * edges[7]) -
                           edges[1] * (edges[3] * edges[8] - edges[5] * edges[6]) +
                           edges[2] * (edges[3] * edges[7] - edges[4] * edges[6])) /
                          6;
    if (!(volume > 0)) wrong = fmt::format("tetrahedron {} has volume {:.3g} m^3", e, volume);
  }
  checks.add_faults("volumes", wrong, fmt::format("{} tetrahedra, all positive", mesh.tetrahedra.size()));

  // Turns a triangle so that its smallest node comes first. Two triangles of the same nodes are then equal where they
  // wind alike.
  const auto turned = [](std::array<std::int32_t, 3> t) {
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    return t;
  };
  std::vector<std::array<std::int32_t, 3>> stored, outer;
  for (std::size_t i = 0; i < s.triangles.size(); i += 3)
    stored.push_back(turned({s.triangles[i], s.triangles[i + 1], s.triangles[i + 2]}));
  wrong.clear();
  try {
    for (const auto& triangle : boundary_triangles(mesh)) outer.push_back(turned(triangle));
  } catch (const InputError& error) {
    wrong = error.what();
  }
  std::sort(stored.begin(), stored.end());
  std::sort(outer.begin(), outer.end());
  if (wrong.empty() && stored != outer) wrong = "the triangles are not the outer surface of the tetrahedra";
  std::vector<bool> used(file.index().counts.surface_nodes, false);
  for (const std::int32_t node : s.triangles) used[node] = true;
  // Of a cut: nodes that may become surface, and those in reserve.
  for (const std::int32_t node : file.numbers<std::int32_t>(SectionId::cut_nodes))
    if (static_cast<std::size_t>(node) < used.size()) used[node] = true;
  if (const auto reserve = file.numbers<std::int32_t>(SectionId::cut_reserve); !reserve.empty())
    std::fill(used.begin() + std::clamp<std::ptrdiff_t>(reserve[0], 0, std::ssize(used)), used.end(), true);
  if (const auto unused = std::find(used.begin(), used.end(), false); wrong.empty() && unused != used.end())
    wrong = fmt::format("node {} is counted among the surface nodes, but no triangle uses it", unused - used.begin());
  checks.add_faults("surface", wrong, fmt::format("{} triangles, the outer faces of the tetrahedra", stored.size()));
}

double stated_tolerance(const BundleFile& file) {
  const nlohmann::json provenance = file.provenance();
  return std::max(number_of(provenance, "tolerance").value_or(INFINITY),
                  number_of(provenance, "residual_floor").value_or(0));
}

void check_certificate(const BundleFile& file, const SmallSections& s, Checks& checks) {
  const double tolerance = stated_tolerance(file);
  const double worst = *std::max_element(s.residual.begin(), s.residual.end());
  const bool in_order = std::all_of(s.residual.begin(), s.residual.end(), [](double r) { return r >= 0; }) &&
                        std::all_of(s.iterations.begin(), s.iterations.end(), [](std::int32_t i) { return i >= 0; });
  const nlohmann::json provenance = file.provenance();
  const bool as_stated = number_of(provenance, "worst_residual").value_or(worst) == worst;
  checks.add_stated("certificate", in_order && as_stated && worst <= tolerance, "worst residual of all columns",
                    provenance, "worst_residual", worst, tolerance);
}

void check_preload(const BundleFile& file, const SmallSections& s, Checks& checks) {
  const auto displacement = file.numbers<double>(SectionId::preload_displacement);
  if (displacement.empty()) return;
  std::string wrong;
  for (std::size_t i = 0; i < displacement.size() && wrong.empty(); ++i)
    if (s.fixed[i] && displacement[i] != 0)
      wrong = fmt::format("fixed node {} moves by {} m under the body force", i / 3, displacement[i]);
  checks.add_faults("preload", wrong, "fixed nodes have zero displacement");
}

namespace {

// What does not hold of the displacements per unit of the motions; "" where all holds.
std::string fault_of_motion_fields(const BundleFile& file, const SmallSections& s) {
  const auto kinds = file.numbers<std::int32_t>(SectionId::motion_kinds);
  const auto check = [&](SectionId id, std::size_t first_node) -> std::string {
    const auto field = file.numbers<float>(id);
    const std::size_t run = field.size() / kinds.size();
    for (std::size_t i = 0; i < field.size(); ++i) {
      const std::size_t motion = i / run, dof = 3 * first_node + i % run;
      const auto kind = static_cast<MotionKind>(kinds[motion]);
      if (!std::isfinite(field[i])) return fmt::format("motion {}: node {} moves by {}", motion, dof / 3, field[i]);
      if (s.fixed[dof] && field[i] != 0 && (kind == MotionKind::pressure || kind == MotionKind::gravity))
        return fmt::format("motion {}, a load, moves fixed node {} by {} m", motion, dof / 3, field[i]);
    }
    return "";
  };
  const std::string surface = check(SectionId::motion_surface, 0);
  return !surface.empty() ? surface : check(SectionId::motion_interior, file.index().counts.surface_nodes);
}

// Rows of pressures against one another: symmetric, their own volume above 0; the others zero.
std::string fault_of_volumes(const BundleFile& file, double tolerance) {
  const auto volume = file.numbers<double>(SectionId::motion_volume);
  const auto kinds = file.numbers<std::int32_t>(SectionId::motion_kinds);
  const std::size_t count = kinds.size();
  const auto is_pressure = [&](std::size_t i) { return static_cast<MotionKind>(kinds[i]) == MotionKind::pressure; };
  const bool any = std::any_of(kinds.begin(), kinds.end(),
                               [](std::int32_t kind) { return static_cast<MotionKind>(kind) == MotionKind::pressure; });
  if (any == volume.empty()) return any ? "a pressure has no volumes" : "there are volumes but no pressure";
  for (std::size_t i = 0; i < count && any; ++i)
    for (std::size_t j = 0; j < count; ++j) {
      const double v = volume[i * count + j], mirrored = volume[j * count + i];
      if (!is_pressure(i) && v != 0) return fmt::format("motion {} is no pressure and sweeps {} m^3", i, v);
      if (i == j && is_pressure(i) && !(v > 0)) return fmt::format("pressure {} sweeps {} m^3 itself", i, v);
      // Betti's law, to what the solver's tolerance leaves.
      const double size = std::sqrt(std::abs(volume[i * count + i] * volume[j * count + j]));
      if (is_pressure(i) && is_pressure(j) && !(std::abs(v - mirrored) <= (1e-9 + 1e3 * tolerance) * size))
        return fmt::format("pressures {} and {} sweep {} m^3 and {} m^3 of one another's surface", i, j, v, mirrored);
    }
  return "";
}

// Each pressure presses on some triangle, and no other motion does.
std::string fault_of_pressed(const BundleFile& file) {
  const auto pressed = file.numbers<std::uint8_t>(SectionId::motion_pressed);
  const auto kinds = file.numbers<std::int32_t>(SectionId::motion_kinds);
  const std::size_t triangles = pressed.size() / std::max<std::size_t>(kinds.size(), 1);
  for (std::size_t i = 0; i < kinds.size() && !pressed.empty(); ++i) {
    const auto row = pressed.begin() + static_cast<std::ptrdiff_t>(i * triangles);
    const auto found = std::count(row, row + static_cast<std::ptrdiff_t>(triangles), std::uint8_t{1});
    if ((found > 0) != (static_cast<MotionKind>(kinds[i]) == MotionKind::pressure))
      return fmt::format("motion {}, {} pressure, presses on {} triangles", i, found > 0 ? "no" : "a", found);
  }
  return "";
}

}  // namespace

void check_motions(const BundleFile& file, const SmallSections& s, Checks& checks) {
  const auto residual = file.numbers<double>(SectionId::motion_residual);
  if (residual.empty()) return;
  const double tolerance = stated_tolerance(file);
  std::string wrong = fault_of_motion_fields(file, s);
  if (wrong.empty()) wrong = fault_of_volumes(file, tolerance);
  if (wrong.empty()) wrong = fault_of_pressed(file);
  const std::string names = file.text(SectionId::motion_names);
  if (const auto lines = std::count(names.begin(), names.end(), '\n');
      wrong.empty() && static_cast<std::size_t>(lines) != residual.size())
    wrong = fmt::format("{} motions but {} names", residual.size(), lines);
  const double worst = *std::max_element(residual.begin(), residual.end());
  const bool in_order = std::all_of(residual.begin(), residual.end(), [](double r) { return r >= 0; });
  if (wrong.empty() && !(in_order && worst <= tolerance))
    wrong = fmt::format("worst residual {:.3g}, tolerance {:.3g}", worst, tolerance);
  checks.add_faults("motions", wrong, fmt::format("{} motions, worst residual {:.3g}", residual.size(), worst));
}

void check_stiffness(const SmallSections& s, std::vector<Matrix3>& compliance, Checks& checks) {
  double asymmetry = 0;
  std::string wrong;
  compliance.resize(s.touchable.size());
  for (std::size_t k = 0; k < s.touchable.size(); ++k) {
    Matrix3 stiffness;
    std::copy_n(s.stiffness.begin() + static_cast<std::ptrdiff_t>(9 * k), 9, stiffness.begin());
    const std::uint8_t* fixed = &s.fixed[3 * static_cast<std::size_t>(s.touchable[k])];
    const double scale = largest(stiffness);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        asymmetry =
            std::max(asymmetry, std::abs(stiffness[3 * i + j] - stiffness[3 * j + i]) / (scale > 0 ? scale : 1));
        if (wrong.empty() && (fixed[i] || fixed[j]) && stiffness[3 * i + j] != 0)
          wrong = fmt::format("node {}: a fixed dof has the stiffness {} N/m", s.touchable[k], stiffness[3 * i + j]);
      }
    if (!invert_on_free(stiffness, fixed, &compliance[k]) && wrong.empty())
      wrong = fmt::format("node {}: not positive definite", s.touchable[k]);
  }
  // The solver makes C_kk symmetric before it inverts it, so that only rounding of a 3 x 3 inverse can make T^f
  // asymmetric.
  checks.add_bounded("symmetric T^f", asymmetry <= 1e-12, "largest asymmetry, relative", asymmetry, 1e-12);
  checks.add_faults("definite T^f", wrong, "positive definite on free dofs, zero on fixed ones");
}

}  // namespace palpate
