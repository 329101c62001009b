// The bundles of the study: those of the organ's boundary set with pressures and a corridor added.
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "formats/organ_config.h"
#include "studies/scenes/full_body.h"
#include "studies/scenes/places.h"

namespace palpate::scenes {

struct ScenesOptions {
  std::filesystem::path mesh, organ, boundary, output, bin, python, source;
  std::filesystem::path image;  // where the boundary's label selectors read it; may be empty
  int steps = 2000;             // timed touches of each world
  int organs = 8;               // at most, and 100 pairs, 12 added modes, ...: a short study takes fewer
  int modes = 12;
  bool quick = false;  // smallest numbers alone
};

class BakedOrgan {
 public:
  explicit BakedOrgan(const ScenesOptions& options);

  const FullBody& full() const { return *full_; }  // of the bundle with all modes
  const ElasticBody& body() const { return full_->body(); }
  const Way& way() const { return way_; }
  int own_modes() const { return own_modes_; }
  // Bakes, unless an earlier run has: the organ with so many pressures on its whole surface more than it has motions. Errors: OperationError.
  std::filesystem::path bundle(int added) const;
  // The organ as it is, also for large deformation; empty where its element is not one that knows it. Errors: OperationError.
  std::filesystem::path large_bundle() const;

 private:
  std::filesystem::path boundary_with(int added) const;
  ElasticBody body_of(const std::filesystem::path& boundary) const;
  std::filesystem::path bake(const std::string& name, int added, std::vector<std::string> options) const;

  const ScenesOptions& options_;
  OrganConfig organ_;
  Way way_;
  int own_modes_ = 0;
  std::unique_ptr<FullBody> full_;
  mutable std::set<std::string> baked_;  // those that this run has asked palpate-precompute for
};

}  // namespace palpate::scenes
