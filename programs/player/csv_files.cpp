#include "programs/player/csv_files.h"

#include <fmt/ostream.h>
#include <fmt/ranges.h>

#include "formats/errors.h"

namespace palpate {
namespace {

constexpr double kInside = 1e-6;  // m: from which a vertex counts as inside the other organ

constexpr const char* kForces =
    "time_s,tool,x_m,y_m,z_m,force_x_N,force_y_N,force_z_N,raw_x_N,raw_y_N,raw_z_N,contacts,flags,torque_x_Nm,"
    "torque_y_Nm,torque_z_Nm\n";
constexpr const char* kContacts =
    "tool,point,node,modified_x_m,modified_y_m,modified_z_m,force_x_N,force_y_N,force_z_N\n";

// state: a palpate_tool_state or a palpate_world_tool_state.
template <typename State>
void add_tool(std::ofstream& file, double time, const std::string& name, const SceneConfig::Vector& position,
              const State& state) {
  fmt::print(file, "{},{},{},{},{},{},{},{}\n", time, quoted(name), fmt::join(position, ","),
             fmt::join(state.force, ","), fmt::join(state.force_raw, ","), state.contact_count, state.flags,
             fmt::join(state.torque, ","));
}

// organ: its name and a comma, or nothing.
void add_nodes(std::ofstream& file, double time, const std::string& organ, const SceneConfig& scene,
               const palpate_contacts& contacts) {
  const palpate_contact_node* nodes = palpate_contacts_node(&contacts, 0);
  const auto name = [&](const palpate_contact_node& node) {
    if (node.source == PALPATE_SOURCE_TOOL) return quoted(scene.tools[node.index].name);
    return std::string(node.source == PALPATE_SOURCE_NEEDLE  ? "needle"
                       : node.source == PALPATE_SOURCE_ORGAN ? "organ"
                                                             : "link");
  };
  const auto number = [](const palpate_contact_node& node) {
    return node.source <= PALPATE_SOURCE_NEEDLE ? node.point : node.index;
  };
  for (int n = 0; n < contacts.node_count; ++n)
    fmt::print(file, "{},{}{},{},{},{},{}\n", time, organ, name(nodes[n]), number(nodes[n]), nodes[n].node,
               fmt::join(nodes[n].modified_displacement, ","), fmt::join(nodes[n].force, ","));
}

}  // namespace

std::string quoted(const std::string& name) {
  if (name.find_first_of(",\"\n") == std::string::npos) return name;
  std::string out = "\"";
  for (const char c : name) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + '"';
}

CsvFiles::CsvFiles(const std::filesystem::path& folder, const SceneConfig& scene)
    : scene_(scene), folder_(folder), forces_(folder / "forces.csv"), contacts_(folder / "contacts.csv") {
  forces_ << kForces;
  contacts_ << (scene.organs.empty() ? "time_s," : "time_s,organ,") << kContacts;
  if (scene.organs.empty()) return;
  organs_.open(folder / "organs.csv");
  organs_ << "time_s,organ,force_x_N,force_y_N,force_z_N,pressed_x_N,pressed_y_N,pressed_z_N,near_tools,flags,torque_x_"
             "Nm,torque_y_Nm,torque_z_Nm\n";
  if (scene_.pairs == 0) return;
  pairs_.open(folder / "pairs.csv");
  pairs_
      << "time_s,organ,node,other_organ,triangle,x_m,y_m,z_m,normal_x,normal_y,normal_z,force_x_N,force_y_N,force_z_N,"
         "pressure_Pa,gap_m,overlap_m\n";
}

void CsvFiles::write(const TouchRecord& touch) {
  for (int t = 0; t < touch.contacts.tool_count; ++t)
    add_tool(forces_, touch.time, scene_.tools[t].name, touch.positions[t], *palpate_contacts_tool(&touch.contacts, t));
  add_nodes(contacts_, touch.time, "", scene_, touch.contacts);
}

void CsvFiles::write(const WorldTouchRecord& touch) {
  const auto name = [&](std::int32_t organ) { return scene_.organs[static_cast<std::size_t>(organ)].name; };
  for (int t = 0; t < touch.contacts.tool_count; ++t)
    add_tool(forces_, touch.time, scene_.tools[t].name, touch.positions[t],
             *palpate_world_contacts_tool(&touch.contacts, t));
  for (int k = 0; k < touch.contacts.organ_count; ++k)
    add_nodes(contacts_, touch.time, name(k) + ',', scene_, *palpate_world_contacts_organ(&touch.contacts, k));
  for (int k = 0; k < touch.contacts.organ_count; ++k) {
    const palpate_world_organ_state& organ = *palpate_world_contacts_state(&touch.contacts, k);
    fmt::print(organs_, "{},{},{},{},{},{},{}\n", touch.time, name(k), fmt::join(organ.force, ","),
               fmt::join(organ.pressed, ","), organ.near_tools, organ.flags, fmt::join(organ.torque, ","));
  }
  for (int p = 0; pairs_.is_open() && p < touch.contacts.pair_count; ++p) {
    const palpate_world_pair& pair = *palpate_world_contacts_pair(&touch.contacts, p);
    const bool presses = pair.force[0] != 0 || pair.force[1] != 0 || pair.force[2] != 0;
    if (!presses && pair.gap > -kInside) continue;
    fmt::print(pairs_, "{},{},{},{},{},{},{},{},{},{},{}\n", touch.time, name(pair.organ[0]), pair.node,
               name(pair.organ[1]), pair.triangle, fmt::join(pair.place, ","), fmt::join(pair.normal, ","),
               fmt::join(pair.force, ","), pair.pressure, pair.gap, pair.overlap);
  }
}

void close_csv(const std::filesystem::path& folder, std::initializer_list<std::ofstream*> files) {
  for (std::ofstream* file : files) {
    if (!file->is_open()) continue;
    file->close();
    if (!*file) throw OperationError(fmt::format("{}: cannot write the CSV files", folder.string()));
  }
}

}  // namespace palpate
