#include "studies/accuracy/choose.h"

#include <fmt/format.h>

#include <algorithm>

namespace palpate::accuracy {
namespace {

using Record = nlohmann::ordered_json;

// An error that is smaller by less than a tenth does not justify a longer precompute.
constexpr double kAsGood = 1.1;

bool within(const Record& record, const Limit& limit) {
  return record.at(limit.field).get<double>() <= limit.most;
}

bool within_all(const Record& record, const std::vector<Limit>& limits, const Limit* but = nullptr) {
  return can_be_chosen(record) && std::all_of(limits.begin(), limits.end(), [&](const Limit& limit) {
           return &limit == but || within(record, limit);
         });
}

const Record* least_of(const std::vector<Record>& points, const std::string& field, auto&& accept) {
  const Record* best = nullptr;
  const auto cost = [&](const Record& r) {
    return std::pair(r.at(field).get<double>(), r.at("bundle_MB").get<double>());
  };
  for (const Record& point : points)
    if (accept(point) && (!best || cost(point) < cost(*best))) best = &point;
  return best;
}

std::string shown(const std::string& field, double value) {
  return field.find("error") != std::string::npos ? fmt::format("{:.2g} %", 100 * value) : fmt::format("{:.3g}", value);
}

}  // namespace

bool can_be_chosen(const Record& r) {
  return r.at("own_material") == true && r.at("columns_everywhere") == true && r.at("exercise") == "press" &&
         r.at("solver") == "auto" && r.at("law") == "sticking" && r.at("contacts") == 1 && r.at("storage") != "f64" &&
         r.at("is_reference") == false && !r.value("shares_reference", false);
}

const Record* cheapest(const std::vector<Record>& points, const std::vector<Limit>& limits, const std::string& least) {
  return least_of(points, least, [&](const Record& r) { return within_all(r, limits); });
}

std::string beyond_the_reference(const Record& point, const std::vector<Limit>& limits) {
  for (const Limit& limit : limits) {
    const std::string own = "reference_" + limit.field;
    if (!point.contains(own)) continue;
    const bool known = point.at(own).is_number();
    if (known && point.at(own).get<double>() <= limit.most) continue;
    return fmt::format(
        "{}: the study cannot tell, since its reference is itself off by {}; study finer meshes (--resolutions, "
        "--memory, --most-seconds), or ask for {}",
        limit.option, known ? "about " + shown(limit.field, point.at(own)) : "an unknown amount, for want of meshes",
        known ? "less" : "no limit of an error");
  }
  return {};
}

std::string what_stands_in_the_way(const std::vector<Record>& points, const std::vector<Limit>& limits) {
  std::string text;
  for (const Limit& limit : limits)
    if (const Record* best =
            least_of(points, limit.field, [&](const Record& r) { return within_all(r, limits, &limit); });
        best && !within(*best, limit))
      text +=
          fmt::format("{}{} stands in the way: with the other limits the least is {} ({})", text.empty() ? "" : "; ",
                      limit.option, shown(limit.field, best->at(limit.field)), best->at("name").get<std::string>());
  if (!text.empty()) return text;
  for (const Limit& limit : limits)
    if (const Record* best = least_of(points, limit.field, can_be_chosen))
      text += fmt::format("{}{}: the least measured is {} ({})", text.empty() ? "no single limit alone: " : "; ",
                          limit.option, shown(limit.field, best->at(limit.field)), best->at("name").get<std::string>());
  return text.empty() ? "nothing was measured that could be chosen" : text;
}

namespace {

// The error at a depth of one push's steps; the error is zero at no depth. Nothing below the deepest step.
std::optional<double> error_at(const Record& steps, const char* error, double depth_mm) {
  double depth = 0, before = 0;
  for (const auto& step : steps) {
    const double here = step.at(error), at = step.at("depth_mm");
    if (depth_mm <= at * (1 + 1e-9)) return before + (here - before) * (depth_mm - depth) / (at - depth);
    depth = at, before = here;
  }
  return {};
}

}  // namespace

std::optional<DeepError> deep_error(const Record& study, const std::string& model, double depth_mm) {
  std::optional<DeepError> worst;
  for (const auto& push : study.value("large_strain", Record::array())) {
    const auto models = push.value("models", Record::object());
    if (!models.contains(model)) continue;
    const auto& steps = models.at(model).at("steps");
    const auto force = error_at(steps, "force_error", depth_mm), field = error_at(steps, "field_error", depth_mm);
    if (!force || !field) continue;
    if (!worst) worst = DeepError{0, 0};
    worst->force = std::max(worst->force, *force), worst->field = std::max(worst->field, *field);
  }
  return worst;
}

nlohmann::ordered_json picks(const std::vector<Record>& points, const Scatter& scatter) {
  const std::vector<std::pair<std::string, std::vector<Limit>>> budgets = {
      {"small: a download, a browser, a small computer",
       {{"bundle_MB", "bundle at most 5 MB", 5}, {"touch_us", "touch at most 20 us", 20}}},
      {"medium: a laptop beside a renderer",
       {{"bundle_MB", "bundle at most 50 MB", 50}, {"touch_us", "touch at most 50 us", 50}}},
      {"large: a workstation",
       {{"bundle_MB", "bundle at most 1000 MB", 1000}, {"touch_us", "touch at most 200 us", 200}}}};
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for (const auto& [budget, limits] : budgets) {
    nlohmann::ordered_json pick = {{"budget", budget}, {"limits", nlohmann::ordered_json::array()}, {"pick", nullptr}};
    for (const Limit& limit : limits) pick["limits"].push_back(limit.option);
    if (cheapest(points, limits, "force_error")) {
      auto as_good = limits;
      for (const auto& [error, scattered] : {std::pair("force_error", scatter.force), {"field_error", scatter.field}}) {
        const double least = cheapest(points, as_good, error)->at(error);
        as_good.push_back({error, "", std::max(kAsGood * least, least + scattered)});
      }
      pick["pick"] = cheapest(points, as_good, "precompute_s")->at("name");
    } else {
      pick["why_not"] = what_stands_in_the_way(points, limits);
    }
    all.push_back(pick);
  }
  return all;
}

}  // namespace palpate::accuracy
