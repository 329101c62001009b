// organ.toml and boundary/NAME.toml: what the organ is made of, what holds it, and where a tool may touch it.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "formats/tetrahedral_mesh.h"
#include "formats/tissue_laws.h"

namespace palpate {

// A number in SI units, and where it is from. The reader refuses an empty source: published values of one tissue differ by
// factors of ten and more.
struct SourcedValue {
  double value = 0;
  std::string source;
  bool operator==(const SourcedValue&) const = default;
};

// The finite element. p1: linear, as in the paper. p1_anp: linear, with the volume change averaged at the nodes, for nearly
// incompressible tissue. p1_ang: in addition most of the shear follows a gradient averaged at the nodes, for bending. p2_p0: quadratic, with one mean volume change in each tetrahedron; the most accurate.
enum class Element { p1, p1_anp, p1_ang, p2_p0 };
const char* name_of(Element element);  // "p1", "p1-anp", "p1-ang", "p2-p0"

struct LengthUnit {
  std::string name = "m";
  double metres = 1;
  bool operator==(const LengthUnit&) const = default;
};

// A row of the section large/law: the law's number and its constants; and where these are from.
struct StoredTissueLaw {
  std::array<double, formats::kLawNumbers> numbers{};
  std::string source;
  bool operator==(const StoredTissueLaw&) const = default;
};

// organ.toml, in SI units. docs/files.md explains the keys; formats/config_keys.cpp lists them.
struct OrganConfig {
  struct Region {
    std::string name;
    SourcedValue young, poisson;
    std::optional<SourcedValue> density;
    // The law of large deformation: at most one of the two; none: neo-Hookean.
    std::optional<SourcedValue> stiffening = {};  // b of the exponential law
    std::optional<StoredTissueLaw> law = {};      // Yeoh or Ogden
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

// A file beside a config that the config reads.
struct NamedFile {
  std::string name;            // as the config writes it
  std::filesystem::path path;  // a relative name is relative to the config's folder
  bool operator==(const NamedFile&) const = default;
};

// `select` of a boundary file: picks nodes of the surface, or of the whole mesh.
struct Selector {
  enum class Kind {
    box,
    sphere,
    half_space,
    nearest,
    below_quantile,
    patch,
    contact,
    everything,
    facing,
    label,
    all_of,
    any_of,
    none_of
  } kind;
  bool whole_mesh = false;
  std::array<double, 3> a{}, b{};               // box: min, max; sphere: centre; half_space: point, normal; direction
  double number = 0;                            // radius, quantile, degrees or distance
  std::vector<std::array<double, 3>> points{};  // nearest
  std::vector<std::string> names{};             // patch, contact
  std::vector<double> labels{};                 // label
  std::optional<NamedFile> image{};             // label; none: the image that the mesh was made from
  std::vector<Selector> inner{};                // all_of, any_of, none_of
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
  // Springs between every point of the selected surface and the world.
  struct Foundation {
    std::string name;
    SourcedValue normal, tangential;  // N/m^3: N/m per m^2 of surface; one of them may be 0
    std::vector<Selector> select;
    int line = 0;
    bool operator==(const Foundation&) const = default;
  };
  std::vector<Foundation> foundations;
  // Springs from the nodes `from` to the nodes `to`, to one point of the world, or to the world.
  struct Spring {
    std::string name;
    SourcedValue stiffness;  // N/m, of all nodes together
    std::vector<Selector> from{}, to{};
    std::optional<std::array<double, 3>> anchor{};  // at most one of to and anchor
    int line = 0;
    bool operator==(const Spring&) const = default;
  };
  std::vector<Spring> springs;
  // What moves the organ from outside: supports that move, pressure on a surface, gravity.
  struct Motion {
    enum class Kind { piston, rotation, field, pressure, gravity } kind;
    std::string name;
    std::array<double, 3> axis{},
        point{};                     // piston and rotation: not zero, of any length; rotation: a point of the axis
    NamedFile file{};                // field: a CSV with the columns x,y,z,ux,uy,uz
    std::vector<Selector> select{};  // which supports move, empty: all; pressure: which triangles
    int line = 0;
    bool operator==(const Motion&) const = default;
  };
  std::vector<Motion> motions;
  // A capsule around the segment from - to, or a ball where both are one point: where a needle may hold tissue inside the organ.
  struct Corridor {
    std::string name;
    std::array<double, 3> from{}, to{};
    double radius = 0;
    int line = 0;
    bool operator==(const Corridor&) const = default;
  };
  std::vector<Corridor> corridors;
  // The nodes that a cut at run time may divide. reserve: new nodes that it may make; -1: as many as the region has, 500 at most.
  struct Cut {
    std::vector<Selector> region;
    int line = 0;
    std::int64_t reserve = -1;
    bool operator==(const Cut&) const = default;
  };
  std::optional<Cut> cut;
  std::vector<Selector> touchable;  // empty: all
  std::optional<std::array<double, 3>> gravity;
  bool store_interior = false, store_large_deformation = false;
  bool operator==(const BoundaryConfig&) const = default;
};
BoundaryConfig read_boundary_config(const std::filesystem::path& file);

// The files that both configs read, by the provenance's key for their hash: "curve_sha256", "label_image_sha256 ../painted.nrrd",
// "motion_file_sha256 field.csv". The name is the one that the boundary file writes, so that the key stays where an organ's
// folder is moved, and two files of one name in two folders have two keys.
std::map<std::string, std::filesystem::path> files_of(const OrganConfig& organ, const BoundaryConfig& boundary);

// Answers a `label` selector: for each node of the mesh, 1 where it is within the selector's distance of one of its labels.
using LabelledNodes = std::function<std::vector<char>(const Selector&)>;

// The selected nodes of the mesh, ascending, without repeats. Errors: InputError when a selector, also one inside of another,
// picks nothing or names a patch or region the mesh has not (lists those it has), and where a `label` is asked for without
// labelled. Warns where a place of `nearest` is farther from its node than the node's longest edge. file: the name of the
// boundary file, for refusals.
std::vector<std::int32_t> select_nodes(const std::vector<Selector>& selectors, const TetrahedralMesh& mesh,
                                       const std::vector<std::int32_t>& surface_nodes,
                                       const std::filesystem::path& file, const LabelledNodes& labelled = {});

}  // namespace palpate
