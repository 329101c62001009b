#include "runtime/large/block_rows.h"

#include <algorithm>

#include "runtime/large/dilatation_sites.h"

namespace palpate {
namespace {

// Lists one after the other: list i is item[first[i]] .. item[first[i + 1] - 1].
struct Lists {
  std::int32_t count = 0;
  std::int64_t* first = nullptr;
  std::int32_t* item = nullptr;
};

// Of `entries` pairs (list_of(i), item_of(i)); pairs with a list below 0 are left out. Items keep their order.
template <class ListOf, class ItemOf>
bool make_lists(SceneMemory& memory, std::int32_t count, std::int64_t entries, ListOf list_of, ItemOf item_of,
                Lists* lists) {
  lists->count = count;
  lists->first = memory.array<std::int64_t>(static_cast<std::size_t>(count) + 2);
  lists->item = memory.array<std::int32_t>(static_cast<std::size_t>(entries));
  if (memory.failed()) return false;
  std::int64_t* const next = lists->first + 1;  // next[i]: where list i goes on; in the end its end
  for (std::int64_t i = 0; i < entries; ++i)
    if (list_of(i) >= 0) ++next[list_of(i) + 1];
  for (std::int32_t i = 0; i < count; ++i) next[i + 1] += next[i];
  for (std::int64_t i = 0; i < entries; ++i)
    if (list_of(i) >= 0) lists->item[next[list_of(i)]++] = item_of(i);
  return true;
}

class Assembly {
 public:
  Assembly(SceneMemory& memory, SceneMemory& scratch, const HyperelasticBody& body, const std::int32_t* place,
           std::int32_t rows, BlockRows& out)
      : memory_(memory), scratch_(scratch), body_(body), place_(place), rows_(rows), out_(out) {}

  bool run() {
    out_.rows = rows_;
    if (!find_coupled() || !find_supported() || !find_pattern()) return false;
    for (std::int32_t e = 0; e < body_.tetrahedron_count; ++e) add_tetrahedron(e);
    if (body_.nodal_dilatation && !add_dilatations()) return false;
    add_supports();
    hold_dofs();
    return true;
  }

 private:
  std::int32_t row_of_corner(std::int64_t c) const {
    const std::int32_t row = place_[body_.tetrahedra[c]];
    return row < rows_ ? row : -1;
  }

  // stars_: the tetrahedra of each site, or each tetrahedron alone. All nodes of a star are coupled.
  bool find_coupled() {
    const std::int64_t corners = 4 * static_cast<std::int64_t>(body_.tetrahedron_count);
    if (body_.nodal_dilatation) {
      if (!find_dilatation_sites(scratch_, body_, &sites_)) return false;
      return make_lists(
                 scratch_, sites_.count, corners, [&](std::int64_t c) { return sites_.of_corner[c]; },
                 [](std::int64_t c) { return static_cast<std::int32_t>(c / 4); }, &stars_) &&
             find_stars_of_rows();
    }
    return make_lists(
               scratch_, body_.tetrahedron_count, body_.tetrahedron_count,
               [](std::int64_t e) { return static_cast<std::int32_t>(e); },
               [](std::int64_t e) { return static_cast<std::int32_t>(e); }, &stars_) &&
           find_stars_of_rows();
  }
  // The rows that supports couple to each row.
  bool find_supported() {
    const auto row_of = [&](std::int64_t end) {
      const std::int32_t row = place_[body_.support_nodes[end]];
      return row < rows_ ? row : -1;
    };
    return make_lists(
        scratch_, rows_, 2 * static_cast<std::int64_t>(body_.support_count),
        [&](std::int64_t end) { return row_of(end ^ 1) < 0 ? -1 : row_of(end); },
        [&](std::int64_t end) { return row_of(end ^ 1); }, &supported_);
  }
  // Which stars hold each row; a star stands there once for each of its tetrahedra that has the row.
  bool find_stars_of_rows() {
    const std::int64_t entries = 4 * stars_.first[stars_.count];
    std::int32_t* const star_of = scratch_.array<std::int32_t>(static_cast<std::size_t>(entries));
    if (!star_of) return false;
    for (std::int32_t s = 0; s < stars_.count; ++s)
      for (std::int64_t at = 4 * stars_.first[s]; at < 4 * stars_.first[s + 1]; ++at) star_of[at] = s;
    return make_lists(
        scratch_, rows_, entries,
        [&](std::int64_t i) { return row_of_corner(4 * static_cast<std::int64_t>(stars_.item[i / 4]) + i % 4); },
        [&](std::int64_t i) { return star_of[i]; }, &around_);
  }

  bool find_pattern() {
    const auto rows = static_cast<std::size_t>(rows_);
    out_.first = memory_.array<std::int64_t>(rows + 1);
    std::int32_t* const seen = scratch_.array<std::int32_t>(rows);  // 1 + the last row that met it
    if (memory_.failed() || scratch_.failed()) return false;
    for (int pass = 0; pass < 2; ++pass) {
      std::int64_t total = 0;
      std::fill(seen, seen + rows, 0);
      for (std::int32_t row = 0; row < rows_; ++row) {
        out_.first[row] = total;
        const auto meet = [&](std::int32_t column) {
          if (column < 0 || seen[column] == row + 1) return;
          seen[column] = row + 1;
          if (pass == 1) out_.column[total] = column;
          ++total;
        };
        for (std::int64_t at = around_.first[row]; at < around_.first[row + 1]; ++at) {
          const std::int32_t star = around_.item[at];
          if (at > around_.first[row] && around_.item[at - 1] == star) continue;
          for (std::int64_t t = stars_.first[star]; t < stars_.first[star + 1]; ++t)
            for (int a = 0; a < 4; ++a) meet(row_of_corner(4 * static_cast<std::int64_t>(stars_.item[t]) + a));
        }
        for (std::int64_t at = supported_.first[row]; at < supported_.first[row + 1]; ++at) meet(supported_.item[at]);
        if (pass == 1) std::sort(out_.column + out_.first[row], out_.column + total);
      }
      out_.first[rows_] = total;
      if (pass == 0) {
        out_.column = memory_.array<std::int32_t>(static_cast<std::size_t>(total));
        out_.block = memory_.array<double>(9 * static_cast<std::size_t>(total));
        if (memory_.failed()) return false;
      }
    }
    return true;
  }

  void add_tetrahedron(std::int32_t e) {
    double inner[3][3], g[4][3];
    const double volume = shape_gradients(body_, e, inner);
    for (int i = 0; i < 3; ++i) {
      g[0][i] = -(inner[0][i] + inner[1][i] + inner[2][i]);
      for (int a = 0; a < 3; ++a) g[a + 1][i] = inner[a][i];
    }
    const TissueLaw& law = body_.laws[body_.region[e]];
    const double mu = volume * (1 - body_.averaged_shear) * law.shear,
                 lambda = (body_.nodal_dilatation ? 0 : volume * law.bulk) - 2 * mu / 3;
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b) {
        const std::int32_t row = row_of_corner(4 * static_cast<std::int64_t>(e) + a),
                           column = row_of_corner(4 * static_cast<std::int64_t>(e) + b);
        if (row < 0 || column < 0) continue;
        double* const block = out_.block + 9 * out_.index_of(row, column);
        const double shear = mu * (g[a][0] * g[b][0] + g[a][1] * g[b][1] + g[a][2] * g[b][2]);
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j)
            block[3 * i + j] += lambda * (g[a][i] * g[b][j]) + mu * (g[a][j] * g[b][i]) + (i == j ? shear : 0);
      }
  }

  // kappa / V D^T D for each site, D = sum of V_e / 4 grad N over its tetrahedra; and the shear of the gradient D / V.
  bool add_dilatations() {
    const auto rows = static_cast<std::size_t>(rows_);
    double* const d = scratch_.array<double>(3 * rows);
    std::int32_t* const seen = scratch_.array<std::int32_t>(rows);
    std::int32_t* const nodes = scratch_.array<std::int32_t>(rows);
    if (scratch_.failed()) return false;
    for (std::int32_t s = 0; s < sites_.count; ++s) {
      std::int32_t count = 0;
      for (std::int64_t t = stars_.first[s]; t < stars_.first[s + 1]; ++t) {
        const std::int32_t e = stars_.item[t];
        double g[3][3];
        const double quarter = shape_gradients(body_, e, g) / 4;
        for (int a = 0; a < 4; ++a) {
          const std::int32_t row = row_of_corner(4 * static_cast<std::int64_t>(e) + a);
          if (row < 0) continue;
          if (seen[row] != s + 1) {
            seen[row] = s + 1, nodes[count++] = row;
            d[3 * row] = d[3 * row + 1] = d[3 * row + 2] = 0;
          }
          for (int i = 0; i < 3; ++i) d[3 * row + i] += quarter * (a ? g[a - 1][i] : -(g[0][i] + g[1][i] + g[2][i]));
        }
      }
      const TissueLaw& law = body_.laws[sites_.region[s]];
      const double mu = body_.averaged_shear * law.shear / sites_.volume[s];
      const double factor = law.bulk / sites_.volume[s] - 2 * mu / 3;
      for (std::int32_t m = 0; m < count; ++m)
        for (std::int32_t n = 0; n < count; ++n) {
          double* const block = out_.block + 9 * out_.index_of(nodes[m], nodes[n]);
          const double *const of_row = d + 3 * nodes[m], *const of_column = d + 3 * nodes[n];
          for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) block[3 * i + j] += factor * of_row[i] * of_column[j];
          if (mu > 0) add_shear(mu, of_row, of_column, block);
        }
    }
    return true;
  }

  static void add_shear(double mu, const double* a, const double* b, double* block) {
    const double both = mu * (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) block[3 * i + j] += mu * (a[j] * b[i]) + (i == j ? both : 0);
  }

  void add_supports() {
    for (std::int32_t p = 0; p < body_.support_count; ++p) {
      const std::int32_t row = place_[body_.support_nodes[2 * p]], column = place_[body_.support_nodes[2 * p + 1]];
      if (row >= rows_ || column >= rows_) continue;
      const double* const from = body_.support_stiffness + 9 * static_cast<std::int64_t>(p);
      double* const block = out_.block + 9 * out_.index_of(row, column);
      for (int i = 0; i < 9; ++i) block[i] += from[i];
      if (row == column) continue;
      double* const mirrored = out_.block + 9 * out_.index_of(column, row);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) mirrored[3 * j + i] += from[3 * i + j];
    }
  }

  // Of a node that no tetrahedron has, as one in reserve for a cut.
  bool is_empty(std::int32_t row) const { return out_.first[row] == out_.first[row + 1]; }

  void hold_dofs() {
    double sum = 0;
    for (std::int32_t row = 0; row < rows_; ++row)
      for (int i = 0; i < 3 && !is_empty(row); ++i) sum += out_.block[9 * out_.index_of(row, row) + 4 * i];
    const double mean = rows_ > 0 ? sum / (3.0 * rows_) : 1;
    for (std::int32_t n = 0; n < body_.node_count; ++n) {
      const std::int32_t row = place_[n];
      if (row >= rows_ || is_empty(row)) continue;
      for (int i = 0; i < 3; ++i) {
        if (!body_.fixed[3 * static_cast<std::int64_t>(n) + i]) continue;
        for (std::int64_t at = out_.first[row]; at < out_.first[row + 1]; ++at)
          for (int j = 0; j < 3; ++j) {
            out_.block[9 * at + 3 * i + j] = 0;
            out_.block[9 * out_.index_of(out_.column[at], row) + 3 * j + i] = 0;
          }
        out_.block[9 * out_.index_of(row, row) + 4 * i] = mean;
      }
    }
  }

  SceneMemory &memory_, &scratch_;
  const HyperelasticBody& body_;
  const std::int32_t* place_;
  std::int32_t rows_;
  BlockRows& out_;
  DilatationSites sites_;
  Lists stars_, around_, supported_;
};

}  // namespace

bool assemble_stiffness(SceneMemory& memory, const HyperelasticBody& body, const std::int32_t* place, std::int32_t rows,
                        BlockRows* stiffness) {
  SceneMemory scratch = memory.of_same_host();
  const bool made = Assembly(memory, scratch, body, place, rows, *stiffness).run();
  scratch.release_all();
  return made;
}

void multiply(const BlockRows& stiffness, const double* moved, std::int32_t rows, float* out) {
  for (std::int32_t row = 0; row < rows; ++row)
    for (std::size_t i = 0; i < 3; ++i) {
      double sum = 0;
      for (std::int64_t at = stiffness.first[row]; at < stiffness.first[row + 1]; ++at)
        for (std::size_t k = 0; k < 3; ++k)
          sum += stiffness.block[9 * static_cast<std::size_t>(at) + 3 * i + k] *
                 moved[3 * static_cast<std::size_t>(stiffness.column[at]) + k];
      out[3 * static_cast<std::size_t>(row) + i] = static_cast<float>(sum);
    }
}

}  // namespace palpate
