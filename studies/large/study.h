// The studies of large deformation on an organ.
#pragma once

#include <vector>

#include "studies/accuracy/organ_case.h"

namespace palpate::large {

struct LargeStudyOptions {
  accuracy::StudyOptions organ;  // output: default DATA/ORGAN/large-deformation/BC
  std::vector<double> poisson = {0.45, 0.49};
  std::vector<double> depths_mm = {10, 20, 30};
  double speed_mm_s = 100;
  int threads = 1;  // moves beside one another
};

// Both resume: points/ keeps what was measured. Errors: InputError, OperationError.

// Following a converged solution, and times, of every mesh and Poisson's ratio: large-deformation.json, large-deformation.csv and
// report.html with its pictures.
void run_study(const LargeStudyOptions& options);

// The same push on every mesh: what the element, the disc and the mesh's shape do to its force. between-meshes.json,
// between-meshes.csv and between-meshes.html with its pictures.
void run_study_between_meshes(const LargeStudyOptions& options);

// With the default folder. Errors: InputError where depths do not grow.
LargeStudyOptions with_defaults(LargeStudyOptions options);

}  // namespace palpate::large
