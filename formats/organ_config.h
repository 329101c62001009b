// organ.toml and boundary/NAME.toml: what the organ is made of, what holds it, and where a tool may touch it.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "formats/tetrahedral_mesh.h"

namespace palpate {

// A number in SI units, and where it is from. The reader refuses an empty source: published values of one tissue differ by
// factors of ten and more.
struct SourcedValue {
  double value = 0;
  std::string source;
  bool operator==(const SourcedValue&) const = default;
};

// The finite element. p1: linear, as in the paper. p1_anp: linear, with the volume change averaged at the nodes, for nearly
// incompressible tissue. p2_p0: quadratic, with one mean volume change in each tetrahedron; the most accurate.
enum class Element { p1, p1_anp, p2_p0 };
const char* name_of(Element element);  // "p1", "p1-anp", "p2-p0"

struct LengthUnit {
  std::string name = "m";
  double metres = 1;
  bool operator==(const LengthUnit&) const = default;
};

// organ.toml, in SI units. docs/files.md explains the keys; formats/config_keys.cpp lists them.
struct OrganConfig {
  struct Region {
    std::string name;
    SourcedValue young, poisson;
    std::optional<SourcedValue> density;
    bool operator==(const Region&) const = default;
  };
  struct Response {
    std::filesystem::path curve;
    std::string source;
    double height = 0, radius = 0;  // m
    double young = 0, poisson = 0;
    int degree = 5;
    bool operator==(const Response&) const = default;
  };
  std::string name, frame;
  Element element = Element::p1;
  LengthUnit mesh_unit;
  std::vector<Region> regions;
  std::optional<Response> response;
  bool operator==(const OrganConfig&) const = default;
};

// Errors: InputError with file, line, key, expected and found; an unknown key is an error.
OrganConfig read_organ_config(const std::filesystem::path& file);

// `select` of a boundary file: picks nodes of the surface, or of the whole mesh.
struct Selector {
  enum class Kind { box, sphere, half_space, nearest, below_quantile, patch, contact, everything } kind;
  bool whole_mesh = false;
  std::array<double, 3> a{}, b{};             // box: min, max; sphere: centre; half_space: point, normal; direction
  double number = 0;                          // radius or quantile
  std::vector<std::array<double, 3>> points;  // nearest
  std::vector<std::string> names;             // patch, contact
  int line = 0;
  bool operator==(const Selector&) const = default;
};

// boundary/NAME.toml. Points stay in the mesh's unit; gravity is in m/s^2.
struct BoundaryConfig {
  std::string name;
  struct Fixed {
    std::array<bool, 3> dofs{};
    std::vector<Selector> select;
    int line = 0;
    bool operator==(const Fixed&) const = default;
  };
  std::vector<Fixed> fixed;
  std::vector<Selector> touchable;  // empty: all
  std::optional<std::array<double, 3>> gravity;
  bool store_interior = false;
  bool operator==(const BoundaryConfig&) const = default;
};
BoundaryConfig read_boundary_config(const std::filesystem::path& file);

// The selected nodes of the mesh, ascending, without repeats. Errors: InputError when a selector picks nothing or names
// a patch or region the mesh has not (lists those it has). file: the name of the boundary file, for refusals.
std::vector<std::int32_t> select_nodes(const std::vector<Selector>& selectors, const TetrahedralMesh& mesh,
                                       const std::vector<std::int32_t>& surface_nodes,
                                       const std::filesystem::path& file);

}  // namespace palpate
