// A body that palpate-precompute has solved, as its users do it: mesh file, organ.toml and boundary file in, a bundle out.
#pragma once

#include "formats/tetrahedral_mesh.h"
#include "studies/validation/cases.h"

namespace palpate::validation {

struct BodyToBake {
  std::string name;  // of its folder in the scratch folder, which is made anew
  TetrahedralMesh mesh;
  double young = 0, poisson = 0;
  Element element = Element::p1;
  std::string boundary;     // of the boundary file, without its name
  std::string motion = {};  // rows "x,y,z,ux,uy,uz" of a motion of supports; empty: none
  std::string moving = {};  // the selector of these supports
  bool large = false;       // also as a hyperelastic body, with CalculiX's law where the element is p1
};
// Returns the bundle. Errors: OperationError.
std::filesystem::path bake(const Workshop& workshop, const BodyToBake& body);

}  // namespace palpate::validation
