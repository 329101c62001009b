// What the bundle gets beside the tensors: sections of the body, provenance, the curve.
#pragma once

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "formats/bundle_writer.h"
#include "formats/organ_config.h"
#include "precompute/elastic_body.h"
#include "precompute/precompute.h"
#include "precompute/response_fit.h"

namespace palpate {

// The summary of all columns; its numbers reach the provenance.
struct Certificate {
  double worst_residual = 0;
  std::int64_t worst_node = -1, worst_dof = 0;  // node in the bundle's order
  std::int64_t most_iterations = 0;
  double reciprocity_error = 0;  // largest |C_nk - C_kn^T| / |C_nk| over pairs of nodes far apart; Frobenius norm
  std::int64_t reciprocity_pairs = 0;
  double cast_error = 0;  // largest ||T stored - T solved|| / ||T solved|| of a column
  double preload_residual = 0;
};

struct BundleContent {
  const ElasticBody& body;
  bool interior = false;
  std::vector<double> preload;  // [3 N] m; empty: none
  std::optional<ResponseFit> response;
};

std::vector<SectionShape> section_shapes(const BundleContent& content);

// Every section that is known before the columns are solved.
void write_body_sections(SectionWriter& writer, const std::vector<formats::SectionEntry>& entries,
                         const BundleContent& content);

const formats::SectionEntry& entry_of(const std::vector<formats::SectionEntry>& entries, formats::SectionId id);

// Keys of the provenance that describe inputs and solver; the certificate's numbers are added by the second function
// under the same keys before (all zero) and after the solve.
nlohmann::json provenance_of(const PrecomputeOptions& options, const OrganConfig& organ, const BoundaryConfig& boundary,
                             const BundleContent& content, const std::string& solver, const std::string& petsc_options,
                             int columns_at_a_time);
std::string provenance_text(nlohmann::json provenance, const Certificate& certificate);

}  // namespace palpate
