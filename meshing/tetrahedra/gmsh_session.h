// Runs gmsh from initialize to finalize. Sets its global state the same way every time. Use it in a child process.
#pragma once

#include <string>
#include <vector>

#include "formats/errors.h"

namespace palpate {

// gmsh could not make the mesh. nodes, surfaces: the tags of those where it failed, if gmsh names any.
struct GmshFailure : OperationError {
  using OperationError::OperationError;
  std::vector<std::size_t> nodes;
  std::vector<int> surfaces;
};

class GmshSession {
 public:
  // assignments: "name=value", which set the DefineConstant parameters of a .geo file.
  explicit GmshSession(const std::vector<std::string>& assignments = {});
  ~GmshSession();
  GmshSession(const GmshSession&) = delete;
  GmshSession& operator=(const GmshSession&) = delete;

  // Selects HXT on one thread. size: largest edge inside; 0: as the surface or the geometry says. optimize_below: see
  // FillOptions.
  void use_hxt(double size, double optimize_below);

  // Errors: GmshFailure with the first error that gmsh reports.
  void generate(int dimension);
};

}  // namespace palpate
