// Deformed shapes for ParaView: shapes.pvd names, for each time, the organ and the tools as VTU files in shapes/.
//
// The organ's points are the deformed positions of the nodes, m; point data: displacement (m), contact_force (N, on the organ at
// nodes under contact), fixed (0 or 1: all three axes held). SHAPE surface writes triangles, SHAPE volume tetrahedra
// with their region. The tools are vertices; point data: tool (its index in the scene) and force (N, of the organ on
// the tool, at each of its points). With a render mesh, part 2 holds its deformed triangles; point data:
// displacement (m) and normal. With links or grasps, the last part holds them: a line for each stretch of a link and a polygon for each
// closed disc, with a pair of points or the corners of its own; cell data: link (its index in the scene, or -1), tool (the same of the
// disc's tool), tension (N) and condition (those of palpate.h).
#pragma once

#include <filesystem>
#include <string>

#include "programs/player/bundle_fields.h"
#include "programs/player/player.h"

namespace palpate {

class ShapeFiles {
 public:
  // fields and player must outlive this.
  ShapeFiles(const std::filesystem::path& folder, const Player& player, const BundleFields& fields);
  ~ShapeFiles();
  ShapeFiles(const ShapeFiles&) = delete;
  ShapeFiles& operator=(const ShapeFiles&) = delete;

  // Errors: OperationError (a full disk).
  void write(const ShapeRecord& shape);
  void close();
  int written() const { return written_; }

 private:
  struct Organ;
  struct Skin;
  void write_held(const ShapeRecord& shape, const std::filesystem::path& file) const;
  const Player& player_;
  std::filesystem::path folder_;
  std::unique_ptr<Organ> organ_;
  std::unique_ptr<Skin> skin_;  // with a render mesh
  std::string entries_;         // of the PVD
  int written_ = 0;
};

}  // namespace palpate
