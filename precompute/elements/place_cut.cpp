#include "precompute/elements/place_cut.h"

#include <fmt/format.h>

#include <algorithm>

#include "formats/bundle_layout.h"
#include "formats/errors.h"

namespace palpate {
namespace {

// Where the file names no reserve: a cut across the region, along a plane, divides fewer of its nodes than it has.
constexpr std::size_t kMostReserve = 500;

// With the other nodes of their tetrahedra.
void add_ring(const TetrahedralMesh& mesh, std::vector<char>& chosen) {
  const std::vector<char> before = chosen;
  for (const auto& tetrahedron : mesh.tetrahedra)
    if (std::ranges::any_of(tetrahedron, [&](std::int32_t n) { return before[n] != 0; }))
      for (const std::int32_t n : tetrahedron) chosen[n] = 1;
}

}  // namespace

CutPlace place_cut(const TetrahedralMesh& mesh, const std::vector<std::int32_t>& dividable,
                   const BoundaryConfig::Cut& config, Element element, const std::filesystem::path& file) {
  const auto refuse = [&](const std::string& what) {
    throw InputError(fmt::format("{}:{}: [cut] {}", file.string(), config.line, what));
  };
  if (element == Element::p2_p0)
    refuse("expected the element p1, p1-anp or p1-ang, found p2-p0, which has nodes on edges; change it in organ.toml");
  std::vector<char> chosen(mesh.nodes.size(), 0);
  for (const std::int32_t n : dividable) chosen[n] = 1;
  for (int ring = element == Element::p1 ? 1 : 2; ring > 0; --ring) add_ring(mesh, chosen);
  CutPlace place;
  for (std::int32_t n = 0; n < static_cast<std::int32_t>(mesh.nodes.size()); ++n)
    if (chosen[n]) place.nodes.push_back(n);
  if (place.nodes.size() > static_cast<std::size_t>(formats::kMostCutNodes))
    refuse(
        fmt::format("region: expected at most {} nodes with those beside it, found {}; take a smaller region or a "
                    "coarser mesh",
                    formats::kMostCutNodes, place.nodes.size()));
  place.dividable = dividable.size();
  place.reserve = static_cast<std::int32_t>(
      config.reserve >= 0 ? config.reserve : static_cast<std::int64_t>(std::min(dividable.size(), kMostReserve)));
  return place;
}

}  // namespace palpate
