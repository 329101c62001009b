#include "precompute/ranks/row_partition.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace palpate {
namespace {

using Point = std::array<double, 3>;

int longest_extent(std::span<const Point> nodes, std::span<const std::int32_t> some) {
  Point low = nodes[some[0]], high = low;
  for (const auto n : some)
    for (int d = 0; d < 3; ++d) {
      low[d] = std::min(low[d], nodes[n][d]);
      high[d] = std::max(high[d], nodes[n][d]);
    }
  int axis = 0;
  for (int d = 1; d < 3; ++d)
    if (high[d] - low[d] > high[axis] - low[axis]) axis = d;
  return axis;
}

// Sorts the node numbers in some by recursive bisection and appends to ends where the share of each rank ends. begin: rows before
// these.
void bisect(std::span<const Point> nodes, std::span<std::int32_t> some, int ranks, std::int32_t begin,
            std::vector<std::int32_t>* ends) {
  constexpr std::size_t kFew = 8;  // from here on the order does not matter for the cache
  if (ranks == 1 && some.size() <= kFew) {
    std::sort(some.begin(), some.end());
    if (ends) ends->push_back(begin + static_cast<std::int32_t>(some.size()));
    return;
  }
  const int left = ranks > 1 ? ranks / 2 : 1, of = ranks > 1 ? ranks : 2;
  const std::size_t half = some.size() * static_cast<std::size_t>(left) / static_cast<std::size_t>(of);
  if (!some.empty()) {
    const int axis = longest_extent(nodes, some);
    std::nth_element(some.begin(), some.begin() + static_cast<std::ptrdiff_t>(half), some.end(), [&](auto a, auto b) {
      return nodes[a][axis] != nodes[b][axis] ? nodes[a][axis] < nodes[b][axis] : a < b;
    });
  }
  const auto middle = begin + static_cast<std::int32_t>(half);
  if (ranks > 1) {
    bisect(nodes, some.first(half), left, begin, ends);
    bisect(nodes, some.subspan(half), ranks - left, middle, ends);
    return;
  }
  bisect(nodes, some.first(half), 1, begin, nullptr);
  bisect(nodes, some.subspan(half), 1, middle, nullptr);
  if (ends) ends->push_back(begin + static_cast<std::int32_t>(some.size()));
}

// Returns the tetrahedra around the marked nodes, and marks the nodes of these tetrahedra as well.
std::vector<std::size_t> one_ring(const ElasticBody& body, std::vector<char>& marked) {
  std::vector<std::size_t> result;
  for (std::size_t t = 0; t < body.tetrahedra.size(); ++t) {
    const auto& nodes = body.tetrahedra[t];
    if (std::any_of(nodes.begin(), nodes.end(), [&](auto n) { return marked[n] != 0; })) result.push_back(t);
  }
  for (const auto t : result)
    for (const auto n : body.tetrahedra[t]) marked[n] = 1;
  return result;
}

// The part of the body that consists of the given tetrahedra and marked nodes, in the order of the body.
struct Part {
  ElasticBody body;
  std::vector<std::int32_t> node;       // number of each node of the part in the whole body
  std::vector<std::int32_t> part_node;  // number of each node of the whole body in the part; -1: not in it
};
// The soft supports that touch a node of this rank; others may lie outside of the part.
void add_supports_of(const ElasticBody& body, const std::vector<char>& own, Part& part) {
  for (const auto& foundation : body.foundations) {
    Foundation mine{foundation.name, foundation.normal, foundation.tangential, {}};
    for (const auto triangle : foundation.triangles) {
      auto nodes = body.triangles[triangle];
      if (std::none_of(nodes.begin(), nodes.end(), [&](auto n) { return own[n] != 0; })) continue;
      for (auto& n : nodes) n = part.part_node[n];
      mine.triangles.push_back(static_cast<std::int32_t>(part.body.triangles.size()));
      part.body.triangles.push_back(nodes);
    }
    part.body.foundations.push_back(std::move(mine));
  }
  for (const auto& set : body.springs) {
    SpringSet mine{set.name, {}};
    for (Spring spring : set.springs) {
      if (!own[spring.a] && (spring.b == Spring::kWorld || !own[spring.b])) continue;
      spring.a = part.part_node[spring.a];
      if (spring.b != Spring::kWorld) spring.b = part.part_node[spring.b];
      mine.springs.push_back(spring);
    }
    part.body.springs.push_back(std::move(mine));
  }
}

Part part_of(const ElasticBody& body, const std::vector<std::size_t>& tetrahedra, const std::vector<char>& marked,
             const std::vector<char>& own) {
  Part part;
  part.part_node.assign(body.nodes.size(), -1);
  for (std::size_t n = 0; n < body.nodes.size(); ++n) {
    if (!marked[n]) continue;
    part.part_node[n] = static_cast<std::int32_t>(part.node.size());
    part.node.push_back(static_cast<std::int32_t>(n));
    part.body.nodes.push_back(body.nodes[n]);
    part.body.fixed.push_back(body.fixed[n]);
  }
  for (const auto t : tetrahedra) {
    auto nodes = body.tetrahedra[t];
    for (auto& n : nodes) n = part.part_node[n];
    part.body.tetrahedra.push_back(nodes);
    part.body.region.push_back(body.region[t]);
  }
  add_supports_of(body, own, part);
  part.body.materials = body.materials;
  part.body.region_names = body.region_names;
  return part;
}

}  // namespace

RowPartition partition_rows(std::span<const Point> nodes, std::span<const std::array<std::uint8_t, 3>> fixed,
                            int ranks) {
  RowPartition result;
  for (std::size_t n = 0; n < nodes.size(); ++n)
    if (!(fixed[n][0] && fixed[n][1] && fixed[n][2])) result.node_of_row.push_back(static_cast<std::int32_t>(n));
  result.first_row.assign(1, 0);
  bisect(nodes, result.node_of_row, ranks, 0, &result.first_row);
  result.row_of_node.assign(nodes.size(), -1);
  for (std::size_t r = 0; r < result.node_of_row.size(); ++r)
    result.row_of_node[result.node_of_row[r]] = static_cast<std::int32_t>(r);
  return result;
}

BlockMatrix assemble_own_rows(const ElasticBody& body, const RowPartition& partition, int rank,
                              const std::function<BlockMatrix(const ElasticBody&)>& assemble) {
  const auto first = partition.first_row[rank], last = partition.first_row[rank + 1];
  std::vector<char> marked(body.nodes.size(), 0);
  for (auto row = first; row < last; ++row) marked[partition.node_of_row[row]] = 1;
  // p1-anp couples a node with the neighbours of its neighbours, and needs every tetrahedron around each neighbour for the
  // neighbour's volume: two rings.
  const std::vector<char> mine = marked;
  one_ring(body, marked);
  const auto tetrahedra = one_ring(body, marked);
  for (const auto& set : body.springs)  // both ends of a spring
    for (const auto& spring : set.springs)
      if (spring.b != Spring::kWorld && (mine[spring.a] || mine[spring.b])) marked[spring.a] = marked[spring.b] = 1;
  const Part part = part_of(body, tetrahedra, marked, mine);
  const BlockMatrix all = assemble(part.body);

  BlockMatrix own;
  own.rows = last - first;
  own.first.assign(1, 0);
  std::vector<std::pair<std::int32_t, std::int64_t>> entries;  // row of the whole K, index in all.block
  for (auto row = first; row < last; ++row) {
    const auto from = part.part_node[partition.node_of_row[row]];
    entries.clear();
    for (auto at = all.first[from]; at < all.first[from + 1]; ++at)
      if (const auto column = partition.row_of_node[part.node[all.column[at]]]; column >= 0)
        entries.emplace_back(column, at);
    std::sort(entries.begin(), entries.end());
    for (const auto& [column, at] : entries) {
      own.column.push_back(column);
      own.block.push_back(all.block[at]);
    }
    own.first.push_back(static_cast<std::int64_t>(own.column.size()));
  }
  return own;
}

}  // namespace palpate
