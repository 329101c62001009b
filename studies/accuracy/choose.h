// The cheapest measured setting within limits, or what stands in the way.
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

// Settings that a user would have: the organ's own material, columns everywhere, the solver's own choice, one disc pressed;
// not f64, twice the bytes of f32 for nothing that can be felt.
bool can_be_chosen(const nlohmann::ordered_json& record);

// The one with the least `least` among those within all limits; of equals the smaller bundle. Null where there is none.
const nlohmann::ordered_json* cheapest(const std::vector<nlohmann::ordered_json>& points,
                                       const std::vector<Limit>& limits, const std::string& least);

// One line for each limit that alone keeps every setting out, or the nearest where several do.
std::string what_stands_in_the_way(const std::vector<nlohmann::ordered_json>& points, const std::vector<Limit>& limits);

// By how much the errors of meshes that are equally good differ; relative.
struct Scatter {
  double force = 0, field = 0;
};

// What to pick for three budgets: of the settings within a tenth, or within scatter, of the smallest force error that each
// affords, those so near the smallest field error among them; of these the one with the shortest precompute.
// [{budget, limits, pick: name or null, why_not}]
nlohmann::ordered_json picks(const std::vector<nlohmann::ordered_json>& points, const Scatter& scatter);

}  // namespace palpate::accuracy
