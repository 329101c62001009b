// A played scene for renderers: one binary glTF 2.0 file (.glb) of the organ's surface or of the render mesh
// that follows it, each shape a morph target, and an animation that goes from one to the next in the scene's own time.
//
// Units are metres and seconds. The mesh stays in the bundle's frame; its node turns z, to the head, up, as glTF has y.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "programs/player/player.h"

namespace palpate {

class GltfFile {
 public:
  // shapes: how many will be added. Each is a morph target of the size of the surface, and the animation's weights grow with
  // their square: InputError above kMostShapes. player must outlive this.
  static constexpr std::uint64_t kMostShapes = 1000;
  GltfFile(std::filesystem::path target, const Player& player, std::uint64_t shapes);

  void add(const ShapeRecord& shape);
  // Whole or absent. Errors: OperationError.
  void write() const;

 private:
  std::filesystem::path target_;
  const Player& player_;
  std::vector<std::uint32_t> indices_;
  std::vector<float> rest_, rest_normals_;                         // [node][3]
  std::vector<std::vector<float>> displacements_, normal_change_;  // [shape][node][3]
  std::vector<float> times_;                                       // s
};

}  // namespace palpate
