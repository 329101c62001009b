// Runs gmsh from initialize to finalize. Sets its global state the same way every time. Use it in a child process.
#pragma once

#include <string>
#include <vector>

namespace palpate {

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

  // Errors: OperationError with the first error that gmsh reports.
  void generate(int dimension);
};

}  // namespace palpate
