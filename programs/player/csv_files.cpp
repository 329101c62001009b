#include "programs/player/csv_files.h"

namespace palpate {
namespace {

constexpr double kInside = 1e-6;  // m: from which a vertex counts as inside the other organ

constexpr const char* kForces =
    "time_s,tool,x_m,y_m,z_m,force_x_N,force_y_N,force_z_N,raw_x_N,raw_y_N,raw_z_N,contacts,flags,flag_names,"
    "torque_x_Nm,torque_y_Nm,torque_z_Nm";
constexpr const char* kContacts =
    "tool,point,node,modified_x_m,modified_y_m,modified_z_m,force_x_N,force_y_N,force_z_N";
constexpr const char* kOrgans =
    "time_s,organ,force_x_N,force_y_N,force_z_N,pressed_x_N,pressed_y_N,pressed_z_N,near_tools,flags,flag_names,"
    "torque_x_Nm,torque_y_Nm,torque_z_Nm";
constexpr const char* kPairs =
    "time_s,organ,node,other_organ,triangle,x_m,y_m,z_m,normal_x,normal_y,normal_z,force_x_N,force_y_N,force_z_N,"
    "pressure_Pa,gap_m,overlap_m";

// state: a palpate_tool_state or a palpate_world_tool_state.
template <typename State>
void add_tool(CsvTable& file, double time, const std::string& name, const SceneConfig::Vector& position,
              const State& state) {
  file.row(time, name, position, state.force, state.force_raw, state.contact_count, FlagCells{state.flags},
           state.torque);
}

// first: the cells before the tool's.
template <typename... First>
void add_nodes(CsvTable& file, const SceneConfig& scene, const palpate_contacts& contacts, const First&... first) {
  const palpate_contact_node* nodes = palpate_contacts_node(&contacts, 0);
  const auto name = [&](const palpate_contact_node& node) {
    if (node.source == PALPATE_SOURCE_TOOL) return scene.tools[node.index].name;
    return std::string(node.source == PALPATE_SOURCE_NEEDLE     ? "needle"
                       : node.source == PALPATE_SOURCE_OBSTACLE ? "obstacle"
                       : node.source == PALPATE_SOURCE_BLADE    ? "blade"
                       : node.source == PALPATE_SOURCE_LIP      ? "lip"
                       : node.source == PALPATE_SOURCE_ORGAN    ? "organ"
                                                                : "link");
  };
  const auto number = [](const palpate_contact_node& node) {
    return node.source <= PALPATE_SOURCE_NEEDLE ? node.point : node.index;
  };
  for (int n = 0; n < contacts.node_count; ++n)
    file.row(first..., name(nodes[n]), number(nodes[n]), nodes[n].node, nodes[n].modified_displacement, nodes[n].force);
}

}  // namespace

CsvFiles::CsvFiles(const std::filesystem::path& folder, const SceneConfig& scene, const CsvStyle& style)
    : scene_(scene), forces_(style), contacts_(style), organs_(style), pairs_(style) {
  forces_.open(folder / "forces.csv", kForces);
  contacts_.open(folder / "contacts.csv", std::string(scene.organs.empty() ? "time_s," : "time_s,organ,") + kContacts);
  if (scene.organs.empty()) return;
  organs_.open(folder / "organs.csv", kOrgans);
  if (scene_.pairs > 0) pairs_.open(folder / "pairs.csv", kPairs);
}

void CsvFiles::write(const TouchRecord& touch) {
  for (int t = 0; t < touch.contacts.tool_count; ++t)
    add_tool(forces_, touch.time, scene_.tools[t].name, touch.positions[t], *palpate_contacts_tool(&touch.contacts, t));
  add_nodes(contacts_, scene_, touch.contacts, touch.time);
}

void CsvFiles::write(const WorldTouchRecord& touch) {
  const auto name = [&](std::int32_t organ) { return scene_.organs[static_cast<std::size_t>(organ)].name; };
  for (int t = 0; t < touch.contacts.tool_count; ++t)
    add_tool(forces_, touch.time, scene_.tools[t].name, touch.positions[t],
             *palpate_world_contacts_tool(&touch.contacts, t));
  for (int k = 0; k < touch.contacts.organ_count; ++k)
    add_nodes(contacts_, scene_, *palpate_world_contacts_organ(&touch.contacts, k), touch.time, name(k));
  for (int k = 0; k < touch.contacts.organ_count; ++k) {
    const palpate_world_organ_state& organ = *palpate_world_contacts_state(&touch.contacts, k);
    organs_.row(touch.time, name(k), organ.force, organ.pressed, organ.near_tools, FlagCells{organ.flags},
                organ.torque);
  }
  for (int p = 0; pairs_.is_open() && p < touch.contacts.pair_count; ++p) {
    const palpate_world_pair& pair = *palpate_world_contacts_pair(&touch.contacts, p);
    const bool presses = pair.force[0] != 0 || pair.force[1] != 0 || pair.force[2] != 0;
    if (!presses && pair.gap > -kInside) continue;
    pairs_.row(touch.time, name(pair.organ[0]), pair.node, name(pair.organ[1]), pair.triangle, pair.place, pair.normal,
               pair.force, pair.pressure, pair.gap, pair.overlap);
  }
}

void CsvFiles::close() {
  for (CsvTable* file : {&forces_, &contacts_, &organs_, &pairs_}) file->close();
}

}  // namespace palpate
