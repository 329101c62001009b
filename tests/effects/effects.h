// The effects of a scene, one by one, and the scene that has two of them.
#pragma once

#include <palpate/palpate_scene_def.hpp>

#include <set>
#include <string>
#include <vector>

#include "tests/runtime/world/played_world.h"
#include "tests/support/fine_body.h"

namespace palpate::tests {

// How the bundle stores displacements.
enum class Store { f32, f16, blocks, interior_f16 };

// A box whose bundle has all sections, in one store, with the dense answers: supports at x = 0, four motions, a corridor through all inner
// nodes, a preload, both response curves and an order of elimination. One that can be cut has no nodes inside: its region is all of it, so that these
// count as nodes of the surface, and behind them are kReserveOfBox nodes in reserve.
inline constexpr std::int32_t kReserveOfBox = 12;
struct EffectBody {
  explicit EffectBody(Store store, bool can_be_cut = false);
  const Eigen::MatrixXd& compliance;  // [3N][3N] m/N
  const Eigen::MatrixXd& motions;     // [3N][4], of amounts that move the box by about a millimetre each
  const Eigen::VectorXd& preload;     // [3N] m
  const Eigen::VectorXd& sweep;       // [3N]: of displacements the volume that the surface of the pressure sweeps, m^3
  TouchedBody touched;
};
struct SceneOfEffects;
const EffectBody& body_of(Store store);
const EffectBody& body_of(const SceneOfEffects& scene);

// The bundle's response: y = x + x^2 / scale on [0, range], which goes beyond what the scenes reach: nothing is flagged.
struct ResponseOfBox {
  double range, scale;
  std::vector<double> coefficients() const;  // of Chebyshev's polynomials
};
inline constexpr ResponseOfBox kRadial{0.02, 0.004}, kForce{8, 1};  // m; N

// What a scene has, and who acts on it.
struct SceneOfEffects {
  SceneDef def = unlimited_def();
  Store store = Store::f32;
  bool grasps = false, links = false, needles = false, motions = false, holds_volume = false, loads = false,
       force_control = false, obstacles = false, skin = false, fine = false, cut = false, touching = false,
       world_links = false;
  bool is_world() const { return touching || world_links; }
};

// Of effects in one slot a scene has one: contact models, laws, ways to deform, stores.
enum class Slot { collision, contact, law, deformation, store, own };

struct Effect {
  const char* name;
  Slot slot;
  void (*apply)(SceneOfEffects& scene);
  void (*needs)(SceneOfEffects& scene,
                const std::set<Slot>& named) = nullptr;  // what it asks of slots that nobody has named
};

const std::vector<Effect>& effects();

// Where the loads of these scenes act, m: a force on one point of the top, and a traction on the whole face x = 60 mm.
inline constexpr double kPointOfForce[3] = {0.047, 0.031, 0.04}, kFaceOfTraction[3] = {0.06, 0.025, 0.02};

// The scene with all of them. One may come twice.
SceneOfEffects scene_with(const std::vector<const Effect*>& all);

// Meshes that a scene_def borrows. The fine surface is the body's own, its edges halved; the render mesh has vertices on every triangle.
const palpate_render_mesh& effect_skin();
const FineHost& effect_fine();

}  // namespace palpate::tests
