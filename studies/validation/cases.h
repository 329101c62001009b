// The closed-form cases: what is solved, on which meshes, what is asked of the answer and what theory promises.
#pragma once

#include <filesystem>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "formats/organ_config.h"

namespace palpate::validation {

// One element and Poisson's ratio, on meshes of increasing fineness: cells along an edge, so that h goes with 1 / level.
struct Variant {
  Element element;
  double poisson;
  std::vector<int> levels;
};

struct Quantity {
  std::string name;
  double value, exact;  // NaN where the error alone is known
  double error;         // relative, not negative
};

// One mesh solved. Seconds of the processor, one thread.
struct Measured {
  std::size_t vertices = 0, unknowns = 0;
  double assemble_seconds = 0, solve_seconds = 0;
  std::vector<Quantity> quantities;
};

// What the error of a quantity has to be: below the bound on the finest mesh (NaN: no bound), and falling with an order
// between least and most, to 0.15; no order where theory has none.
struct Expectation {
  double bound = std::numeric_limits<double>::quiet_NaN();
  struct Order {
    double least, most;
  };
  std::optional<Order> order = {};
  double logarithms = 0;  // theory's error is h^order ln(1 / h)^logarithms: what is judged is the order of the rest
  bool locks = false;     // shown, not judged: the element is known to fail there
};

struct Case {
  std::string id, title, closed_form, source;
  std::string theory;  // where its orders come from
  std::vector<Variant> variants;
  std::function<Measured(const Variant&, int level)> measure;
  std::function<Expectation(const std::string& quantity, const Variant&)> expect;
};

// Where the programs are, and a folder for files that are removed again: for what is measured through them.
struct Workshop {
  std::filesystem::path bin, scratch;
};

// In the order of the report. A PetscSession must be alive where they are measured.
std::vector<Case> all_cases(const Workshop& workshop);

// ---- one by one ----

Case patch_test();
Case rigid_motion();
Case manufactured(double pressure);  // see Manufactured
Case thick_sphere();
Case point_force();
Case flat_punch_even();
Case flat_punch_squared();
Case hertz_contact();
Case cantilever();
Case elliptic_plate_le10();
Case pressed_cylinder();
Case superposition(const Workshop& workshop);

}  // namespace palpate::validation
