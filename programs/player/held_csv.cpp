#include "programs/player/held_csv.h"

#include <fmt/format.h>

#include <iterator>

#include "formats/errors.h"
#include "programs/player/csv_files.h"

namespace palpate {

const char* word_of(palpate_link_condition condition) {
  static constexpr const char* words[] = {"slack", "taut", "broken"};
  return words[condition];
}

const char* word_of(palpate_grasp_condition condition) {
  static constexpr const char* words[] = {"open", "holds", "slips", "let go"};
  return words[condition];
}

HeldCsvFiles::HeldCsvFiles(const std::filesystem::path& folder, const Player& player)
    : player_(player), folder_(folder) {
  if (!player.held().links().empty())
    *(links_ = std::ofstream(folder / "links.csv"))
        << "time_s,link,stretch,condition,tension_N,length_m,rest_length_m,force_x_N,force_y_N,force_z_N,"
           "first_x_m,first_y_m,first_z_m,second_x_m,second_y_m,second_z_m\n";
  if (player.held().has_grasps())
    *(grasps_ = std::ofstream(folder / "grasps.csv")) << "time_s,tool,condition,force_x_N,force_y_N,force_z_N,torque_x_"
                                                         "Nm,torque_y_Nm,torque_z_Nm,place_x_m,place_y_m,"
                                                         "place_z_m,slipped_m,friction_limit_N\n";
}

void HeldCsvFiles::write(const TouchRecord& touch) {
  fmt::memory_buffer rows;
  const HeldTissue& held = player_.held();
  for (std::size_t s = 0; links_ && s < held.stretches().size(); ++s) {
    const palpate_link_state* link = palpate_scene_link_state(player_.runtime_scene(), static_cast<std::int32_t>(s));
    if (!link) continue;
    fmt::format_to(std::back_inserter(rows), "{},{},{},{},{},{},{},{},{},{}\n", touch.time,
                   quoted(player_.scene().links[held.stretches()[s].link].name), held.stretches()[s].part + 1,
                   word_of(link->condition), link->tension, link->length, link->rest_length,
                   fmt::join(link->force, ","), fmt::join(link->ends[0], ","), fmt::join(link->ends[1], ","));
  }
  if (links_) links_->write(rows.data(), static_cast<std::streamsize>(rows.size()));
  rows.clear();
  for (std::size_t t = 0; grasps_ && t < player_.scene().tools.size(); ++t) {
    const palpate_grasp_state* grasp = palpate_scene_grasp_state(player_.runtime_scene(), static_cast<std::int32_t>(t));
    if (!held.grasp(t) || !grasp) continue;
    fmt::format_to(std::back_inserter(rows), "{},{},{},{},{},{},{},{}\n", touch.time,
                   quoted(player_.scene().tools[t].name), word_of(grasp->condition), fmt::join(grasp->force, ","),
                   fmt::join(grasp->torque, ","), fmt::join(grasp->place, ","), grasp->slipped, grasp->friction_limit);
  }
  if (grasps_) grasps_->write(rows.data(), static_cast<std::streamsize>(rows.size()));
}

void HeldCsvFiles::close() {
  for (auto* file : {&links_, &grasps_}) {
    if (!*file) continue;
    (*file)->close();
    if (!**file) throw OperationError(fmt::format("{}: cannot write the CSV files", folder_.string()));
  }
}

}  // namespace palpate
