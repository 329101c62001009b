// One point of the study: how the organ is computed and stored, what is done to it, and how the scene models that.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace palpate::accuracy {

// What decides the bundle's bytes, beside organ and boundary set.
struct BundleSetting {
  std::string resolution;       // a mesh size of the organ's pipeline
  std::string element;          // p1, p1-anp, p2-p0
  double poisson = 0;           // of every region; 0: each region's own
  std::string solver = "auto";  // auto: palpate-precompute's choice; multigrid
  double tolerance = 1e-9;
  std::string storage = "f32";  // f64, f32, f16, "low-rank 1e-3"
  bool everywhere = true;       // columns of every touchable node, or only of those near the places of the study
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(BundleSetting, resolution, element, poisson, solver, tolerance, storage, everywhere)

// exercise, law and contacts are what is done to the organ; the others are how well the scene models it.
struct SceneSetting {
  std::string exercise = "press";  // press, drag, neighbour, measured, hold (exercises.h)
  std::string law = "sticking";    // sticking, sliding, unilateral, coulomb
  int contacts = 1;                // places pressed at a time
  std::string contact = "patch";   // node, triangle, point, patch
  std::string collision = "rest";  // rest, deformed
  bool response = false;           // P and Q
  bool relaxation = false;
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(SceneSetting, exercise, law, contacts, contact, collision, response, relaxation)

struct Setting {
  BundleSetting bundle;
  SceneSetting scene;
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Setting, bundle, scene)

// The same text for the same setting: keys of files and rows.
template <class Part>
std::string text_of(const Part& part) {
  return nlohmann::json(part).dump();
}

// What is done to the organ, as text: points with the same situation have the same truth.
inline std::string situation_of(const Setting& s) {
  return nlohmann::json{{"poisson", s.bundle.poisson},
                        {"exercise", s.scene.exercise},
                        {"law", s.scene.law},
                        {"contacts", s.scene.contacts}}
      .dump();
}

// The scene that models a situation as well as the runtime can.
inline SceneSetting best_scene(SceneSetting scene) {
  scene.contact = "patch";
  scene.collision = scene.exercise == "neighbour" ? "deformed" : "rest";
  scene.response = scene.exercise == "measured";
  scene.relaxation = scene.exercise == "hold";
  return scene;
}

// "1700 p1-anp f16", "1700 p1, nu 0.45, node contact": what differs from the plainest setting.
std::string name_of(const Setting& setting);

}  // namespace palpate::accuracy
