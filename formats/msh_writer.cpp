// MSH 4.1 ASCII, as the gmsh reference manual describes it (section "MSH file format").
#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <limits>

#include "formats/atomic_file.h"
#include "formats/errors.h"
#include "formats/tetrahedral_mesh.h"

namespace palpate {

namespace {

constexpr int kMshTriangle = 2, kMshTetrahedron = 4;

using Text = fmt::memory_buffer;

template <class... Arguments>
void put(Text& text, fmt::format_string<Arguments...> format, Arguments&&... arguments) {
  fmt::format_to(std::back_inserter(text), format, std::forward<Arguments>(arguments)...);
}

struct Box {
  double low[3] = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
                   std::numeric_limits<double>::infinity()};
  double high[3] = {-low[0], -low[1], -low[2]};
  template <class Element>
  void add(const TetrahedralMesh& mesh, const Element& element) {
    for (const std::int32_t node : element)
      for (int d = 0; d < 3; ++d) {
        low[d] = std::min(low[d], mesh.nodes[node][d]);
        high[d] = std::max(high[d], mesh.nodes[node][d]);
      }
  }
};

// An entity with its box, one physical group of the same number, no bounding entities.
void put_entity(Text& text, std::size_t tag, const Box& box) {
  put(text, "{} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} 1 {} 0\n", tag, box.low[0], box.low[1], box.low[2],
      box.high[0], box.high[1], box.high[2], tag);
}

void check_name(const std::string& name) {
  if (name.empty() || name.find_first_of("\"\n\r") != std::string::npos)
    throw InputError(
        fmt::format("cannot write the name '{}' to a mesh file; use one without quotes or line ends", name));
}

void put_names(Text& text, const TetrahedralMesh& mesh) {
  put(text, "$PhysicalNames\n{}\n", mesh.patches.size() + mesh.region_names.size());
  for (std::size_t p = 0; p < mesh.patches.size(); ++p) {
    check_name(mesh.patches[p].name);
    put(text, "2 {} \"{}\"\n", p + 1, mesh.patches[p].name);
  }
  for (std::size_t r = 0; r < mesh.region_names.size(); ++r) {
    check_name(mesh.region_names[r]);
    put(text, "3 {} \"{}\"\n", r + 1, mesh.region_names[r]);
  }
  put(text, "$EndPhysicalNames\n");
}

void put_entities(Text& text, const TetrahedralMesh& mesh) {
  std::vector<Box> regions(mesh.region_names.size());
  for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e) regions[mesh.region[e]].add(mesh, mesh.tetrahedra[e]);
  put(text, "$Entities\n0 0 {} {}\n", mesh.patches.size(), regions.size());
  for (std::size_t p = 0; p < mesh.patches.size(); ++p) {
    Box box;
    for (const auto& triangle : mesh.patches[p].triangles) box.add(mesh, triangle);
    if (mesh.patches[p].triangles.empty()) box.add(mesh, std::array<std::int32_t, 1>{0});
    put_entity(text, p + 1, box);
  }
  for (std::size_t r = 0; r < regions.size(); ++r) put_entity(text, r + 1, regions[r]);
  put(text, "$EndEntities\n");
}

void put_nodes(Text& text, const TetrahedralMesh& mesh) {
  const std::size_t count = mesh.nodes.size();
  put(text, "$Nodes\n1 {0} 1 {0}\n3 1 0 {0}\n", count);
  for (std::size_t n = 1; n <= count; ++n) put(text, "{}\n", n);
  for (const auto& p : mesh.nodes) put(text, "{:.17g} {:.17g} {:.17g}\n", p[0], p[1], p[2]);
  put(text, "$EndNodes\n");
}

void put_elements(Text& text, const TetrahedralMesh& mesh) {
  std::vector<std::vector<std::size_t>> of_region(mesh.region_names.size());
  for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e) of_region[mesh.region[e]].push_back(e);
  std::size_t total = mesh.tetrahedra.size(), tag = 0;
  for (const auto& patch : mesh.patches) total += patch.triangles.size();

  put(text, "$Elements\n{} {} 1 {}\n", mesh.patches.size() + of_region.size(), total, total);
  for (std::size_t p = 0; p < mesh.patches.size(); ++p) {
    put(text, "2 {} {} {}\n", p + 1, kMshTriangle, mesh.patches[p].triangles.size());
    for (const auto& t : mesh.patches[p].triangles) put(text, "{} {} {} {}\n", ++tag, t[0] + 1, t[1] + 1, t[2] + 1);
  }
  for (std::size_t r = 0; r < of_region.size(); ++r) {
    put(text, "3 {} {} {}\n", r + 1, kMshTetrahedron, of_region[r].size());
    for (const std::size_t e : of_region[r]) {
      const auto& t = mesh.tetrahedra[e];
      put(text, "{} {} {} {} {}\n", ++tag, t[0] + 1, t[1] + 1, t[2] + 1, t[3] + 1);
    }
  }
  put(text, "$EndElements\n");
}

}  // namespace

void write_mesh(const std::filesystem::path& file, const TetrahedralMesh& mesh) {
  if (mesh.tetrahedra.empty()) throw InputError(file.string() + ": there are no tetrahedra to write");
  Text text;
  put(text, "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n");
  put_names(text, mesh);
  put_entities(text, mesh);
  put_nodes(text, mesh);
  put_elements(text, mesh);
  write_text_atomically(file, {text.data(), text.size()});
}

}  // namespace palpate
