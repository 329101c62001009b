// Measured points against the truth of their situation, and how far that truth itself may be off.
#pragma once

#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "bench/accuracy/measured.h"

namespace palpate::accuracy {

// Relative - of a tool's force, to the largest force in its exercise: one that hardly touches has none of its own - root
// mean square over tools or exercises, and the worst of them.
struct Difference {
  double force = 0, force_worst = 0, force_newtons = 0;  // newtons: the largest difference of a tool's force
  double field = 0, field_worst = 0, field_mm = 0;       // of the surface's displacement in the 2-norm; largest, mm
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Difference, force, force_worst, force_newtons, field, field_worst, field_mm)
Difference difference(const Observation& seen, const Observation& truth);

// Estimated error of the finest of three solutions by Richardson's extrapolation on meshes that are not nested: the order
// is the one observed (Celik et al. 2008, J. Fluids Eng. 130, 078001, eq. 3), kept between 0.5 and 2, and the estimate is
// 1.25 e21 / (r21^p - 1). With two solutions the order is taken as 1 and the factor as 3; with one, nothing is known: NaN.
// e21, e32: relative differences of neighbours; r: ratios of their spacings, above 1.
struct Extrapolated {
  double error, order;
};
Extrapolated richardson(double e21, double r21, double e32, double r32);
Extrapolated richardson(double e21, double r21);

struct JudgedPoint {
  const MeasuredPoint* point;
  std::set<std::string> axes;
  bool is_reference = false;
  Difference error;              // against the reference of its situation
  Difference added;              // against the same mesh, element and scene with nothing saved in solving or storing
  double reference_force_error;  // of that reference, by extrapolation
  double reference_field_error;
  double force_newtons = 0;  // mean length of the tools' forces
};

struct PlannedMeasurement {
  const MeasuredPoint* point;
  std::set<std::string> axes;
};
// Points whose situation has no reference are left out.
std::vector<JudgedPoint> judge(const std::vector<PlannedMeasurement>& points);

}  // namespace palpate::accuracy
