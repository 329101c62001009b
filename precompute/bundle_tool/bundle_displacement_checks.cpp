#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <random>

#include "formats/program.h"
#include "precompute/bundle_tool/bundle_checks.h"
#include "precompute/bundle_tool/stored_columns.h"

namespace palpate {

using namespace formats;

namespace {

// All checks of T^u, column by column: a bundle that is larger than memory is read once.
class TensorPass {
 public:
  TensorPass(const BundleFile& file, const SmallSections& small, const std::vector<Matrix3>& compliance,
             std::vector<std::int32_t> paired)
      : small_(small),
        compliance_(compliance),
        columns_(file),
        paired_(std::move(paired)),
        blocks_(paired_.size() * paired_.size()) {
    column_norm_.resize(small.touchable.size());
  }

  void run() {
    Progress progress("verify", columns_.columns());
    std::vector<std::int32_t> index_in_paired(small_.touchable.size(), -1);
    for (std::size_t a = 0; a < paired_.size(); ++a) index_in_paired[paired_[a]] = static_cast<std::int32_t>(a);
    ColumnRows rows;
    for (std::size_t k = 0; k < columns_.columns(); ++k) {
      columns_.read(k, rows);
      look_at_column("surface", k, 0, rows.surface);
      look_at_column("interior", k, columns_.surface_nodes(), rows.interior);
      look_at_own(k, rows.surface);
      if (index_in_paired[k] >= 0) keep_pairs(static_cast<std::size_t>(index_in_paired[k]), rows.surface);
      progress.advance();
    }
  }

  void report(Checks& checks) const {
    checks.add("stored as", true, columns_.form());
    checks.add_faults("finite displacements", not_finite_, "in every column");
    checks.add_faults("fixed nodes", moved_, "have zero displacement in every column");
    // Rows hold one and zero exactly, as every type does; 1e-6 is for stores that were rounded on the way. In blocks
    // T^u_kk is a rounded C_kk times T^f_k: 9 |C_kk| |T^f_k| roundings.
    if (columns_.in_blocks())
      checks.add_bounded("own displacement", identity_ <= 1, "largest |T^u_kk - identity| over its rounding", identity_,
                         1);
    else
      checks.add_bounded("own displacement", identity_ <= 1e-6, "largest |T^u_kk - identity|", identity_, 1e-6);
  }

  const StoredColumns& columns() const { return columns_; }
  // T^u_nk of the paired nodes n = paired[a], k = paired[b] (positions in touchable), row-major.
  const Matrix3& block(std::size_t a, std::size_t b) const { return blocks_[a * paired_.size() + b]; }
  // Scalar products of the three columns of slot k with each other, over all stored nodes.
  const Matrix3& column_products(std::size_t k) const { return column_norm_[k]; }

 private:
  // rows: [3][count][3]. first: the node to which the first entry belongs.
  void look_at_column(const char* where, std::size_t k, std::uint64_t first, const std::vector<double>& rows) {
    const std::size_t length = rows.size() / 3;
    Matrix3& products = column_norm_[k];
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t i = 0; i < length; ++i) {
        const double value = rows[j * length + i];
        if (!std::isfinite(value) && not_finite_.empty())
          not_finite_ = fmt::format("{}: row [{}, {}], node {}: {}", where, k, j, first + i / 3, value);
        if (small_.fixed[3 * first + i] && value != 0 && moved_.empty())
          moved_ = fmt::format("{}: row [{}, {}], fixed node {} moves by {}", where, k, j, first + i / 3, value);
        for (std::size_t m = 0; m <= j; ++m) products[3 * j + m] += value * rows[m * length + i];
      }
  }

  Matrix3 block_of(std::int32_t node, const std::vector<double>& rows) const {
    Matrix3 t;
    const std::size_t length = rows.size() / 3;
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t i = 0; i < 3; ++i) t[3 * i + j] = rows[j * length + 3 * static_cast<std::size_t>(node) + i];
    return t;
  }

  void look_at_own(std::size_t k, const std::vector<double>& rows) {
    const std::int32_t node = small_.touchable[k];
    const std::uint8_t* fixed = &small_.fixed[3 * static_cast<std::size_t>(node)];
    Matrix3 difference = block_of(node, rows);
    for (int j = 0; j < 3; ++j) difference[4 * j] -= fixed[j] ? 0.0 : 1.0;
    double found = largest(difference);
    if (columns_.in_blocks()) {
      Matrix3 stiffness;
      std::copy_n(small_.stiffness.begin() + 9 * static_cast<std::ptrdiff_t>(k), 9, stiffness.begin());
      const double rounding = columns_.type() == ElementType::f16 ? 0x1p-11 : 0x1p-24;
      found /= 9 * rounding * largest(compliance_[k]) * largest(stiffness);
    }
    if (!(found <= identity_)) identity_ = found;
  }

  void keep_pairs(std::size_t b, const std::vector<double>& rows) {
    for (std::size_t a = 0; a < paired_.size(); ++a)
      blocks_[a * paired_.size() + b] = block_of(small_.touchable[paired_[a]], rows);
  }

  const SmallSections& small_;
  const std::vector<Matrix3>& compliance_;
  StoredColumns columns_;
  std::vector<std::int32_t> paired_;
  std::vector<Matrix3> blocks_;
  std::vector<Matrix3> column_norm_;
  std::string not_finite_, moved_;
  double identity_ = 0;
};

// ---- reciprocity ----------------------------------------------------------------------------------------------------

// Pairs of nodes are compared in memory: all pairs where there are at most this many touchable nodes, else those of a
// random sample.
constexpr std::size_t kMostPairedNodes = 3500;  // 12 million pairs, 0.9 GB

}  // namespace

std::vector<std::int32_t> draw(std::size_t from, std::size_t count, std::uint64_t seed) {
  std::vector<std::int32_t> all(from), drawn;
  std::iota(all.begin(), all.end(), 0);
  std::mt19937_64 random(seed);
  std::sample(all.begin(), all.end(), std::back_inserter(drawn), count, random);
  return drawn;
}

namespace {

// The theorem of Betti and Maxwell: C_nk = C_kn^T, where C_nk = T^u_nk C_kk. Stored numbers miss it by three errors:
//  - T^u was rounded. Rounding of an entry is u = 2^-24 of it in f32 and 2^-11 in f16, plus a fixed step for the
//    smallest numbers of f16. This gives u |T^u_nk| |C_kk| in C_nk, and as much in C_kn. A compliance in blocks is
//    symmetric however it was rounded.
//  - The solver stops at a residual r with |r| <= tolerance. Row n of C r is then at most |C e_n| tolerance (Cauchy and
//    Schwarz). This error is in C_nk, and through C_kk once more in T^u_nk: twice for each side.
//  - T^f is inverted in double precision: an error of its condition number times 2^-53 in C_nk.
// The bound is computed for each pair from what is stored, so that it is small for far pairs, whose C_nk is small.
// Where the interior is not stored, |C e_n| is taken as that of the surface times sqrt(N / Ns). The sum of the errors
// is doubled, because it is of first order only.
struct Reciprocity {
  double worst = 0;     // largest |C_nk - C_kn^T| / its bound
  double relative = 0;  // largest |C_nk - C_kn^T| / |C_nk|, largest entries
  std::size_t n = 0, k = 0;
  double far = 0, far_bound = 0;  // of pairs farther apart than half the largest distance: |.| / |C_nk|, Frobenius
};

Reciprocity measure_reciprocity(const BundleFile& file, const SmallSections& s, const TensorPass& pass,
                                const std::vector<std::int32_t>& paired, const std::vector<Matrix3>& compliance) {
  const double tolerance = *std::max_element(s.residual.begin(), s.residual.end());
  const BundleCounts& counts = file.index().counts;
  const double unseen = file.find(SectionId::displacement_interior)
                            ? 1.0
                            : static_cast<double>(counts.nodes) / static_cast<double>(counts.surface_nodes);
  // |C e| of each dof of the sample: the columns of T^u times C_kk.
  std::vector<std::array<double, 3>> norm(paired.size());
  std::vector<double> inverse_rounding(paired.size());
  for (std::size_t a = 0; a < paired.size(); ++a) {
    const Matrix3& own = compliance[paired[a]];
    Matrix3 products = pass.column_products(paired[a]);
    for (int j = 0; j < 3; ++j)
      for (int m = 0; m < j; ++m) products[3 * m + j] = products[3 * j + m];
    const Matrix3 of_columns = multiply(multiply(own, products), own);
    for (int j = 0; j < 3; ++j) norm[a][j] = std::sqrt(std::max(0.0, unseen * of_columns[4 * j]));
    Matrix3 stiffness;
    std::copy_n(s.stiffness.begin() + 9 * static_cast<std::ptrdiff_t>(paired[a]), 9, stiffness.begin());
    inverse_rounding[a] = 9 * largest(own) * largest(stiffness) * 0x1p-53;
  }

  Reciprocity found;
  const double relative_rounding = pass.columns().relative_rounding();
  // How far rounding may move each entry of T^u_nk. b: index of the column in the sample.
  const auto rounding_of = [&](const Matrix3& t, std::size_t b) {
    Matrix3 moved = absolute(t);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        moved[3 * i + j] = relative_rounding * moved[3 * i + j] +
                           pass.columns().absolute_rounding(static_cast<std::size_t>(paired[b]), j);
    return moved;
  };
  const auto distance = [&](std::size_t a, std::size_t b) {
    const double* p = &s.nodes[3 * static_cast<std::size_t>(s.touchable[paired[a]])];
    const double* q = &s.nodes[3 * static_cast<std::size_t>(s.touchable[paired[b]])];
    return std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
  };
  double farthest = 0;
  for (std::size_t a = 0; a < paired.size(); ++a)
    for (std::size_t b = 0; b < a; ++b) farthest = std::max(farthest, distance(a, b));
  for (std::size_t a = 0; a < paired.size(); ++a)
    for (std::size_t b = 0; b < a; ++b) {
      const Matrix3 &t_ab = pass.block(a, b), &t_ba = pass.block(b, a);
      const Matrix3 &own_a = compliance[paired[a]], &own_b = compliance[paired[b]];
      const Matrix3 c_ab = multiply(t_ab, own_b), c_ba = multiply(t_ba, own_a);
      const Matrix3 size_ab = multiply(absolute(t_ab), absolute(own_b)),
                    size_ba = multiply(absolute(t_ba), absolute(own_a));
      const Matrix3 rounded_ab = multiply(rounding_of(t_ab, b), absolute(own_b)),
                    rounded_ba = multiply(rounding_of(t_ba, a), absolute(own_a));
      double difference = 0, squares = 0, bounds = 0, sizes = 0;
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          const int ij = 3 * i + j, ji = 3 * j + i;
          const double miss = std::abs(c_ab[ij] - c_ba[ji]);
          const double stored =
              rounded_ab[ij] + inverse_rounding[b] * size_ab[ij] + rounded_ba[ji] + inverse_rounding[a] * size_ba[ji];
          const double bound = 2 * (stored + 2 * tolerance * (norm[a][i] + norm[b][j]));
          difference = std::max(difference, miss);
          squares += miss * miss, bounds += bound * bound, sizes += c_ab[ij] * c_ab[ij];
          const double ratio = miss == 0 ? 0 : miss / bound;
          if (!(ratio <= found.worst)) {
            found.worst = ratio;
            found.n = static_cast<std::size_t>(s.touchable[paired[a]]);
            found.k = static_cast<std::size_t>(s.touchable[paired[b]]);
          }
        }
      if (const double size = largest(c_ab); size > 0) found.relative = std::max(found.relative, difference / size);
      if (sizes > 0 && distance(a, b) >= 0.5 * farthest && squares / sizes >= found.far * found.far) {
        found.far = std::sqrt(squares / sizes);
        found.far_bound = std::sqrt(bounds / sizes);
      }
    }
  return found;
}

void check_reciprocity(const BundleFile& file, const SmallSections& s, const TensorPass& pass,
                       const std::vector<std::int32_t>& paired, const std::vector<Matrix3>& compliance,
                       Checks& checks) {
  if (paired.size() < 2) return;
  const Reciprocity found = measure_reciprocity(file, s, pass, paired, compliance);
  const std::string which = paired.size() == s.touchable.size()
                                ? fmt::format("all {} touchable nodes", paired.size())
                                : fmt::format("{} of {} touchable nodes", paired.size(), s.touchable.size());
  checks.add_bounded("reciprocity", found.worst <= 1,
                     fmt::format("|C_nk - C_kn^T| over its bound among {} (relative to C_nk {:.2g}; worst pair {}, {})",
                                 which, found.relative, found.n, found.k),
                     found.worst, 1);
  checks.add_stated("far reciprocity", found.far <= found.far_bound,
                    "|C_nk - C_kn^T| / |C_nk| of pairs farther apart than half the organ", file.provenance(),
                    "reciprocity_error", found.far, found.far_bound);
}

}  // namespace

std::map<SectionId, std::uint64_t> check_displacements(const BundleFile& file, const SmallSections& small,
                                                       const std::vector<Matrix3>& compliance, std::uint64_t seed,
                                                       Checks& checks) {
  const std::size_t touchable = small.touchable.size();
  const auto paired = draw(touchable, std::min(touchable, kMostPairedNodes), seed);
  TensorPass pass(file, small, compliance, paired);
  pass.run();
  pass.report(checks);
  if (checks.all_held()) check_reciprocity(file, small, pass, paired, compliance, checks);
  return pass.columns().checksums();
}

}  // namespace palpate
