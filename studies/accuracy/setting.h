// One point of the study: how the bundle is computed and stored, the exercise, and how the scene models the contact.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace palpate::accuracy {

// What decides the bundle's bytes, besides the organ and the boundary set.
struct BundleSetting {
  std::string resolution;       // a mesh size of the organ's pipeline
  std::string element;          // p1, p1-anp, p2-p0
  double poisson = 0;           // of every region; 0: each region's own
  std::string solver = "auto";  // auto: palpate-precompute's choice; multigrid
  double tolerance = 1e-9;
  std::string storage = "f32";  // f64, f32, f16, "low-rank 1e-3"
  bool everywhere = true;       // columns of every touchable node; false: only of nodes near the sites
  bool large = false;           // with what large deformation needs, and CalculiX's neo-Hookean law in every region
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(BundleSetting, resolution, element, poisson, solver, tolerance, storage, everywhere,
                                   large)

// exercise, law and contacts define the physical situation; the other members say how the scene models it.
struct SceneSetting {
  std::string exercise = "press";  // press, drag, neighbour, measured, hold (exercises.h)
  std::string law = "sticking";    // sticking, sliding, unilateral, coulomb
  int contacts = 1;                // sites pressed at a time
  std::string contact = "patch";   // node, triangle, point, patch
  std::string collision = "rest";  // rest, deformed
  std::string surface = "mesh";    // which tools meet: mesh, or fine: that of the study's finest mesh
  bool response = false;           // P and Q
  bool relaxation = false;
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(SceneSetting, exercise, law, contacts, contact, collision, surface, response,
                                   relaxation)

struct Setting {
  BundleSetting bundle;
  SceneSetting scene;
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Setting, bundle, scene)

// Equal settings give equal text, so that the text can be a key.
template <class Part>
std::string text_of(const Part& part) {
  return nlohmann::json(part).dump();
}

// The physical situation as text: points with the same situation have the same reference.
inline std::string situation_of(const Setting& s) {
  return nlohmann::json{{"poisson", s.bundle.poisson},
                        {"exercise", s.scene.exercise},
                        {"law", s.scene.law},
                        {"contacts", s.scene.contacts}}
      .dump();
}

// The most accurate scene of the runtime for a situation: the scene of the reference.
inline SceneSetting best_scene(SceneSetting scene) {
  scene.contact = "patch";
  scene.collision = scene.exercise == "neighbour" || scene.exercise == "drag" ? "deformed" : "rest";
  scene.surface = scene.exercise == "drag" ? "fine" : "mesh";
  scene.response = scene.exercise == "measured";
  scene.relaxation = scene.exercise == "hold";
  return scene;
}

// "1700 p1-anp f16", "1700 p1, nu 0.45, node contact": what differs from the defaults above.
std::string name_of(const Setting& setting);

}  // namespace palpate::accuracy
