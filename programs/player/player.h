// Plays a scene through the runtime's C API: calls touch and shape at their rates and measures the time of each call.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <vector>

#include <palpate/palpate.h>
#include "formats/scene_config.h"
#include "programs/player/held_tissue.h"
#include "programs/player/organ_motions.h"
#include "programs/player/render_mesh.h"
#include "programs/player/tool_turn.h"

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
};

struct Timing {
  // One per step, in order; none where nothing is skinned, or the body is not solved beside the touch.
  std::vector<double> touch_us, shape_us, skin_us, deform_us;
};

// Which half of a scene a program plays. The effects of the other half are off, so that their sections are not mapped.
enum class Half { both, touch, shape };

// The touchable nodes that a grip holds, ascending. Errors: InputError with the grip's line in file where there are none.
std::vector<std::int32_t> gripped_nodes(const SceneConfig::Grip& grip, const palpate_bundle* bundle,
                                        const std::filesystem::path& file);

class Player {
 public:
  // Opens the bundle, finds the grips' nodes, creates the runtime's scene. render_mesh follows the shapes; it must outlive
  // this, or be nullptr.
  // Errors: InputError that names the byte of the bundle, or the line of the scene.
  Player(SceneConfig scene, const std::filesystem::path& bundle, Half half = Half::both,
         const RenderMesh* render_mesh = nullptr);

  const SceneConfig& scene() const { return scene_; }
  const std::vector<std::vector<palpate_grip>>& grips() const { return grips_; }  // [tool][grip], a node each
  const HeldTissue& held() const { return *held_; }
  const OrganMotions& motions() const { return *motions_; }
  bool holds_tissue() const { return holds_; }  // whether the library's scene has links or grasps
  palpate_bundle* bundle() const { return bundle_.get(); }
  const RenderMesh* render_mesh() const { return render_mesh_; }
  // The finer surface that the tools meet; nullptr: the bundle's.
  const palpate_fine_surface* met_surface() const { return met_triangles_.empty() ? nullptr : &met_surface_; }
  palpate_scene* runtime_scene() const { return runtime_scene_.get(); }
  double duration() const;            // s, the last key frame of all tools, links and motions
  std::uint64_t shape_count() const;  // shapes that play makes
  std::uint64_t touch_count() const;  // steps of the whole scene, both ends included
  int contact_node_limit() const { return contact_node_limit_; }

  int shape_node_count() const;  // nodes that palpate_scene_shape fills

  // For a caller with a loop of its own: move_tools puts all tools where their paths are at a time and withdraws those that are
  // away then, with what the scene's links, motions and jaws do then; place_tool puts one tool where the caller says, touch makes one step.
  // None of them allocates.
  void move_tools(double time);
  void place_tool(std::size_t tool, const SceneConfig::Vector& position, const Rotation& turn = kNoTurn);
  void withdraw_tool(std::size_t tool);  // it touches nothing until it is placed again
  const std::vector<SceneConfig::Vector>& positions() const { return positions_; }         // [tool] origin, m
  const std::vector<std::vector<SceneConfig::Vector>>& points() const { return points_; }  // [tool][point], m
  palpate_step_flags touch(double dt, palpate_contacts* contacts, std::size_t contacts_bytes) {
    return palpate_scene_touch(runtime_scene_.get(), tools_.data(), static_cast<std::int32_t>(tools_.size()), dt,
                               contacts, contacts_bytes);
  }

  // Plays the whole scene from its start. Either callback may be empty. The times are those of palpate_scene_touch, palpate_scene_shape,
  // palpate_scene_skin and palpate_scene_deform alone. before is called before each of these but skin, on_deform after a solve.
  Timing play(const std::function<void(const TouchRecord&)>& on_touch,
              const std::function<void(const ShapeRecord&)>& on_shape, const std::function<void()>& before = {},
              const std::function<void()>& on_deform = {});

 private:
  struct CloseBundle {
    void operator()(palpate_bundle* bundle) const { palpate_bundle_close(bundle); }
  };
  struct DestroyScene {
    void operator()(palpate_scene* scene) const { palpate_scene_destroy(scene); }
  };

  SceneConfig scene_;
  const RenderMesh* render_mesh_;
  std::vector<float> met_positions_;
  std::vector<std::int32_t> met_triangles_;
  palpate_fine_surface met_surface_ = palpate_default_fine_surface();
  std::unique_ptr<palpate_bundle, CloseBundle> bundle_;
  std::unique_ptr<palpate_scene, DestroyScene> runtime_scene_;
  int contact_node_limit_ = 0;
  std::vector<std::vector<SceneConfig::Vector>> local_points_, points_;  // [tool][point]: own frame; now
  std::vector<std::vector<palpate_grip>> grips_;                         // [tool][grip]
  std::vector<SceneConfig::Vector> positions_;                           // [tool]
  std::vector<palpate_tool> tools_;
  std::unique_ptr<HeldTissue> held_;
  std::unique_ptr<OrganMotions> motions_;
  bool holds_ = false;  // the library's scene has links or grasps
  bool moves_ = false;  // and motions, which this player sets
};

}  // namespace palpate
