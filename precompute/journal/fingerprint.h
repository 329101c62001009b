// Everything that decides the bytes of the columns. A part that was begun with one fingerprint is never finished with
// another.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <vector>

#include "formats/bundle_writer.h"
#include "precompute/tensors/column_batches.h"

namespace palpate {

// A flat JSON object: the provenance (SHA-256 of every input, options, solver), SHA-256 of this program, the layout of the bundle and
// the batches of columns. It also holds the processor: a part that was begun on another processor is resumed with a warning.
using Fingerprint = nlohmann::json;

Fingerprint fingerprint_of(nlohmann::json provenance, const std::vector<SectionShape>& sections,
                           std::span<const ColumnBatch> batches);

// The first entry that differs, as "KEY was A, is B"; empty where all but the processor are equal.
std::string difference(const Fingerprint& earlier, const Fingerprint& now);

}  // namespace palpate
