#include "runtime/cut/cut_supports.h"

#include <algorithm>
#include <cmath>

namespace palpate {
namespace {

// What the foundations leave of a block below this share of it is rounding, not a spring.
constexpr double kRounding = 1e-9;

// The place of a pair among those of the body, which ascend; -1: none.
std::int32_t find_pair(const HyperelasticBody& body, std::int32_t a, std::int32_t b) {
  std::int32_t low = 0, high = body.support_count;
  while (low < high) {
    const std::int32_t middle = (low + high) / 2, *const pair =
                                                      body.support_nodes + 2 * static_cast<std::int64_t>(middle);
    if (pair[0] < a || (pair[0] == a && pair[1] < b))
      low = middle + 1;
    else
      high = middle;
  }
  const std::int32_t* const pair = body.support_nodes + 2 * static_cast<std::int64_t>(low);
  return low < body.support_count && pair[0] == a && pair[1] == b ? low : -1;
}

double largest_of(const double* block) {
  double most = 0;
  for (int i = 0; i < 9; ++i) most = std::max(most, std::fabs(block[i]));
  return most;
}

}  // namespace

bool CutSupports::create(SceneMemory& memory, const HyperelasticBody& body, const SupportedSurface& surface,
                         const CutTissue& tissue) {
  const double* const foundation = surface.foundation;
  const bool founded = foundation && std::any_of(foundation, foundation + 2 * static_cast<std::int64_t>(surface.count),
                                                 [](double k) { return k > 0; });
  if (surface.count == 0) return true;
  exist_ = founded || body.support_count > 0;
  all_nodes_ = tissue.most_nodes();
  if (!make_faces(memory, body, surface, tissue)) return false;
  return body.support_count == 0 || make_springs(memory, body, surface);
}

void CutSupports::forget() {
  if (held_) std::fill_n(held_, all_nodes_, 1.0);
}

void CutSupports::begin_from(const CutSupports& now) {
  if (held_) std::copy_n(now.held_, all_nodes_, held_);
}

bool CutSupports::make_faces(SceneMemory& memory, const HyperelasticBody& body, const SupportedSurface& surface,
                             const CutTissue& tissue) {
  const auto corners = 4 * static_cast<std::size_t>(body.tetrahedron_count);
  face_at_ = memory.array<std::int32_t>(corners);
  faces_ = memory.array<Face>(static_cast<std::size_t>(surface.count));
  triangles_ = surface.triangles;
  if (memory.failed()) return false;
  std::fill_n(face_at_, corners, -1);
  for (std::int32_t t = 0; t < surface.count; ++t) {
    const std::int32_t* const node = surface.triangles + 3 * static_cast<std::int64_t>(t);
    tissue.for_each_at(node[0], [&](std::int32_t e, int first) {
      const int second = tissue.corner_of(e, node[1]), third = tissue.corner_of(e, node[2]);
      if (second >= 0 && third >= 0) face_at_[4 * static_cast<std::int64_t>(e) + 6 - first - second - third] = t;
    });
    const auto at = [&](int v) { return load3(body.nodes + 3 * static_cast<std::int64_t>(node[v])); };
    const Vec3 twice = cross(at(1) - at(0), at(2) - at(0)), n = unit_or_zero(twice);
    Face& face = faces_[t] = Face{};
    face.area = 0.5 * length(twice);
    if (!surface.foundation) continue;
    const double *const k = surface.foundation + 2 * static_cast<std::int64_t>(t), part = face.area / 12;
    face.founded = k[0] > 0 || k[1] > 0;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) face.block.m[i][j] = part * ((i == j ? k[1] : 0) + (k[0] - k[1]) * (n[i] * n[j]));
  }
  for (std::int32_t e = 0; e < body.tetrahedron_count; ++e)
    most_foundations_ = std::max(most_foundations_, foundations_of(e));
  return true;
}

int CutSupports::foundations_of(std::int32_t e) const {
  int count = 0;
  for (int c = 0; c < 4; ++c) {
    const Face* const of = face(e, c);
    count += of && of->founded;
  }
  return count;
}

// What the foundations leave of the body's supports.
bool CutSupports::make_springs(SceneMemory& memory, const HyperelasticBody& body, const SupportedSurface& surface) {
  SceneMemory scratch = memory.of_same_host();
  const auto pairs = static_cast<std::size_t>(body.support_count), nodes = static_cast<std::size_t>(body.node_count);
  double* const rest = scratch.array<double>(9 * pairs);
  if (!rest) return false;
  std::copy_n(body.support_stiffness, 9 * pairs, rest);
  for (std::int32_t t = 0; t < surface.count; ++t) {
    if (!faces_[t].founded) continue;
    const std::int32_t* const node = surface.triangles + 3 * static_cast<std::int64_t>(t);
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) {
        const std::int32_t pair = node[a] <= node[b] ? find_pair(body, node[a], node[b]) : -1;
        for (int i = 0; i < 9 && pair >= 0; ++i)
          rest[9 * static_cast<std::size_t>(pair) + static_cast<std::size_t>(i)] -=
              (a == b ? 2 : 1) * faces_[t].block.m[i / 3][i % 3];
      }
  }
  const auto each = [&](auto visit) {
    for (std::size_t p = 0; p < pairs; ++p)
      if (largest_of(rest + 9 * p) > kRounding * largest_of(body.support_stiffness + 9 * p))
        visit(body.support_nodes[2 * p], body.support_nodes[2 * p + 1], rest + 9 * p);
  };
  std::size_t count = 0;
  each([&](std::int32_t a, std::int32_t b, const double*) { count += a == b ? 1 : 2; });
  if (count > 0) {
    first_ = memory.array<std::int32_t>(nodes + 1), springs_ = memory.array<Spring>(count);
    held_ = memory.array<double>(static_cast<std::size_t>(all_nodes_));
  }
  if (count > 0 && !memory.failed()) {
    each([&](std::int32_t a, std::int32_t b, const double*) { ++first_[a + 1], first_[b + 1] += a != b; });
    for (std::size_t n = 0; n < nodes; ++n) first_[n + 1] += first_[n];
    std::int32_t* const next = scratch.array<std::int32_t>(nodes);
    if (next) {
      std::copy_n(first_, nodes, next);
      each([&](std::int32_t a, std::int32_t b, const double* block) {
        Spring &one = springs_[next[a]++] = Spring{b, 0, {}}, *const other = a == b ? nullptr : &springs_[next[b]++];
        if (other) *other = Spring{a, 0, {}};
        for (int i = 0; i < 9; ++i) {
          one.block.m[i / 3][i % 3] = block[i];
          if (other) other->block.m[i % 3][i / 3] = block[i];
        }
      });
      count_pairs(surface, body.node_count, next);
    }
    for (std::int32_t t = 0; t < surface.count; ++t) {
      const std::int32_t* const node = surface.triangles + 3 * static_cast<std::int64_t>(t);
      faces_[t].has_springs = has_springs(node[0]) && has_springs(node[1]) && has_springs(node[2]);
    }
    forget();
  }
  const bool made = !memory.failed() && !scratch.failed();
  scratch.release_all();
  return made;
}

// triangles_at: memory for it, [nodes].
void CutSupports::count_pairs(const SupportedSurface& surface, std::int32_t nodes, std::int32_t* triangles_at) {
  std::fill_n(triangles_at, nodes, 0);
  for (std::int64_t corner = 0; corner < 3 * std::int64_t{surface.count}; ++corner)
    ++triangles_at[surface.triangles[corner]];
  for (std::int32_t n = 0; n < nodes; ++n) {
    std::int32_t pairs = 0;
    for_each_spring(
        n, [&](std::int32_t other, const Mat3&) { pairs += other == n ? 1 : std::max(1, triangles_at[other]); });
    most_pairs_of_new_ = std::max(most_pairs_of_new_, pairs);
  }
}

Mat3 CutSupports::springs_of(std::int32_t triangle) const {
  Mat3 sum;
  if (!faces_ || !faces_[triangle].has_springs) return sum;
  for (int v = 0; v < 3; ++v) {
    const std::int32_t node = triangles_[3 * static_cast<std::int64_t>(triangle) + v];
    for_each_spring(node, [&](std::int32_t, const Mat3& block) { add_scaled(sum, 1, block); });
  }
  return sum;
}

// ---- shares ----------------------------------------------------------------------------------------------------------

double CutSupports::weight_of(const Face& face, Weight weight) {
  if (weight == Weight::foundation)
    return face.founded ? face.block.m[0][0] + face.block.m[1][1] + face.block.m[2][2] : 0;
  return weight == Weight::area || face.has_springs ? face.area : 0;
}

// What goes, of the sum of the weights of the node's faces. -1: the sum is zero.
double CutSupports::share_by(const CutTissue& tissue, std::int32_t node, const std::uint8_t* goes,
                             Weight weight) const {
  double all = 0, part = 0;
  tissue.for_each_at(node, [&](std::int32_t e, int corner) {
    for (int c = 0; c < 4; ++c) {
      const Face* const of = c == corner ? nullptr : face(e, c);
      const double own = of ? weight_of(*of, weight) : 0;
      all += own;
      if (goes[e]) part += own;
    }
  });
  return all > 0 ? part / all : -1;
}

double CutSupports::share_of(const CutTissue& tissue, std::int32_t node, const std::uint8_t* goes) const {
  if (!has_springs(tissue.origin(node))) return 0;
  double share = share_by(tissue, node, goes, Weight::area_with_springs);
  if (share < 0) share = share_by(tissue, node, goes, Weight::area);
  return std::max(0.0, share);
}

double CutSupports::share_of_forces(const CutTissue& tissue, std::int32_t node, const std::uint8_t* goes) const {
  const double share = share_by(tissue, node, goes, Weight::foundation);
  if (share >= 0) return share;
  return has_springs(tissue.origin(node)) ? share_of(tissue, node, goes) : share_by(tissue, node, goes, Weight::area);
}

double CutSupports::share_of_triangles(const CutTissue& tissue, std::int32_t node, const std::uint8_t* goes) const {
  const double share = share_by(tissue, node, goes, Weight::foundation);
  if (share >= 0) return share;
  return has_springs(tissue.origin(node)) ? 0 : share_by(tissue, node, goes, Weight::area);
}

}  // namespace palpate
