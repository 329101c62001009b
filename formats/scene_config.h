// scene.toml: the bundle, the effects, the tools and their paths.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace palpate {

// docs/files.md explains the keys; formats/config_keys.cpp lists them. Lengths are in metres here.
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
    double force = 50;                       // N
    double force_slew = 1e4;                 // N/s
    double tool_speed = 10;                  // m/s
    std::optional<double> release_distance;  // m
    bool operator==(const Limits&) const = default;
  };
  struct Relaxation {
    std::vector<std::array<double, 2>> terms;  // share, s
    std::string source;
    bool operator==(const Relaxation&) const = default;
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
  struct Tool {
    std::string name;
    std::vector<Vector> points;
    std::optional<Capsule> capsule;
    std::vector<Grip> grips;
    std::vector<KeyFrame> path;  // at least one, times ascending
    double disc_radius = 0;      // m
    double friction = 0;
    bool hold = false;
    int line = 0;
    bool operator==(const Tool&) const = default;
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
  bool operator==(const SceneConfig&) const = default;
};

// Errors: InputError with file, line, key, expected and found.
SceneConfig read_scene_config(const std::filesystem::path& file);

}  // namespace palpate
