// gmsh from initialize to finalize, with its global state set the same way every time. Use it in a child process.
#pragma once

#include <string>
#include <vector>

namespace palpate {

class GmshSession {
 public:
  // assignments: "name=value" for the DefineConstant parameters of a .geo file.
  explicit GmshSession(const std::vector<std::string>& assignments = {});
  ~GmshSession();
  GmshSession(const GmshSession&) = delete;
  GmshSession& operator=(const GmshSession&) = delete;

  // HXT on one thread; size: largest edge inside (0: as the surface or the geometry says); optimize_below: FillOptions.
  void use_hxt(double size, double optimize_below);

  // Errors: OperationError with gmsh's own first error.
  void generate(int dimension);
};

}  // namespace palpate
