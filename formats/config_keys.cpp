#include "formats/config_keys.h"

#include <cstring>

namespace palpate {
namespace {

// The values of examples; of the keys that are not here their type, default or table tells one. table: nullptr for every table.
struct Example {
  const char *table, *key, *value;
};
constexpr Example kExamples[] = {
    {"foundation", "normal", "{ value = 5e4, unit = \"N/m^3\", source = \"assumed\" }"},
    {"foundation", "tangential", "{ value = 1e4, unit = \"N/m^3\", source = \"assumed\" }"},
    {"spring", "stiffness", "{ value = 30, unit = \"N/m\", source = \"assumed\" }"},
    {"spring", "from", "{ nearest = { points = [[0, 0, 0]] } }"},
    {"spring", "to", "{ nearest = { points = [[0, 0, 0]] } }"},
    {"select", "facing", "{ direction = [0, 0, 1], within = 40 }"},
    {"facing", "within", "40"},
    {"select", "label", "{ labels = [2], within = 3 }"},
    {"label", "labels", "[2]"},
    {"select", "and", "[{ patch = \"liver\" }, { facing = { direction = [0, 0, 1], within = 40 } }]"},
    {"select", "or", "[{ patch = \"left\" }, { patch = \"right\" }]"},
    {"select", "not", "{ patch = \"left\" }"},
    {"poisson", "value", "0.45"},
    {"density", "value", "1060"},
    {"gravity", "value", "[0, 9.81, 0]"},
    {"motion", "axis", "[0, 0, 1]"},
    {"motion", "sine", "{ amplitude = 12, period = 4 }"},
    {"motion", "amounts", "[[0, 0], [2, 12]]"},
    {"motion", "amounts_csv", "\"breath.csv\""},
    {"motion", "file", "\"diaphragm.csv\""},
    {nullptr, "value", "5.4"},
    {nullptr, "source", "\"Author year, table 2\""},
    {nullptr, "max", "[10, 10, 10]"},
    {"half_space", "normal", "[0, 0, 1]"},
    {nullptr, "direction", "[0, 0, 1]"},
    {nullptr, "quantile", "0.2"},
    {nullptr, "terms", "[[0.45, 0.5]]"},
    {nullptr, "path", "[[0, 150, 15, 118], [0.5, 150, 24, 118]]"},
    {"capsule", "length", "60"},
    {"link", "places", "[[0, 0, 0], [10, 0, 0]]"},
    {nullptr, "samples", "40"},
};

// The word that most files have, where it is one of the list.
std::string usual_word(const std::string& words) {
  for (const std::string usual : {"mm", "kPa", "p1-anp"})
    if ((", " + words + ",").find(", " + usual + ",") != std::string::npos) return '"' + usual + '"';
  return '"' + words.substr(0, words.find(',')) + '"';
}

std::string example_value(const ConfigKey& key);

// The required keys of an inline table, or an empty text where it has none.
std::string example_table(const ConfigKey& key) {
  std::string inner;
  for (const ConfigKey& one : config_keys())
    if (one.file == key.file && std::strcmp(one.table, key.key) == 0 && std::strcmp(one.standard, "required") == 0)
      inner += (inner.empty() ? "" : ", ") + std::string(one.key) + " = " + example_value(one);
  return inner.empty() ? inner : "{ " + inner + " }";
}

std::string example_value(const ConfigKey& key) {
  for (const Example& example : kExamples)
    if ((!example.table || std::strcmp(example.table, key.table) == 0) && std::strcmp(example.key, key.key) == 0)
      return example.value;
  const std::string type = key.type, standard = key.standard;
  if (standard != "required" && standard != "-") return standard;
  if (type == "table") return example_table(key);
  if (type == "selector") return "{ below_quantile = { direction = [0, 0, 1], quantile = 0.2 } }";
  if (type == "choice") return usual_word(key.limits);
  if (type == "boolean") return "true";
  if (type == "point") return "[0, 0, 0]";
  if (type == "points") return "[[0, 0, 0]]";
  return type == "number" || type == "integer" ? "4" : "\"name\"";
}

}  // namespace

const std::vector<ConfigKey>& config_keys() {
  constexpr auto O = ConfigFile::organ, B = ConfigFile::boundary, S = ConfigFile::scene;
  static const std::vector<ConfigKey> keys = {
      {O, "", "name", "text", "-", "required", "not empty", "The organ's name; the bundle records it."},
      {O, "", "mesh_unit", "choice", "-", "required", "m, cm, mm, um",
       "The length unit of the mesh file, and of every point in `boundary/NAME.toml`."},
      {O, "", "frame", "choice", "-", "required", "LPS, RAS, none",
       "What the axes mean: x, y, z point to the patient's left, posterior, superior (`LPS`, what the meshing programs "
       "write), or right, anterior, superior (`RAS`). `none`: not a patient. The bundle records the word; nothing is "
       "converted."},
      {O, "", "element", "choice", "-", "required", "p1, p1-anp, p2-p0",
       "The finite element (`precompute/ELEMENTS.md`). `p1-anp` is the one for soft tissue; `p1` is the paper's, for "
       "Poisson ratios up to 0.3; `p2-p0` has the least error of force on a mesh and the longest precompute."},
      {O, "", "region", "tables", "-", "required", "one for each region of the mesh, names all different",
       "`[[region]]`: the material of one region."},
      {O, "", "response", "table", "-", "-", "",
       "`[response]`: a measured force curve, from which the program fits the non-linear correction."},
      {O, "region", "name", "text", "-", "required", "not empty",
       "The region's name in the mesh file: the `--region` or `--labels` name given to `palpate-tetrahedra`, else the "
       "surface file's name (`liver` for `liver.ply`)."},
      {O, "region", "young", "table", "-", "required", "1e-6 to 1e15 Pa", "Young's modulus."},
      {O, "region", "poisson", "table", "-", "required", "-1 < value < 0.5, at least 1e-6 away from both",
       "Poisson's ratio."},
      {O, "region", "density", "table", "-", "-", "above 0, at most 1e6 kg/m^3",
       "The density. Needed where the boundary file has a `[preload]`."},
      {O, "region", "stiffening", "table", "-", "-", "above 0, at most 1e4",
       "For `deformation = \"large\"`: the tissue stiffens with strain, W = mu / (2 b) (exp(b x) - 1) with this b. "
       "Without it: neo-Hookean."},
      {O, "young", "value", "number", "`unit`", "required", "see `young`", "The number."},
      {O, "young", "unit", "choice", "-", "required", "Pa, kPa, MPa, GPa", "The unit of `value`."},
      {O, "young", "source", "text", "-", "required", "not empty",
       "Where the number is from: published values of one tissue differ by factors of ten and more."},
      {O, "poisson", "value", "number", "1", "required", "see `poisson`", "The number."},
      {O, "poisson", "source", "text", "-", "required", "not empty", "Where the number is from."},
      {O, "density", "value", "number", "`unit`", "required", "see `density`", "The number."},
      {O, "density", "unit", "choice", "-", "required", "kg/m^3, g/cm^3", "The unit of `value`."},
      {O, "density", "source", "text", "-", "required", "not empty", "Where the number is from."},
      {O, "stiffening", "value", "number", "1", "required", "see `stiffening`", "The number."},
      {O, "stiffening", "source", "text", "-", "required", "not empty", "Where the number is from."},
      {O, "response", "curve", "file", "mm, N", "required",
       "a CSV file with the columns `displacement_mm,force_N` and optionally `radial_mm`; `#` begins a comment",
       "The curve measured when a cylinder is compressed. The path is relative to the folder of `organ.toml`."},
      {O, "response", "source", "text", "-", "required", "not empty", "Where the curve is from."},
      {O, "response", "height", "table", "-", "required", "above 0", "The height of the measured cylinder."},
      {O, "response", "radius", "table", "-", "required", "above 0", "The radius of the measured cylinder."},
      {O, "response", "young", "table", "-", "required", "as in `[[region]]`",
       "Young's modulus of the linear model that the curve corrects."},
      {O, "response", "poisson", "table", "-", "required", "as in `[[region]]`", "Poisson's ratio of that model."},
      {O, "response", "degree", "integer", "-", "5", "4 to 10", "The degree of the fitted polynomials."},
      {O, "height", "value", "number", "`unit`", "required", "above 0", "The number."},
      {O, "height", "unit", "choice", "-", "required", "m, cm, mm, um", "The unit of `value`."},
      {O, "radius", "value", "number", "`unit`", "required", "above 0", "The number."},
      {O, "radius", "unit", "choice", "-", "required", "m, cm, mm, um", "The unit of `value`."},

      {B, "", "name", "text", "-", "required", "not empty",
       "The name of this set of boundary conditions; the bundle records it."},
      {B, "", "fixed", "tables", "-", "-", "together with `foundation` and `spring`: one or more",
       "`[[fixed]]`: nodes that cannot move."},
      {B, "", "foundation", "tables", "-", "-", "names all different",
       "`[[foundation]]`: a piece of the surface that something soft holds, such as the diaphragm."},
      {B, "", "spring", "tables", "-", "-", "names all different",
       "`[[spring]]`: springs between nodes, or from nodes to the world."},
      {B, "", "motion", "tables", "-", "-", "names all different; at most 32, where gravity counts as three",
       "`[[motion]]`: a support that moves, such as the diaphragm of a patient who breathes; pressure on a surface; "
       "gravity."},
      {B, "", "corridor", "tables", "-", "-", "names all different; at most 16",
       "`[[corridor]]`: where a needle may hold tissue inside the organ."},
      {B, "", "touchable", "table", "-", "-", "",
       "`[touchable]`: the nodes that a tool may touch. Without it: every surface node that is free along at least one "
       "axis. Fewer touchable nodes make the computation shorter and the bundle smaller."},
      {B, "", "preload", "table", "-", "-", "", "`[preload]`: a body force that acts before any tool does."},
      {B, "", "store", "table", "-", "-", "", "`[store]`: what the bundle keeps."},
      {B, "fixed", "dofs", "text", "-", "required", "some of the letters x, y, z, each once",
       "The axes along which the nodes cannot move."},
      {B, "fixed", "select", "selector", "-", "required", "", "Which nodes."},
      {B, "foundation", "name", "text", "-", "required", "not empty", "The foundation's name; the bundle records it."},
      {B, "foundation", "normal", "table", "-", "required", "0 to 1e15 N/m^3",
       "The stiffness along the surface's normal, of each square metre. A layer of Young's modulus E and thickness h "
       "that "
       "is free to bulge has E / h."},
      {B, "foundation", "tangential", "table", "-", "-", "0 to 1e15 N/m^3; above 0 where `normal` is 0",
       "The stiffness along the surface. Without it the organ slides there without resistance."},
      {B, "foundation", "select", "selector", "-", "required", "",
       "Which triangles of the surface: those whose three corners are selected."},
      {B, "normal", "value", "number", "`unit`", "required", "see `normal`", "The number."},
      {B, "normal", "unit", "choice", "-", "required", "N/m^3, kPa/cm, kPa/mm",
       "The unit of `value`. 1 kPa/mm is 1e6 N/m^3."},
      {B, "normal", "source", "text", "-", "required", "not empty",
       "Where the number is from; say so where it is assumed."},
      {B, "tangential", "value", "number", "`unit`", "required", "see `tangential`", "The number."},
      {B, "tangential", "unit", "choice", "-", "required", "N/m^3, kPa/cm, kPa/mm", "The unit of `value`."},
      {B, "tangential", "source", "text", "-", "required", "not empty", "Where the number is from."},
      {B, "spring", "name", "text", "-", "required", "not empty", "The spring's name; the bundle records it."},
      {B, "spring", "from", "selector", "-", "required", "", "Where the spring begins: one node or more."},
      {B, "spring", "to", "selector", "-", "-", "not together with `anchor`",
       "Where it ends in the organ: each node of `from` is tied to the nearest node of `to`, along the line between "
       "them. "
       "Nodes at the same place are tied along x, y and z."},
      {B, "spring", "anchor", "point", "`mesh_unit`", "-", "not together with `to`",
       "Where it ends in the world: each node of `from` is tied to this point, along the line to it. Without `to` and "
       "`anchor` each node of `from` is tied to its own place, along x, y and z."},
      {B, "spring", "stiffness", "table", "-", "required", "above 0, at most 1e15 N/m",
       "The stiffness of the whole spring. Each node of `from` has the share that its part of the selected surface "
       "has; "
       "where no triangle is selected, all have the same share."},
      {B, "stiffness", "value", "number", "`unit`", "required", "see `stiffness`", "The number."},
      {B, "stiffness", "unit", "choice", "-", "required", "N/m, N/mm", "The unit of `value`."},
      {B, "stiffness", "source", "text", "-", "required", "not empty", "Where the number is from."},
      {B, "motion", "name", "text", "-", "required", "at most 60 bytes, no control characters",
       "The motion's name, by which scenes and programs call it. `gravity` makes three motions: `NAME x`, `NAME y`, "
       "`NAME z`."},
      {B, "motion", "kind", "choice", "-", "required", "piston, rotation, field, pressure, gravity",
       "What a unit of it is. `piston`: the supports move by 1 m along `axis`. `rotation`: they turn by 1 rad about "
       "`axis` through `point`, linearly: right for small angles. `field`: they move as `file` says, once. `pressure`: "
       "1 Pa on the selected triangles. `gravity`: 1 m/s^2 along x, y or z; every `[[region]]` then needs a "
       "`density`."},
      {B, "motion", "axis", "point", "-", "-", "not zero; required for `piston` and `rotation`, of any length",
       "The direction of the piston; the axis of the rotation, right-handed."},
      {B, "motion", "point", "point", "`mesh_unit`", "-", "required for `rotation`", "A point of the axis."},
      {B, "motion", "file", "file", "`mesh_unit`", "-",
       "required for `field`: a CSV file with the columns `x,y,z,ux,uy,uz`; `#` begins a comment",
       "Where the supports are and by how much they move. Each of them takes the row that is nearest to it, at most "
       "its longest edge away. The path is relative to the folder of the boundary file."},
      {B, "motion", "select", "selector", "-", "-", "required for `pressure`; not for `gravity`",
       "Which supports move: held nodes, foundations and springs to the world; without it all. `pressure`: which "
       "triangles of the surface, those whose three corners are selected; the pressure pushes on the tissue, on the "
       "outer surface inwards and in a cavity outwards."},
      {B, "corridor", "name", "text", "-", "required", "at most 60 bytes, no control characters",
       "The corridor's name; the bundle records it."},
      {B, "corridor", "from", "point", "`mesh_unit`", "required", "coordinates of at most 1e15",
       "One end of the corridor's axis. It may lie outside the organ."},
      {B, "corridor", "to", "point", "`mesh_unit`", "required", "coordinates of at most 1e15",
       "The other end. Where it is `from`, the corridor is a ball."},
      {B, "corridor", "radius", "number", "`mesh_unit`", "required", "above 0, at most 1e15",
       "The distance from the axis up to which tetrahedra belong to the corridor. Their nodes inside the organ get "
       "columns, at most 2,000 in all."},
      {B, "touchable", "select", "selector", "-", "required", "", "Which nodes."},
      {B, "select", "box", "table", "-", "-", "", "The nodes in a box along the axes."},
      {B, "select", "sphere", "table", "-", "-", "", "The nodes in a sphere."},
      {B, "select", "nearest", "table", "-", "-", "", "For each point, the node nearest to it."},
      {B, "select", "half_space", "table", "-", "-", "", "The nodes on one side of a plane."},
      {B, "select", "patch", "text", "-", "-", "a surface patch of the mesh",
       "The nodes of a named surface patch (a physical surface of the MSH file)."},
      {B, "select", "below_quantile", "table", "-", "-", "",
       "The lowest share of the nodes along a direction: the way to say \"the bottom fifth\" without coordinates."},
      {B, "select", "contact", "two texts", "-", "-", "two regions of the mesh", "The nodes that two regions share."},
      {B, "select", "everything", "boolean", "-", "-", "true", "Every node."},
      {B, "select", "facing", "table", "-", "-", "",
       "The surface nodes whose outward normal points in a direction: \"what faces the diaphragm\"."},
      {B, "select", "label", "table", "-", "-", "",
       "The nodes in or near the voxels of a label image: \"where the kidney touches\", or what was painted."},
      {B, "select", "and", "selector", "-", "-", "", "The nodes that all of these selectors pick."},
      {B, "select", "or", "selector", "-", "-", "", "The nodes that any of these selectors picks."},
      {B, "select", "not", "selector", "-", "-", "", "The nodes that none of these selectors picks."},
      {B, "select", "where", "choice", "-", "\"surface\"", "surface, all",
       "Whether a selector picks from the surface nodes or from all nodes. The default is `\"all\"` for `patch`, "
       "`contact`, `and` and `or`."},
      {B, "box", "min", "point", "`mesh_unit`", "required", "each coordinate at most that of `max`",
       "The lowest corner."},
      {B, "box", "max", "point", "`mesh_unit`", "required", "", "The highest corner."},
      {B, "sphere", "center", "point", "`mesh_unit`", "required", "", "The centre."},
      {B, "sphere", "radius", "number", "`mesh_unit`", "required", "above 0", "The radius."},
      {B, "half_space", "point", "point", "`mesh_unit`", "required", "", "A point of the plane."},
      {B, "half_space", "normal", "point", "-", "required", "not zero",
       "A normal of the plane. It points away from the nodes that are selected."},
      {B, "nearest", "points", "points", "`mesh_unit`", "required", "one or more", "The points."},
      {B, "below_quantile", "direction", "point", "-", "required", "not zero",
       "The direction in which \"low\" is measured: low nodes have the smallest coordinate along it."},
      {B, "below_quantile", "quantile", "number", "1", "required", "0 < value <= 1", "The share of the nodes."},
      {B, "facing", "direction", "point", "-", "required", "not zero", "The direction."},
      {B, "facing", "within", "number", "degrees", "required", "above 0, at most 180",
       "The largest angle between normal and direction."},
      {B, "label", "labels", "numbers", "-", "required", "values of the image", "The values of the voxels."},
      {B, "label", "within", "number", "`mesh_unit`", "0", "0 or above",
       "The largest distance between a node and a voxel with one of the labels. 0: the nodes inside such voxels."},
      {B, "label", "image", "file", "mm", "-", "a format that `palpate-surface` reads, but no PNG slices",
       "The image, relative to the folder of the boundary file. Without it: the image that `--image` names."},
      {B, "preload", "gravity", "table", "-", "required", "",
       "The acceleration of gravity. Every `[[region]]` then needs a `density`."},
      {B, "gravity", "value", "point", "`unit`", "required", "components of at most 1e6 m/s^2", "The vector."},
      {B, "gravity", "unit", "choice", "-", "required", "m/s^2", "The unit of `value`."},
      {B, "store", "interior", "boolean", "-", "false", "",
       "Whether the bundle also keeps the displacement of the nodes inside the organ, which `shape = \"volume\"` in "
       "`scene.toml` needs. The bundle becomes several times larger."},
      {B, "store", "large_deformation", "boolean", "-", "false", "",
       "Whether the bundle also keeps what `deformation = \"large\"` in `scene.toml` needs, as `palpate-precompute "
       "--large-deformation` does. For the elements `p1` and `p1-anp`."},

      {S, "", "name", "text", "-", "required", "not empty", "The scene's name; the results record it."},
      {S, "", "bundle", "file", "-", "-", "",
       "The bundle, relative to the scene's folder. Required unless the program is given `--bundle`, which wins."},
      {S, "", "unit", "choice", "-", "required", "m, cm, mm, um", "The unit of every length in this file."},
      {S, "", "effects", "table", "-", "-", "", "`[effects]`: what is computed, and how."},
      {S, "", "relaxation", "table", "-", "-", "", "`[relaxation]`: the force falls while a displacement is held."},
      {S, "", "surface", "table", "-", "-", "",
       "`[surface]`: a finer surface of the organ, which the tools meet in place of the mesh's (docs/method.md, "
       "section 9)."},
      {S, "", "rate", "table", "-", "-", "", "`[rate]`: the rates of the loops."},
      {S, "", "limits", "table", "-", "-", "", "`[limits]`: sizes and safety limits."},
      {S, "", "organ", "tables", "-", "-", "up to 32, names all different",
       "`[[organ]]`: one of several organs, in place of `bundle` and `surface` above. `palpate-run` plays such a "
       "scene."},
      {S, "", "world", "table", "-", "-", "needs `[[organ]]`", "`[world]`: how the organs meet one another."},
      {S, "", "tool", "tables", "-", "required", "1 to 8", "`[[tool]]`: one tool and its path."},
      {S, "", "link", "tables", "-", "-", "at most 1000 stretches together",
       "`[[link]]`: a suture, clip, ligament or spring, which holds places of the organ together or to the world."},
      {S, "", "motion", "tables", "-", "-", "names all different",
       "`[[motion]]`: by how much a motion of the bundle moves the organ, a piston in `unit`, a rotation in degrees, a "
       "field in itself, a pressure in Pa, gravity in m/s^2. It needs `collision = \"deformed\"`, which it also "
       "selects, or `\"off\"`."},
      {S, "", "carried", "tables", "-", "-", "needs `inside = true`; names all different",
       "`[[carried]]`: a surface inside the organ, such as a tumour or a vessel, which the tissue carries along."},
      {S, "effects", "collision", "choice", "-", "\"rest\"", "off, rest, deformed",
       "Where the program looks for contacts: nowhere (grips alone move the organ), on the surface at rest, or on the "
       "deformed surface."},
      {S, "effects", "contact", "choice", "-", "\"point\"", "node, triangle, point, patch",
       "Where a touch acts: on the nearest node, on the three nodes of the touched triangle, on the touched point, or "
       "on a disc. `patch` is the default where a tool has a `disc_radius`, and the only one whose force hardly "
       "depends on the mesh."},
      {S, "effects", "law", "choice", "-", "\"sticking\"", "sticking, sliding, unilateral, coulomb",
       "How a tool's point holds the surface: it sticks in all directions; it slides freely and may pull; it slides "
       "freely and only pushes; it pushes, and sticks until friction gives way. A grip always sticks."},
      {S, "effects", "force", "choice", "-", "\"linear\"", "off, linear, response",
       "The force on the tool: none, the linear model's, or that force corrected by the measured curve (`[response]` "
       "of `organ.toml`)."},
      {S, "effects", "shape", "choice", "-", "\"surface\"", "off, surface, volume",
       "The deformed nodes: none, those of the surface, or all (`volume`, which needs `interior = true` in the "
       "boundary file)."},
      {S, "effects", "radial", "choice", "-", "\"off\"", "off, response",
       "The displacement across a tool's motion: as the linear model has it, or corrected by the measured curve."},
      {S, "effects", "deformation", "choice", "-", "\"linear\"", "linear, large, large-beside, large-renewed",
       "How the organ deforms: by superposition of the tensors, or as a hyperelastic body, right at any depth. "
       "`large-beside` solves that body beside the touch, for organs that are too large to be solved in each touch "
       "step. `large-renewed` is the same for slender parts and a Poisson's ratio above 0.495. "
       "They need `large_deformation = true` in `[store]` of the boundary file, and none of `response`."},
      {S, "effects", "dent", "choice", "-", "\"off\"", "off, discs",
       "Whether the mesh of `palpate-run --render-mesh` sinks to the disc of each contact where the bundle's mesh is "
       "too "
       "coarse to show it. It changes what is drawn, and no force. It needs a tool with a `disc_radius`."},
      {S, "effects", "preload", "boolean", "-", "false", "",
       "Whether the organ is shown under the `[preload]` of the boundary file."},
      {S, "effects", "inside", "boolean", "-", "false", "needs `shape = \"volume\"`",
       "Whether the files of the shapes have strain and stress (docs/method.md, section 20), and `[[carried]]` "
       "surfaces "
       "follow the tissue. The bundle has the element `p1` or `p1-anp`."},
      {S, "organ", "name", "text", "-", "required", "letters, digits, - and _",
       "The organ's name in this file, in the results and in `--bundle NAME=FILE`."},
      {S, "organ", "bundle", "file", "-", "-", "",
       "The organ's bundle, relative to the scene's folder. Required unless the program is given `--bundle NAME=FILE`, "
       "which wins. Several organs may have one bundle."},
      {S, "organ", "position", "point", "`unit`", "[0, 0, 0]", "",
       "Where the origin of the bundle's coordinates is in the world."},
      {S, "organ", "turn", "point", "degrees", "[0, 0, 0]", "at most 1e6 degrees",
       "How far the organ is turned about that origin: a vector along the axis whose length is the angle."},
      {S, "organ", "effects", "table", "-", "-", "",
       "`[organ.effects]`: the keys of `[effects]` that are different for this organ."},
      {S, "organ", "relaxation", "table", "-", "-", "", "`[organ.relaxation]`: in place of `[relaxation]`."},
      {S, "organ", "surface", "table", "-", "-", "needs `pairs = 0`",
       "`[organ.surface]`: as `[surface]`, of this organ."},
      {S, "world", "pairs", "integer", "-", "0", "0 to 1000",
       "At how many places at most organs are held apart. With 0 they pass through one another, which costs nothing. "
       "Above 0 the organs need `deformation = \"linear\"` and `collision = \"deformed\"`, which it also selects."},
      {S, "world", "friction", "number", "1", "0", "0 to 100; above 0 needs `pairs`",
       "The coefficient of friction between organs."},
      {S, "relaxation", "terms", "rows", "1, s", "required",
       "1 to 8 rows; shares of at least 0, below 1 together; times above 0 s",
       "Rows `[share, seconds]`: the share of the force at once that is lost, and the time constant of the loss."},
      {S, "relaxation", "source", "text", "-", "required", "not empty", "Where the numbers are from."},
      {S, "surface", "file", "file", "`unit`", "required", "a closed surface (.ply)",
       "The surface, as `palpate-surface` writes it. The path is relative to the folder of this file. The places that "
       "`at` "
       "and `near` of a tool find stay those of the mesh."},
      {S, "surface", "unit", "choice", "-", "\"mm\"", "m, cm, mm, um", "The unit of the surface's positions."},
      {S, "rate", "touch", "number", "Hz", "1000", "1e-6 to 1e6", "Steps of the haptic loop in a second."},
      {S, "rate", "shape", "number", "Hz", "60", "1e-6 to `touch`", "Shapes in a second."},
      {S, "rate", "deform", "number", "Hz", "100", "1e-6 to `touch`",
       "With `deformation = \"large-beside\"` or `\"large-renewed\"`: solves of the body in a second. A solve is of "
       "the touch step before it, "
       "and "
       "the "
       "next touch step has it. Against the clock (`--realtime`) the body is solved as often as a thread can."},
      {S, "limits", "points", "integer", "-", "-", "1 to 65536",
       "Tool points and grips of all tools together. By default: as many as the tools have."},
      {S, "limits", "contact_nodes", "integer", "-", "-", "1 to 3000",
       "Nodes in contact at one time, at least one for each point (three under triangle), link and grasp. A needle "
       "takes "
       "four for each place that it holds. Where they are short, discs act on fewer nodes, and the step's flag says "
       "so. "
       "By default: as many as the tools need, up to 1000, or three for each point."},
      {S, "limits", "needle_places", "integer", "-", "32", "2 to 64",
       "Places of the tissue that a needle holds at most. A needle that needs more stays where it is, and the step's "
       "flag says so."},
      {S, "limits", "force", "number", "N", "50", "above 0",
       "The largest force on one tool; a larger one is cut to this length, and the step's flag says so."},
      {S, "limits", "force_slew", "number", "N/s", "10000.0", "above 0",
       "The fastest change of the force on one tool."},
      {S, "limits", "tool_speed", "number", "m/s", "10.0", "above 0",
       "A tool point that moves faster has lost its tracking: it has no contact, and the step's flag says so."},
      {S, "limits", "release_distance", "number", "m", "-", "above 0",
       "A contact ends where its tool point is farther than this from its anchor. By default: a fifth of the diagonal "
       "of the "
       "organ's box."},
      {S, "limits", "displacement", "number", "m", "-", "above 0",
       "Where the organ moves by more than this, `palpate-run` warns; nothing is cut. By default and with "
       "`deformation = \"linear\"`: the least of the bundle's own figure (`accuracy_linear_limit_mm`) or else 10 mm, "
       "and a "
       "tenth of the organ's smallest extent, up to which linear elasticity can be trusted."},
      {S, "limits", "operations", "integer", "-", "300000", "1 to 1000000000",
       "Counted operations of a touch step, about a nanosecond each on a server processor. What does not fit is put "
       "off "
       "to the next step, and the step's flag says so."},
      {S, "tool", "name", "text", "-", "required", "not empty", "The tool's name in the results."},
      {S, "tool", "points", "points", "`unit`", "-", "",
       "Points that touch, relative to the tool's position. A tool needs `points`, a `capsule`, a `[[tool.grip]]`, a "
       "`[tool.grasp]` or a `[tool.needle]`."},
      {S, "tool", "capsule", "table", "-", "-", "", "Adds points on the skin of a capsule (a rod with round ends)."},
      {S, "tool", "disc_radius", "number", "`unit`", "-", "above 0, at most 1 m",
       "Makes each point a flat disc of this radius. It needs `contact = \"patch\"`, which it also selects."},
      {S, "tool", "radius", "number", "`unit`", "-", "above 0, at most 1 m", "The earlier name of `disc_radius`."},
      {S, "tool", "friction", "number", "1", "0", "0 to 100",
       "The coefficient of friction. A value above 0 needs `law = \"coulomb\"`."},
      {S, "tool", "hold", "boolean", "-", "false", "",
       "Whether a contact stays when the tool leaves the surface; the tool then pulls."},
      {S, "tool", "path", "rows", "s, `unit`", "-", "times of at least 0 s, ascending",
       "Rows `[t, x, y, z]`: the tool's position at these times, on straight lines in between. A tool has either "
       "`path`, or `path_csv`, or a place (`at` or `near`) with `depth`."},
      {S, "tool", "path_csv", "file", "s, `unit`", "-", "as `path`",
       "A CSV file of `time,x,y,z`, relative to the scene's folder; `#` begins a comment. The first line may be a "
       "heading, of which no cell begins as a number does."},
      {S, "tool", "away", "rows", "s", "-", "ascending times of at least 0 s",
       "Rows `[from, until]`: the tool is away and touches nothing from the first time until before the second."},
      {S, "tool", "at", "choice", "-", "-", "foremost, hindmost, leftmost, rightmost, uppermost, lowest",
       "A place on the organ at rest: the touchable surface node that lies farthest in this direction of the patient. "
       "The bundle's frame must be `LPS` or `RAS`."},
      {S, "tool", "near", "point", "`unit`", "-", "",
       "A place on the organ at rest: the point of the touchable surface that is nearest to this point."},
      {S, "tool", "depth", "rows", "s, `unit`", "-", "times of at least 0 s, ascending",
       "Rows `[t, depth]`: how deep the tool is below the place at these times, against the surface's outward normal "
       "there; of a needle, along its direction. Below 0 the tool is in front of the surface."},
      {S, "tool", "grip", "tables", "-", "-", "",
       "`[[tool.grip]]`: nodes that move as the tool has moved since its start, whether the tool touches them or not."},
      {S, "tool", "turn", "rows", "s, degrees", "-", "times of at least 0 s, ascending; at most 1e6 degrees",
       "Rows `[t, x, y, z]`: how far the tool is turned about its position at these times, a vector along the axis "
       "whose "
       "length is the angle, on straight lines in between. Its points, its grasp and its needle turn; a grip moves "
       "without a turn. "
       "Without it the tool does not turn."},
      {S, "tool", "grasp", "table", "-", "-", "",
       "`[tool.grasp]`: jaws that hold tissue, which follows them in all six degrees of freedom."},
      {S, "tool", "needle", "table", "-", "-", "",
       "`[tool.needle]`: a straight, stiff needle that pierces the organ. Its tip is the tool's position."},
      {S, "tool", "organ", "text", "-", "-",
       "an `[[organ]]`; required in a scene of several organs with the other keys named here",
       "The organ that `at`, `near`, `[[tool.grip]]`, `[tool.grasp]` and `[tool.needle]` are on. The tool touches all "
       "organs."},
      {S, "capsule", "radius", "number", "`unit`", "required", "above 0",
       "The radius of the rod and of its round ends."},
      {S, "capsule", "length", "number", "`unit`", "required", "0 or above",
       "The distance between the centres of the two round ends."},
      {S, "capsule", "axis", "point", "-", "[0, 0, 1]", "not zero",
       "From the first centre, which is the tool's position, towards the second."},
      {S, "capsule", "samples", "integer", "-", "required", "2 to 65536", "How many points to put on the skin."},
      {S, "grip", "nearest", "point", "`unit`", "-", "",
       "Grips the touchable node nearest to this point. A grip has either `nearest` or `box`."},
      {S, "grip", "box", "table", "-", "-", "", "Grips every touchable node in the box."},
      {S, "grip", "axes", "text", "-", "\"xyz\"", "some of the letters x, y, z, each once",
       "The axes along which the nodes are moved; along the others no force acts on them."},
      {S, "grasp", "near", "point", "`unit`", "required", "",
       "Where the first disc's middle is: the point of the touchable surface at rest that is nearest to this point."},
      {S, "grasp", "opposite", "point", "`unit`", "-", "",
       "Where the middle of a second disc is, which faces the first one across a fold. Without it there is one disc."},
      {S, "grasp", "radius", "number", "`unit`", "required", "above 0, at most 1 m", "The radius of each disc."},
      {S, "grasp", "closing", "rows", "s, `unit`", "-", "times of at least 0 s, ascending; lengths of at least 0",
       "Rows `[t, length]`: by how much the two discs have come nearer to each other at these times, since the jaws "
       "closed, on straight lines in between. It needs `opposite`."},
      {S, "grasp", "friction", "number", "1", "-", "0 to 100",
       "The coefficient of friction: the grasp slips where its force exceeds this times what presses the jaws on the "
       "tissue. Without it the grasp never slips."},
      {S, "grasp", "clamp_force", "number", "N", "-", "0 or above",
       "What presses the jaws on the tissue of one disc. It needs `friction`. Two discs press with the force between "
       "them."},
      {S, "grasp", "closed", "rows", "s", "-", "ascending times of at least 0 s",
       "Rows `[from, until]`: the jaws are closed from the first time until before the second. Without it they are "
       "closed "
       "all the time, but for the times at which the tool is `away`."},
      {S, "needle", "entry", "point", "`unit`", "-", "required without `at` and `near` of the tool",
       "Where it enters: the point of the touchable surface at rest that is nearest to this point. A tool with `at` or "
       "`near` enters there."},
      {S, "needle", "direction", "point", "-", "-", "not zero",
       "From the handle to the tip, in the bundle's axes, before the tool's `turn`. Without it: against the surface's "
       "outward normal where it enters."},
      {S, "needle", "radius", "number", "`unit`", "required", "above 0, at most 10 mm", "The radius of the shaft."},
      {S, "needle", "friction", "number", "N/m", "0", "0 to 1e6",
       "The friction along the shaft, for its length in the tissue."},
      {S, "needle", "puncture_force", "number", "N", "0", "0 to 1e6",
       "The force at which the tip pierces the surface."},
      {S, "needle", "cutting_force", "number", "N", "0", "0 to 1e6",
       "The force at which the tip cuts its way through the tissue."},
      {S, "needle", "spacing", "number", "`unit`", "-", "0.1 mm to 1 m",
       "After this length of its way the needle takes hold of one more place of the tissue. By default: 5 mm."},
      {S, "carried", "name", "text", "-", "required", "letters, digits, - and _",
       "The surface's name, which its files have."},
      {S, "carried", "organ", "text", "-", "-", "an `[[organ]]`; required in a scene of several organs",
       "The organ that carries it."},
      {S, "carried", "file", "file", "`unit`", "required", "a surface (.ply)",
       "The surface in the bundle's coordinates, relative to the scene's folder. It need not be closed."},
      {S, "carried", "unit", "choice", "-", "\"mm\"", "m, cm, mm, um", "The unit of the surface's positions."},
      {S, "carried", "within", "number", "scene's `unit`", "0", "0 or above",
       "How far outside of the mesh's tetrahedra a vertex may be. It then moves with the nearest one."},
      {S, "motion", "name", "text", "-", "required", "a motion of the bundle",
       "As the boundary file names it; of `gravity` with its axis, `weight z`."},
      {S, "motion", "organ", "text", "-", "-", "an `[[organ]]`; required in a scene of several organs",
       "The organ that is moved."},
      {S, "motion", "sine", "table", "-", "-", "not together with `amounts` or `amounts_csv`",
       "The amount swings about its mean."},
      {S, "motion", "amounts", "rows", "s, see `[[motion]]`", "-", "times of at least 0 s, ascending",
       "Rows `[t, amount]`, on straight lines in between."},
      {S, "motion", "amounts_csv", "file", "s, see `[[motion]]`", "-", "as `amounts`",
       "A CSV file with the columns `time,amount`, relative to the scene's folder."},
      {S, "sine", "amplitude", "number", "see `[[motion]]`", "required", "", "The largest way from the mean."},
      {S, "sine", "period", "number", "s", "required", "above 0", "Of one breath. It begins at the mean and rises."},
      {S, "sine", "mean", "number", "see `[[motion]]`", "-", "", "The amount in the middle; without it 0."},
      {S, "link", "name", "text", "-", "required", "not empty", "The link's name in the results."},
      {S, "link", "organ", "text", "-", "-", "an `[[organ]]`; required in a scene of several organs without `organs`",
       "The organ whose places are held together."},
      {S, "link", "organs", "texts", "-", "-", "as many `[[organ]]` as places; not together with `organ`",
       "Of a link between organs: the organ of each place."},
      {S, "link", "kind", "choice", "-", "required", "thread, spring, clip",
       "A thread pulls its ends together and never pushes: a suture, a ligament. A spring pulls and pushes along the "
       "line "
       "between its ends. A clip brings its ends to one place, in all directions."},
      {S, "link", "places", "points", "`unit`", "required", "two ends with `world`; of a thread up to 1000",
       "The ends: each holds the point of the surface at rest that is nearest to this point, and moves with the "
       "tissue. A "
       "thread of more than two ends runs through them without friction."},
      {S, "link", "world", "point", "`unit`", "-", "", "One more end, behind the places, that stands in the world."},
      {S, "link", "rest_length", "number", "`unit`", "-", "0 or above",
       "Longer than this, the thread is stretched; of a thread through several places, the length of all of it. By "
       "default: as long as from place to place on the mesh. A clip has none."},
      {S, "link", "rest_lengths", "rows", "s, `unit`", "-", "times of at least 0 s, ascending; lengths of at least 0",
       "In place of `rest_length`: rows `[t, length]`, on straight lines in between, for a thread that is drawn "
       "tight."},
      {S, "link", "stiffness", "number", "N/m", "-", "above 0",
       "The force over what the link is longer than its rest length. By default it does not stretch. Each stretch "
       "between two ends has this stiffness."},
      {S, "link", "stiffnesses", "rows", "s, N/m", "-", "times of at least 0 s, ascending; above 0",
       "In place of `stiffness`: rows `[t, stiffness]`, on straight lines in between."},
      {S, "link", "breaking_force", "number", "N", "-", "above 0",
       "A stretch that bears more breaks, and stays broken. By default it never does."},
      {S, "link", "radius", "number", "`unit`", "-", "above 0, at most 1 m",
       "Of the disc of tissue that each place takes hold of. It needs `contact = \"patch\"`, which it also selects. "
       "Without it "
       "a place is a point, whose stiffness falls as the mesh is refined."},
      {S, "box", "min", "point", "`unit`", "required", "each coordinate at most that of `max`", "The lowest corner."},
      {S, "box", "max", "point", "`unit`", "required", "", "The highest corner."},
  };
  return keys;
}

const ConfigKey* find_config_key(ConfigFile file, std::string_view table, std::string_view key) {
  for (const ConfigKey& one : config_keys())
    if (one.file == file && table == one.table && key == one.key) return &one;
  return nullptr;
}

std::string example_line(const ConfigKey& key) {
  const std::string unit = key.unit, type = key.type;
  if (type == "table" && key.table[0] == '\0') return '[' + std::string(key.key) + ']';  // its heading
  if (type == "tables") return "[[" + std::string(key.key) + "]]";
  const bool bare = unit != "-" && unit != "1" && type != "choice" && type != "text";
  return std::string(key.key) + " = " + example_value(key) + (bare ? "  # in " + unit : "");
}

}  // namespace palpate
