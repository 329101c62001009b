// Presses an indenter on a bundle by the runtime's C API: the stiffness that the bundle gives at each measured spot.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <palpate/palpate.h>
#include <palpate/palpate_queries.h>
#include "programs/fit/measurements.h"

namespace palpate::fit {

// sticking: a disc that does not slip, pressed along the organ's inward normal. sliding: the same disc without friction. plate: all
// touchable nodes at once, without friction; sticking_plate: the same, held by the plate.
enum class Press { sticking, sliding, plate, sticking_plate };
inline bool is_plate(Press press) {
  return press == Press::plate || press == Press::sticking_plate;
}

struct Region {
  std::string name;
  double young = 0, poisson = 0;  // Pa, 1
};

// The disc of a flat end that is held at a spot (of a ball its middle and the normal alone): u of its row is the mean displacement of nodes with these weights, and what the row has
// beside u under a force is the compliance times that force.
struct HeldDisc {
  std::array<double, 3> at{}, outward{};  // m, its middle on the surface; the surface's normal
  std::vector<std::int32_t> nodes;
  std::vector<double> weights;   // their sum is 1
  double compliance[3][3] = {};  // m/N
};

// The body that a bundle was made of.
struct BundleBody {
  const double* nodes = nullptr;             // [node_count][3] m
  const std::int32_t* tetrahedra = nullptr;  // [tetrahedron_count][4]
  const std::int32_t* region = nullptr;      // [tetrahedron_count]
  const std::uint8_t* fixed = nullptr;       // [node_count][3]
  std::int32_t node_count = 0, tetrahedron_count = 0, surface_count = 0;
  const std::vector<std::int32_t>* support_nodes = nullptr;  // as in BundleFields
  const std::vector<double>* support_stiffness = nullptr;
  std::string element;  // "p1", "p1-anp", "p2-p0"
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

  // The arrays stay with the bundle.
  BundleBody body() const;
  std::vector<std::int32_t> touchable() const;
  // Errors: as stiffness().
  std::vector<HeldDisc> hold_discs(const std::vector<Spot>& spots, const std::filesystem::path& source);
  // The axis that the touchable part of the surface looks along; sign: outward. Errors: InputError where there is none.
  int plate_axis(double& sign) const;

 private:
  struct Close {
    void operator()(palpate_bundle* bundle) const { palpate_bundle_close(bundle); }
  };
  void read_provenance(const std::string& text);
  double plane_modulus(std::int32_t triangle) const;
  palpate_surface_hit hit_of(palpate_scene* scene, const Spot& spot, const std::string& line) const;
  std::vector<double> press_discs(const std::vector<Spot>& spots, Press press, const std::filesystem::path& source);
  double press_plate(Press press);

  std::filesystem::path file_;
  std::unique_ptr<palpate_bundle, Close> bundle_;
  std::vector<Region> regions_;
  std::vector<std::int32_t> region_of_;  // [tetrahedron]
  std::string element_;
  std::vector<std::int32_t> support_nodes_;
  std::vector<double> support_stiffness_;
  std::vector<std::string> warnings_;
  std::map<std::string, std::string> soft_supports_;
  double plate_height_ = 0, linear_limit_ = 0;
};

}  // namespace palpate::fit
