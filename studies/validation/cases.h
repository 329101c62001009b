// The cases of palpate-validation: each solves a problem with a known solution on several meshes and compares the error and
// its order of convergence with theory.
#pragma once

#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "formats/organ_config.h"

namespace palpate::validation {

// One element and Poisson's ratio on meshes of increasing fineness. A level is the number of cells along an edge, so that
// the cell size h is proportional to 1 / level.
struct Variant {
  Element element;
  double poisson;
  std::vector<int> levels;
};

struct Quantity {
  std::string name;
  double value, exact;  // NaN if only the error is known
  double error;         // relative, not negative
};

// Names that several cases share. A case's `expect` chooses by name.
inline constexpr const char *kForce = "force, N", *kDisplacement = "displacement, L2", *kGradient = "gradient, L2";

// A quantity with a known exact value, and one of which only the error is known.
inline Quantity compared(const std::string& name, double value, double exact) {
  return {name, value, exact, std::abs(value / exact - 1)};
}
inline Quantity error_alone(const std::string& name, double error) {
  constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  return {name, unknown, unknown, error};
}

// The result on one mesh. Processor seconds of one thread.
struct Measured {
  std::size_t vertices = 0, unknowns = 0;
  double assemble_seconds = 0, solve_seconds = 0;
  std::vector<Quantity> quantities;
};

// What theory promises for the error of a quantity: at most `bound` on the finest mesh (NaN: no bound), and an order of
// convergence between least and most, with a tolerance of 0.15. order is empty if theory gives none.
struct Expectation {
  double bound = std::numeric_limits<double>::quiet_NaN();
  struct Order {
    double least, most;
  };
  std::optional<Order> order = {};
  // Theory's error is h^order ln(1 / h)^logarithms. The logarithm is divided out before the order is judged.
  double logarithms = 0;
  bool locks = false;  // the element is known to lock here: the error is shown but not judged
};

struct Case {
  std::string id, title, closed_form, source;
  std::string theory;  // the source of the expected orders
  std::vector<Variant> variants;
  std::function<Measured(const Variant&, int level)> measure;
  std::function<Expectation(const std::string& quantity, const Variant&)> expect;
};

// For cases that run the installed programs: the programs' folder, and a folder for temporary files.
struct Workshop {
  std::filesystem::path bin, scratch;
};

// In the order of the report. A PetscSession must be alive while a case is measured.
std::vector<Case> all_cases(const Workshop& workshop);

// ---- the single cases ----

Case patch_test();
Case rigid_motion();
Case manufactured(double pressure);  // see Manufactured
Case thick_sphere();
Case point_force();
Case flat_punch_even();
Case flat_punch_squared();
Case hertz_contact();
Case equal_spheres(const Workshop& workshop);
Case unequal_spheres(const Workshop& workshop);
Case sphere_on_block(const Workshop& workshop);
Case two_shells(const Workshop& workshop);
Case ironing(const Workshop& workshop);
Case cantilever();
Case elliptic_plate_le10();
Case cook_linear();
Case pressed_cylinder();
Case superposition(const Workshop& workshop);
Case stretched_bar();
Case sheared_block();
Case twisted_cylinder();
Case elastica();
Case cook_large();

}  // namespace palpate::validation
