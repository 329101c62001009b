// An organ under a boundary set, as its pipeline has it: meshes by the pipeline's own rules, and variants of its files.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "precompute/elements/elastic_body.h"
#include "studies/accuracy/places.h"

namespace palpate::accuracy {

struct StudyOptions {
  std::string organ, boundary;              // pipelines/ORGAN, its boundary/BC.toml
  std::filesystem::path source, bin, data;  // the repository; the programs; where results go
  std::filesystem::path python;             // with matplotlib, for the report
  std::filesystem::path output;             // of the study; default: DATA/ORGAN/accuracy/BC
  std::vector<std::string> resolutions;     // coarse to fine; default: all of the organ's
  std::vector<std::string> make_variables;  // "IMAGE=...": for the pipeline's rules
  double memory_gigabytes = 0;              // a precompute may take; 0: what it finds free
  double most_seconds = 150;                // a precompute with p2-p0 is predicted to take, else it is left out; the
                                            // organ's own reference, near the places alone, may take twice that
  int repeats = 3;                          // of a short precompute; the median counts
  double radius_mm = 10;                    // of the tool's disc
  int places = 6, samples = 200;            // pressed; looked at
};

// The organ.toml with another element and, where poisson is not 0, that Poisson's ratio in every region; its curve by an
// absolute path, so that it may stand anywhere.
std::string organ_text(const std::filesystem::path& organ_toml, const std::string& element, double poisson);

class OrganCase {
 public:
  // Errors: InputError where there is no such organ or boundary set, or no such resolution.
  explicit OrganCase(StudyOptions options);

  const StudyOptions& options() const { return options_; }
  const std::vector<std::string>& resolutions() const { return options_.resolutions; }
  // The pipeline's default where the study has it, else the middle one.
  const std::string& base_resolution() const { return base_; }
  bool has_response() const;
  std::string element() const;  // of organ.toml
  double poisson() const;       // of all regions; NaN where they differ

  // Made by the pipeline's rules where it is missing or out of date. Errors: OperationError.
  std::filesystem::path make_mesh(const std::string& resolution) const;
  // As a file of the study: organ_text.
  std::filesystem::path organ_file(const std::string& element, double poisson) const;
  // The boundary set as it is; with places: only nodes near those are touchable, unless the set itself says which are.
  std::filesystem::path boundary_file() const;
  std::filesystem::path boundary_file(const StudyPlaces& places, const std::string& resolution) const;
  ElasticBody body(const std::string& resolution) const;

 private:
  std::filesystem::path folder() const { return options_.source / "pipelines" / options_.organ; }
  std::vector<std::string> make(const std::string& resolution, const std::string& target) const;
  void choose_resolutions();

  StudyOptions options_;
  std::string base_;
  // What one run makes stays as it is.
  mutable std::map<std::string, std::filesystem::path> meshes_, boundaries_;
};

}  // namespace palpate::accuracy
