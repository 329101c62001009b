#include "studies/accuracy/measured.h"

#include <fmt/format.h>

#include <fstream>

#include "formats/atomic_file.h"
#include "formats/errors.h"

namespace palpate::accuracy {

MeasuredPoints::MeasuredPoints(std::filesystem::path folder) : folder_(std::move(folder)) {
  std::filesystem::create_directories(folder_);
}

std::optional<MeasuredPoint> MeasuredPoints::find(const std::string& key) const {
  const auto file = folder_ / (key + ".json");
  std::ifstream in(file);
  if (!in) return {};
  try {
    const auto json = nlohmann::json::parse(in);
    return MeasuredPoint{json.at("setting").get<Setting>(), json.at("cost"), json.at("seen").get<Observation>()};
  } catch (const nlohmann::json::exception& error) {
    throw InputError(fmt::format("{}: expected a measured point, found {}; remove it to have it measured again",
                                 file.string(), error.what()));
  }
}

void MeasuredPoints::add(const std::string& key, const MeasuredPoint& point) const {
  const nlohmann::json json = {{"setting", point.setting}, {"cost", point.cost}, {"seen", point.seen}};
  write_text_atomically(folder_ / (key + ".json"), json.dump() + "\n");
}

}  // namespace palpate::accuracy
