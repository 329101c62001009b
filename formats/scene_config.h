// scene.toml: which bundle is touched, with which effects, by which tools, along which paths.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace palpate {

// scene.toml
//
//   name = "push"
//   bundle = "bundle.h5"           # beside the scene file; palpate-run --bundle overrides
//   unit = "mm"                    # of every length below: m, cm, mm, um
//
//   [effects]                      # all optional; the defaults are shown
//   collision = "rest"             # off, rest, deformed
//   contact = "point"              # node, triangle, point, patch; patch where a tool has a radius
//   law = "sticking"               # sticking, sliding, unilateral, coulomb: how tool points hold; grips always stick
//   force = "linear"               # off, linear, response
//   shape = "surface"              # off, surface, volume
//   radial = "off"                 # off, response
//   preload = false
//
//   [relaxation]                   # optional: force relaxes while a displacement is held; at most 8 terms
//   terms = [[0.45, 0.5], [0.365, 50]]   # share of the force at once that is lost, s; shares together below 1
//   source = "..."                 # where the numbers are from
//
//   [rate]                         # optional
//   touch = 1000                   # Hz
//   shape = 60                     # Hz, at most touch
//
//   [limits]                       # optional; by default as many points and contact nodes as the tools can need
//   points = 64                    # tool points and grips of all tools together
//   contact_nodes = 192
//   force = 50                     # N, length of each tool's force
//   force_slew = 1e4               # N/s, on the change of each tool's force
//
//   [[tool]]                       # 1 .. 8 of them
//   name = "probe"
//   points = [[0, 0, 0]]           # in the tool's frame, which moves along path without turning
//   capsule = { radius = 4, length = 60, axis = [0, 0, 1], samples = 40 }
//                                  # optional, adds points: the capsule's skin; the tool's origin is the centre of its
//                                  # first cap, the axis runs from there to the second
//   radius = 3                     # optional: each point is a flat disc of this radius, under contact = "patch"
//   friction = 0.2                 # optional, 0 .. 100: of the law coulomb
//   hold = false                   # true: a contact is held when the tool leaves, and pulls
//   path = [[0, x, y, z], ...]     # key frames: seconds and position, straight lines between them
//   path_csv = "path.csv"          # or, beside the scene file, rows of time,x,y,z; '#' comments and one header line
//
//   [[tool.grip]]                  # optional: nodes that are moved whatever the collision finds, by path(t) -
//   path(start) nearest = [x, y, z]            # the touchable node nearest to this point box = { min = [x, y, z], max
//   = [x, y, z] }   # or every touchable node inside axes = "xyz"                   # imposed axes; the others stay
//   force-free
struct SceneConfig {
  using Vector = std::array<double, 3>;

  enum class Collision { off, rest, deformed };
  enum class Contact { node, triangle, point, patch };
  enum class Law { sticking, sliding, unilateral, coulomb };
  enum class Force { off, linear, response };
  enum class Shape { off, surface, volume };
  enum class Radial { off, response };

  struct Limits {
    std::optional<int> points, contact_nodes;
    double force = 50;        // N
    double force_slew = 1e4;  // N/s
  };
  struct Relaxation {
    std::vector<std::array<double, 2>> terms;  // share, s
    std::string source;
  };
  struct Capsule {
    double radius = 0, length = 0;
    Vector axis{0, 0, 1};  // unit length
    int samples = 0;
  };
  struct KeyFrame {
    double time = 0;  // s
    Vector position{};
  };
  struct Grip {
    std::optional<Vector> nearest;
    Vector box_min{}, box_max{};  // where nearest is not given
    unsigned axes = 7;            // bits 1, 2, 4: x, y, z
    int line = 0;
  };
  struct Tool {
    std::string name;
    std::vector<Vector> points;
    std::optional<Capsule> capsule;
    std::vector<Grip> grips;
    std::vector<KeyFrame> path;  // at least one, times ascending
    double radius = 0;           // m
    double friction = 0;
    bool hold = false;
    int line = 0;
  };

  std::string name;
  std::filesystem::path file;
  std::filesystem::path bundle;  // already relative to the scene's folder; empty where the scene names none
  Collision collision = Collision::rest;
  Contact contact = Contact::point;
  Law law = Law::sticking;
  Force force = Force::linear;
  Shape shape = Shape::surface;
  Radial radial = Radial::off;
  bool preload = false;
  std::optional<Relaxation> relaxation;
  double touch_hz = 1000, shape_hz = 60;
  Limits limits;
  std::vector<Tool> tools;
};

// Reads a scene; every length is in metres afterwards. Errors: InputError with file, line, key, expected and found; an
// unknown key is an error.
SceneConfig read_scene_config(const std::filesystem::path& file);

}  // namespace palpate
