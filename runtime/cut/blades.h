// The blades of a scene: lines of points that the host moves. What a blade has not cut yet lies between the line where the mesh has followed it to,
// which goes along with the tissue, and the line where it is.
#pragma once

#include <cstdint>

#include "runtime/base/scene_memory.h"
#include "runtime/base/vec3.h"
#include "runtime/cut/blade_search.h"
#include "runtime/cut/rest_mesh.h"
#include "runtime/include/palpate/palpate_cut.h"

namespace palpate {

class Blades {
 public:
  // rest: borrowed.
  void create(SceneMemory& memory, const RestMesh* rest);
  void forget();

  // points: [count][3] m in the world, checked; 0: the blade is withdrawn.
  void set(std::int32_t blade, const double* points, std::int32_t count);

  bool are_there() const;
  void begin_step() { asked_ = 0; }
  // The next blade in turn; -1: all have come in this step.
  std::int32_t next();
  // The sweep of a blade that next() gave, in the organ's frame: valid until the next call. now: [count][3] where its points are, m, organ's frame; nodes
  // [tetrahedra][4] of the corners and positions [nodes][3] m of the mesh as it is.
  BladeSweep sweep(std::int32_t blade, const std::int32_t* nodes, const double* positions);
  // The mesh has followed the blade to where it is. Cost: a walk through the mesh for each point.
  void followed(std::int32_t blade, const std::int32_t* nodes, const double* positions);
  // The lines come into the organ's frame: place(p) of a point of the world.
  template <class Place>
  void place(Place place) {
    for (Blade& blade : blades_)
      for (std::int32_t i = 0; i < blade.count; ++i) store3(place(load3(blade.sent[i])), blade.now[i]);
  }

 private:
  // A point that goes along with a tetrahedron; -1: outside of the tissue, at a place in the organ's frame.
  struct Place {
    std::int32_t tetrahedron, unused;  // in the place of padding, which a saved state would hold
    double weight[4];
    double at[3];  // m
  };
  struct Blade {
    double sent[PALPATE_MAX_BLADE_POINTS][3];  // m, in the world
    double now[PALPATE_MAX_BLADE_POINTS][3];   // m, in the organ's frame
    Place last[PALPATE_MAX_BLADE_POINTS];      // to where the mesh has followed
    std::int32_t count, followed;              // points of sent; of last, 0: the blade has just come
  };
  static Vec3 corner(const std::int32_t* nodes, const double* positions, std::int32_t c) {
    return load3(positions + 3 * static_cast<std::size_t>(nodes[c]));
  }
  Place locate(Vec3 p, std::int32_t begin, const std::int32_t* nodes, const double* positions) const;
  std::int32_t nearest_tetrahedron(Vec3 p, const std::int32_t* nodes, const double* positions) const;

  const RestMesh* rest_ = nullptr;
  Blade blades_[PALPATE_MAX_BLADES] = {};
  std::int32_t turn_ = 0;
  int asked_ = 0;
  double from_[PALPATE_MAX_BLADE_POINTS][3] = {};
};

}  // namespace palpate
