// Deformed shapes for ParaView: shapes.pvd names, for each time, the organ and the tools as VTU files in shapes/.
//
// The organ's points are the deformed positions of the nodes, m; point data: displacement (m), contact_force (N, on the organ at
// nodes under contact), fixed (0 or 1: all three axes held). SHAPE surface writes triangles, SHAPE volume tetrahedra
// with their region. The tools are vertices; point data: tool (its index in the scene) and force (N, of the organ on
// the tool, at each of its points). With a render mesh, part 2 holds its deformed triangles; point data:
// displacement (m) and normal. Where the scene looks inside, the organ's point data has strain, stress (Pa; both six components, of a
// symmetric tensor), pressure, von_mises and principal_stress (Pa), and each carried surface is a part of its own, carried_NAME_000000.vtu, with
// displacement (m, from rest). With links, grasps or needles, the last part holds them: a line for each stretch of a link, a polygon for each
// closed disc and a line for each needle, with a pair of points or the corners of its own; cell data: link (its index in the scene, or -1),
// tool (the same of the tool of a disc or a needle), tension (N) and condition (those of palpate.h; of a needle, its own). With loads, loads_000000.vtu
// has a vertex for each, where its patch is; point data: load (its index), force (N) and displacement (m). Links between organs are a part of their own, links_000000.vtu, of the same
// form. With obstacles, obstacles_000000.vtu has their triangles where they are in the world; point data: obstacle (its index) and force (N, of all organs
// on it, at each of its points). An organ that is cut is the triangles of its present surface, with SHAPE volume too; cell data: lip (1: of a cut, 0: the
// bundle's own). With blades, blades_000000.vtu has a line for each that is there, in the world; cell data: blade (its index). Of several organs each has files of its own, organ_NAME_000000.vtu, and all
// of them are in the world's frame.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "programs/player/bundle_fields.h"
#include "programs/player/player.h"
#include "programs/player/world_player.h"

namespace palpate {

class ShapeFiles {
 public:
  // fields: [organ] of its bundle. player must outlive this.
  ShapeFiles(const std::filesystem::path& folder, const Player& player, const std::vector<BundleFields>& fields);
  ShapeFiles(const std::filesystem::path& folder, const WorldPlayer& player, const std::vector<BundleFields>& fields);
  ~ShapeFiles();
  ShapeFiles(const ShapeFiles&) = delete;
  ShapeFiles& operator=(const ShapeFiles&) = delete;

  // Errors: OperationError (a full disk).
  void write(const ShapeRecord& shape);
  void write(const WorldShapeRecord& shapes);
  void close();
  int written() const { return written_; }

 private:
  struct Organ;
  struct Obstacles;
  explicit ShapeFiles(const std::filesystem::path& folder);
  // Writes the files of an organ and appends their names.
  void write_organ(Organ& organ, const ShapeRecord& shape, std::vector<std::string>& parts) const;
  void begin_obstacles();
  void write_obstacles(std::vector<std::string>& parts) const;
  void add_entries(double time, const std::vector<std::string>& parts);

  std::filesystem::path folder_;
  std::vector<std::unique_ptr<Organ>> organs_;
  std::unique_ptr<Obstacles> obstacles_;  // where there are any
  const WorldPlayer* world_ = nullptr;
  std::string entries_;  // of the PVD
  int written_ = 0;
};

}  // namespace palpate
