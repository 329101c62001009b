// Bundles of the study: baked and packed by the programs that users run, kept by a fingerprint of all that decides them.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "studies/accuracy/organ_case.h"
#include "studies/accuracy/setting.h"

namespace palpate::accuracy {

struct Baked {
  std::string fingerprint;       // of the mesh, the organ, the boundary set, the setting and the programs
  std::filesystem::path bundle;  // there once bake() has made it
};

// What it took: mesh_sha256, vertices, columns, seconds, peak_bytes, bundle_bytes, reciprocity_error, worst_residual, most_iterations,
// solver, and of a packed one pack_seconds and pack_error. seconds of short runs: the median of several.
using BakeCost = nlohmann::json;

class Bakery {
 public:
  Bakery(const OrganCase& organ, const StudyPlaces& places) : organ_(organ), places_(places) {}

  // Cheap: nothing is baked.
  Baked look(const BundleSetting& setting) const;
  // Errors: OperationError.
  BakeCost bake(const BundleSetting& setting) const;
  // Why it is left out: the plan predicts more memory or time than the study may take.
  std::optional<std::string> too_large(const BundleSetting& setting) const;

 private:
  struct Inputs {
    std::filesystem::path mesh, organ, boundary;
  };
  Inputs inputs(const BundleSetting& setting) const;
  std::vector<std::string> precompute(const BundleSetting& setting, const Inputs& from) const;
  std::filesystem::path record_of(const Baked& baked) const;
  bool is_baked(const Baked& baked) const;
  BakeCost bake_rows(const BundleSetting& setting, const Baked& to) const;
  BakeCost pack(const BundleSetting& setting, const Baked& to) const;

  const OrganCase& organ_;
  const StudyPlaces& places_;
};

}  // namespace palpate::accuracy
