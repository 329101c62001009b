#include "precompute/block_record.h"

#include <algorithm>
#include <cstring>

namespace palpate {

BlockRecord record_of(const TensorBlock& solved, const ColumnBlock& block, const ReciprocitySample& sample) {
  BlockRecord record;
  for (std::size_t i = 0; i < block.nodes.size(); ++i) {
    NodeRecord node{};
    node.force = solved.force(i);
    for (int j = 0; j < 3; ++j) {
      const ColumnReport report = solved.report(i, j);
      node.residual[j] = report.residual;
      node.iterations[j] = report.iterations;
    }
    record.nodes.push_back(node);
    if (sample.place_of(block.nodes[i]) < 0) continue;
    for (const auto n : sample.nodes()) {
      const auto c = solved.compliance(n, i);
      record.compliance.insert(record.compliance.end(), c.begin(), c.end());
    }
  }
  return record;
}

std::size_t record_bytes(const ColumnBlock& block, const ReciprocitySample& sample) {
  const auto sampled =
      std::count_if(block.nodes.begin(), block.nodes.end(), [&](auto n) { return sample.place_of(n) >= 0; });
  return sizeof(double) + block.nodes.size() * sizeof(NodeRecord) +
         static_cast<std::size_t>(sampled) * sample.nodes().size() * 9 * sizeof(double);
}

std::vector<std::byte> to_bytes(const BlockRecord& record) {
  const std::size_t of_nodes = record.nodes.size() * sizeof(NodeRecord);
  const std::size_t of_sample = record.compliance.size() * sizeof(double);
  std::vector<std::byte> bytes(sizeof(double) + of_nodes + of_sample);
  std::memcpy(bytes.data(), &record.cast_error, sizeof(double));
  std::memcpy(bytes.data() + sizeof(double), record.nodes.data(), of_nodes);
  if (of_sample > 0) std::memcpy(bytes.data() + sizeof(double) + of_nodes, record.compliance.data(), of_sample);
  return bytes;
}

BlockRecord from_bytes(std::span<const std::byte> bytes, const ColumnBlock& block) {
  BlockRecord record;
  record.nodes.resize(block.nodes.size());
  const std::size_t of_nodes = record.nodes.size() * sizeof(NodeRecord);
  record.compliance.resize((bytes.size() - sizeof(double) - of_nodes) / sizeof(double));
  std::memcpy(&record.cast_error, bytes.data(), sizeof(double));
  std::memcpy(record.nodes.data(), bytes.data() + sizeof(double), of_nodes);
  if (!record.compliance.empty())
    std::memcpy(record.compliance.data(), bytes.data() + sizeof(double) + of_nodes,
                record.compliance.size() * sizeof(double));
  return record;
}

}  // namespace palpate
