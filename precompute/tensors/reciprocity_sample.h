// Checks that the solved columns obey the theorem of Betti and Maxwell: C_nk = C_kn^T, that is, the displacement at n
// by a force at k equals the displacement at k by the same force at n. Errors of the solver show first in pairs that
// are far apart.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/elements/elastic_body.h"

namespace palpate {

// At most 48 of the touchable nodes, evenly spread over their list, and the compliances between them.
class ReciprocitySample {
 public:
  explicit ReciprocitySample(const ElasticBody& body);

  // Ascending.
  std::span<const std::int32_t> nodes() const { return nodes_; }
  // Index of a node in nodes(); -1 where it is not in the sample.
  int index_of(std::int32_t node) const;

  // Takes the column of the k-th sampled node: C_nk of every sampled n in turn, row-major, m/N; [nodes().size()][9].
  void take(int k, std::span<const double> column);

  // All columns must have been taken. Far pairs: farther apart than half the largest distance in the sample.
  struct Result {
    double error = 0;  // largest |C_nk - C_kn^T| / |C_nk| in the Frobenius norm over the free dofs
    std::int64_t pairs = 0;
  };
  Result compare_far_pairs() const;

 private:
  double distance(std::size_t a, std::size_t b) const;

  const ElasticBody& body_;
  std::vector<std::int32_t> nodes_;
  std::vector<double> compliance_;  // [k][n][9]
};

}  // namespace palpate
