// A played scene as one binary glTF 2.0 file (.glb): the organ's surface, or the render mesh in its place. Each shape is a
// morph target; an animation shows one after the other at the times of the scene.
//
// Units are metres and seconds. The mesh is in the bundle's frame; its node turns z (to the head) upwards, since up is y in
// glTF. Of several organs each has a mesh and a node, which stands in the world's node. An obstacle has a
// node there too, which the animation moves where the obstacle moves; a scene of one organ then has a world's node as well. An organ that is cut has a mesh and
// a node for each surface that a shape had, one after the other: the animation gives the present one the scale 1, the others the scale 0. Its lips have a
// material of their own.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "programs/player/player.h"
#include "programs/player/shown_obstacles.h"
#include "programs/player/world_player.h"

namespace palpate {

class GltfFile {
 public:
  // shapes: how many will be added. Each takes a morph target of the size of the surface, and the weights of the animation
  // grow with the square of their number, so more than kMostShapes is an InputError. player must outlive this.
  static constexpr std::uint64_t kMostShapes = 1000;
  GltfFile(std::filesystem::path target, const Player& player, std::uint64_t shapes);
  GltfFile(std::filesystem::path target, const WorldPlayer& player, std::uint64_t shapes);

  void add(const ShapeRecord& shape);
  void add(const WorldShapeRecord& shapes);
  // Writes the whole file or none. Errors: OperationError.
  void write() const;

 private:
  struct Surface {
    const PlayedOrgan* organ;
    std::string name;
    const palpate_pose* pose;                         // nullptr: the only organ
    std::vector<std::uint32_t> indices = {};          // of nodes
    std::vector<std::int32_t> nodes = {};             // the shape's that it has; of a render mesh none
    std::vector<float> rest = {}, rest_normals = {};  // [node][3]
    std::vector<std::vector<float>> displacements = {}, normal_change = {};  // [shape][node][3]
    std::size_t lips = 0,
                first = 0;  // how many of the last indices are of lips of a cut; the first shape that has this surface
  };
  struct Obstacle {
    ShownObstacle of;
    std::vector<float> places, turns;  // [shape][3] m; [shape][4] quaternion x y z w
  };
  GltfFile(std::filesystem::path target, const SceneConfig& scene, std::uint64_t shapes);
  void begin_obstacles();
  void add_obstacles();
  void begin(const PlayedOrgan& organ, const std::string& name, const palpate_pose* pose);
  void add(std::size_t organ, const ShapeRecord& shape);
  static void add_shape(Surface& surface, const ShapeRecord& shape);

  std::filesystem::path target_;
  const SceneConfig& scene_;
  struct Organ {
    std::size_t surface;  // that it has now
    std::string name;
    PresentSurface cut;
    int surfaces = 1;  // that it has had
  };
  void begin_cut(Organ& organ);
  bool lasts(const Surface& surface) const { return surface.displacements.size() == times_.size(); }

  std::vector<Surface> surfaces_;
  std::vector<Organ> organs_;
  std::vector<Obstacle> obstacles_;
  std::vector<float> times_;  // s
};

}  // namespace palpate
