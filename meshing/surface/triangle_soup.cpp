#include "meshing/surface/triangle_soup.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <unordered_map>

namespace palpate {
namespace {

std::size_t keep_triangles(TriangleSurface& soup, const std::vector<bool>& keep) {
  std::size_t kept = 0;
  for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
    if (keep[t]) soup.triangles[kept++] = soup.triangles[t];
  }
  const std::size_t dropped = soup.triangles.size() - kept;
  soup.triangles.resize(kept);
  return dropped;
}

// One triangle at one edge. The list of these is sorted by edge.
struct EdgeUse {
  std::int32_t low, high;
  std::int32_t triangle;
  bool forward;  // the triangle runs along the edge from its low to its high point
};

std::vector<EdgeUse> edge_uses(const TriangleSurface& soup) {
  std::vector<EdgeUse> uses;
  uses.reserve(3 * soup.triangles.size());
  for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
    for (int c = 0; c < 3; ++c) {
      const std::int32_t a = soup.triangles[t][c], b = soup.triangles[t][(c + 1) % 3];
      uses.push_back({std::min(a, b), std::max(a, b), static_cast<std::int32_t>(t), a < b});
    }
  }
  std::stable_sort(uses.begin(), uses.end(), [](const EdgeUse& x, const EdgeUse& y) {
    return std::pair(x.low, x.high) < std::pair(y.low, y.high);
  });
  return uses;
}

// Calls each(first, count) for each edge, with the range of the edge's triangles.
template <class Each>
void for_each_edge(const std::vector<EdgeUse>& uses, const Each& each) {
  for (std::size_t first = 0; first < uses.size();) {
    std::size_t end = first + 1;
    while (end < uses.size() && uses[end].low == uses[first].low && uses[end].high == uses[first].high) ++end;
    each(first, end - first);
    first = end;
  }
}

double triangle_area(const TriangleSurface& soup, const Triangle& t) {
  const Point n = cross(soup.points[t[1]] - soup.points[t[0]], soup.points[t[2]] - soup.points[t[0]]);
  return 0.5 * std::sqrt(dot(n, n));
}

class UnionFind {
 public:
  explicit UnionFind(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0); }
  std::size_t root(std::size_t n) {
    while (parent_[n] != n) n = parent_[n] = parent_[parent_[n]];
    return n;
  }
  void join(std::size_t a, std::size_t b) { parent_[root(a)] = root(b); }

 private:
  std::vector<std::size_t> parent_;
};

}  // namespace

std::size_t merge_near_points(TriangleSurface& soup, double tolerance) {
  // the cells are much larger than the tolerance, so that a search rarely needs a second cell
  const Point origin = bounding_box(soup).low;
  const double cell = std::max(64 * tolerance, 1e-300);
  const auto key = [](std::int64_t i, std::int64_t j, std::int64_t k) {
    return static_cast<std::uint64_t>(i) * 73856093u ^ static_cast<std::uint64_t>(j) * 19349663u * 2654435761u ^
           static_cast<std::uint64_t>(k) * 83492791u * 40503u;
  };
  std::unordered_multimap<std::uint64_t, std::int32_t> kept_in;
  kept_in.reserve(soup.points.size());
  std::vector<std::int32_t> renumbered(soup.points.size());
  std::vector<Point> kept;
  for (std::size_t p = 0; p < soup.points.size(); ++p) {
    std::array<std::int64_t, 3> low{}, high{}, own{};
    for (int axis = 0; axis < 3; ++axis) {
      const double x = (soup.points[p][axis] - origin[axis]) / cell, reach = tolerance / cell;
      own[axis] = static_cast<std::int64_t>(std::floor(x));
      low[axis] = static_cast<std::int64_t>(std::floor(x - reach));
      high[axis] = static_cast<std::int64_t>(std::floor(x + reach));
    }
    std::int32_t same = -1;
    for (std::int64_t i = low[0]; i <= high[0]; ++i) {
      for (std::int64_t j = low[1]; j <= high[1]; ++j) {
        for (std::int64_t k = low[2]; k <= high[2]; ++k) {
          const auto [first, last] = kept_in.equal_range(key(i, j, k));
          for (auto it = first; it != last; ++it) {
            const Point d = kept[it->second] - soup.points[p];
            if (dot(d, d) <= tolerance * tolerance && (same < 0 || it->second < same)) same = it->second;
          }
        }
      }
    }
    if (same < 0) {
      same = static_cast<std::int32_t>(kept.size());
      kept.push_back(soup.points[p]);
      kept_in.emplace(key(own[0], own[1], own[2]), same);
    }
    renumbered[p] = same;
  }
  const std::size_t merged = soup.points.size() - kept.size();
  soup.points = std::move(kept);
  for (Triangle& triangle : soup.triangles) {
    for (std::int32_t& corner : triangle) corner = renumbered[corner];
  }
  return merged;
}

std::size_t drop_isolated_points(TriangleSurface& soup) {
  const std::size_t before = soup.points.size();
  soup = subset(soup, std::vector<bool>(soup.triangles.size(), true));
  return before - soup.points.size();
}

std::size_t drop_collapsed_triangles(TriangleSurface& soup) {
  std::vector<bool> keep;
  for (const auto& [a, b, c] : soup.triangles) keep.push_back(a != b && b != c && c != a);
  return keep_triangles(soup, keep);
}

std::size_t drop_repeated_triangles(TriangleSurface& soup) {
  std::set<Triangle> seen;
  std::vector<bool> keep;
  for (Triangle t : soup.triangles) {
    std::sort(t.begin(), t.end());
    keep.push_back(seen.insert(t).second);
  }
  return keep_triangles(soup, keep);
}

std::size_t drop_fins(TriangleSurface& soup) {
  std::size_t dropped = 0;
  while (true) {
    const std::vector<EdgeUse> uses = edge_uses(soup);
    UnionFind patches(soup.triangles.size());
    for_each_edge(uses, [&](std::size_t first, std::size_t count) {
      if (count == 2)
        patches.join(static_cast<std::size_t>(uses[first].triangle),
                     static_cast<std::size_t>(uses[first + 1].triangle));
    });
    std::vector<bool> has_free(soup.triangles.size()), has_crowded(soup.triangles.size());
    for_each_edge(uses, [&](std::size_t first, std::size_t count) {
      for (std::size_t u = first; u < first + count; ++u) {
        const std::size_t patch = patches.root(static_cast<std::size_t>(uses[u].triangle));
        if (count == 1) has_free[patch] = true;
        if (count > 2) has_crowded[patch] = true;
      }
    });
    std::vector<double> areas(soup.triangles.size());
    for (std::size_t t = 0; t < soup.triangles.size(); ++t)
      areas[patches.root(t)] += triangle_area(soup, soup.triangles[t]);
    const auto largest = static_cast<std::size_t>(std::max_element(areas.begin(), areas.end()) - areas.begin());
    std::vector<bool> keep(soup.triangles.size());
    for (std::size_t t = 0; t < keep.size(); ++t) {
      const std::size_t patch = patches.root(t);
      keep[t] = patch == largest || !has_free[patch] || !has_crowded[patch];
    }
    const std::size_t now = keep_triangles(soup, keep);
    if (now == 0) return dropped;
    dropped += now;
  }
}

std::size_t orient_patches(TriangleSurface& soup, bool* orientable) {
  const std::vector<EdgeUse> uses = edge_uses(soup);
  struct Neighbour {
    std::int32_t triangle;
    bool same_way;  // both triangles run along the edge in the same direction, so one of them is turned
  };
  std::vector<std::vector<Neighbour>> neighbours(soup.triangles.size());
  for_each_edge(uses, [&](std::size_t first, std::size_t count) {
    if (count != 2) return;
    const EdgeUse &a = uses[first], &b = uses[first + 1];
    neighbours[static_cast<std::size_t>(a.triangle)].push_back({b.triangle, a.forward == b.forward});
    neighbours[static_cast<std::size_t>(b.triangle)].push_back({a.triangle, a.forward == b.forward});
  });
  *orientable = true;
  std::size_t turned = 0;
  std::vector<std::int8_t> turn(soup.triangles.size(), -1);
  for (std::size_t seed = 0; seed < turn.size(); ++seed) {
    if (turn[seed] >= 0) continue;
    turn[seed] = 0;
    std::vector<std::size_t> patch = {seed};
    for (std::size_t n = 0; n < patch.size(); ++n) {
      for (const auto& [next, same_way] : neighbours[patch[n]]) {
        const auto wanted = static_cast<std::int8_t>(turn[patch[n]] ^ static_cast<std::int8_t>(same_way));
        if (turn[static_cast<std::size_t>(next)] < 0) {
          turn[static_cast<std::size_t>(next)] = wanted;
          patch.push_back(static_cast<std::size_t>(next));
        } else if (turn[static_cast<std::size_t>(next)] != wanted) {
          *orientable = false;
        }
      }
    }
    const auto ones = static_cast<std::size_t>(
        std::count_if(patch.begin(), patch.end(), [&](std::size_t t) { return turn[t] == 1; }));
    const std::int8_t lesser = 2 * ones > patch.size() ? 0 : 1;
    for (const std::size_t t : patch) {
      if (turn[t] != lesser) continue;
      std::swap(soup.triangles[t][1], soup.triangles[t][2]);
      ++turned;
    }
  }
  return turned;
}

EdgeCensus count_edges(const TriangleSurface& soup) {
  EdgeCensus census;
  const std::vector<EdgeUse> uses = edge_uses(soup);
  UnionFind rims(soup.points.size());
  std::set<std::size_t> on_rim;
  for_each_edge(uses, [&](std::size_t first, std::size_t count) {
    const auto a = static_cast<std::size_t>(uses[first].low), b = static_cast<std::size_t>(uses[first].high);
    const Point middle = 0.5 * (soup.points[a] + soup.points[b]);
    if (count == 1) {
      if (census.free++ == 0) census.free_place = middle;
      rims.join(a, b);
      on_rim.insert(a);
    }
    if (count > 2 && census.crowded++ == 0) census.crowded_place = middle;
  });
  std::set<std::size_t> roots;
  for (const std::size_t p : on_rim) roots.insert(rims.root(p));
  census.loops = roots.size();
  return census;
}

Caps cap_free_edges(TriangleSurface& soup) {
  std::vector<std::array<std::int32_t, 2>> edges;  // along the new triangle
  UnionFind rims(soup.points.size());
  const std::vector<EdgeUse> uses = edge_uses(soup);
  for_each_edge(uses, [&](std::size_t first, std::size_t count) {
    if (count != 1) return;
    const EdgeUse& use = uses[first];
    edges.push_back({use.forward ? use.high : use.low, use.forward ? use.low : use.high});
    rims.join(static_cast<std::size_t>(use.low), static_cast<std::size_t>(use.high));
  });
  struct Rim {
    Point sum{}, low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};
    double edges = 0;
    std::int32_t centre = 0;
  };
  std::map<std::size_t, Rim> rim_of;
  for (const auto& edge : edges) {
    Rim& rim = rim_of[rims.root(static_cast<std::size_t>(edge[0]))];
    const Point p = soup.points[edge[0]], middle = 0.5 * (p + soup.points[edge[1]]);
    rim.sum = rim.sum + middle;
    ++rim.edges;
    for (int axis = 0; axis < 3; ++axis) {
      rim.low[axis] = std::min(rim.low[axis], p[axis]);
      rim.high[axis] = std::max(rim.high[axis], p[axis]);
    }
  }
  Caps caps;
  for (auto& [root, rim] : rim_of) {
    rim.centre = static_cast<std::int32_t>(soup.points.size());
    soup.points.push_back((1 / rim.edges) * rim.sum);
    ++caps.loops;
    const double width = Box{rim.low, rim.high}.diagonal();
    if (width <= caps.widest) continue;
    caps.widest = width;
    caps.place = soup.points.back();
  }
  for (const auto& edge : edges)
    soup.triangles.push_back({edge[0], edge[1], rim_of[rims.root(static_cast<std::size_t>(edge[0]))].centre});
  return caps;
}

}  // namespace palpate
