// What the bundle gets beside the tensors: sections of the body, provenance, the curve.
#pragma once

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "formats/bundle_writer.h"
#include "formats/organ_config.h"
#include "precompute/elements/elastic_body.h"
#include "precompute/journal/certificate.h"
#include "precompute/run/precompute.h"
#include "precompute/run/response_fit.h"
#include "precompute/run/run_inputs.h"
#include "precompute/tensors/locking_estimate.h"

namespace palpate {

struct BundleContent {
  const ElasticBody& body;
  bool interior = false;
  std::vector<double> preload;  // [3 N] m; empty: none
  std::optional<ResponseFit> response;
  formats::ElementType store = formats::ElementType::f32;  // of the displacements; f64 as well
};

std::vector<SectionShape> section_shapes(const BundleContent& content);

// Every section that is known before the columns are solved.
void write_body_sections(SectionWriter& writer, const std::vector<formats::SectionEntry>& entries,
                         const BundleContent& content);

// Forces, residuals and iterations of every column.
void write_column_sections(SectionWriter& writer, const std::vector<formats::SectionEntry>& entries,
                           std::span<const ColumnBlock> blocks, std::span<const BlockRecord> records);

// Keys of the provenance that describe inputs and solver; the certificate's numbers are added by the second function
// under the same keys before (all zero) and after the solve.
nlohmann::json provenance_of(const PrecomputeOptions& options, const RunInputs& inputs, const BundleContent& content,
                             const std::string& solver, const std::string& petsc_options, int columns_at_a_time,
                             const LockingEstimate& locking);
std::string provenance_text(nlohmann::json provenance, const Certificate& certificate);

}  // namespace palpate
