// Solves the same discrete problem with CalculiX, on meshes of several kinds with one load each, and compares the
// displacement of every node.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "formats/organ_config.h"
#include "studies/accuracy/organ_case.h"

namespace palpate::validation {

struct CalculixMesh {
  std::string name;
  Element element;      // p1 against C3D4, p2-p0 against C3D10
  std::string poisson;  // for the report
  double bound;         // on Agreement::difference
  std::function<ElasticBody()> body;
};

struct Agreement {
  std::size_t vertices = 0, nodes = 0, cells = 0;
  double difference = 0;  // largest difference of a node's displacement, over the largest displacement
  double assemble_seconds = 0, solve_seconds = 0, calculix_seconds = 0;
};

// Boxes, a sphere, cylinders and plates, meshed by this program.
std::vector<CalculixMesh> built_in_meshes();

// ORGAN/BC/RESOLUTION: the organ's materials and held nodes on its pipeline's mesh. Errors: InputError.
CalculixMesh organ_mesh(const std::string& name, const accuracy::StudyOptions& folders);

// Creates the folder scratch and removes it. Errors: OperationError.
Agreement compare_with_calculix(const CalculixMesh& mesh, const std::filesystem::path& scratch);

}  // namespace palpate::validation
