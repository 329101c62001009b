#include "precompute/journal/displacement_sections.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "formats/bundle_writer.h"
#include "formats/checksum.h"
#include "formats/errors.h"

namespace palpate {

using formats::SectionId;

namespace {

bool is_double(const DisplacementSection& section) {
  return section.entry.type == static_cast<std::uint32_t>(formats::ElementType::f64);
}

}  // namespace

std::vector<DisplacementSection> displacement_sections(const std::vector<formats::SectionEntry>& entries,
                                                       const ElasticBody& body) {
  const auto all = static_cast<std::int32_t>(body.nodes.size());
  std::vector<DisplacementSection> sections = {
      {entry_of(entries, SectionId::displacement_surface), 0, body.surface_count}};
  for (const auto& entry : entries)
    if (entry.id == static_cast<std::uint32_t>(SectionId::displacement_interior))
      sections.push_back({entry, body.surface_count, all - body.surface_count});
  return sections;
}

void take_rows(const std::vector<DisplacementSection>& sections, const BatchTensors& solved, DisplacementRows& rows,
               BatchRecord& record) {
  rows.resize(sections.size());
  CastLoss loss;
  for (std::size_t s = 0; s < sections.size(); ++s) {
    const auto& section = sections[s];
    const std::uint64_t node_bytes = section.node_bytes();
    rows[s].resize(record.nodes.size() * node_bytes);
    if (is_double(section))
      solved.displacement(section.first, section.count, reinterpret_cast<double*>(rows[s].data()), nullptr);
    else
      solved.displacement(section.first, section.count, reinterpret_cast<float*>(rows[s].data()), &loss);
    for (std::size_t i = 0; i < record.nodes.size(); ++i)
      record.nodes[i].rows[s] = formats::xxh64(&rows[s][i * node_bytes], node_bytes);
  }
  record.cast_error = is_double(sections[0]) ? 0 : loss.worst();
}

void write_rows(const std::vector<DisplacementSection>& sections, const ColumnBatch& batch,
                const DisplacementRows& rows, SectionWriter& writer) {
  for (std::size_t s = 0; s < sections.size(); ++s) {
    const std::uint64_t node_bytes = sections[s].node_bytes();
    for (std::size_t i = 0, run = 1; i < batch.slots.size(); i += run, run = 1) {
      // Nodes in neighbouring slots go in one write.
      while (i + run < batch.slots.size() && batch.slots[i + run] == batch.slots[i] + static_cast<int>(run)) ++run;
      writer.write(sections[s].entry, static_cast<std::uint64_t>(batch.slots[i]) * node_bytes, &rows[s][i * node_bytes],
                   run * node_bytes);
    }
  }
}

bool rows_hold(const std::vector<DisplacementSection>& sections, const ColumnBatch& batch, const BatchRecord& record,
               const PlainFile& part) {
  std::vector<char> rows;
  for (std::size_t s = 0; s < sections.size(); ++s) {
    rows.resize(sections[s].node_bytes());
    for (std::size_t i = 0; i < batch.slots.size(); ++i) {
      const std::uint64_t at = sections[s].entry.offset + static_cast<std::uint64_t>(batch.slots[i]) * rows.size();
      if (part.read(at, rows.data(), rows.size()) < rows.size() ||
          formats::xxh64(rows.data(), rows.size()) != record.nodes[i].rows[s])
        return false;
    }
  }
  return true;
}

namespace {

// The check of one section, whose rows arrive in the order of their slots.
struct PassingRows {
  std::uint64_t node_bytes;
  std::vector<std::uint64_t> expected;  // by slot
  formats::Xxh64 checksum;

  void take(std::uint64_t first_byte, const char* bytes, std::size_t count, const std::filesystem::path& part) {
    while (count > 0) {
      const std::uint64_t slot = first_byte / node_bytes, end = (slot + 1) * node_bytes;
      const auto some = static_cast<std::size_t>(std::min<std::uint64_t>(count, end - first_byte));
      checksum.update(bytes, some);
      first_byte += some, bytes += some, count -= some;
      if (first_byte < end) return;
      if (checksum.digest() != expected[slot])
        throw OperationError(
            fmt::format("{}: the rows of touchable node {} changed on the disk after they were written; run the same "
                        "command again, which solves their batch anew",
                        part.string(), slot));
      checksum = {};
    }
  }
};

}  // namespace

SectionReader check_rows(const std::vector<DisplacementSection>& sections, const std::vector<ColumnBatch>& batches,
                         const std::vector<BatchRecord>& records, const std::filesystem::path& part) {
  std::map<std::uint32_t, PassingRows> passing;
  for (std::size_t s = 0; s < sections.size(); ++s) {
    PassingRows rows{sections[s].node_bytes(), std::vector<std::uint64_t>(sections[s].entry.shape[0]), {}};
    for (std::size_t b = 0; b < batches.size(); ++b)
      for (std::size_t i = 0; i < batches[b].slots.size(); ++i)
        rows.expected[batches[b].slots[i]] = records[b].nodes[i].rows[s];
    passing.emplace(sections[s].entry.id, std::move(rows));
  }
  return [passing, part](const formats::SectionEntry& entry, std::uint64_t first, const char* bytes,
                         std::size_t count) mutable {
    if (const auto rows = passing.find(entry.id); rows != passing.end()) rows->second.take(first, bytes, count, part);
  };
}

}  // namespace palpate
