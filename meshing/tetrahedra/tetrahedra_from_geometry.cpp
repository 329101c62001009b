#include "meshing/tetrahedra/tetrahedra_from_geometry.h"

#include <fmt/format.h>
#include <gmsh.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>
#include <unordered_map>

#include "formats/errors.h"
#include "meshing/tetrahedra/gmsh_session.h"
#include "meshing/tetrahedra/in_child_process.h"
#include "meshing/tetrahedra/mesh_bytes.h"

namespace palpate {
namespace {

namespace mesh_api = gmsh::model::mesh;

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  if (!in || !(text << in.rdbuf()))
    throw InputError(fmt::format("{}: cannot be read or is empty; expected a gmsh geometry", file.string()));
  return text.str();
}

// A .geo file is a script. Refuses the commands that reach other files or programs or end gmsh.
void refuse_side_effects(const std::filesystem::path& file, const std::string& text) {
  static const std::regex forbidden(
      R"(\b(SystemCall|NonBlockingSystemCall|OnelabRun|Plugin|Include|Merge|MergeWithBoundingBox|ShapeFromFile|Save|Print|Printf|CreateDir|PurgeFile|Exit|Abort)\b)");
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    std::smatch match;
    const std::string code = line.substr(0, line.find("//"));
    if (std::regex_search(code, match, forbidden))
      throw InputError(
          fmt::format("{}: line {}: \"{}\" is refused, because it reaches other files or programs or ends the mesher; "
                      "keep the geometry in one file without it",
                      file.string(), number, match.str()));
  }
}

void check_assignments(const std::filesystem::path& file, const std::string& text,
                       const std::vector<std::string>& assignments) {
  for (const std::string& assignment : assignments) {
    const std::size_t equals = assignment.find('=');
    const std::string name = assignment.substr(0, equals);
    double value = 0;
    std::istringstream number(equals == std::string::npos ? "" : assignment.substr(equals + 1));
    if (!std::regex_match(name, std::regex("[A-Za-z_][A-Za-z_0-9]*")) || !(number >> value) || !number.eof())
      throw InputError(fmt::format("--set {}: expected NAME=NUMBER", assignment));
    const std::regex defined(R"(DefineConstant\s*\[[^;]*\b)" + name + R"(\s*=)");
    if (!std::regex_search(text, defined))
      throw InputError(fmt::format("--set {}: {} has no DefineConstant[ {} = ... ]", assignment, file.string(), name));
  }
}

void open_geometry(const std::filesystem::path& file) {
  std::string reason;
  try {
    gmsh::open(file.string());
  } catch (const std::string& error) {
    reason = error;
  }
  // After a syntax error gmsh continues with what it has read, so we stop at the first error in its log.
  std::vector<std::string> log;
  gmsh::logger::get(log);
  for (const std::string& line : log)
    if (line.rfind("Error: ", 0) == 0) {
      reason = line.substr(7);
      break;
    }
  if (!reason.empty()) throw InputError(fmt::format("{}: gmsh refuses the geometry: {}", file.string(), reason));
}

// Returns the physical groups of one dimension as name -> entities, in order of their tags. Without physical groups
// each entity forms a group of its own.
std::vector<std::pair<std::string, std::vector<int>>> groups(int dimension, const std::string& unnamed) {
  std::vector<std::pair<std::string, std::vector<int>>> result;
  gmsh::vectorpair physical;
  gmsh::model::getPhysicalGroups(physical, dimension);
  for (const auto& [dim, tag] : physical) {
    std::string name;
    std::vector<int> entities;
    gmsh::model::getPhysicalName(dim, tag, name);
    gmsh::model::getEntitiesForPhysicalGroup(dim, tag, entities);
    result.emplace_back(name.empty() ? fmt::format("{} {}", unnamed, tag) : name, entities);
  }
  return result;
}

class Collector {
 public:
  explicit Collector(const std::filesystem::path& file) : file_(file) {
    std::vector<std::size_t> tags;
    std::vector<double> xyz, unused;
    mesh_api::getNodes(tags, xyz, unused, -1, -1, false, false);
    for (std::size_t i = 0; i < tags.size(); ++i) position_[tags[i]] = {xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]};
  }

  void add_region(const std::string& name, const std::vector<int>& volumes) {
    const auto region = static_cast<std::int32_t>(mesh_.region_names.size());
    mesh_.region_names.push_back(name);
    for (const int volume : volumes) {
      if (const auto [before, fresh] = region_of_.emplace(volume, region); !fresh)
        throw InputError(
            fmt::format("{}: volume {} is in two physical volumes, \"{}\" and \"{}\"; every volume is one region",
                        file_.string(), volume, mesh_.region_names[before->second], name));
      refuse_other_elements(3, volume, 4, "tetrahedra");
      std::vector<std::size_t> tags, corners;
      mesh_api::getElementsByType(4, tags, corners, volume);
      for (std::size_t i = 0; i + 3 < corners.size(); i += 4) {
        mesh_.tetrahedra.push_back(
            {number(corners[i]), number(corners[i + 1]), number(corners[i + 2]), number(corners[i + 3])});
        mesh_.region.push_back(region);
      }
    }
  }

  // leave out triangles of surfaces that bound no region: the mesh does not have their nodes
  void add_patch(const std::string& name, const std::vector<int>& surfaces) {
    TetrahedralMesh::Patch patch{name, {}};
    for (const int surface : surfaces) {
      refuse_other_elements(2, surface, 2, "triangles");
      std::vector<std::size_t> tags, corners;
      mesh_api::getElementsByType(2, tags, corners, surface);
      for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
        if (!number_.contains(corners[i]) || !number_.contains(corners[i + 1]) || !number_.contains(corners[i + 2]))
          continue;
        patch.triangles.push_back({number(corners[i]), number(corners[i + 1]), number(corners[i + 2])});
      }
    }
    mesh_.patches.push_back(std::move(patch));
  }

  TetrahedralMesh take() { return std::move(mesh_); }

 private:
  std::int32_t number(std::size_t tag) {
    const auto [found, fresh] = number_.emplace(tag, static_cast<std::int32_t>(mesh_.nodes.size()));
    if (fresh) mesh_.nodes.push_back(position_.at(tag));
    return found->second;
  }

  void refuse_other_elements(int dimension, int entity, int allowed, const char* expected) const {
    std::vector<int> types;
    mesh_api::getElementTypes(types, dimension, entity);
    for (const int type : types)
      if (type != allowed)
        throw InputError(
            fmt::format("{}: the geometry asks for elements of gmsh type {} in entity {}, but only linear {} are "
                        "supported; remove Recombine, Layers or ElementOrder",
                        file_.string(), type, entity, expected));
  }

  const std::filesystem::path& file_;
  TetrahedralMesh mesh_;
  std::unordered_map<std::size_t, std::array<double, 3>> position_;
  std::unordered_map<std::size_t, std::int32_t> number_;
  std::map<int, std::int32_t> region_of_;
};

// " near (x, y, z)" where gmsh names a node, " within the box ... of surface n" where it names a surface, else the box of all.
std::string place_of(const GmshFailure& failed) {
  if (!failed.nodes.empty()) {
    std::vector<double> at, unused;
    mesh_api::getNode(failed.nodes.front(), at, unused);
    if (at.size() == 3) return fmt::format(" near ({:.6g}, {:.6g}, {:.6g})", at[0], at[1], at[2]);
  }
  const bool surface = !failed.surfaces.empty();
  std::array<double, 3> low{}, high{};
  gmsh::model::getBoundingBox(surface ? 2 : -1, surface ? failed.surfaces.front() : -1, low[0], low[1], low[2], high[0],
                              high[1], high[2]);
  return fmt::format(" between ({:.6g}, {:.6g}, {:.6g}) and ({:.6g}, {:.6g}, {:.6g}){}", low[0], low[1], low[2],
                     high[0], high[1], high[2], surface ? fmt::format(", surface {}", failed.surfaces.front()) : "");
}

std::string mesh_in_gmsh(const std::filesystem::path& file, const std::vector<std::string>& assignments,
                         const FillOptions& options) {
  GmshSession session(assignments);
  open_geometry(file);
  session.use_hxt(options.size, options.optimize_below);
  gmsh::vectorpair volumes;
  gmsh::model::getEntities(volumes, 3);
  if (volumes.empty())
    throw InputError(fmt::format("{}: the geometry has no volume; expected at least one Volume", file.string()));
  try {
    session.generate(3);
  } catch (const GmshFailure& failed) {
    throw OperationError(failed.what() + place_of(failed));
  }
  Collector collector(file);
  auto regions = groups(3, "region");
  if (regions.empty())
    for (const auto& [dimension, tag] : volumes) regions.push_back({fmt::format("volume {}", tag), {tag}});
  for (const auto& [name, entities] : regions) collector.add_region(name, entities);
  for (const auto& [name, entities] : groups(2, "patch")) collector.add_patch(name, entities);
  return to_bytes(collector.take());
}

// Turns the triangles of patches on the outer surface outward, so that callers can use their normals.
void turn_patches_outward(TetrahedralMesh& mesh) {
  const auto key = [](std::array<std::int32_t, 3> t) {
    std::sort(t.begin(), t.end());
    return t;
  };
  std::map<std::array<std::int32_t, 3>, std::array<std::int32_t, 3>> outward;
  for (const auto& t : boundary_triangles(mesh)) outward[key(t)] = t;
  for (auto& patch : mesh.patches)
    for (auto& t : patch.triangles)
      if (const auto found = outward.find(key(t)); found != outward.end()) t = found->second;
}

}  // namespace

TetrahedralMesh tetrahedra_from_geometry(const std::filesystem::path& file, const std::vector<std::string>& assignments,
                                         const FillOptions& options) {
  const std::string text = text_of(file);
  refuse_side_effects(file, text);
  check_assignments(file, text, assignments);
  TetrahedralMesh mesh;
  try {
    mesh =
        from_bytes(run_in_child("gmsh", options.time_limit, [&] { return mesh_in_gmsh(file, assignments, options); }));
  } catch (const OutOfTime& stopped) {
    throw OutOfTime(fmt::format("{}: {}", file.string(), stopped.what()));
  } catch (const OperationError& failed) {
    throw OperationError(fmt::format(
        "{}: {}; look there for surfaces that cross, leave a gap or meet at a sharp angle, or ask for smaller "
        "edges in the geometry (--set where it has a parameter)",
        file.string(), failed.what()));
  }
  if (mesh.tetrahedra.empty())
    throw OperationError(fmt::format("{}: gmsh made no tetrahedra; check that the volumes are closed", file.string()));
  turn_patches_outward(mesh);
  return mesh;
}

}  // namespace palpate
