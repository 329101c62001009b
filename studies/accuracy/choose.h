// Finds the cheapest measured setting within limits, or says which limit rules every setting out.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace palpate::accuracy {

// A bound on one number of a point's record (results.h).
struct Limit {
  std::string field;   // "force_error"
  std::string option;  // "--force-error 2%", for sentences
  double most = 0;
};

// True for a setting that a user could bake: the organ's own material, columns at every touchable node, the default solver,
// measured with one pressed disc. Left out are f64, which takes twice the bytes of f32 where the force differs by less than 1e-4,
// and what shares the reference's mesh, element and scene: its distance from the reference is no error.
bool can_be_chosen(const nlohmann::ordered_json& record);

// Among the points within all limits, the one with the smallest value of the field `least`; a tie goes to the smaller
// bundle. Null if no point is within the limits.
const nlohmann::ordered_json* cheapest(const std::vector<nlohmann::ordered_json>& points,
                                       const std::vector<Limit>& limits, const std::string& least);

// Why no limit on an error can be judged against this point's reference: its own error, estimated, is above the limit or unknown. A
// sentence; empty: it can.
std::string beyond_the_reference(const nlohmann::ordered_json& point, const std::vector<Limit>& limits);

// Names each limit that rules out every setting although the other limits leave some. If there is no such limit, names
// the smallest measured value for each limit.
std::string what_stands_in_the_way(const std::vector<nlohmann::ordered_json>& points, const std::vector<Limit>& limits);

// The error of a deformation (linear, response, large) at a depth of the study's deep pushes: the worst site, by linear interpolation
// between depths. Nothing where no site was pushed so deep.
struct DeepError {
  double force, field;
};
std::optional<DeepError> deep_error(const nlohmann::ordered_json& study, const std::string& model, double depth_mm);

// Scatter of the errors of the reference meshes about their fitted order, relative: smaller differences mean nothing.
struct Scatter {
  double force = 0, field = 0;
};

// One setting for each of three budgets. Step 1: keep the settings whose force error is within a tenth, or within the
// scatter, of the smallest one in the budget. Step 2: the same with the field error. Step 3: take the shortest precompute.
// [{budget, limits, pick: name or null, why_not}]
nlohmann::ordered_json picks(const std::vector<nlohmann::ordered_json>& points, const Scatter& scatter);

}  // namespace palpate::accuracy
