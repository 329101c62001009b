// Whether solved columns obey Betti and Maxwell: C_nk = C_kn^T for pairs of nodes far apart, where an error shows first.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "precompute/elements/elastic_body.h"

namespace palpate {

// At most 48 nodes spread over the touchable ones, and the compliances between them.
class ReciprocitySample {
 public:
  explicit ReciprocitySample(const ElasticBody& body);

  // Ascending.
  std::span<const std::int32_t> nodes() const { return nodes_; }
  // Place of a node among nodes(); -1: it is not sampled.
  int place_of(std::int32_t node) const;

  // The column of the k-th sampled node: C_nk of every sampled n in turn, row-major, m/N; [nodes().size()][9].
  void take(int k, std::span<const double> column);

  // Of the pairs whose columns were both taken. Far: farther apart than half the largest distance in the sample.
  struct Result {
    double error = 0;  // largest |C_nk - C_kn^T| / |C_nk|, Frobenius norm, over the dofs that are free
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
