#include "precompute/elements/elastic_body.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <numeric>

#include "formats/errors.h"
#include "formats/program.h"
#include "precompute/elements/label_nodes.h"
#include "precompute/elements/place_corridors.h"
#include "precompute/elements/place_cut.h"
#include "precompute/elements/place_motions.h"
#include "precompute/elements/place_supports.h"

namespace palpate {
namespace {

std::string quoted(const std::vector<std::string>& names) {
  std::string text;
  for (const auto& name : names) text += (text.empty() ? "\"" : ", \"") + name + '"';
  return text;
}

std::vector<Material> materials_by_name(const TetrahedralMesh& mesh, const OrganConfig& organ, const BodyFiles& files) {
  std::vector<Material> result;
  for (const auto& name : mesh.region_names) {
    const auto at = std::find_if(organ.regions.begin(), organ.regions.end(),
                                 [&name](const OrganConfig::Region& r) { return r.name == name; });
    if (at == organ.regions.end())
      throw InputError(fmt::format("{}: no [[region]] is named \"{}\", but {} has such a region (its regions: {})",
                                   files.organ.string(), name, files.mesh.string(), quoted(mesh.region_names)));
    result.push_back({at->young.value, at->poisson.value, at->density ? at->density->value : 0.0});
  }
  for (const auto& region : organ.regions)
    if (std::find(mesh.region_names.begin(), mesh.region_names.end(), region.name) == mesh.region_names.end())
      warn(fmt::format("{}: [[region]] \"{}\" is not in {}", files.organ.string(), region.name, files.mesh.string()));
  return result;
}

// For each node of the mesh: its number in the body. Surface nodes come first, then those of `inside`, then the reserve, which the mesh does not have; all
// groups keep the order of the mesh. surface_count: up to the reserve.
std::vector<std::int32_t> surface_first(std::size_t count, const std::vector<std::int32_t>& surface_nodes,
                                        const std::vector<std::int32_t>& inside, std::int32_t reserve,
                                        std::int32_t* surface_count) {
  std::vector<std::int32_t> order(count, -1);
  std::int32_t next = 0;
  for (const auto n : surface_nodes) order[n] = next++;
  for (const auto n : inside)
    if (order[n] < 0) order[n] = next++;
  *surface_count = next += reserve;
  for (auto& new_node : order)
    if (new_node < 0) new_node = next++;
  return order;
}

std::vector<std::int32_t> nodes_of(const std::vector<std::array<std::int32_t, 3>>& triangles) {
  std::vector<std::int32_t> nodes;
  for (const auto& triangle : triangles) nodes.insert(nodes.end(), triangle.begin(), triangle.end());
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  return nodes;
}

// The size of no organ is outside these limits: there mesh_unit is wrong or the file holds something else. Far outside,
// products of lengths overflow.
constexpr double kSmallest = 1e-9, kLargest = 1e9;  // m

void check_extent(const ElasticBody& body, const BodyFiles& files) {
  double extent = 0;
  for (int d = 0; d < 3; ++d) {
    const auto [low, high] = std::minmax_element(body.nodes.begin(), body.nodes.end(),
                                                 [d](const auto& a, const auto& b) { return a[d] < b[d]; });
    extent = std::max(extent, (*high)[d] - (*low)[d]);
  }
  if (!(extent >= kSmallest && extent <= kLargest))
    throw InputError(fmt::format("{}: the body is {:.3g} m across, expected 1e-9 to 1e9 m; check mesh_unit in {}",
                                 files.mesh.string(), extent, files.organ.string()));
}

// Of the selected nodes, ascending, those that may be touched: on the surface, with a dof that is not held.
std::vector<std::int32_t> touchable_nodes(const std::vector<std::int32_t>& wanted, const ElasticBody& body,
                                          const BodyFiles& files) {
  std::vector<std::int32_t> result;
  std::size_t inside = 0;
  for (const auto n : wanted) {
    const auto& held = body.fixed[n];
    if (n >= body.surface_count)
      ++inside;
    else if (!(held[0] && held[1] && held[2]))
      result.push_back(n);
  }
  if (inside > 0)
    warn(fmt::format("{}: [touchable] names {} nodes inside the body; left out", files.boundary.string(), inside));
  if (result.empty())
    throw InputError(
        fmt::format("{}: no node can be touched: expected surface nodes with a free degree of freedom, found "
                    "that all {} selected ones are held; let [touchable] select others",
                    files.boundary.string(), wanted.size() - inside));
  return result;
}

}  // namespace

ElasticBody make_elastic_body(const TetrahedralMesh& mesh, const OrganConfig& organ, const BoundaryConfig& boundary,
                              const BodyFiles& files) {
  ElasticBody body;
  try {
    body.triangles = boundary_triangles(mesh);
  } catch (const InputError& error) {
    throw InputError(fmt::format("{}: {}", files.mesh.string(), error.what()));
  }
  const auto surface = nodes_of(body.triangles);
  const LabelledNodes labelled = labelled_nodes(mesh, organ, files.image, files.boundary);
  const auto select_in_mesh = [&](const std::vector<Selector>& selectors) {
    return select_nodes(selectors, mesh, surface, files.boundary, labelled);
  };
  CutPlace cut;
  if (boundary.cut)
    cut = place_cut(mesh, select_in_mesh(boundary.cut->region), *boundary.cut, organ.element, files.boundary);
  const auto order = surface_first(mesh.nodes.size(), surface, cut.nodes, cut.reserve, &body.surface_count);
  body.reserve = cut.reserve, body.cut_dividable = cut.dividable;
  for (const auto n : cut.nodes) body.cut_nodes.push_back(order[n]);
  std::ranges::sort(body.cut_nodes);

  // The reserve waits at a node of the region.
  const std::size_t nodes = mesh.nodes.size() + static_cast<std::size_t>(cut.reserve);
  body.nodes.resize(nodes);
  for (std::size_t n = 0; n < nodes && cut.reserve > 0; ++n)
    for (int d = 0; d < 3; ++d) body.nodes[n][d] = mesh.nodes[cut.nodes[0]][d] * organ.mesh_unit.metres;
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n)
    for (int d = 0; d < 3; ++d) body.nodes[order[n]][d] = mesh.nodes[n][d] * organ.mesh_unit.metres;
  check_extent(body, files);
  body.tetrahedra = mesh.tetrahedra;
  for (auto& tetrahedron : body.tetrahedra)
    for (auto& n : tetrahedron) n = order[n];
  for (auto& triangle : body.triangles)
    for (auto& n : triangle) n = order[n];
  body.region = mesh.region;
  body.region_names = mesh.region_names;
  body.materials = materials_by_name(mesh, organ, files);

  const auto select = [&](const std::vector<Selector>& selectors) {
    auto selected = select_in_mesh(selectors);
    for (auto& n : selected) n = order[n];
    std::sort(selected.begin(), selected.end());
    return selected;
  };
  body.fixed.assign(nodes, {0, 0, 0});
  for (std::int32_t n = body.surface_count - cut.reserve; n < body.surface_count; ++n) body.fixed[n] = {1, 1, 1};
  for (const auto& fixed : boundary.fixed)
    for (const auto n : select(fixed.select))
      for (int d = 0; d < 3; ++d) body.fixed[n][d] |= fixed.dofs[d] ? 1 : 0;
  place_supports(boundary, organ.mesh_unit.metres, files.boundary, select, body);
  place_motions(boundary, organ.mesh_unit.metres, files.boundary, select, body);
  place_corridors(boundary, organ.mesh_unit.metres, files.boundary, body);

  std::vector<std::int32_t> wanted(static_cast<std::size_t>(body.surface_count));
  std::iota(wanted.begin(), wanted.end(), 0);
  if (!boundary.touchable.empty()) {
    std::vector<std::int32_t> all;
    std::ranges::set_union(select(boundary.touchable), body.cut_nodes, std::back_inserter(all));
    wanted = std::move(all);
  }
  body.touchable = touchable_nodes(wanted, body, files);
  return body;
}

}  // namespace palpate
