// The sections of displacement rows, and a solved block's rows as the bytes that go there.
#pragma once

#include <cstdint>
#include <vector>

#include "formats/bundle_writer.h"
#include "precompute/journal/block_record.h"
#include "precompute/tensors/tensors.h"

namespace palpate {

struct DisplacementSection {
  formats::SectionEntry entry;                                               // of shape [touchable nodes][3][count][3]
  std::int32_t first, count;                                                 // the nodes whose displacements it holds
  std::uint64_t node_bytes() const { return entry.bytes / entry.shape[0]; }  // of one touchable node's rows
};

// That of the surface and, where it is among entries, that of the interior.
std::vector<DisplacementSection> displacement_sections(const std::vector<formats::SectionEntry>& entries,
                                                       const ElasticBody& body);

// Of one block: for each section, its nodes' rows one after the other.
using DisplacementRows = std::vector<std::vector<char>>;

// Fills rows and what the record says of them. rows is reused where it has the size already.
void take_rows(const std::vector<DisplacementSection>& sections, const TensorBlock& solved, DisplacementRows& rows,
               BlockRecord& record);

// Each node's rows at the node's own place. Errors: OperationError.
void write_rows(const std::vector<DisplacementSection>& sections, const ColumnBlock& block,
                const DisplacementRows& rows, SectionWriter& writer);

// Whether a block's rows on the disk are those that the record speaks of. Errors: OperationError (reading).
bool rows_hold(const std::vector<DisplacementSection>& sections, const ColumnBlock& block, const BlockRecord& record,
               const PlainFile& part);

// The same for all blocks, of bytes that come by in order: a SectionReader for seal_bundle. Throws OperationError at the
// first row that does not hold.
SectionReader check_rows(const std::vector<DisplacementSection>& sections, const std::vector<ColumnBlock>& blocks,
                         const std::vector<BlockRecord>& records, const std::filesystem::path& part);

}  // namespace palpate
