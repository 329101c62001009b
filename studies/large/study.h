// The study of large deformation on an organ: every mesh and Poisson's ratio, one after the other; then the report.
#pragma once

#include <vector>

#include "studies/accuracy/organ_case.h"

namespace palpate::large {

struct LargeStudyOptions {
  accuracy::StudyOptions organ;  // output: default DATA/ORGAN/large-deformation/BC
  std::vector<double> poisson = {0.45, 0.49};
  std::vector<double> depths_mm = {10, 20, 30};
  double speed_mm_s = 100;
};

// Writes large-deformation.json, large-deformation.csv and report.html with its pictures. Resumes: points/ keeps each mesh with each
// ratio. Errors: InputError, OperationError.
void run_study(LargeStudyOptions options);

}  // namespace palpate::large
