// The study of large deformation on an organ.
#pragma once

#include <vector>

#include "studies/accuracy/organ_case.h"

namespace palpate::large {

struct LargeStudyOptions {
  accuracy::StudyOptions organ;  // output: default DATA/ORGAN/large-deformation/BC
  std::vector<double> poisson = {0.45, 0.49};
  std::vector<double> depths_mm = {10, 20, 30};
  double speed_mm_s = 100;
  int threads = 1;   // moves beside one another
  int composed = 4;  // places of jaws and of two organs
};

// Following a converged solution, and times, of every mesh and Poisson's ratio: large-deformation.json, large-deformation.csv and
// report.html with its pictures. Resumes: points/ keeps what was measured. Errors: InputError, OperationError.
void run_study(const LargeStudyOptions& options);

}  // namespace palpate::large
