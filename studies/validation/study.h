// Runs every case on every mesh, compares with CalculiX, and judges the errors. Measurements of an earlier run of the same
// program are read, not repeated.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace palpate::validation {

struct StudyOptions {
  std::filesystem::path source, bin, data;  // the repository; the programs; where results go
  std::filesystem::path python;             // with matplotlib, for the report
  std::filesystem::path output;             // default: DATA/validation
  std::vector<std::string> organ_meshes;    // ORGAN/BC/RESOLUTION: further meshes for CalculiX
  std::vector<std::string> organ_pushes;    // the same, with large strain
  std::vector<std::string> only;            // ids of cases ("calculix" too); empty: all
  bool brief = false;                       // the two coarsest meshes of each variant
};

// Writes validation.json, validation.csv and report.html with its pictures; a PetscSession must be alive. Errors: InputError;
// OperationError; VerificationError, after the report, where a bound or an order does not hold.
void run_study(StudyOptions options);

}  // namespace palpate::validation
