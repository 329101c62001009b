#include "runtime/cut/mesh_pieces.h"

#include <algorithm>
#include <cmath>

#include "runtime/base/vec3.h"

namespace palpate {
namespace {

// Three places are on one line if the area between them is below this share of the square of their largest distance.
constexpr double kOnOneLine = 1e-3;
// Supports hold a piece if they resist each shift of it by more than this share of what they resist in all.
constexpr double kLeastSupport = 1e-6;

bool resists_each_shift(const Mat3& k) {
  const double least = kLeastSupport * (k.m[0][0] + k.m[1][1] + k.m[2][2]);
  Mat3 l;  // of Cholesky
  for (int j = 0; j < 3; ++j)
    for (int i = j; i < 3; ++i) {
      double sum = k.m[i][j];
      for (int m = 0; m < j; ++m) sum -= l.m[i][m] * l.m[j][m];
      if (i == j && !(sum > least)) return false;
      l.m[i][j] = i == j ? std::sqrt(sum) : sum / l.m[j][j];
    }
  return true;
}

}  // namespace

bool MeshPieces::create(SceneMemory& memory, const CutState& state) {
  state_ = &state;
  const CutBody& body = state.rest().body();
  const auto tetrahedra = static_cast<std::size_t>(body.tetrahedron_count);
  piece_of_ = memory.array<std::int32_t>(tetrahedra);
  pieces_ = memory.array<CutPiece>(tetrahedra);
  lines_ = memory.array<Line>(tetrahedra);
  counted_ = memory.array<std::int32_t>(tetrahedra);
  part_of_ = memory.array<std::int32_t>(tetrahedra);
  marks_ = memory.array<std::uint32_t>(tetrahedra);
  for (auto& list : lists_) list = memory.array<std::int32_t>(tetrahedra);
  held_ = memory.array<std::int32_t>(static_cast<std::size_t>(body.node_count));
  if (memory.failed()) return false;
  memory.keep(count_);
  memory.keep_array(piece_of_, tetrahedra);
  memory.keep_array(pieces_, tetrahedra, count_);
  for (std::int32_t n = 0; body.held && n < body.node_count; ++n)
    if (body.held[n]) held_[held_count_++] = n;
  if (body.support) supported_ = memory.array<std::int32_t>(static_cast<std::size_t>(body.triangle_count));
  for (std::int32_t t = 0; supported_ && t < body.triangle_count; ++t) {
    const Mat3& k = body.support[t];
    if (k.m[0][0] + k.m[1][1] + k.m[2][2] > 0) supported_[supported_count_++] = t;
  }
  forget();
  return true;
}

void MeshPieces::forget() {
  const std::int32_t tetrahedra = state_->rest().tetrahedra();
  std::fill(piece_of_, piece_of_ + tetrahedra, 0);
  count_ = 0;
  // Parts of the body that were never connected are pieces, too.
  pieces_[count_++] = {tetrahedra, 0, -1, 0, 0, 0};
  renumber();
  measure();
}

int MeshPieces::visit(Search& search, const Search& other) {
  if (search.at == search.end) return 0;
  const std::int32_t t = search.list[search.at++];
  ++work_;
  for (std::int32_t face = 4 * t; face < 4 * t + 4; ++face) {
    if (state_->open(face)) continue;
    const std::int32_t next = state_->rest().neighbour(face);
    if (marks_[next] == other.mark) return 2;
    if (marks_[next] == search.mark) continue;
    marks_[next] = search.mark;
    search.list[search.end++] = next;
  }
  return 1;
}

MeshPieces::Search MeshPieces::flood(std::int32_t tetrahedron) {
  const Search none{lists_[1], 0, 0, ++mark_};
  Search search{lists_[0], 0, 1, ++mark_};
  search.list[0] = tetrahedron, marks_[tetrahedron] = search.mark;
  while (visit(search, none)) {
  }
  return search;
}

bool MeshPieces::connected(std::int32_t one, std::int32_t two) {
  if (one == two || piece_of_[one] != piece_of_[two]) return one == two;
  Search searches[2] = {{lists_[0], 0, 1, ++mark_}, {lists_[1], 0, 1, ++mark_}};
  searches[0].list[0] = one, marks_[one] = searches[0].mark;
  searches[1].list[0] = two, marks_[two] = searches[1].mark;
  for (int side = 0;; side = 1 - side)
    if (const int found = visit(searches[side], searches[1 - side]); found != 1) return found == 2;
}

void MeshPieces::renumber() {
  const std::int32_t all = state_->rest().tetrahedra(), before = count_;
  // Each piece's largest part first, by a tetrahedron of it.
  for (std::int32_t i = 0; i < before; ++i) pieces_[i].tetrahedra = 0, pieces_[i].first = -1;
  std::fill(part_of_, part_of_ + all, -1);
  for (std::int32_t t = 0; t < all; ++t) {
    if (state_->gone(t) || part_of_[t] >= 0) continue;
    const Search part = flood(t);
    for (std::int32_t i = 0; i < part.end; ++i) part_of_[part.list[i]] = t;
    if (CutPiece& piece = pieces_[piece_of_[t]]; part.end > piece.tetrahedra)
      piece.tetrahedra = part.end, piece.first = t;
  }
  for (std::int32_t t = 0; t < all; ++t) {
    const std::int32_t first = state_->gone(t) ? -1 : part_of_[t], from = piece_of_[t];
    if (first < 0 || pieces_[from].first == first) continue;
    if (t == first) pieces_[count_++] = {0, t, from, 0, 0, 0};
    // The first tetrahedron of a part comes before the others.
    piece_of_[t] = t == first ? count_ - 1 : piece_of_[first];
    ++pieces_[piece_of_[t]].tetrahedra;
  }
}

void MeshPieces::remove(std::int32_t tetrahedron) {
  CutPiece& piece = pieces_[piece_of_[tetrahedron]];
  --piece.tetrahedra;
  if (piece.first != tetrahedron) return;
  piece.first = -1;
  for (std::int32_t t = 0; t < state_->rest().tetrahedra() && piece.tetrahedra > 0 && piece.first < 0; ++t)
    if (piece_of_[t] == piece_of_[tetrahedron] && !state_->gone(t)) piece.first = t;
}

void MeshPieces::add_anchor(CutPiece& piece, std::int32_t node) {
  const double* const rest = state_->rest().body().nodes;
  Line& line = lines_[&piece - pieces_];
  ++piece.anchors;
  if (piece.anchors == 1) {
    line = {{node, node}};
    return;
  }
  const Vec3 begin = load3(rest + 3 * line.node[0]), along = load3(rest + 3 * line.node[1]) - begin;
  const Vec3 away = load3(rest + 3 * node) - begin;
  if (is_zero(along)) {
    line.node[1] = node;
    return;
  }
  const double largest = std::max(dot(along, along), dot(away, away));
  if (length(cross(along, away)) > kOnOneLine * largest) piece.is_held = 1;
  // The longer of the two tells best which others are on its line.
  if (dot(away, away) > dot(along, along)) line.node[1] = node;
}

void MeshPieces::measure() {
  for (std::int32_t i = 0; i < count_; ++i) pieces_[i].anchors = pieces_[i].is_held = 0, counted_[i] = -1;
  for (std::int32_t i = 0; i < held_count_; ++i)
    for (const std::int32_t corner : state_->rest().star(held_[i])) {
      const std::int32_t piece = piece_of_[corner / 4];
      if (state_->gone(corner / 4) || counted_[piece] == held_[i]) continue;
      counted_[piece] = held_[i];
      add_anchor(pieces_[piece], held_[i]);
    }
  for (std::int32_t i = 0; i < count_; ++i)
    if (!pieces_[i].is_held) pieces_[i].is_held = is_supported(i);
}

// By the triangles that it has, of which each holds at three corners.
bool MeshPieces::is_supported(std::int32_t piece) const {
  Mat3 sum;
  for (std::int32_t i = 0; i < supported_count_; ++i) {
    const std::int32_t t = state_->rest().face_of_triangle(supported_[i]) / 4;
    if (!state_->gone(t) && piece_of_[t] == piece) add_scaled(sum, 1, state_->rest().body().support[supported_[i]]);
  }
  return resists_each_shift(sum);
}

}  // namespace palpate
