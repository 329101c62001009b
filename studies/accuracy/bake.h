// The study's bundles. The programs that users run make them; each file's name is a fingerprint of everything that decides
// its content, so that a second study finds it again.
#pragma once

#include <filesystem>
#include <map>
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

// What the bundle cost: bundle (its file name), mesh_sha256, vertices, columns, seconds, peak_bytes, bundle_bytes,
// reciprocity_error, worst_residual, most_iterations, solver; for a packed bundle also pack_seconds. A run of less than 3 s is
// repeated, and seconds is then the median.
using BakeCost = nlohmann::json;

class Bakery {
 public:
  Bakery(const OrganCase& organ, const StudySites& sites) : organ_(organ), sites_(sites) {}

  // Where the bundle is or would be; computes nothing but hashes.
  Baked look(const BundleSetting& setting) const;
  // Errors: OperationError.
  BakeCost bake(const BundleSetting& setting) const;
  // The reason to leave the setting out, if palpate-precompute --plan predicts more memory or time than the study may take.
  std::optional<std::string> too_large(const BundleSetting& setting) const;
  // What the columns of every touchable node would take by palpate-precompute --plan: seconds, bundle_bytes; null for a low-rank
  // bundle, whose size is known once its columns are. Errors: OperationError.
  nlohmann::json predict_full(const BundleSetting& setting) const;

 private:
  struct Inputs {
    std::filesystem::path mesh, organ, boundary;
  };
  Inputs inputs(const BundleSetting& setting) const;
  std::vector<std::string> precompute(const BundleSetting& setting, const Inputs& from) const;
  const nlohmann::json& plan(const BundleSetting& setting, bool everywhere) const;
  std::filesystem::path record_of(const Baked& baked) const;
  bool is_baked(const Baked& baked) const;
  BakeCost bake_rows(const BundleSetting& setting, const Baked& to) const;
  BakeCost pack(const BundleSetting& setting, const Baked& to) const;

  const OrganCase& organ_;
  const StudySites& sites_;
  mutable std::map<std::string, nlohmann::json> plans_;  // by setting; on a large mesh a plan takes a minute
};

}  // namespace palpate::accuracy
