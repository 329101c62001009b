#include "precompute/journal/certificate.h"

#include <algorithm>
#include <tuple>
#include <utility>

namespace palpate {
namespace {

void take_columns(const ColumnBatch& batch, const BatchRecord& record, Certificate& certificate) {
  for (std::size_t i = 0; i < batch.nodes.size(); ++i)
    for (int j = 0; j < 3; ++j) {
      const NodeRecord& node = record.nodes[i];
      certificate.most_iterations = std::max<std::int64_t>(certificate.most_iterations, node.iterations[j]);
      const std::pair<std::int64_t, std::int64_t> column(batch.nodes[i], j);
      const bool worse = node.residual[j] > certificate.worst_residual;
      const bool earlier = node.residual[j] == certificate.worst_residual && node.residual[j] > 0 &&
                           column < std::pair(certificate.worst_node, certificate.worst_dof);
      if (!worse && !earlier) continue;
      certificate.worst_residual = node.residual[j];
      std::tie(certificate.worst_node, certificate.worst_dof) = column;
    }
  certificate.cast_error = std::max(certificate.cast_error, record.cast_error);
  certificate.residual_floor = std::max(certificate.residual_floor, record.residual_floor);
}

void take_compliances(const ColumnBatch& batch, const BatchRecord& record, ReciprocitySample& sample) {
  const std::size_t column = 9 * sample.nodes().size();
  std::span<const double> rest(record.compliance);
  for (const auto node : batch.nodes)
    if (const int k = sample.index_of(node); k >= 0) {
      sample.take(k, rest.first(column));
      rest = rest.subspan(column);
    }
}

}  // namespace

Certificate certify(std::span<const ColumnBatch> batches, std::span<const BatchRecord> records,
                    ReciprocitySample& sample) {
  Certificate certificate;
  for (std::size_t b = 0; b < batches.size(); ++b) {
    take_columns(batches[b], records[b], certificate);
    take_compliances(batches[b], records[b], sample);
  }
  const auto reciprocity = sample.compare_far_pairs();
  certificate.reciprocity_error = reciprocity.error;
  certificate.reciprocity_pairs = reciprocity.pairs;
  return certificate;
}

}  // namespace palpate
