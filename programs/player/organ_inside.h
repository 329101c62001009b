// What a scene with `inside` asks after each shape: strain and stress of all nodes, and where carried surfaces are.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <palpate/palpate_complete.h>
#include "formats/scene_config.h"
#include "programs/player/render_mesh.h"

namespace palpate {

class OrganInside {
 public:
  struct Carried {
    std::string name;
    RenderMesh mesh;                           // as meshed; its normals are not used
    std::vector<palpate_inside_place> places;  // [vertex]
    std::vector<float> rest, positions;        // [vertex][3] m, of the organ at rest and of the last shape
  };

  // Reads the scene's carried surfaces and finds their places. scene: with inside; runtime_scene must outlive this. nodes: of its shape.
  // Errors: InputError with the file, and the vertex that is farthest from the mesh where one is too far.
  OrganInside(const SceneConfig& scene, palpate_scene* runtime_scene, int nodes);
  OrganInside(const OrganInside&) = delete;

  // After palpate_scene_shape, which has filled displacements and positions. Allocates nothing. Returns step flags.
  palpate_step_flags follow(const palpate_shape_out& shape);

  const palpate_inside_out& field() const { return field_; }
  const std::vector<Carried>& carried() const { return carried_; }

 private:
  void add(const SceneConfig::Carried& surface);
  palpate_scene* runtime_scene_;
  std::vector<float> strains_, stresses_, pressures_, von_mises_, principal_;
  palpate_inside_out field_ = palpate_default_inside_out();
  std::vector<Carried> carried_;
};

}  // namespace palpate
