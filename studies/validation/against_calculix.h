// Solves the same discrete problem with CalculiX, on meshes of several kinds with one load each, and compares the
// displacement of every node; with large strain, a disc is pushed in, and the displacements of the surface and the force are compared.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "formats/organ_config.h"
#include "studies/accuracy/organ_case.h"
#include "studies/hyperelastic/large_body.h"

namespace palpate::validation {

struct Agreement;

struct CalculixMesh {
  std::string name;
  Element element;      // p1 against C3D4, p2-p0 against C3D10
  std::string poisson;  // for the report
  double bound;         // on Agreement::difference
  std::function<ElasticBody()> body;
  double push_mm = 0;  // 0: small strain and a load; else large strain: a disc of 10 mm radius goes in so far
  LawForm form = {};   // of large strain
  std::function<Agreement(const std::filesystem::path& scratch)> compare =
      {};  // in place of body: of two bodies in contact
};

struct Agreement {
  std::size_t vertices = 0, nodes = 0, cells = 0;
  double difference =
      0;  // largest difference of a node's displacement, over the largest displacement; with a push also
          // that of the force, over the force
  double assemble_seconds = 0, solve_seconds = 0, calculix_seconds = 0;
};

// Boxes, a sphere, cylinders and plates, meshed by this program.
std::vector<CalculixMesh> built_in_meshes();

// A block under a disc at 10, 20 and 30 mm, at nu 0.45; at 20 mm also of Yeoh's and Ogden's laws.
std::vector<CalculixMesh> pushed_blocks();

// ORGAN/BC/RESOLUTION: the organ's materials and held nodes on its pipeline's mesh. Errors: InputError.
CalculixMesh organ_mesh(const std::string& name, const accuracy::StudyOptions& folders);
// The same mesh under a disc at 10, 20 and 30 mm.
std::vector<CalculixMesh> pushed_organ(const std::string& name, const accuracy::StudyOptions& folders);

// Creates the folder scratch and removes it. Errors: OperationError.
Agreement compare_with_calculix(const CalculixMesh& mesh, const std::filesystem::path& scratch);

}  // namespace palpate::validation
