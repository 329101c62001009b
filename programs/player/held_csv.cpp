#include "programs/player/held_csv.h"

#include "programs/player/needle_peak.h"

namespace palpate {

const char* word_of(palpate_grasp_condition condition) {
  static constexpr const char* words[] = {"open", "holds", "slips", "let go"};
  return words[condition];
}

namespace {

std::vector<const PlayedOrgan*> organs_of(const WorldPlayer& player) {
  std::vector<const PlayedOrgan*> organs;
  for (std::size_t k = 0; k < player.organ_count(); ++k) organs.push_back(&player.organ(k));
  return organs;
}

std::vector<std::string> names_of(const SceneConfig& scene) {
  std::vector<std::string> names;
  for (const SceneConfig::Organ& organ : scene.organs) names.push_back(organ.name);
  return names;
}

}  // namespace

HeldCsvFiles::HeldCsvFiles(const std::filesystem::path& folder, const CsvStyle& style, const WorldPlayer& player)
    : HeldCsvFiles(folder, style, organs_of(player), names_of(player.scene())) {
  world_ = &player;
  if (!player.links().empty()) open_links();
}

void HeldCsvFiles::open(CsvTable& file, const char* name, const char* heading) {
  if (!file.is_open()) file.open(folder_ / name, std::string(names_.empty() ? "time_s," : "time_s,organ,") + heading);
}

void HeldCsvFiles::open_links() {
  open(links_, "links.csv",
       "link,stretch,condition,tension_N,length_m,rest_length_m,force_x_N,force_y_N,force_z_N,"
       "first_x_m,first_y_m,first_z_m,second_x_m,second_y_m,second_z_m");
}

HeldCsvFiles::HeldCsvFiles(const std::filesystem::path& folder, const CsvStyle& style,
                           std::vector<const PlayedOrgan*> organs, std::vector<std::string> names)
    : organs_(std::move(organs)),
      names_(std::move(names)),
      folder_(folder),
      links_(style),
      grasps_(style),
      needles_(style),
      loads_(style),
      obstacles_(style),
      blades_(style),
      cut_(style),
      events_(style),
      histories_(organs_.size()) {
  for (const PlayedOrgan* each : organs_) {
    if (!each->held().links().empty()) open_links();
    if (each->held().has_grasps())
      open(grasps_, "grasps.csv",
           "tool,condition,force_x_N,force_y_N,force_z_N,torque_x_Nm,torque_y_Nm,torque_z_Nm,place_x_m,place_y_m,"
           "place_z_m,slipped_m,friction_limit_N");
    if (each->has_needles())
      open(needles_, "needles.csv",
           "tool,condition,depth_m,force_x_N,force_y_N,force_z_N,torque_x_Nm,torque_y_Nm,torque_z_Nm,tip_force_N,"
           "shaft_force_N,places,slipping,rest_x_m,rest_y_m,rest_z_m");
    if (each->loads().any())
      open(loads_, "loads.csv",
           "load,force_x_N,force_y_N,force_z_N,place_x_m,place_y_m,place_z_m,displacement_x_m,displacement_y_m,"
           "displacement_z_m,area_m2");
    if (each->obstacles().any())
      open(obstacles_, "obstacles.csv",
           "obstacle,force_x_N,force_y_N,force_z_N,torque_x_Nm,torque_y_Nm,torque_z_Nm,x_m,y_m,z_m,nodes,slipping,"
           "deepest_m");
    if (!each->is_cut()) continue;
    if (each->cuts().feels())
      open(blades_, "blades.csv",
           "blade,force_x_N,force_y_N,force_z_N,torque_x_Nm,torque_y_Nm,torque_z_Nm,work_J,friction_work_J,area_m2,in_"
           "tissue,cuts");
    open(cut_, "cut.csv", "faces,area_m2,nodes,removed,pieces,waiting,left,rank,is_full,rebased");
    open(events_, "events.csv", "event,pieces");
  }
}

void HeldCsvFiles::add_link(double time, const std::string& organ, const std::string& name, int part,
                            const palpate_link_state& link) {
  row(links_, time, organ, name, part + 1, std::string(word_of(link.condition)), link.tension, link.length,
      link.rest_length, link.force, link.ends[0], link.ends[1]);
}

void HeldCsvFiles::add_links(double time, std::size_t organ) {
  const PlayedOrgan& of = *organs_[organ];
  const auto& stretches = of.held().stretches();
  for (std::size_t s = 0; s < stretches.size(); ++s) {
    const palpate_link_state* link = palpate_scene_link_state(of.runtime_scene(), static_cast<std::int32_t>(s));
    if (link) add_link(time, name_of(organ), of.scene().links[stretches[s].link].name, stretches[s].part, *link);
  }
}

void HeldCsvFiles::add_links_between_organs(double time) {
  const auto& stretches = world_->links().stretches();
  for (std::size_t s = 0; s < stretches.size(); ++s)
    if (const palpate_link_state* link =
            palpate_world_link_state(world_->runtime_world(), static_cast<std::int32_t>(s)))
      add_link(time, stretches[s].organs, world_->scene().links[stretches[s].link].name, stretches[s].part, *link);
}

void HeldCsvFiles::add_grasps(double time, std::size_t organ) {
  const PlayedOrgan& of = *organs_[organ];
  for (std::size_t t = 0; t < of.scene().tools.size(); ++t) {
    const palpate_grasp_state* grasp = palpate_scene_grasp_state(of.runtime_scene(), static_cast<std::int32_t>(t));
    if (!of.held().grasp(t) || !grasp) continue;
    row(grasps_, time, name_of(organ), of.scene().tools[t].name, std::string(word_of(grasp->condition)), grasp->force,
        grasp->torque, grasp->place, grasp->slipped, grasp->friction_limit);
  }
}

void HeldCsvFiles::add_needles(double time, std::size_t organ) {
  const PlayedOrgan& of = *organs_[organ];
  for (std::size_t t = 0; t < of.scene().tools.size(); ++t) {
    const palpate_needle_state* needle = palpate_scene_needle_state(of.runtime_scene(), static_cast<std::int32_t>(t));
    if (!of.needles().of(t) || !needle) continue;
    row(needles_, time, name_of(organ), of.scene().tools[t].name, std::string(word_of(needle->condition)),
        needle->depth, needle->force, needle->torque, needle->tip_force, needle->shaft_force, needle->places,
        needle->slipping, needle->tip_at_rest);
  }
}

void HeldCsvFiles::add_loads(double time, std::size_t organ) {
  const PlayedOrgan& of = *organs_[organ];
  for (std::size_t i = 0; i < of.loads().count(); ++i)
    if (const palpate_load_state* load = OrganLoads::state(of.runtime_scene(), i))
      row(loads_, time, name_of(organ), of.loads().name_of(i), load->force, load->place, load->displacement,
          load->area);
}

void HeldCsvFiles::add_obstacles(double time, std::size_t organ) {
  const PlayedOrgan& of = *organs_[organ];
  for (std::size_t i = 0; i < of.obstacles().count(); ++i)
    if (const palpate_obstacle_state* obstacle = OrganObstacles::state(of.runtime_scene(), i))
      row(obstacles_, time, name_of(organ), of.obstacles().of(i).name, obstacle->force, obstacle->torque,
          obstacle->position, obstacle->nodes, obstacle->slips, obstacle->deepest);
}

void HeldCsvFiles::add_blades(double time, std::size_t organ) {
  const PlayedOrgan& of = *organs_[organ];
  for (std::size_t i = 0; i < of.cuts().blade_count(); ++i) {
    const palpate_blade_state* const blade = OrganCuts::blade_state(of.runtime_scene(), i);
    if (of.cuts().blade(i).toughness > 0 && blade)
      row(blades_, time, name_of(organ), of.cuts().blade(i).name, blade->force, blade->torque, blade->work,
          blade->friction_work, blade->area, blade->in_tissue, blade->cuts);
  }
}

void HeldCsvFiles::add_cut_row(double time, std::size_t organ) {
  const palpate_cut_state& cut = histories_[organ].state();
  row(cut_, time, name_of(organ), cut.faces, cut.area, cut.nodes, cut.removed, cut.pieces, cut.waiting, cut.left,
      cut.rank, cut.is_full, cut.rebased);
}

void HeldCsvFiles::add_cut(double time, std::size_t organ) {
  const palpate_cut_state* const state = OrganCuts::state(organs_[organ]->runtime_scene());
  CutHistory& history = histories_[organ];
  const std::size_t known = history.events().size();
  if (!state || !history.add(*state, time)) return;
  add_cut_row(time, organ);
  for (std::size_t i = known; i < history.events().size(); ++i)
    row(events_, time, name_of(organ), std::string(history.events()[i].what), history.events()[i].pieces);
}

void HeldCsvFiles::write(double time) {
  time_ = time;
  for (std::size_t k = 0; k < organs_.size(); ++k) {
    if (links_.is_open()) add_links(time, k);
    if (grasps_.is_open()) add_grasps(time, k);
    if (needles_.is_open()) add_needles(time, k);
    if (loads_.is_open()) add_loads(time, k);
    if (obstacles_.is_open()) add_obstacles(time, k);
    if (blades_.is_open()) add_blades(time, k);
    if (cut_.is_open()) add_cut(time, k);
  }
  if (world_ && !world_->links().empty()) add_links_between_organs(time);
}

void HeldCsvFiles::close() {
  for (std::size_t k = 0; k < histories_.size(); ++k)
    if (histories_[k].time() >= 0 && histories_[k].time() < time_) add_cut_row(time_, k);
  for (CsvTable* file : {&links_, &grasps_, &needles_, &loads_, &obstacles_, &blades_, &cut_, &events_}) file->close();
}

}  // namespace palpate
