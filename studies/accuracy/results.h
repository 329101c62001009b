// The study's result as flat records, one for each point: accuracy.json and accuracy.csv, which the report and
// palpate-accuracy choose read.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "studies/accuracy/errors_of_points.h"

namespace palpate::accuracy {

// JSON has no NaN and no infinity: as members of an object they become null.
nlohmann::ordered_json with_nulls(nlohmann::ordered_json object);

// Every setting, error and cost of a point. A name ends in the unit: force_error (relative), field_error_mm,
// touch_us, touch_us_99, shape_us, precompute_s, precompute_GB, bundle_MB, open_ms, ... own_poisson: the organ's, for settings
// that do not change it.
nlohmann::ordered_json record_of(const JudgedPoint& judged, double own_poisson);

// Unknown values (NaN) become null.
nlohmann::ordered_json json_of(const Extrapolated& estimate);
nlohmann::ordered_json json_of(const EstimateCheck& check);
nlohmann::ordered_json json_of(const EstimateRange& range);
// null where there is none.
nlohmann::ordered_json json_of(const OtherReference& other);

// Processor, cores, memory and load of this machine.
nlohmann::ordered_json machine_json();

// NAME.json and NAME.csv in the folder, atomically. study: the other keys beside "points". Errors: OperationError.
void write_results(const std::filesystem::path& folder, const std::string& name, nlohmann::ordered_json study,
                   const std::vector<nlohmann::ordered_json>& points);

}  // namespace palpate::accuracy
