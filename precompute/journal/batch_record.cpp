#include "precompute/journal/batch_record.h"

#include <algorithm>
#include <cstring>

namespace palpate {
namespace {

constexpr std::size_t kOfBatch = 2 * sizeof(double);  // cast error, residual floor

}  // namespace

BatchRecord record_of(const BatchTensors& solved, const ColumnBatch& batch, const ReciprocitySample& sample) {
  BatchRecord record;
  for (std::size_t i = 0; i < batch.nodes.size(); ++i) {
    NodeRecord node{};
    node.stiffness = solved.stiffness(i);
    for (int j = 0; j < 3; ++j) {
      const ColumnReport report = solved.report(i, j);
      node.residual[j] = report.residual;
      node.iterations[j] = report.iterations;
      record.residual_floor = std::max(record.residual_floor, report.floor);
    }
    record.nodes.push_back(node);
    if (sample.index_of(batch.nodes[i]) < 0) continue;
    for (const auto n : sample.nodes()) {
      const auto c = solved.compliance(n, i);
      record.compliance.insert(record.compliance.end(), c.begin(), c.end());
    }
  }
  return record;
}

std::size_t record_bytes(const ColumnBatch& batch, const ReciprocitySample& sample) {
  const auto sampled =
      std::count_if(batch.nodes.begin(), batch.nodes.end(), [&](auto n) { return sample.index_of(n) >= 0; });
  return kOfBatch + batch.nodes.size() * sizeof(NodeRecord) +
         static_cast<std::size_t>(sampled) * sample.nodes().size() * 9 * sizeof(double);
}

std::vector<std::byte> to_bytes(const BatchRecord& record) {
  const std::size_t of_nodes = record.nodes.size() * sizeof(NodeRecord);
  const std::size_t of_sample = record.compliance.size() * sizeof(double);
  std::vector<std::byte> bytes(kOfBatch + of_nodes + of_sample);
  const double of_batch[] = {record.cast_error, record.residual_floor};
  static_assert(sizeof of_batch == kOfBatch);
  std::memcpy(bytes.data(), of_batch, kOfBatch);
  std::memcpy(bytes.data() + kOfBatch, record.nodes.data(), of_nodes);
  if (of_sample > 0) std::memcpy(bytes.data() + kOfBatch + of_nodes, record.compliance.data(), of_sample);
  return bytes;
}

BatchRecord from_bytes(std::span<const std::byte> bytes, const ColumnBatch& batch) {
  BatchRecord record;
  record.nodes.resize(batch.nodes.size());
  const std::size_t of_nodes = record.nodes.size() * sizeof(NodeRecord);
  record.compliance.resize((bytes.size() - kOfBatch - of_nodes) / sizeof(double));
  std::memcpy(&record.cast_error, bytes.data(), sizeof(double));
  std::memcpy(&record.residual_floor, bytes.data() + sizeof(double), sizeof(double));
  std::memcpy(record.nodes.data(), bytes.data() + kOfBatch, of_nodes);
  if (!record.compliance.empty())
    std::memcpy(record.compliance.data(), bytes.data() + kOfBatch + of_nodes,
                record.compliance.size() * sizeof(double));
  return record;
}

}  // namespace palpate
