// What the study keeps: bundles that it bakes, and points that it measured once.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "studies/accuracy/organ_case.h"
#include "studies/hyperelastic/large_body.h"

namespace palpate::large {

class StudyFolder {
 public:
  using Measure = std::function<nlohmann::ordered_json(const std::filesystem::path& parts)>;

  explicit StudyFolder(const accuracy::OrganCase& organ);  // organ must outlive it

  const std::filesystem::path& path() const { return organ_.options().output; }

  // Bakes the mesh by palpate-precompute, with what large deformation needs. Returns the bundle. Errors: OperationError.
  std::filesystem::path bake(const std::filesystem::path& mesh, const std::filesystem::path& organ,
                             const std::string& name) const;
  LargeBody body(const std::filesystem::path& mesh, const std::filesystem::path& organ) const;

  // The point that an earlier run of this program kept for the same files and settings; else measures and keeps it. measure gets a
  // folder for parts of the point, which is there until the point is kept.
  nlohmann::ordered_json kept_or_measured(const std::vector<std::filesystem::path>& files,
                                          const nlohmann::ordered_json& settings, const Measure& measure) const;

  // NAME.json, NAME.csv, and report.html.
  void write(const std::string& name, nlohmann::ordered_json study,
             const std::vector<nlohmann::ordered_json>& rows) const;

 private:
  const accuracy::OrganCase& organ_;
  const std::string own_hash_;
};

}  // namespace palpate::large
