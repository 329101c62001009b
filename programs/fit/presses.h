// Presses an indenter on a bundle by the runtime's C API: the stiffness that the bundle gives at each measured spot.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <palpate/palpate.h>
#include "programs/fit/measurements.h"

namespace palpate::fit {

// sticking: a disc that does not slip, pressed along the organ's inward normal. sliding: the same disc without friction. plate: all
// touchable nodes at once, without friction.
enum class Press { sticking, sliding, plate };

struct Region {
  std::string name;
  double young = 0, poisson = 0;  // Pa, 1
};

class PressedBundle {
 public:
  // Errors: InputError where the file is not a bundle that can be used.
  explicit PressedBundle(const std::filesystem::path& file);

  const std::filesystem::path& file() const { return file_; }
  const std::vector<Region>& regions() const { return regions_; }

  // Errors: InputError that names both files where mesh, supports, touchable nodes or the regions' names differ.
  void expect_same_body(const PressedBundle& other) const;

  // Force over depth of each spot, N/m; of a ball at its depth (ball.h). source: the file of the spots, for refusals. Under plate all
  // spots have the same. Errors: InputError where a spot is farther from the surface than its radius, cannot be touched, or is a
  // ball under another press than sliding or deeper than its contact can reach.
  std::vector<double> stiffness(const std::vector<Spot>& spots, Press press, const std::filesystem::path& source);

  // The depth up to which the bundle says that linear elasticity is good (accuracy_linear_limit_mm of its provenance), m; 0: it says
  // nothing.
  double linear_limit() const { return linear_limit_; }

  // The elastic foundations and springs of the boundary set, as the provenance words them.
  const std::map<std::string, std::string>& soft_supports() const { return soft_supports_; }

  // What a press did not hold in full: spots on held nodes, for example. One sentence each.
  const std::vector<std::string>& warnings() const { return warnings_; }

  // The organ's length along the direction of the plate, m; 0 before stiffness(plate).
  double plate_height() const { return plate_height_; }

 private:
  struct Close {
    void operator()(palpate_bundle* bundle) const { palpate_bundle_close(bundle); }
  };
  void read_provenance(const std::string& text);
  double plane_modulus(std::int32_t triangle) const;
  std::vector<double> press_discs(const std::vector<Spot>& spots, Press press, const std::filesystem::path& source);
  double press_plate();
  int plate_axis(double& sign) const;

  std::filesystem::path file_;
  std::unique_ptr<palpate_bundle, Close> bundle_;
  std::vector<Region> regions_;
  std::vector<std::int32_t> region_of_;  // [tetrahedron]
  std::vector<std::string> warnings_;
  std::map<std::string, std::string> soft_supports_;
  double plate_height_ = 0, linear_limit_ = 0;
};

}  // namespace palpate::fit
