// Converts a bundle of f32 rows to the other storage forms, as palpate-bundle pack does with files.
#pragma once

#include <Eigen/Dense>
#include <functional>
#include <utility>

#include "formats/half.h"
#include "precompute/bundle_tool/compliance_packer.h"
#include "tests/support/bundle_parts.h"

namespace palpate::tests {

void store_as_f64(BundleParts& parts);

void store_as_f16(BundleParts& parts);

// Stores the interior alone in f16; the surface stays as it is.
void store_interior_as_f16(BundleParts& parts);

// Stores the surface as compliance in blocks; the interior stays in rows.
PackedCompliance store_in_blocks(BundleParts& parts, const CompliancePackOptions& options);

// All forms.
inline const std::pair<const char*, std::function<void(BundleParts&)>> kPackedForms[] = {
    {"f64 rows", store_as_f64},
    {"f16 rows", store_as_f16},
    {"f32 blocks",
     [](BundleParts& parts) {
       store_in_blocks(parts, {formats::ElementType::f32, 1e-4});
     }},
    {"f16 blocks",
     [](BundleParts& parts) {
       store_in_blocks(parts, {formats::ElementType::f16, 1e-3});
     }},
};

}  // namespace palpate::tests
