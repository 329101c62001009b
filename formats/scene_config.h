// scene.toml: the bundle, the effects, the tools and their paths.
#pragma once

#include <palpate/palpate_scene_def.hpp>

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "formats/scene_keys.h"

namespace palpate {

// What is computed of an organ, and how: [effects], [limits] and [relaxation]. What tools, links and motions of the file decide has its
// default.
struct SceneEffects {
  SceneDef def = default_of_scene_file();
  std::string relaxation_source;
  bool operator==(const SceneEffects& other) const {
    return relaxation_source == other.relaxation_source && have_equal_fields(def, other.def);
  }
};

// docs/files.md explains the keys; formats/config_keys.cpp lists them. Lengths are in metres here. A scene of several organs has
// `organs`, each with effects of its own; in a scene of one organ `organs` is empty and the effects are the scene's.
struct SceneConfig : SceneEffects {
  using Vector = std::array<double, 3>;

  struct Surface {
    std::filesystem::path file;  // already relative to the scene's folder
    double metres_per_unit = 1e-3;
    bool operator==(const Surface&) const = default;
  };
  struct Capsule {
    double radius = 0, length = 0;
    Vector axis{0, 0, 1};  // unit length
    int samples = 0;
    bool operator==(const Capsule&) const = default;
  };
  struct KeyFrame {
    double time = 0;  // s
    Vector position{};
    bool operator==(const KeyFrame&) const = default;
  };
  struct Grip {
    std::optional<Vector> nearest;
    Vector box_min{}, box_max{};  // where nearest is not given
    unsigned axes = 7;            // bits 1, 2, 4: x, y, z
    int line = 0;
    bool operator==(const Grip&) const = default;
  };
  // Where a tool presses, said without coordinates of a path: a point of the surface, and depths below it along its normal.
  struct Place {
    enum class At { foremost, hindmost, leftmost, rightmost, uppermost, lowest };
    std::optional<At> at;
    std::optional<Vector> near;                // where at is not given
    std::vector<std::array<double, 2>> depth;  // s, m below the surface at rest; below 0 in front of it
    bool operator==(const Place&) const = default;
  };
  // What holds places of the surface together, or to a point of the world (palpate_link of palpate.h). A thread may run through several
  // places: its stretches then share its length.
  struct Link {
    enum class Kind { thread, spring, clip };
    std::string name;
    Kind kind = Kind::thread;
    std::vector<Vector> places;                      // m; each holds the point of the surface that is nearest to it
    std::optional<Vector> world;                     // m: the last end, which stands in the world
    std::vector<std::array<double, 2>> rest_length;  // s, m, of the whole thread; empty: that at rest
    std::vector<std::array<double, 2>> stiffness;    // s, N/m; empty: infinite
    std::optional<double> breaking_force;            // N
    double radius = 0;                               // m
    std::size_t organ = 0;                           // of a scene of several organs
    std::vector<std::size_t> organs;                 // [place] of each place, of a link between organs; else empty
    int line = 0;
    bool operator==(const Link&) const = default;
  };
  // By how much a motion of the bundle moves the organ (palpate_scene_set_motions of palpate.h). Amounts in the file's units: a piston in
  // its lengths, a rotation in degrees.
  struct Motion {
    struct Sine {
      double mean = 0, amplitude = 0, period = 0;  // period: s
      bool operator==(const Sine&) const = default;
    };
    std::string name;
    std::optional<Sine> sine;
    std::vector<std::array<double, 2>> amounts;  // s, amount; where there is no sine
    std::size_t organ = 0;                       // of a scene of several organs
    int line = 0;
    bool operator==(const Motion&) const = default;
  };
  // What a patch of the surface bears (palpate_scene_set_load of palpate_loads.h).
  struct Load {
    std::string name;
    std::optional<Place::At> at;
    std::optional<Vector> near;     // m, where at is not given
    double radius = 0;              // m
    std::vector<KeyFrame> vectors;  // N in all or Pa; at least one, times ascending
    bool per_area = false, in_world = true;
    std::size_t organ = 0;  // of a scene of several organs
    int line = 0;
    bool operator==(const Load&) const = default;
  };
  // A rigid surface that organs do not enter (palpate_obstacle of palpate_obstacles.h). In the world.
  struct Obstacle {
    enum class Kind { rectangle, disc, mesh };
    std::string name;
    Kind kind = Kind::rectangle;
    std::array<double, 2> size{};    // m: of a rectangle its lengths, of a disc its radius
    std::optional<Surface> surface;  // of a mesh
    Vector normal{0, 0, 1};          // of any length, not zero: of a rectangle and a disc, to the side of the organ
    std::vector<KeyFrame> path;      // at least one, times ascending
    std::vector<KeyFrame> turn;      // as of a tool; turns the normal too
    double friction = 0;
    std::optional<double> depth;      // m
    std::vector<std::size_t> organs;  // that it holds off, of a scene of several organs
    int line = 0;
    bool operator==(const Obstacle&) const = default;
  };
  // A line that cuts the organ where it passes (palpate_blade of palpate_cut.h). In the world.
  struct Blade {
    std::string name;
    std::vector<Vector> edge;                 // m, in the blade's frame, from heel to tip
    std::vector<KeyFrame> path;               // at least one, times ascending
    std::vector<KeyFrame> turn;               // as of a tool
    std::vector<std::array<double, 2>> cuts;  // s: from, until; ascending; empty: always
    double toughness = 0;                     // J/m^2; 0: it feels nothing
    double friction = 0;                      // Pa, of its flanks
    double width = 0;                         // m, of these behind the edge
    Vector direction{};     // where the edge looks, of any length, in its frame; zero without toughness
    std::size_t organ = 0;  // of a scene of several organs
    int line = 0;
    bool operator==(const Blade&) const = default;
  };
  // Tissue that is taken away around a place (palpate_scene_remove_tissue of palpate_cut.h). In the world.
  struct Removal {
    std::string name;
    std::vector<KeyFrame> path;                // at least one, times ascending
    double radius = 0;                         // m
    std::vector<std::array<double, 2>> times;  // s: from, until; ascending; once where both are the same
    double every = 0.02;                       // s, from one removal to the next
    double contact_time = 0;                   // s, that tissue is to be within the radius before it goes
    std::size_t organ = 0;                     // of a scene of several organs
    int line = 0;
    bool operator==(const Removal&) const = default;
  };
  // A surface that the tissue carries along (palpate_scene_carry of palpate.h).
  struct Carried {
    std::string name;            // letters, digits, - and _
    std::filesystem::path file;  // already relative to the scene's folder
    double metres_per_unit = 1e-3;
    double within = 0;      // m, of the mesh
    std::size_t organ = 0;  // of a scene of several organs
    int line = 0;
    bool operator==(const Carried&) const = default;
  };
  // Jaws of a tool (palpate_grasp of palpate.h).
  struct Grasp {
    Vector near{};                   // m; the first disc holds the point of the surface that is nearest to it
    std::optional<Vector> opposite;  // m; the same of the second disc
    double radius = 0;               // m
    std::vector<std::array<double, 2>> closing;   // s, m
    std::optional<double> friction, clamp_force;  // 1, N
    std::vector<std::array<double, 2>> closed;    // s: from, until; ascending; empty: always
    int line = 0;
    bool operator==(const Grasp&) const = default;
  };
  // A needle of a tool (palpate_needle of palpate.h). Its tip is the tool's position.
  struct Needle {
    std::optional<Vector> entry;                   // m; absent: where the tool is placed
    std::optional<Vector> direction;               // of any length; absent: against the surface's normal at the entry
    double radius = 0;                             // m
    double friction = 0;                           // N/m
    double puncture_force = 0, cutting_force = 0;  // N
    double spacing = 5e-3;                         // m
    int line = 0;
    bool operator==(const Needle&) const = default;
  };
  // The force that a tool presses with (palpate_given_force of palpate_force_control.h).
  struct GivenForce {
    std::vector<KeyFrame> forces;  // N in the world; at least one, times ascending
    std::optional<double> speed;   // m/s
    int line = 0;
    bool operator==(const GivenForce&) const = default;
  };
  struct Tool {
    std::string name;
    std::vector<Vector> points;
    std::optional<Capsule> capsule;
    std::vector<Grip> grips;
    std::optional<Place> place;
    std::vector<KeyFrame> path;  // at least one, times ascending; with a place the player fills in the positions
    std::vector<KeyFrame> turn;  // axis times angle in degrees, times ascending; empty: it does not turn
    std::optional<Grasp> grasp;
    std::optional<Needle> needle;
    std::optional<GivenForce> given_force;
    double disc_radius = 0;  // m
    double friction = 0;
    bool hold = false;
    std::vector<std::array<double, 2>> away;  // s: from, until; ascending
    std::size_t organ = 0;  // of a scene of several organs: that the place, grips, grasp, needle and force are on
    int line = 0;
    bool operator==(const Tool&) const = default;
  };
  // One organ of several.
  struct Organ {
    std::string name;              // letters, digits, - and _
    std::filesystem::path bundle;  // already relative to the scene's folder; empty where the scene names none
    Vector position{}, turn{};     // m; axis times angle in degrees: where the organ's frame is in the world
    SceneEffects effects;          // [effects] of the scene, and [organ.effects] over it
    std::optional<Surface> surface;
    int line = 0;
    bool operator==(const Organ&) const = default;
  };

  std::string name;
  std::filesystem::path file;
  std::filesystem::path bundle;    // already relative to the scene's folder; empty where the scene names none
  std::optional<Surface> surface;  // a finer one than the bundle's, which tools meet
  double touch_hz = 1000, shape_hz = 60, deform_hz = 100;
  std::optional<double> displacement;  // m, up to which the scene takes the linear model; beyond, it warns
  std::vector<Tool> tools;
  std::vector<Link> links;
  std::vector<Motion> motions;
  std::vector<Load> loads;
  std::vector<Obstacle> obstacles;
  std::vector<Blade> blades;
  std::vector<Removal> removals;
  std::vector<Carried> carried;
  double metres_per_unit = 1;      // of the file's lengths, for amounts of pistons
  double csv_metres_per_unit = 1;  // of lengths in the CSV files of the results
  std::vector<Organ> organs;
  int pairs = 0;              // places at most where organs are held apart; 0: they pass through one another
  double organ_friction = 0;  // between organs
  bool operator==(const SceneConfig&) const = default;
};

// Errors: InputError with file, line, key, expected and found.
SceneConfig read_scene_config(const std::filesystem::path& file);

// The scene of one organ of several: with its bundle, effects, links, motions and blades, the obstacles that hold it off, and
// with all tools, which hold this organ alone.
SceneConfig organ_scene(const SceneConfig& scene, std::size_t organ);

}  // namespace palpate
