#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <random>

#include "formats/checksum.h"
#include "formats/program.h"
#include "precompute/palpate_bundle_checks.h"

namespace palpate {

using namespace formats;

namespace {

// Everything that is asked of T^u, column by column, so that a store larger than memory needs one pass.
class TensorPass {
 public:
  TensorPass(const BundleFile& file, const SmallSections& small, std::vector<std::int32_t> paired)
      : file_(file), small_(small), paired_(std::move(paired)), blocks_(paired_.size() * paired_.size()) {
    column_norm_.resize(small.touchable.size());
  }

  void run() {
    const SectionEntry* surface = file_.find(SectionId::displacement_surface);
    const SectionEntry* interior = file_.find(SectionId::displacement_interior);
    Progress progress("verify", surface->shape[0] * (interior ? 2 : 1));
    read_section(*surface, 0, progress);
    if (interior) read_section(*interior, file_.index().counts.surface_nodes, progress);
  }

  void report(Checks& checks) const {
    checks.add("finite displacements", not_finite_.empty(), not_finite_.empty() ? "in every column" : not_finite_);
    checks.add("fixed nodes", moved_.empty(), moved_.empty() ? "have zero displacement in every column" : moved_);
    // T^u_kk = C_kk C_kk^-1, rounded to f32 once (6e-8); the product of a 3 x 3 matrix with its inverse adds its
    // condition number times 1e-16, and one of 1e8 would still leave 1e-8.
    checks.add_bounded("own displacement", identity_ <= 1e-6, "largest |T^u_kk - identity|", identity_, 1e-6);
  }

  const std::map<SectionId, std::uint64_t>& checksums() const { return checksums_; }
  // T^u_nk of the paired nodes n = paired[a], k = paired[b] (positions in touchable), row-major.
  const std::array<float, 9>& block(std::size_t a, std::size_t b) const { return blocks_[a * paired_.size() + b]; }
  // Squares of the 2-norm over all stored nodes of the three columns at touchable k.
  const Matrix3& column_products(std::size_t k) const { return column_norm_[k]; }

 private:
  // rows [k, j] of [count][3] numbers; first: the mesh node of the first.
  void read_section(const SectionEntry& entry, std::uint64_t first, Progress& progress) {
    const std::uint64_t count = entry.shape[2], bytes = 9 * count * sizeof(float);
    std::vector<float> rows(9 * count);
    Xxh64 checksum;
    std::vector<std::int32_t> place(small_.touchable.size(), -1);
    for (std::size_t a = 0; a < paired_.size(); ++a) place[paired_[a]] = static_cast<std::int32_t>(a);
    for (std::uint64_t k = 0; k < entry.shape[0]; ++k) {
      file_.read(entry, k * bytes, rows.data(), bytes);
      checksum.update(rows.data(), bytes);
      look_at_column(entry, k, first, count, rows);
      if (first == 0) look_at_surface(k, count, rows, place[k]);
      progress.advance();
    }
    checksums_[static_cast<SectionId>(entry.id)] = checksum.digest();
  }

  void look_at_column(const SectionEntry& entry, std::uint64_t k, std::uint64_t first, std::uint64_t count,
                      const std::vector<float>& rows) {
    const std::uint64_t length = 3 * count;
    Matrix3& products = column_norm_[k];
    for (int j = 0; j < 3; ++j)
      for (std::uint64_t i = 0; i < length; ++i) {
        const float value = rows[j * length + i];
        if (!std::isfinite(value) && not_finite_.empty())
          not_finite_ = fmt::format("{}: row [{}, {}], node {}: {}", section_name(entry), k, j, first + i / 3, value);
        if (small_.fixed[3 * first + i] && value != 0 && moved_.empty())
          moved_ = fmt::format("{}: row [{}, {}], fixed node {} moves by {}", section_name(entry), k, j, first + i / 3,
                               value);
        for (int m = 0; m <= j; ++m) products[3 * j + m] += static_cast<double>(value) * rows[m * length + i];
      }
  }

  void look_at_surface(std::uint64_t k, std::uint64_t count, const std::vector<float>& rows, std::int32_t b) {
    const auto node = static_cast<std::uint64_t>(small_.touchable[k]);
    const std::uint8_t* fixed = &small_.fixed[3 * node];
    for (int j = 0; j < 3; ++j)
      for (int i = 0; i < 3; ++i) {
        const double expected = i == j && !fixed[j] ? 1.0 : 0.0;
        const double difference = std::abs(rows[(j * count + node) * 3 + i] - expected);
        if (!(difference <= identity_)) identity_ = difference;
      }
    if (b < 0) return;
    for (std::size_t a = 0; a < paired_.size(); ++a) {
      const auto n = static_cast<std::uint64_t>(small_.touchable[paired_[a]]);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) blocks_[a * paired_.size() + b][3 * i + j] = rows[(j * count + n) * 3 + i];
    }
  }

  const BundleFile& file_;
  const SmallSections& small_;
  std::vector<std::int32_t> paired_;
  std::vector<std::array<float, 9>> blocks_;
  std::vector<Matrix3> column_norm_;
  std::map<SectionId, std::uint64_t> checksums_;
  std::string not_finite_, moved_;
  double identity_ = 0;
};

// ---- reciprocity ----------------------------------------------------------------------------------------------------

// Pairs are compared in memory: all of them, or those among as many nodes as this takes.
constexpr std::size_t kMostPairedNodes = 5000;  // 25 million pairs, 0.9 GB

}  // namespace

std::vector<std::int32_t> draw(std::size_t from, std::size_t count, std::uint64_t seed) {
  std::vector<std::int32_t> all(from), drawn;
  std::iota(all.begin(), all.end(), 0);
  std::mt19937_64 random(seed);
  std::sample(all.begin(), all.end(), std::back_inserter(drawn), count, random);
  return drawn;
}

namespace {

// Betti-Maxwell: C_nk = C_kn^T, with C_nk = T^u_nk C_kk. How far stored numbers may miss it:
//  - T^u was rounded to f32, u = 2^-24 per entry: u |T^u_nk| |C_kk| for C_nk, the same for C_kn;
//  - a solve stops at the residual r, |r| <= tolerance: row n of C r is at most |C e_n| tolerance by Cauchy-Schwarz. It
//    enters C_nk and, through C_kk, T^u_nk once more: twice for each side;
//  - inverting T^f in double: its condition number times 2^-53 of C_nk.
// All of it is computed from what is stored, pair by pair, so that far pairs, whose C_nk is small, are held to a bound
// that is as small. Where the interior is not stored |C e_n| is taken as that of the surface times sqrt(N / Ns). The
// whole is allowed twice over, for what these first-order sums leave out.
struct Reciprocity {
  double worst = 0;     // largest |C_nk - C_kn^T| / its bound
  double relative = 0;  // largest |C_nk - C_kn^T| / |C_nk|, largest entries
  std::size_t n = 0, k = 0;
};

Reciprocity measure_reciprocity(const BundleFile& file, const SmallSections& s, const TensorPass& pass,
                                const std::vector<std::int32_t>& paired, const std::vector<Matrix3>& compliance) {
  const double tolerance = *std::max_element(s.residual.begin(), s.residual.end());
  const BundleCounts& counts = file.index().counts;
  const double unseen = file.find(SectionId::displacement_interior)
                            ? 1.0
                            : static_cast<double>(counts.nodes) / static_cast<double>(counts.surface_nodes);
  // |C e| of each paired dof: the columns of T^u times C_kk.
  std::vector<std::array<double, 3>> norm(paired.size());
  std::vector<double> inverse_rounding(paired.size());
  for (std::size_t a = 0; a < paired.size(); ++a) {
    const Matrix3& own = compliance[paired[a]];
    Matrix3 products = pass.column_products(paired[a]);
    for (int j = 0; j < 3; ++j)
      for (int m = 0; m < j; ++m) products[3 * m + j] = products[3 * j + m];
    const Matrix3 of_columns = multiply(multiply(own, products), own);
    for (int j = 0; j < 3; ++j) norm[a][j] = std::sqrt(std::max(0.0, unseen * of_columns[4 * j]));
    Matrix3 force;
    std::copy_n(s.force.begin() + 9 * static_cast<std::ptrdiff_t>(paired[a]), 9, force.begin());
    inverse_rounding[a] = 9 * largest(own) * largest(force) * 0x1p-53;
  }

  Reciprocity found;
  const auto widened = [](const std::array<float, 9>& block) {
    Matrix3 wide;
    std::copy(block.begin(), block.end(), wide.begin());
    return wide;
  };
  for (std::size_t a = 0; a < paired.size(); ++a)
    for (std::size_t b = 0; b < a; ++b) {
      const Matrix3 t_ab = widened(pass.block(a, b)), t_ba = widened(pass.block(b, a));
      const Matrix3 &own_a = compliance[paired[a]], &own_b = compliance[paired[b]];
      const Matrix3 c_ab = multiply(t_ab, own_b), c_ba = multiply(t_ba, own_a);
      const Matrix3 size_ab = multiply(absolute(t_ab), absolute(own_b)),
                    size_ba = multiply(absolute(t_ba), absolute(own_a));
      double difference = 0;
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          const int ij = 3 * i + j, ji = 3 * j + i;
          const double miss = std::abs(c_ab[ij] - c_ba[ji]);
          const double stored =
              (0x1p-24 + inverse_rounding[b]) * size_ab[ij] + (0x1p-24 + inverse_rounding[a]) * size_ba[ji];
          const double bound = 2 * (stored + 2 * tolerance * (norm[a][i] + norm[b][j]));
          difference = std::max(difference, miss);
          const double ratio = miss == 0 ? 0 : miss / bound;
          if (!(ratio <= found.worst)) {
            found.worst = ratio;
            found.n = static_cast<std::size_t>(s.touchable[paired[a]]);
            found.k = static_cast<std::size_t>(s.touchable[paired[b]]);
          }
        }
      if (const double size = largest(c_ab); size > 0) found.relative = std::max(found.relative, difference / size);
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
}

}  // namespace

std::map<SectionId, std::uint64_t> check_displacements(const BundleFile& file, const SmallSections& small,
                                                       const std::vector<Matrix3>& compliance, std::uint64_t seed,
                                                       Checks& checks) {
  const std::size_t touchable = small.touchable.size();
  const auto paired = draw(touchable, std::min(touchable, kMostPairedNodes), seed);
  TensorPass pass(file, small, paired);
  pass.run();
  pass.report(checks);
  if (checks.all_held()) check_reciprocity(file, small, pass, paired, compliance, checks);
  return pass.checksums();
}

}  // namespace palpate
