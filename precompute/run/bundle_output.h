// What a bundle holds beside the displacement rows: the body, the curve, T^f, the certificate and the provenance.
#pragma once

#include <nlohmann/json_fwd.hpp>
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
#include "precompute/tensors/corridor_columns.h"
#include "precompute/tensors/motions.h"

namespace palpate {

// The sections large/stiffening and large/law.
struct TissueLaws {
  std::vector<double> stiffening;                                // of each region
  std::vector<std::array<double, formats::kLawNumbers>> others;  // of each region; empty: stiffening says all
};

struct BundleContent {
  const ElasticBody& body;
  bool interior = false;
  std::vector<double> preload;  // [3 N] m; empty: none
  const SolvedMotions& motions;
  const SolvedCorridor& corridor;
  std::optional<ResponseFit> response;
  formats::ElementType store = formats::ElementType::f32;  // of the displacements: f32 or f64
  std::vector<std::int32_t> elimination_order;             // of the nodes that can move; empty: no large deformation
  TissueLaws laws;                                         // with the order
  SupportStiffness supports;  // with the order or a cut's region; empty: the organ has no soft support
};

// For each region of the body, in its order: the law of its [[region]].
TissueLaws laws_of(const ElasticBody& body, const OrganConfig& organ);

std::vector<SectionShape> section_shapes(const BundleContent& content);

// Writes every section that is known before the columns are solved.
void write_body_sections(SectionWriter& writer, const std::vector<formats::SectionEntry>& entries,
                         const BundleContent& content);

// Writes T^f (the section tensors/force), residuals and iterations of every column.
void write_column_sections(SectionWriter& writer, const std::vector<formats::SectionEntry>& entries,
                           std::span<const ColumnBatch> batches, std::span<const BatchRecord> records);

// The provenance is a flat JSON object that says how the bundle was made. provenance_of() gives what is known before
// the solve. provenance_text() adds the numbers of the certificate: zeros when the bundle is laid out, the real ones at
// the end.
nlohmann::json provenance_of(const PrecomputeOptions& options, const RunInputs& inputs, const BundleContent& content,
                             const std::string& solver, const std::string& petsc_options, int columns_at_a_time);
std::string provenance_text(nlohmann::json provenance, const Certificate& certificate);

}  // namespace palpate
