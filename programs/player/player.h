// Plays a scene through the runtime's C API: calls touch and shape at their rates and measures the time of each call.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <vector>

#include <palpate/palpate.h>
#include "formats/scene_config.h"
#include "programs/player/played_organ.h"
#include "programs/player/played_tools.h"
#include "programs/player/scene_clock.h"

namespace palpate {

// One touch step. The references are valid until the callback returns.
struct TouchRecord {
  double time;                                        // s
  palpate_step_flags flags;                           // of this touch
  const std::vector<SceneConfig::Vector>& positions;  // [tool] origin, m
  const palpate_contacts& contacts;
};

// One shape. Arrays have node_count rows of three, m.
struct ShapeRecord {
  double time;
  palpate_step_flags flags;
  const std::vector<std::vector<SceneConfig::Vector>>& points;  // [tool][point], m, where they are now
  const palpate_contacts& contacts;
  int node_count;
  const float* displacements;
  const float* positions;
  const float* skin_positions;  // of the render mesh, [vertex][3] m, and its normals; nullptr without one
  const float* skin_normals;
  const OrganCrossings* crossings = nullptr;  // nullptr: the scene does not look for them
  const OrganInside* inside = nullptr;        // strain, stress and carried surfaces in this shape; nullptr: none
};

struct Timing {
  // One per step, in order; none where nothing is skinned, no scene looks inside or for crossings, or the body is not solved beside the touch.
  std::vector<double> touch_us, shape_us, skin_us, inside_us, crossings_us, deform_us;
};

class Player {
 public:
  // Opens the bundle, finds the grips' nodes, creates the runtime's scene. render_mesh follows the shapes; it must outlive
  // this, or be nullptr.
  // Errors: InputError that names the byte of the bundle, or the line of the scene.
  Player(SceneConfig scene, const std::filesystem::path& bundle, Half half = Half::both,
         const RenderMesh* render_mesh = nullptr);

  const PlayedOrgan& organ() const { return organ_; }
  const SceneConfig& scene() const { return organ_.scene(); }
  const std::vector<std::vector<palpate_grip>>& grips() const { return organ_.grips(); }  // [tool][grip], a node each
  const HeldTissue& held() const { return organ_.held(); }
  const PlayedNeedles& needles() const { return organ_.needles(); }
  const OrganMotions& motions() const { return organ_.motions(); }
  palpate_bundle* bundle() const { return organ_.bundle(); }
  const RenderMesh* render_mesh() const { return organ_.render_mesh(); }
  palpate_scene* runtime_scene() const { return runtime_scene_.get(); }
  double duration() const { return duration_of(scene()); }               // s
  std::uint64_t shape_count() const;                                     // shapes that play makes
  std::uint64_t touch_count() const { return touch_count_of(scene()); }  // steps of the whole scene
  int contact_node_limit() const { return organ_.contact_node_limit(); }
  int shape_node_count() const { return organ_.shape_node_count(); }  // nodes that palpate_scene_shape fills

  // For a caller with a loop of its own: move_tools puts all tools where their paths are at a time and withdraws those that are
  // away then, with what the scene's links, motions and jaws do then; place_tool puts one tool where the caller says, touch makes one step.
  // None of them allocates.
  void move_tools(double time);
  void place_tool(std::size_t tool, const SceneConfig::Vector& position, const Rotation& turn = kNoTurn) {
    tools_->place(tool, position, turn);
  }
  void withdraw_tool(std::size_t tool) { tools_->withdraw(tool); }
  const std::vector<SceneConfig::Vector>& positions() const { return tools_->positions(); }         // [tool] origin, m
  const std::vector<std::vector<SceneConfig::Vector>>& points() const { return tools_->points(); }  // [tool][point], m
  palpate_step_flags touch(double dt, palpate_contacts* contacts, std::size_t contacts_bytes) {
    const palpate_step_flags flags =
        palpate_scene_touch(runtime_scene(), tools_->tools().data(), static_cast<std::int32_t>(tools_->tools().size()),
                            dt, contacts, contacts_bytes);
    tools_->follow();
    return flags;
  }

  // Plays the whole scene from its start. Either callback may be empty. The times are those of palpate_scene_touch, palpate_scene_shape,
  // palpate_scene_skin and palpate_scene_deform alone. before is called before each of these but skin, on_deform after a solve. Where the scene
  // looks inside, that follows each shape.
  Timing play(const std::function<void(const TouchRecord&)>& on_touch,
              const std::function<void(const ShapeRecord&)>& on_shape, const std::function<void()>& before = {},
              const std::function<void()>& on_deform = {});

 private:
  struct DestroyScene {
    void operator()(palpate_scene* scene) const { palpate_scene_destroy(scene); }
  };

  PlayedOrgan organ_;
  std::unique_ptr<palpate_scene, DestroyScene> runtime_scene_;
  std::unique_ptr<PlayedTools> tools_;
};

}  // namespace palpate
