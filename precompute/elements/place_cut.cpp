#include "precompute/elements/place_cut.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "formats/errors.h"

namespace palpate {
namespace {

// With the other nodes of their tetrahedra.
void add_ring(const ElasticBody& body, std::vector<char>& chosen) {
  const std::vector<char> before = chosen;
  for (const auto& tetrahedron : body.tetrahedra)
    if (std::ranges::any_of(tetrahedron, [&](std::int32_t n) { return before[n] != 0; }))
      for (const std::int32_t n : tetrahedron) chosen[n] = 1;
}

}  // namespace

void place_cut(const std::vector<std::int32_t>& dividable, Element element, int line, const std::filesystem::path& file,
               ElasticBody& body) {
  const auto refuse = [&](const std::string& what) {
    throw InputError(fmt::format("{}:{}: [cut] {}", file.string(), line, what));
  };
  if (element == Element::p2_p0)
    refuse("expected the element p1, p1-anp or p1-ang, found p2-p0, which has nodes on edges; change it in organ.toml");
  std::vector<char> chosen(body.nodes.size(), 0);
  for (const std::int32_t n : dividable) chosen[n] = 1;
  for (int ring = element == Element::p1 ? 1 : 2; ring > 0; --ring) add_ring(body, chosen);
  std::vector<std::int32_t> inside;
  std::size_t without_column = 0;
  for (std::int32_t n = 0; n < static_cast<std::int32_t>(body.nodes.size()); ++n) {
    if (!chosen[n]) continue;
    body.cut_nodes.push_back(n);
    const auto& held = body.fixed[n];
    if (n >= body.surface_count)
      inside.push_back(n);
    else if (!(held[0] && held[1] && held[2]) && !std::ranges::binary_search(body.touchable, n))
      ++without_column;
  }
  if (body.cut_nodes.size() > static_cast<std::size_t>(formats::kMostCutNodes))
    refuse(
        fmt::format("region: expected at most {} nodes with those beside it, found {}; take a smaller region or a "
                    "coarser mesh",
                    formats::kMostCutNodes, body.cut_nodes.size()));
  if (without_column > 0)
    refuse(
        fmt::format("region: expected that the surface in and beside it can be touched, found {} nodes that "
                    "[touchable] leaves out; select them there, or take a smaller region",
                    without_column));
  body.cut_dividable = dividable.size();
  std::vector<std::int32_t> all;
  std::ranges::set_union(body.corridor_nodes, inside, std::back_inserter(all));
  body.corridor_nodes = std::move(all);
}

}  // namespace palpate
