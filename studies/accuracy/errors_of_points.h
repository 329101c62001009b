// Measured points against the truth of their situation, and how far that truth itself may be off.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "studies/accuracy/measured.h"

namespace palpate::accuracy {

// Relative - of a tool's force, to the largest force in its exercise: one that hardly touches has none of its own - root
// mean square over tools or exercises, and the worst of them.
struct Difference {
  double force = 0, force_worst = 0, force_newtons = 0;  // newtons: the largest difference of a tool's force
  double field = 0, field_worst = 0, field_mm = 0;       // of the surface's displacement in the 2-norm; largest, mm
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Difference, force, force_worst, force_newtons, field, field_worst, field_mm)
Difference difference(const Observation& seen, const Observation& truth);

// A coarser mesh: its spacing over the finest one's, above 1, and how far its answer is from the finest one's, relative.
struct DistanceToFinest {
  double ratio, distance;
};

// Estimated error of the finest of several solutions, by Richardson's extrapolation in the least-squares form that meshes
// which are not nested need (Eca and Hoekstra 2014, J. Comput. Phys. 262, 104-130): c (ratio^p - 1) is fitted to all
// distances, p between 0.5 and 2; the finest one's own error is c, to which a factor of safety and the scatter about the
// fit are added. The factor is 1.25 where p was observed; where it lies on a bound or there is one distance, p is taken
// as 1 and the factor as 3 (Roache's grid convergence index). Without a distance nothing is known: NaN.
struct Extrapolated {
  double error = NAN, order = NAN, scatter = NAN;
  bool order_observed = false;
};
Extrapolated extrapolate(std::span<const DistanceToFinest> distances);

// The estimate put to the test: what it would have been without the finest mesh, against what that mesh then showed.
struct EstimateCheck {
  int vertices = 0;  // of the finest but one; 0: too few meshes to say
  double estimated_force = NAN, found_force = NAN, estimated_field = NAN, found_field = NAN;
};

struct TruthError {
  Extrapolated force, field;
  EstimateCheck check;
};

struct JudgedPoint {
  const MeasuredPoint* point;
  std::set<std::string> axes;
  bool is_reference = false;
  Difference error;            // against the reference of its situation
  Difference added;            // against the same mesh, element and scene with nothing saved in solving or storing
  TruthError reference_error;  // of that reference, by extrapolation
  double force_newtons = 0;    // mean length of the tools' forces
};

struct PlannedMeasurement {
  const MeasuredPoint* point;
  std::set<std::string> axes;
};
// Points whose situation has no reference are left out.
std::vector<JudgedPoint> judge(const std::vector<PlannedMeasurement>& points);

}  // namespace palpate::accuracy
