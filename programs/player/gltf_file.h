// A played scene as one binary glTF 2.0 file (.glb): the organ's surface, or the render mesh in its place. Each shape is a
// morph target; an animation shows one after the other at the times of the scene.
//
// Units are metres and seconds. The mesh is in the bundle's frame; its node turns z (to the head) upwards, since up is y in
// glTF.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "programs/player/player.h"

namespace palpate {

class GltfFile {
 public:
  // shapes: how many will be added. Each takes a morph target of the size of the surface, and the weights of the animation
  // grow with the square of their number, so more than kMostShapes is an InputError. player must outlive this.
  static constexpr std::uint64_t kMostShapes = 1000;
  GltfFile(std::filesystem::path target, const Player& player, std::uint64_t shapes);

  void add(const ShapeRecord& shape);
  // Writes the whole file or none. Errors: OperationError.
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
