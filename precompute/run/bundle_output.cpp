#include "precompute/run/bundle_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "formats/element_layout.h"
#include "formats/program.h"

namespace palpate {
namespace {

using formats::SectionId;

bool has_radial(const BundleContent& content) {
  return content.response && !content.response->radial.coefficient.empty();
}

std::string place_text(const std::array<double, 3>& p) {
  return fmt::format("({:.4g}, {:.4g}, {:.4g}) mm", 1e3 * p[0], 1e3 * p[1], 1e3 * p[2]);
}

// The mean of the nodes at one end of the springs.
std::string mean_place(const ElasticBody& body, const SpringSet& set, std::int32_t Spring::*end) {
  std::array<double, 3> mean{};
  for (const Spring& spring : set.springs)
    for (int d = 0; d < 3; ++d) mean[d] += body.nodes[spring.*end][d] / static_cast<double>(set.springs.size());
  return place_text(mean);
}

// Where the other ends of the springs are: "others at (1, 2, 3) mm".
std::string other_ends(const ElasticBody& body, const SpringSet& set) {
  if (set.anchor) return "a point at " + place_text(*set.anchor);
  return set.springs.front().b == Spring::kWorld ? "their places" : "others at " + mean_place(body, set, &Spring::b);
}

// "foundation diaphragm": "normal 5e+04 N/m^3 (assumed), tangential 1e+04 N/m^3 (assumed); 0.0123 m^2".
std::map<std::string, std::string> support_texts(const ElasticBody& body, const BoundaryConfig& boundary) {
  std::map<std::string, std::string> texts;
  for (std::size_t i = 0; i < boundary.foundations.size(); ++i) {
    const auto& f = boundary.foundations[i];
    std::string text = fmt::format("normal {:.6g} N/m^3 ({})", f.normal.value, f.normal.source);
    if (f.tangential.value > 0)
      text += fmt::format(", tangential {:.6g} N/m^3 ({})", f.tangential.value, f.tangential.source);
    texts["foundation " + f.name] = text + fmt::format("; {:.4g} m^2", area_of(body, body.foundations[i]));
  }
  for (std::size_t i = 0; i < boundary.springs.size(); ++i) {
    const auto& s = boundary.springs[i];
    const SpringSet& set = body.springs[i];
    texts["spring " + s.name] =
        fmt::format("{:.6g} N/m ({}); from {} nodes at {} to {}", s.stiffness.value, s.stiffness.source,
                    set.springs.size(), mean_place(body, set, &Spring::a), other_ends(body, set));
  }
  return texts;
}

// "motion diaphragm": "piston along (0, 0, 1); 123 nodes".
std::map<std::string, std::string> motion_texts(const ElasticBody& body) {
  std::map<std::string, std::string> texts;
  for (const Motion& motion : body.motions) {
    const auto nodes = std::count(motion.moves.begin(), motion.moves.end(), 1);
    const std::string axis = fmt::format("({:.4g}, {:.4g}, {:.4g})", motion.axis[0], motion.axis[1], motion.axis[2]);
    std::string& text = texts["motion " + motion.name];
    switch (motion.kind) {
      case formats::MotionKind::piston:
        text = fmt::format("piston along {}; per m; {} nodes", axis, nodes);
        break;
      case formats::MotionKind::rotation:
        text = fmt::format("rotation about {} through {}; per rad; {} nodes", axis, place_text(motion.point), nodes);
        break;
      case formats::MotionKind::field:
        text = fmt::format("field from a file; {} nodes", nodes);
        break;
      case formats::MotionKind::pressure:
        text = fmt::format("pressure; per Pa; {:.4g} m^2", area_of(body, {"", 0, 0, motion.triangles}));
        break;
      case formats::MotionKind::gravity:
        text = fmt::format("gravity along {}; per m/s^2", axis);
        break;
    }
  }
  return texts;
}

// "corridor biopsy": "capsule from (1, 2, 3) mm to (4, 5, 6) mm, radius 5 mm; 123 nodes".
std::map<std::string, std::string> corridor_texts(const ElasticBody& body) {
  std::map<std::string, std::string> texts;
  for (const PlacedCorridor& corridor : body.corridors)
    texts["corridor " + corridor.name] =
        fmt::format("capsule from {} to {}, radius {:.4g} mm; {} nodes", place_text(corridor.from),
                    place_text(corridor.to), 1e3 * corridor.radius, corridor.nodes.size());
  return texts;
}

// "412 nodes may be divided; 903 nodes with those beside them".
std::string cut_text(const ElasticBody& body) {
  return fmt::format("{} nodes may be divided; {} nodes with those beside them; {} nodes in reserve",
                     body.cut_dividable, body.cut_nodes.size(), body.reserve);
}

// A section and its numbers, which the content or this object holds; null where the columns bring them.
struct FilledSection {
  SectionShape shape;
  std::shared_ptr<const void> numbers = nullptr;
  std::uint64_t bytes = 0;
};

template <class Values>
FilledSection held_by_content(SectionId id, std::vector<std::uint64_t> shape, const Values& values) {
  return {{id, std::move(shape)},
          {std::shared_ptr<const void>(), values.data()},
          values.size() * sizeof(typename Values::value_type)};
}
template <class Values>
FilledSection made(SectionId id, std::vector<std::uint64_t> shape, Values values) {
  const auto kept = std::make_shared<const Values>(std::move(values));
  return {{id, std::move(shape)}, {kept, kept->data()}, kept->size() * sizeof(typename Values::value_type)};
}

template <class Things>
FilledSection names_of(SectionId id, const Things& things, auto&& name) {
  std::string text;
  for (const auto& thing : things) text += name(thing) + '\n';
  return made(id, {text.size()}, text);
}

void add_body(std::vector<FilledSection>& sections, const ElasticBody& body) {
  const std::uint64_t n = body.nodes.size(), e = body.tetrahedra.size(), f = body.triangles.size();
  std::vector<double> young, poisson;
  for (const auto& material : body.materials) young.push_back(material.young), poisson.push_back(material.poisson);
  sections = {held_by_content(SectionId::nodes, {n, 3}, body.nodes),
              held_by_content(SectionId::tetrahedra, {e, 4}, body.tetrahedra),
              held_by_content(SectionId::region, {e}, body.region),
              held_by_content(SectionId::triangles, {f, 3}, body.triangles),
              held_by_content(SectionId::fixed, {n, 3}, body.fixed),
              made(SectionId::young, {young.size()}, young),
              made(SectionId::poisson, {poisson.size()}, poisson),
              names_of(SectionId::region_names, body.region_names, [](const auto& name) { return name; })};
  if (!body.foundations.empty()) sections.push_back(made(SectionId::foundation, {f, 2}, foundation_of_triangles(body)));
}

void add_response(std::vector<FilledSection>& sections, const ResponseFit& fit) {
  const auto &radial = fit.radial.coefficient, &force = fit.force.coefficient;
  if (!radial.empty()) sections.push_back(held_by_content(SectionId::response_radial, {radial.size()}, radial));
  sections.push_back(held_by_content(SectionId::response_force, {force.size()}, force));
  sections.push_back(made(SectionId::response_range, {2}, std::vector<double>{fit.radial.range, fit.force.range}));
}

void add_large_deformation(std::vector<FilledSection>& sections, const BundleContent& content) {
  const auto& order = content.elimination_order;
  const std::uint64_t pairs = content.supports.nodes.size();
  if (!order.empty()) {
    sections.push_back(held_by_content(SectionId::large_order, {order.size()}, order));
    const auto& [stiffening, others] = content.laws;
    sections.push_back(held_by_content(SectionId::large_stiffening, {stiffening.size()}, stiffening));
    if (!others.empty())
      sections.push_back(held_by_content(SectionId::large_law, {others.size(), formats::kLawNumbers}, others));
  }
  if (pairs == 0) return;
  sections.push_back(held_by_content(SectionId::large_support_nodes, {pairs, 2}, content.supports.nodes));
  sections.push_back(held_by_content(SectionId::large_support_stiffness, {pairs, 3, 3}, content.supports.block));
}

// [motions][triangles]
std::vector<std::uint8_t> pressed_triangles(const ElasticBody& body) {
  std::vector<std::uint8_t> pressed;
  for (const Motion& motion : body.motions) {
    std::vector<std::uint8_t> row(body.triangles.size(), 0);
    for (const std::int32_t t : motion.triangles) row[static_cast<std::size_t>(t)] = 1;
    pressed.insert(pressed.end(), row.begin(), row.end());
  }
  return pressed;
}

void add_motions(std::vector<FilledSection>& sections, const BundleContent& content) {
  const ElasticBody& body = content.body;
  const std::uint64_t m = body.motions.size(), n = body.nodes.size(),
                      ns = static_cast<std::uint64_t>(body.surface_count);
  if (m == 0) return;
  const auto split = 3 * static_cast<std::ptrdiff_t>(ns);
  std::vector<float> surface, interior;
  for (const auto& u : content.motions.displacement) {
    surface.insert(surface.end(), u.begin(), u.begin() + split);
    interior.insert(interior.end(), u.begin() + split, u.end());
  }
  std::vector<std::int32_t> kinds;
  for (const Motion& motion : body.motions) kinds.push_back(static_cast<std::int32_t>(motion.kind));
  sections.push_back(names_of(SectionId::motion_names, body.motions, [](const Motion& motion) { return motion.name; }));
  sections.push_back(made(SectionId::motion_kinds, {m}, kinds));
  sections.push_back(made(SectionId::motion_surface, {m, ns, 3}, std::move(surface)));
  // A hyperelastic body moves with all of its nodes; none is inside where a cut's region is the whole organ.
  if (n > ns && (content.interior || !content.elimination_order.empty()))
    sections.push_back(made(SectionId::motion_interior, {m, n - ns, 3}, std::move(interior)));
  if (!content.motions.volume.empty())
    sections.push_back(held_by_content(SectionId::motion_volume, {m, m}, content.motions.volume));
  // A pressure follows the surface of a hyperelastic body.
  if (!content.motions.volume.empty() && !content.elimination_order.empty())
    sections.push_back(made(SectionId::motion_pressed, {m, body.triangles.size()}, pressed_triangles(body)));
  sections.push_back(held_by_content(SectionId::motion_residual, {m}, content.motions.residual));
}

void add_corridor(std::vector<FilledSection>& sections, const BundleContent& content) {
  const SolvedCorridor& corridor = content.corridor;
  const auto& nodes = content.body.corridor_nodes;
  const std::uint64_t k = nodes.size(), n = content.body.nodes.size(),
                      ns = static_cast<std::uint64_t>(content.body.surface_count);
  if (k == 0) return;
  sections.push_back(held_by_content(SectionId::corridor_nodes, {k}, nodes));
  sections.push_back(held_by_content(SectionId::corridor_compliance, {k, 3, k, 3}, corridor.compliance));
  sections.push_back(held_by_content(SectionId::corridor_surface, {k, 3, ns, 3}, corridor.surface));
  if (content.interior)
    sections.push_back(held_by_content(SectionId::corridor_interior, {k, 3, n - ns, 3}, corridor.interior));
  sections.push_back(held_by_content(SectionId::corridor_residual, {k, 3}, corridor.residual));
}

void add_cut(std::vector<FilledSection>& sections, const BundleContent& content) {
  const std::uint64_t c = content.body.cut_nodes.size();
  if (c == 0) return;
  sections.push_back(held_by_content(SectionId::cut_nodes, {c}, content.body.cut_nodes));
  sections.push_back(
      held_by_content(SectionId::cut_compliance, {c * (c + 1) / 2, 3, 3}, content.corridor.cut_compliance));
  sections.push_back(held_by_content(SectionId::cut_residual, {c, 3}, content.corridor.cut_residual));
  const std::int32_t reserve = content.body.reserve;
  sections.push_back(made(SectionId::cut_reserve, {2}, std::vector{content.body.surface_count - reserve, reserve}));
}

// The one list of what a bundle holds, in the order of the file.
std::vector<FilledSection> sections_of(const BundleContent& content) {
  const ElasticBody& body = content.body;
  const std::uint64_t n = body.nodes.size(), ns = static_cast<std::uint64_t>(body.surface_count);
  const std::uint64_t s = body.touchable.size();
  std::vector<FilledSection> sections;
  add_body(sections, body);
  if (content.response) add_response(sections, *content.response);
  if (!content.preload.empty())
    sections.push_back(held_by_content(SectionId::preload_displacement, {n, 3}, content.preload));
  add_large_deformation(sections, content);
  add_motions(sections, content);
  add_corridor(sections, content);
  add_cut(sections, content);
  sections.push_back(held_by_content(SectionId::touchable, {s}, body.touchable));
  sections.push_back({{SectionId::displacement_surface, {s, 3, ns, 3}, content.store}});
  if (content.interior) sections.push_back({{SectionId::displacement_interior, {s, 3, n - ns, 3}, content.store}});
  sections.push_back({{SectionId::force, {s, 3, 3}}});
  sections.push_back({{SectionId::residual, {s, 3}}});
  sections.push_back({{SectionId::iterations, {s, 3}}});
  return sections;
}

template <class Value>
void write_all(SectionWriter& writer, const std::vector<formats::SectionEntry>& entries, SectionId id,
               const std::vector<Value>& values) {
  writer.write(entry_of(entries, id), 0, values.data(), values.size() * sizeof(Value));
}

}  // namespace

TissueLaws laws_of(const ElasticBody& body, const OrganConfig& organ) {
  TissueLaws result;
  bool has_others = false;
  for (const auto& name : body.region_names)
    for (const auto& region : organ.regions) {
      if (region.name != name) continue;
      result.others.push_back(region.law ? region.law->numbers : decltype(region.law->numbers){});
      result.stiffening.push_back(region.law          ? formats::kNoStiffening
                                  : region.stiffening ? region.stiffening->value
                                                      : 0.0);
      has_others = has_others || region.law.has_value();
    }
  if (!has_others) result.others.clear();
  return result;
}

std::vector<SectionShape> section_shapes(const BundleContent& content) {
  std::vector<SectionShape> shapes;
  for (const FilledSection& section : sections_of(content)) shapes.push_back(section.shape);
  return shapes;
}

void write_body_sections(SectionWriter& writer, const std::vector<formats::SectionEntry>& entries,
                         const BundleContent& content) {
  for (const FilledSection& section : sections_of(content))
    if (section.numbers) writer.write(entry_of(entries, section.shape.id), 0, section.numbers.get(), section.bytes);
}

void write_column_sections(SectionWriter& writer, const std::vector<formats::SectionEntry>& entries,
                           std::span<const ColumnBatch> batches, std::span<const BatchRecord> records) {
  std::size_t nodes = 0;
  for (const auto& batch : batches) nodes += batch.nodes.size();
  std::vector<std::array<double, 9>> stiffness(nodes);
  std::vector<std::array<double, 3>> residual(nodes);
  std::vector<std::array<std::int32_t, 3>> iterations(nodes);
  for (std::size_t b = 0; b < batches.size(); ++b)
    for (std::size_t i = 0; i < batches[b].slots.size(); ++i) {
      const auto slot = static_cast<std::size_t>(batches[b].slots[i]);
      stiffness[slot] = records[b].nodes[i].stiffness;
      residual[slot] = records[b].nodes[i].residual;
      iterations[slot] = records[b].nodes[i].iterations;
    }
  write_all(writer, entries, SectionId::force, stiffness);
  write_all(writer, entries, SectionId::residual, residual);
  write_all(writer, entries, SectionId::iterations, iterations);
}

nlohmann::json provenance_of(const PrecomputeOptions& options, const RunInputs& inputs, const BundleContent& content,
                             const std::string& solver, const std::string& petsc_options, int columns_at_a_time) {
  const OrganConfig& organ = inputs.organ;
  const BoundaryConfig& boundary = inputs.boundary;
  nlohmann::json p;
  p["format"] = "palpate bundle";
  p["version"] = formats::layout_of_element(name_of(organ.element));
  p["program"] = "palpate-precompute";
  p["program_version"] = PALPATE_VERSION;
  p["element"] = name_of(organ.element);
  p["units"] = "m, N, Pa";
  p["frame"] = organ.frame;
  p["organ"] = organ.name;
  p["boundary"] = boundary.name;
  p["node_order"] = "surface nodes, then interior nodes, each in the order of the mesh file";
  for (const auto& [key, hash] : inputs.hashes) p[key] = hash;
  p["solver"] = solver;
  p["petsc_options"] = petsc_options;
  p["columns_at_a_time"] = columns_at_a_time;
  p["tolerance"] = options.tolerance;
  for (const auto& [key, text] : support_texts(content.body, boundary)) p[key] = text;
  for (const auto& [key, text] : motion_texts(content.body)) p[key] = text;
  for (const auto& [key, text] : corridor_texts(content.body)) p[key] = text;
  if (!content.body.cut_nodes.empty()) p["cut"] = cut_text(content.body);
  p["preload"] = !content.preload.empty();
  for (const auto& region : organ.regions) {
    p["young_source " + region.name] = region.young.source;
    p["poisson_source " + region.name] = region.poisson.source;
    if (region.stiffening && inputs.large_deformation)
      p["stiffening_source " + region.name] = region.stiffening->source;
    if (region.law && inputs.large_deformation) p["law_source " + region.name] = region.law->source;
    if (region.density) p["density_source " + region.name] = region.density->source;
  }
  if (boundary.gravity)
    for (int d = 0; d < 3; ++d) p[std::string("gravity_") + "xyz"[d]] = (*boundary.gravity)[d];
  if (content.response) {
    const auto& fit = *content.response;
    p["curve_source"] = organ.response->source;
    p["response_force_rms"] = fit.force.rms;
    p["response_force_note"] = fit.force.note;
    if (has_radial(content)) p["response_radial_rms"] = fit.radial.rms;
    if (has_radial(content)) p["response_radial_note"] = fit.radial.note;
  }
  return p;
}

std::string provenance_text(nlohmann::json p, const Certificate& certificate) {
  p["worst_residual"] = certificate.worst_residual;
  p["residual_floor"] = certificate.residual_floor;
  p["worst_column_node"] = certificate.worst_node;
  p["worst_column_dof"] = certificate.worst_dof;
  p["most_iterations"] = certificate.most_iterations;
  p["reciprocity_error"] = certificate.reciprocity_error;
  p["reciprocity_pairs"] = certificate.reciprocity_pairs;
  p["cast_error"] = certificate.cast_error;
  p["reciprocal_condition"] = certificate.reciprocal_condition;
  p["element_probes"] = certificate.element.probes;
  p["element_excess"] = certificate.element.largest;
  p["element_excess_median"] = certificate.element.median;
  if (p["preload"].get<bool>()) p["preload_residual"] = certificate.preload_residual;
  return p.dump();
}

}  // namespace palpate
