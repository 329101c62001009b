// What decides the bytes of a bundle: a part that was begun with one fingerprint is never finished with another.
#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <vector>

#include "formats/bundle_writer.h"
#include "precompute/tensors/column_blocks.h"

namespace palpate {

// A flat object: the provenance (SHA-256 of every input, options, solver, versions), SHA-256 of this program, the layout
// and the blocks of columns; and the processor, of which a difference is told but does not hinder.
using Fingerprint = nlohmann::json;

Fingerprint fingerprint_of(nlohmann::json provenance, const std::vector<SectionShape>& sections,
                           std::span<const ColumnBlock> blocks);

// The first thing that decides bytes and differs, as "KEY was A, is B"; empty when there is none.
std::string difference(const Fingerprint& earlier, const Fingerprint& now);

}  // namespace palpate
