#include "precompute/displacement_sections.h"

#include <algorithm>

#include "formats/checksum.h"
#include "precompute/bundle_output.h"

namespace palpate {

using formats::SectionId;

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

void take_rows(const std::vector<DisplacementSection>& sections, const TensorBlock& solved, DisplacementRows& rows,
               BlockRecord& record) {
  rows.resize(sections.size());
  std::int32_t stored = 0;
  for (std::size_t s = 0; s < sections.size(); ++s) {
    const auto& section = sections[s];
    const std::uint64_t node_bytes = section.node_bytes();
    rows[s].resize(record.nodes.size() * node_bytes);
    solved.displacement(section.first, section.count, reinterpret_cast<float*>(rows[s].data()));
    for (std::size_t i = 0; i < record.nodes.size(); ++i)
      record.nodes[i].rows[s] = formats::xxh64(&rows[s][i * node_bytes], node_bytes);
    stored = section.first + section.count;
  }
  record.cast_error = solved.cast_error(0, stored);
}

void write_rows(const std::vector<DisplacementSection>& sections, const ColumnBlock& block,
                const DisplacementRows& rows, SectionWriter& writer) {
  for (std::size_t s = 0; s < sections.size(); ++s) {
    const std::uint64_t node_bytes = sections[s].node_bytes();
    for (std::size_t i = 0, run = 1; i < block.places.size(); i += run, run = 1) {
      // Neighbours go in one write.
      while (i + run < block.places.size() && block.places[i + run] == block.places[i] + static_cast<int>(run)) ++run;
      writer.write(sections[s].entry, static_cast<std::uint64_t>(block.places[i]) * node_bytes,
                   &rows[s][i * node_bytes], run * node_bytes);
    }
  }
}

}  // namespace palpate
