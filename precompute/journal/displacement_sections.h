// The sections of the bundle that hold T^u, and the rows of a solved batch as the bytes that go there.
#pragma once

#include <cstdint>
#include <vector>

#include "formats/bundle_writer.h"
#include "precompute/journal/batch_record.h"
#include "precompute/tensors/tensors.h"

namespace palpate {

struct DisplacementSection {
  formats::SectionEntry entry;  // of shape [touchable nodes][3][count][3]
  std::int32_t first, count;    // nodes whose displacements the section holds
  std::uint64_t node_bytes() const { return entry.bytes / entry.shape[0]; }  // of the rows of one touchable node
};

// The section of the surface and, where entries has it, that of the interior.
std::vector<DisplacementSection> displacement_sections(const std::vector<formats::SectionEntry>& entries,
                                                       const ElasticBody& body);

// The rows of one batch: for each section, the rows of its nodes one after the other.
using DisplacementRows = std::vector<std::vector<char>>;

// Fills rows, and in record the checksums of the rows and the error of rounding. Reuses the memory of rows.
void take_rows(const std::vector<DisplacementSection>& sections, const BatchTensors& solved, DisplacementRows& rows,
               BatchRecord& record);

// Writes the rows of each node at the node's slot. Errors: OperationError.
void write_rows(const std::vector<DisplacementSection>& sections, const ColumnBatch& batch,
                const DisplacementRows& rows, SectionWriter& writer);

// Whether the rows of a batch on the disk have the checksums of its record. Errors: OperationError where they cannot be
// read.
bool rows_hold(const std::vector<DisplacementSection>& sections, const ColumnBatch& batch, const BatchRecord& record,
               const PlainFile& part);

// The same check of all batches, on bytes that seal_bundle() reads from first to last anyway. Throws OperationError at
// the first node whose rows do not hold.
SectionReader check_rows(const std::vector<DisplacementSection>& sections, const std::vector<ColumnBatch>& batches,
                         const std::vector<BatchRecord>& records, const std::filesystem::path& part);

}  // namespace palpate
