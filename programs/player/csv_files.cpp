#include "programs/player/csv_files.h"

#include <fmt/format.h>

#include <iterator>

#include "formats/errors.h"

namespace palpate {
namespace {

template <typename Row>
void append(std::ofstream& stream, const Row& row) {
  stream.write(row.data(), static_cast<std::streamsize>(row.size()));
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
  forces_ << "time_s,tool,x_m,y_m,z_m,force_x_N,force_y_N,force_z_N,raw_x_N,raw_y_N,raw_z_N,contacts,flags,torque_x_Nm,"
             "torque_y_Nm,torque_z_Nm\n";
  contacts_ << "time_s,tool,point,node,modified_x_m,modified_y_m,modified_z_m,force_x_N,force_y_N,force_z_N\n";
}

void CsvFiles::write(const TouchRecord& touch) {
  fmt::memory_buffer rows;
  for (int t = 0; t < touch.contacts.tool_count; ++t) {
    const palpate_tool_state& tool = *palpate_contacts_tool(&touch.contacts, t);
    fmt::format_to(std::back_inserter(rows), "{},{},{},{},{},{},{},{}\n", touch.time, quoted(scene_.tools[t].name),
                   fmt::join(touch.positions[t], ","), fmt::join(tool.force, ","), fmt::join(tool.force_raw, ","),
                   tool.contact_count, tool.flags, fmt::join(tool.torque, ","));
  }
  append(forces_, rows);
  rows.clear();
  const palpate_contact_node* nodes = palpate_contacts_node(&touch.contacts, 0);
  for (int n = 0; n < touch.contacts.node_count; ++n)
    fmt::format_to(std::back_inserter(rows), "{},{},{},{},{},{}\n", touch.time,
                   nodes[n].tool < 0 ? "link" : quoted(scene_.tools[nodes[n].tool].name), nodes[n].point, nodes[n].node,
                   fmt::join(nodes[n].modified_displacement, ","), fmt::join(nodes[n].force, ","));
  append(contacts_, rows);
}

void CsvFiles::close() {
  forces_.close();
  contacts_.close();
  if (!forces_ || !contacts_) throw OperationError(fmt::format("{}: cannot write the CSV files", folder_.string()));
}

}  // namespace palpate
