// One organ of a played scene: its bundle, what its scene asks of the library, and what holds and moves it.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <palpate/palpate_scene_def.hpp>
#include "formats/scene_config.h"
#include "programs/player/held_tissue.h"
#include "programs/player/organ_crossings.h"
#include "programs/player/organ_cuts.h"
#include "programs/player/organ_inside.h"
#include "programs/player/organ_loads.h"
#include "programs/player/organ_motions.h"
#include "programs/player/organ_obstacles.h"
#include "programs/player/played_needles.h"
#include "programs/player/render_mesh.h"

namespace palpate {

// Which half of a scene a program plays. The effects of the other half are off, so that their sections are not mapped.
enum class Half { both, touch, shape };

// The touchable nodes that a grip holds, ascending. Errors: InputError with the grip's line in file where there are none.
std::vector<std::int32_t> gripped_nodes(const SceneConfig::Grip& grip, const palpate_bundle* bundle,
                                        const std::filesystem::path& file);

// What the library logged of an organ until play_on(), a sentence each: notes of the scene alone; of the warnings not that the scene leaves out
// the bundle's preload, which its file decides.
struct LibraryLog {
  std::vector<std::string> notes, warnings;
};

class PlayedOrgan {
 public:
  // Opens the bundle, finds the grips' nodes and the places of tools, links, grasps and needles. scene: of this organ alone. render_mesh
  // follows the shapes; it must outlive this, or be nullptr. name: of the organ among several, for the log.
  // Errors: InputError that names the byte of the bundle, or the line of the scene.
  PlayedOrgan(SceneConfig scene, std::filesystem::path bundle, Half half = Half::both,
              const RenderMesh* render_mesh = nullptr, std::string name = {});
  PlayedOrgan(const PlayedOrgan&) = delete;
  PlayedOrgan& operator=(const PlayedOrgan&) = delete;

  const SceneConfig& scene() const { return scene_; }  // with the positions of the tools that are placed on this organ
  const std::filesystem::path& bundle_file() const { return bundle_file_; }
  palpate_bundle* bundle() const { return bundle_.get(); }
  const RenderMesh* render_mesh() const { return render_mesh_; }
  // The finer surface that the tools meet; nullptr: the bundle's.
  const palpate_fine_surface& met_surface() const { return met_surface_; }
  const std::vector<std::vector<palpate_grip>>& grips() const { return grips_; }  // [tool][grip], a node each
  std::vector<std::vector<palpate_grip>>& grips() { return grips_; }
  const HeldTissue& held() const { return *held_; }
  HeldTissue& held() { return *held_; }
  const PlayedNeedles& needles() const { return *needles_; }
  PlayedNeedles& needles() { return *needles_; }
  const OrganMotions& motions() const { return *motions_; }
  const OrganLoads& loads() const { return *loads_; }
  const OrganObstacles& obstacles() const { return *obstacles_; }
  const OrganCuts& cuts() const { return *cuts_; }
  bool is_cut() const { return is_cut_; }                         // whether the library's scene cuts
  const std::string& name() const { return name_; }               // among several organs
  OrganCrossings* crossings() const { return crossings_.get(); }  // nullptr: the scene does not look for them
  OrganInside* inside() const { return inside_.get(); }           // nullptr: the scene does not look inside

  // Points of all tools and grips of this organ together.
  int points_and_grips() const;
  // What the library's scene takes. max_points: the least number that the scene has room for; of organs of one world the same. The
  // pointers in it are valid as long as this.
  SceneDef definition(int max_points);
  // The scene that the owner made by that definition.
  void play_on(palpate_scene* scene);
  palpate_scene* runtime_scene() const { return runtime_scene_; }
  // Refuses what the library refused. Throws InputError, or OperationError for want of memory.
  [[noreturn]] void refuse(const palpate_error& error) const;

  const LibraryLog& log() const { return log_; }

  bool holds_tissue() const { return holds_; }          // whether the library's scene has links or grasps
  bool has_needles() const { return pierced_; }         // whether it has needles
  bool presses_with_forces() const { return forced_; }  // whether its tools may have forces
  int contact_node_limit() const { return contact_node_limit_; }
  int shape_node_count() const;  // nodes that palpate_scene_shape fills

  // Gives the library's scene its links, jaws, motions, loads, obstacles, blades and removals at a time, s. Allocates nothing.
  void move(double time);

 private:
  struct CloseBundle {
    void operator()(palpate_bundle* bundle) const { palpate_bundle_close(bundle); }
  };

  static void hear(void* organ, palpate_log_level level, const char* text);

  SceneConfig scene_;
  std::filesystem::path bundle_file_;
  Half half_;
  const RenderMesh* render_mesh_;
  std::string name_;
  LibraryLog log_;
  palpate_render_mesh skin_ = palpate_default_render_mesh();
  std::vector<float> met_positions_;
  std::vector<std::int32_t> met_triangles_;
  palpate_fine_surface met_surface_ = palpate_default_fine_surface();
  std::unique_ptr<palpate_bundle, CloseBundle> bundle_;
  std::vector<std::vector<palpate_grip>> grips_;
  std::unique_ptr<HeldTissue> held_;
  std::unique_ptr<PlayedNeedles> needles_;
  std::unique_ptr<OrganMotions> motions_;
  std::unique_ptr<OrganLoads> loads_;
  std::unique_ptr<OrganObstacles> obstacles_;
  std::unique_ptr<OrganCuts> cuts_;
  std::unique_ptr<OrganCrossings> crossings_;
  std::unique_ptr<OrganInside> inside_;
  palpate_scene* runtime_scene_ = nullptr;
  int contact_node_limit_ = 0;
  bool holds_ = false;    // the library's scene has links or grasps
  bool pierced_ = false;  // and needles
  bool forced_ = false;   // and tools with forces
  bool moves_ = false;    // and motions, loads and obstacles, which this sets
  bool is_cut_ = false;   // and is cut
};

}  // namespace palpate
