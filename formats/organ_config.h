// organ.toml and boundary/*.toml: what the organ is made of, where it is held, where it may be touched.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "formats/tetrahedral_mesh.h"

namespace palpate {

// A number with the place it was taken from. In TOML: young = { value = 5.4, unit = "kPa", source = "..." }.
// Stored in SI. source must not be empty: a published tissue value spreads over decades.
struct SourcedValue {
  double value = 0;
  std::string source;
};

// What the displacement is between the vertices: linear, as in the paper; linear with the dilatation averaged over nodes,
// for nearly incompressible tissue; quadratic with one mean dilatation per tetrahedron, the accurate one.
enum class Element { p1, p1_anp, p2_p0 };
const char* name_of(Element element);  // "p1", "p1-anp", "p2-p0"

// organ.toml
//
//   name = "liver"
//   mesh_unit = "mm"             # of the mesh file: m, cm, mm, um
//   frame = "LPS"                # what the axes mean: LPS, RAS or "none"
//   element = "p1-anp"           # p1, p1-anp, p2-p0: precompute/ELEMENTS.md
//
//   [[region]]                   # one per region of the mesh, found by name
//   name = "liver"
//   young   = { value = 5.4, unit = "kPa", source = "..." }    # Pa, kPa, MPa, GPa; 1e-6 to 1e15 Pa
//   poisson = { value = 0.45, source = "..." }                 # -1 < nu < 0.5, 1e-6 from both
//   density = { value = 1060, unit = "kg/m^3", source = "..." }  # only needed by gravity; also g/cm^3
//
//   [response]                   # optional: measured curve of a cylinder, for P and Q
//   curve = "curves/NAME.csv"    # beside organ.toml; columns displacement_mm,force_N[,radial_mm]; '#' comments
//   source = "..."
//   height = { value = 13, unit = "mm" }
//   radius = { value = 15, unit = "mm" }
//   young = ...; poisson = ...   # of the linear model the curve corrects, as above
//   degree = 5                   # 4 .. 10
struct OrganConfig {
  struct Region {
    std::string name;
    SourcedValue young, poisson;
    std::optional<SourcedValue> density;
  };
  struct Response {
    std::filesystem::path curve;
    std::string source;
    double height = 0, radius = 0;  // m
    double young = 0, poisson = 0;
    int degree = 5;
  };
  std::string name, frame;
  Element element = Element::p1;
  double metres_per_mesh_unit = 1;
  std::vector<Region> regions;
  std::optional<Response> response;
};

// Errors: InputError with file, line, key, expected and found; an unknown key is an error.
OrganConfig read_organ_config(const std::filesystem::path& file);

// A selector picks nodes of the surface (where = "surface") or of the whole mesh (where = "all", the default of patch and
// contact, which name their nodes; the others default to the surface). select = { box = { ... }, where = "all" }.
//   select = { box = { min = [x, y, z], max = [x, y, z] } }                mesh units
//   select = { sphere = { center = [x, y, z], radius = r } }
//   select = { half_space = { point = [x, y, z], normal = [x, y, z] } }    the side the normal points away from
//   select = { nearest = { points = [[x, y, z], ...] } }                   one node per point
//   select = { below_quantile = { direction = [x, y, z], quantile = 0.2 } }
//   select = { patch = "name" }                                            named surface patch of the mesh
//   select = { contact = ["label a", "label b"] }                          nodes shared by two regions
//   select = { everything = true }
// Several selectors in an array are united: select = [ {...}, {...} ].
struct Selector;

// boundary/NAME.toml
//
//   name = "back"
//   [[fixed]]
//   dofs = "xyz"                 # any of x, y, z
//   select = ...
//   [touchable]                  # default: every surface node with a free dof
//   select = ...
//   [preload]                    # optional body force
//   gravity = { value = [0, 0, -9.81], unit = "m/s^2" }
//   [store]
//   interior = false             # also displacement_interior
struct BoundaryConfig {
  std::string name;
  struct Fixed {
    std::array<bool, 3> dofs{};
    std::vector<Selector> select;
    int line = 0;
  };
  std::vector<Fixed> fixed;
  std::vector<Selector> touchable;  // empty: all
  std::optional<std::array<double, 3>> gravity;
  bool store_interior = false;
};
BoundaryConfig read_boundary_config(const std::filesystem::path& file);

struct Selector {
  enum class Kind { box, sphere, half_space, nearest, below_quantile, patch, contact, everything } kind;
  bool whole_mesh = false;
  std::array<double, 3> a{}, b{};             // box min/max; centre; point/normal; direction
  double number = 0;                          // radius or quantile
  std::vector<std::array<double, 3>> points;  // nearest
  std::vector<std::string> names;             // patch, contact
  int line = 0;
};

// The selected nodes of the mesh, ascending, without repeats. Errors: InputError when a selector picks nothing or names
// a patch or region the mesh has not (lists those it has). file is for the sentence.
std::vector<std::int32_t> select_nodes(const std::vector<Selector>& selectors, const TetrahedralMesh& mesh,
                                       const std::vector<std::int32_t>& surface_nodes,
                                       const std::filesystem::path& file);

}  // namespace palpate
