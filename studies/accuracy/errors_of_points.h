// Errors of measured points against the reference of their situation, and the estimated error of that reference.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "studies/accuracy/measured.h"

namespace palpate::accuracy {

// Relative errors: root mean square over tools (force) or exercises (field), and the worst. A tool's force error is
// relative to the largest force of its exercise, because a tool that hardly touches has almost no force to divide by.
struct Difference {
  double force = 0, force_worst = 0, force_newtons = 0;  // newtons: largest error of a tool's force, N
  double field = 0, field_worst = 0, field_mm = 0;       // displacement of the surface, 2-norm; mm: largest error
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Difference, force, force_worst, force_newtons, field, field_worst, field_mm)
Difference difference(const Observation& seen, const Observation& truth);

// A coarser mesh: ratio of its edge length to that of the finest mesh (above 1), and the relative distance between the two
// answers.
struct DistanceToFinest {
  double ratio, distance;
};

// Estimated error of the finest of several solutions: Richardson's extrapolation in the least-squares form for meshes that
// are not nested (Eca and Hoekstra 2014, J. Comput. Phys. 262, 104-130). c (ratio^p - 1) is fitted to all distances with
// p in 0.5 .. 2. The estimate is c times a factor of safety plus the scatter about the fit. The factor is 1.25. If the
// fitted p lies on a bound, or there is only one distance, p = 1 and the factor is 3 (Roache's grid convergence index).
// Without any distance the estimate is NaN.
struct Extrapolated {
  double error = NAN, order = NAN, scatter = NAN;
  bool order_observed = false;
};
Extrapolated extrapolate(std::span<const DistanceToFinest> distances);

// A test of the estimate: computed without the finest mesh, and compared with the distance to the finest mesh.
struct EstimateCheck {
  int vertices = 0;  // of the second finest mesh; 0: too few meshes for the test
  double estimated_force = NAN, found_force = NAN, estimated_field = NAN, found_field = NAN;
};

// Another test: the least and the largest estimate with one of the coarser meshes left out.
struct EstimateRange {
  double least_force = NAN, most_force = NAN, least_field = NAN, most_field = NAN;  // NAN: too few meshes for the test
};

// The finest mesh of the element that is not the reference's: its answer has other errors, so its distance checks both estimates.
struct OtherReference {
  const MeasuredPoint* point = nullptr;  // nullptr: the study has none
  Extrapolated force, field;
  Difference distance;  // from the reference
};

struct TruthError {
  Extrapolated force, field;
  EstimateCheck check;
  EstimateRange range;
  OtherReference other;
};

struct JudgedPoint {
  const MeasuredPoint* point = nullptr;
  std::set<std::string> axes;
  bool is_reference = false;
  bool shares_reference = false;  // its mesh, element and scene: its error is the reference's own, not the distance
  Difference error;               // against the reference of its situation
  Difference added;               // against the same mesh, element and scene, solved by the factor and stored as f32
  TruthError reference_error;     // of that reference, estimated by extrapolation
  double force_newtons = 0;       // mean length of the tools' forces
};

struct PlannedMeasurement {
  const MeasuredPoint* point;
  std::set<std::string> axes;
};
// The reference of a situation, among the points of the axis "reference": p2-p0 on its finest mesh; or p1-anp on its finest mesh,
// where this mesh is finer and the estimated errors of force and field are both smaller, or known where the others are not. Leaves
// out the points whose situation has no reference.
std::vector<JudgedPoint> judge(const std::vector<PlannedMeasurement>& points);

}  // namespace palpate::accuracy
