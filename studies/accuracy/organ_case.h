// An organ under one of its boundary sets. Meshes come from the pipeline's own rules; variants of organ.toml and of the
// boundary set are written as files of the study.
#pragma once

#include <algorithm>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "precompute/elements/elastic_body.h"
#include "studies/accuracy/sites.h"

namespace palpate::accuracy {

inline constexpr const char* kAxes[] = {"mesh", "scenes", "storage", "tolerance", "poisson", "depth"};

struct StudyOptions {
  std::string organ, boundary;              // a folder of ORGANS_DIR or of pipelines, its boundary/BC.toml
  std::filesystem::path source, bin, data;  // the repository; the programs; where results go
  std::filesystem::path python;             // with matplotlib, for the report
  std::filesystem::path output;             // of the study; default: DATA/ORGAN/accuracy/BC
  std::vector<std::string> resolutions;     // coarse to fine; default: all of the organ's
  std::vector<std::string> axes;            // what is varied, of kAxes; default: all
  std::vector<std::string> make_variables;  // "IMAGE=...": for the pipeline's rules
  double memory_gigabytes = 0;              // that a precompute may take; 0: the memory that is free
  double most_seconds = 150;                // limit on the predicted time of a precompute with p2-p0, and of any on a
                                            // mesh that p2-p0 does not fit; columns near the sites in the organ's own
                                            // material, as of the reference, may take twice that
  int repeats = 3;                          // runs of a precompute of less than 3 s; the median counts
  double radius_mm = 10;                    // of the tool's disc
  int sites = 6, samples = 200;             // pressed; compared

  bool has_axis(const std::string& axis) const {
    return axes.empty() || std::find(axes.begin(), axes.end(), axis) != axes.end();
  }
};

// organ.toml with another element and, if poisson is not 0, that Poisson's ratio in every region, and if stiffening is not 0 that
// stiffening. The path of its response curve is made absolute, so that the text may be written to any folder.
std::string organ_text(const std::filesystem::path& organ_toml, const std::string& element, double poisson,
                       double stiffening = 0);

class OrganCase {
 public:
  // Errors: InputError where there is no such organ or boundary set, or no such resolution.
  explicit OrganCase(StudyOptions options);

  const StudyOptions& options() const { return options_; }
  const std::vector<std::string>& resolutions() const { return options_.resolutions; }
  // The pipeline's default resolution if the study has it, else the middle one.
  const std::string& base_resolution() const { return base_; }
  bool has_response() const;
  std::string element() const;  // of organ.toml
  double poisson() const;       // of all regions; NaN where they differ

  // Runs the pipeline's rules if the mesh is missing or out of date. Errors: OperationError.
  std::filesystem::path make_mesh(const std::string& resolution) const;
  // Writes organ_text to a file of the study.
  std::filesystem::path organ_file(const std::string& element, double poisson, double stiffening = 0) const;
  // The boundary set as it is. With sites: a copy in which only nodes near the sites are touchable, unless the set itself
  // has [touchable].
  std::filesystem::path boundary_file() const;
  std::filesystem::path boundary_file(const StudySites& sites, const std::string& resolution) const;
  ElasticBody body(const std::string& resolution) const;

 private:
  std::filesystem::path folder() const;
  std::vector<std::string> make(const std::string& resolution, const std::string& target) const;
  void choose_resolutions();

  StudyOptions options_;
  std::string base_;
  // By resolution. A run makes each file once.
  mutable std::map<std::string, std::filesystem::path> meshes_, boundaries_;
};

}  // namespace palpate::accuracy
