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
    {"yeoh", "c2", "-0.2"},
    {"yeoh", "c3", "0.3"},
    {"ogden", "share", "0.1"},
    {"ogden", "second_exponent", "10"},
    {"gravity", "value", "[0, 9.81, 0]"},
    {"motion", "axis", "[0, 0, 1]"},
    {"motion", "sine", "{ amplitude = 12, period = 4 }"},
    {"motion", "amounts", "[[0, 0], [2, 12]]"},
    {"motion", "amounts_csv", "\"breath.csv\""},
    {"motion", "file", "\"diaphragm.csv\""},
    {"given_force", "forces", "[[0, 0, 0, 0], [2, 0, 0, -0.5]]"},
    {"obstacle", "size", "[300, 200]"},
    {"obstacle", "file", "\"rib.stl\""},
    {"obstacle", "path", "[[0, 0, 0, -40], [2, 0, 0, -20]]"},
    {"load", "forces", "[[0, 0, 0, 0], [2, 0, 0, -0.5]]"},
    {"load", "tractions", "[[0, 0, 0, 0], [2, 0, 0, -500]]"},
    {nullptr, "value", "5.4"},
    {nullptr, "source", "\"Author year, table 2\""},
    {nullptr, "max", "[10, 10, 10]"},
    {"half_space", "normal", "[0, 0, 1]"},
    {nullptr, "direction", "[0, 0, 1]"},
    {nullptr, "quantile", "0.2"},
    {nullptr, "terms", "[[0.45, 0.5]]"},
    {"tool", "given_force", "{ force = [0, 0, -0.5] }"},
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
      {O, "", "name", "text", "-", "required", "not empty"},
      {O, "", "mesh_unit", "choice", "-", "required", "m, cm, mm, um"},
      {O, "", "frame", "choice", "-", "required", "LPS, RAS, none"},
      {O, "", "element", "choice", "-", "required", "p1, p1-anp, p1-ang, p2-p0"},
      {O, "", "region", "tables", "-", "required", "one for each region of the mesh, names all different"},
      {O, "", "response", "table", "-", "-", ""},
      {O, "region", "name", "text", "-", "required", "not empty"},
      {O, "region", "young", "table", "-", "required", "1e-6 to 1e15 Pa"},
      {O, "region", "poisson", "table", "-", "required", "-1 < value < 0.5, at least 1e-6 away from both"},
      {O, "region", "density", "table", "-", "-", "above 0, at most 1e6 kg/m^3"},
      {O, "region", "stiffening", "table", "-", "-", "above 0, at most 1e4"},
      {O, "region", "yeoh", "table", "-", "-", "see `c2`; instead of `stiffening`"},
      {O, "region", "ogden", "table", "-", "-", "see `exponent`; instead of `stiffening` and `yeoh`"},
      {O, "young", "value", "number", "`unit`", "required", "see `young`"},
      {O, "young", "unit", "choice", "-", "required", "Pa, kPa, MPa, GPa"},
      {O, "young", "source", "text", "-", "required", "not empty"},
      {O, "poisson", "value", "number", "1", "required", "see `poisson`"},
      {O, "poisson", "source", "text", "-", "required", "not empty"},
      {O, "density", "value", "number", "`unit`", "required", "see `density`"},
      {O, "density", "unit", "choice", "-", "required", "kg/m^3, g/cm^3"},
      {O, "density", "source", "text", "-", "required", "not empty"},
      {O, "stiffening", "value", "number", "1", "required", "see `stiffening`"},
      {O, "stiffening", "source", "text", "-", "required", "not empty"},
      {O, "yeoh", "c2", "number", "`unit`", "required",
       "0 to 1e4 mu; below 0 where 3 c2^2 < 5 c1 c3, with c1 = mu / 2"},
      {O, "yeoh", "c3", "number", "`unit`", "required", "0 to 1e4 mu"},
      {O, "yeoh", "unit", "choice", "-", "required", "Pa, kPa, MPa, GPa"},
      {O, "yeoh", "source", "text", "-", "required", "not empty"},
      {O, "ogden", "exponent", "number", "1", "required", "1.5 to 50, or -50 to -3"},
      {O, "ogden", "share", "number", "1", "-", "above 0, below 1; together with `second_exponent`"},
      {O, "ogden", "second_exponent", "number", "1", "-", "as `exponent`"},
      {O, "ogden", "source", "text", "-", "required", "not empty"},
      {O, "response", "curve", "file", "mm, N", "required",
       "a CSV file with the columns `displacement_mm,force_N` and optionally `radial_mm`; `#` begins a comment"},
      {O, "response", "source", "text", "-", "required", "not empty"},
      {O, "response", "height", "table", "-", "required", "above 0"},
      {O, "response", "radius", "table", "-", "required", "above 0"},
      {O, "response", "young", "table", "-", "required", "as in `[[region]]`"},
      {O, "response", "poisson", "table", "-", "required", "as in `[[region]]`"},
      {O, "response", "degree", "integer", "-", "5", "4 to 10"},
      {O, "height", "value", "number", "`unit`", "required", "above 0"},
      {O, "height", "unit", "choice", "-", "required", "m, cm, mm, um"},
      {O, "radius", "value", "number", "`unit`", "required", "above 0"},
      {O, "radius", "unit", "choice", "-", "required", "m, cm, mm, um"},

      {B, "", "name", "text", "-", "required", "not empty"},
      {B, "", "fixed", "tables", "-", "-", "together with `foundation` and `spring`: one or more"},
      {B, "", "foundation", "tables", "-", "-", "names all different"},
      {B, "", "spring", "tables", "-", "-", "names all different"},
      {B, "", "motion", "tables", "-", "-", "names all different; at most 32, where gravity counts as three"},
      {B, "", "corridor", "tables", "-", "-", "names all different; at most 16"},
      {B, "", "cut", "table", "-", "-", "not with the element p2-p0"},
      {B, "", "touchable", "table", "-", "-", ""},
      {B, "", "preload", "table", "-", "-", ""},
      {B, "", "store", "table", "-", "-", ""},
      {B, "fixed", "dofs", "text", "-", "required", "some of the letters x, y, z, each once"},
      {B, "fixed", "select", "selector", "-", "required", ""},
      {B, "foundation", "name", "text", "-", "required", "not empty"},
      {B, "foundation", "normal", "table", "-", "required", "0 to 1e15 N/m^3"},
      {B, "foundation", "tangential", "table", "-", "-", "0 to 1e15 N/m^3; above 0 where `normal` is 0"},
      {B, "foundation", "select", "selector", "-", "required", ""},
      {B, "normal", "value", "number", "`unit`", "required", "see `normal`"},
      {B, "normal", "unit", "choice", "-", "required", "N/m^3, kPa/cm, kPa/mm"},
      {B, "normal", "source", "text", "-", "required", "not empty"},
      {B, "tangential", "value", "number", "`unit`", "required", "see `tangential`"},
      {B, "tangential", "unit", "choice", "-", "required", "N/m^3, kPa/cm, kPa/mm"},
      {B, "tangential", "source", "text", "-", "required", "not empty"},
      {B, "spring", "name", "text", "-", "required", "not empty"},
      {B, "spring", "from", "selector", "-", "required", ""},
      {B, "spring", "to", "selector", "-", "-", "not together with `anchor`"},
      {B, "spring", "anchor", "point", "`mesh_unit`", "-", "not together with `to`"},
      {B, "spring", "stiffness", "table", "-", "required", "above 0, at most 1e15 N/m"},
      {B, "stiffness", "value", "number", "`unit`", "required", "see `stiffness`"},
      {B, "stiffness", "unit", "choice", "-", "required", "N/m, N/mm"},
      {B, "stiffness", "source", "text", "-", "required", "not empty"},
      {B, "motion", "name", "text", "-", "required", "at most 60 bytes, no control characters"},
      {B, "motion", "kind", "choice", "-", "required", "piston, rotation, field, pressure, gravity"},
      {B, "motion", "axis", "point", "-", "-", "not zero; required for `piston` and `rotation`, of any length"},
      {B, "motion", "point", "point", "`mesh_unit`", "-", "required for `rotation`"},
      {B, "motion", "file", "file", "`mesh_unit`", "-",
       "required for `field`: a CSV file with the columns `x,y,z,ux,uy,uz`; `#` begins a comment"},
      {B, "motion", "select", "selector", "-", "-", "required for `pressure`; not for `gravity`"},
      {B, "corridor", "name", "text", "-", "required", "at most 60 bytes, no control characters"},
      {B, "corridor", "from", "point", "`mesh_unit`", "required", "coordinates of at most 1e15"},
      {B, "corridor", "to", "point", "`mesh_unit`", "required", "coordinates of at most 1e15"},
      {B, "corridor", "radius", "number", "`mesh_unit`", "required", "above 0, at most 1e15"},
      {B, "cut", "region", "selector", "-", "required", ""},
      {B, "cut", "reserve", "integer", "-", "nodes of the region, at most 500", "0 to 6000"},
      {B, "touchable", "select", "selector", "-", "required", ""},
      {B, "select", "box", "table", "-", "-", ""},
      {B, "select", "sphere", "table", "-", "-", ""},
      {B, "select", "nearest", "table", "-", "-", ""},
      {B, "select", "half_space", "table", "-", "-", ""},
      {B, "select", "patch", "text", "-", "-", "a surface patch of the mesh"},
      {B, "select", "below_quantile", "table", "-", "-", ""},
      {B, "select", "contact", "two texts", "-", "-", "two regions of the mesh"},
      {B, "select", "everything", "boolean", "-", "-", "true"},
      {B, "select", "facing", "table", "-", "-", ""},
      {B, "select", "label", "table", "-", "-", ""},
      {B, "select", "and", "selector", "-", "-", ""},
      {B, "select", "or", "selector", "-", "-", ""},
      {B, "select", "not", "selector", "-", "-", ""},
      {B, "select", "where", "choice", "-", "\"surface\"", "surface, all"},
      {B, "box", "min", "point", "`mesh_unit`", "required", "each coordinate at most that of `max`"},
      {B, "box", "max", "point", "`mesh_unit`", "required", ""},
      {B, "sphere", "center", "point", "`mesh_unit`", "required", ""},
      {B, "sphere", "radius", "number", "`mesh_unit`", "required", "above 0"},
      {B, "half_space", "point", "point", "`mesh_unit`", "required", ""},
      {B, "half_space", "normal", "point", "-", "required", "not zero"},
      {B, "nearest", "points", "points", "`mesh_unit`", "required", "one or more"},
      {B, "below_quantile", "direction", "point", "-", "required", "not zero"},
      {B, "below_quantile", "quantile", "number", "1", "required", "0 < value <= 1"},
      {B, "facing", "direction", "point", "-", "required", "not zero"},
      {B, "facing", "within", "number", "degrees", "required", "above 0, at most 180"},
      {B, "label", "labels", "numbers", "-", "required", "values of the image"},
      {B, "label", "within", "number", "`mesh_unit`", "0", "0 or above"},
      {B, "label", "image", "file", "mm", "-", "a format that `palpate-surface` reads"},
      {B, "preload", "gravity", "table", "-", "required", ""},
      {B, "gravity", "value", "point", "`unit`", "required", "components of at most 1e6 m/s^2"},
      {B, "gravity", "unit", "choice", "-", "required", "m/s^2"},
      {B, "store", "interior", "boolean", "-", "false", ""},
      {B, "store", "large_deformation", "boolean", "-", "false", ""},

      {S, "", "name", "text", "-", "required", "not empty"},
      {S, "", "bundle", "file", "-", "-", ""},
      {S, "", "unit", "choice", "-", "required", "m, cm, mm, um"},
      {S, "", "csv_unit", "choice", "-", "\"m\"", "m, cm, mm, um"},
      {S, "", "effects", "table", "-", "-", ""},
      {S, "", "relaxation", "table", "-", "-", ""},
      {S, "", "surface", "table", "-", "-", ""},
      {S, "", "rate", "table", "-", "-", ""},
      {S, "", "limits", "table", "-", "-", ""},
      {S, "", "organ", "tables", "-", "-", "up to 32, names all different"},
      {S, "", "world", "table", "-", "-", "needs `[[organ]]`"},
      {S, "", "tool", "tables", "-", "required", "1 to 8"},
      {S, "", "link", "tables", "-", "-", "at most 1000 stretches together"},
      {S, "", "motion", "tables", "-", "-", "names all different"},
      {S, "", "load", "tables", "-", "-", "names all different; at most 4 on an organ"},
      {S, "", "obstacle", "tables", "-", "-", "names all different; at most 16 of an organ"},
      {S, "", "carried", "tables", "-", "-", "needs `inside = true`; names all different"},
      {S, "limits", "displacement", "number", "m", "-", "above 0"},
      {S, "organ", "name", "text", "-", "required", "letters, digits, - and _"},
      {S, "organ", "bundle", "file", "-", "-", ""},
      {S, "organ", "position", "point", "`unit`", "[0, 0, 0]", ""},
      {S, "organ", "turn", "point", "degrees", "[0, 0, 0]", "at most 1e6 degrees"},
      {S, "organ", "effects", "table", "-", "-", ""},
      {S, "organ", "relaxation", "table", "-", "-", ""},
      {S, "organ", "surface", "table", "-", "-", ""},
      {S, "world", "pairs", "integer", "-", "0", "0 to 1000"},
      {S, "world", "friction", "number", "1", "0", "0 to 100; above 0 needs `pairs`"},
      {S, "relaxation", "terms", "rows", "1, s", "required",
       "1 to 8 rows; shares of at least 0, below 1 together; times above 0 s"},
      {S, "relaxation", "source", "text", "-", "required", "not empty"},
      {S, "surface", "file", "file", "`unit`", "required", "a closed surface (.ply)"},
      {S, "surface", "unit", "choice", "-", "\"mm\"", "m, cm, mm, um"},
      {S, "rate", "touch", "number", "Hz", "1000", "1e-6 to 1e6"},
      {S, "rate", "shape", "number", "Hz", "60", "1e-6 to `touch`"},
      {S, "rate", "deform", "number", "Hz", "100", "1e-6 to `touch`"},
      {S, "tool", "name", "text", "-", "required", "not empty"},
      {S, "tool", "points", "points", "`unit`", "-", ""},
      {S, "tool", "capsule", "table", "-", "-", ""},
      {S, "tool", "disc_radius", "number", "`unit`", "-", "above 0, at most 1 m"},
      {S, "tool", "friction", "number", "1", "0", "0 to 100"},
      {S, "tool", "hold", "boolean", "-", "false", ""},
      {S, "tool", "path", "rows", "s, `unit`", "-", "times of at least 0 s, ascending"},
      {S, "tool", "path_csv", "file", "s, `unit`", "-", "as `path`"},
      {S, "tool", "away", "rows", "s", "-", "ascending times of at least 0 s"},
      {S, "tool", "at", "choice", "-", "-", "foremost, hindmost, leftmost, rightmost, uppermost, lowest"},
      {S, "tool", "near", "point", "`unit`", "-", ""},
      {S, "tool", "depth", "rows", "s, `unit`", "-", "times of at least 0 s, ascending"},
      {S, "tool", "grip", "tables", "-", "-", ""},
      {S, "tool", "turn", "rows", "s, degrees", "-", "times of at least 0 s, ascending; at most 1e6 degrees"},
      {S, "tool", "grasp", "table", "-", "-", ""},
      {S, "tool", "needle", "table", "-", "-", ""},
      {S, "tool", "given_force", "table", "-", "-", "not together with `grasp` or `needle`"},
      {S, "tool", "organ", "text", "-", "-",
       "an `[[organ]]`; required in a scene of several organs with the other keys named here"},
      {S, "capsule", "radius", "number", "`unit`", "required", "above 0"},
      {S, "capsule", "length", "number", "`unit`", "required", "0 or above"},
      {S, "capsule", "axis", "point", "-", "[0, 0, 1]", "not zero"},
      {S, "capsule", "samples", "integer", "-", "required", "2 to 65536"},
      {S, "grip", "nearest", "point", "`unit`", "-", ""},
      {S, "grip", "box", "table", "-", "-", ""},
      {S, "grip", "axes", "text", "-", "\"xyz\"", "some of the letters x, y, z, each once"},
      {S, "grasp", "near", "point", "`unit`", "required", ""},
      {S, "grasp", "opposite", "point", "`unit`", "-", ""},
      {S, "grasp", "radius", "number", "`unit`", "required", "above 0, at most 1 m"},
      {S, "grasp", "closing", "rows", "s, `unit`", "-", "times of at least 0 s, ascending; lengths of at least 0"},
      {S, "grasp", "friction", "number", "1", "-", "0 to 100"},
      {S, "grasp", "clamp_force", "number", "N", "-", "0 or above"},
      {S, "grasp", "closed", "rows", "s", "-", "ascending times of at least 0 s"},
      {S, "given_force", "force", "point", "N", "-", "one of `force` and `forces`; at most 1e6 N"},
      {S, "given_force", "forces", "rows", "s, N", "-", "times of at least 0 s, ascending"},
      {S, "given_force", "speed", "number", "`unit`/s", "-", "above 0"},
      {S, "needle", "entry", "point", "`unit`", "-", "required without `at` and `near` of the tool"},
      {S, "needle", "direction", "point", "-", "-", "not zero"},
      {S, "needle", "radius", "number", "`unit`", "required", "above 0, at most 10 mm"},
      {S, "needle", "friction", "number", "N/m", "0", "0 to 1e6"},
      {S, "needle", "puncture_force", "number", "N", "0", "0 to 1e6"},
      {S, "needle", "cutting_force", "number", "N", "0", "0 to 1e6"},
      {S, "needle", "spacing", "number", "`unit`", "-", "0.1 mm to 1 m"},
      {S, "carried", "name", "text", "-", "required", "letters, digits, - and _"},
      {S, "carried", "organ", "text", "-", "-", "an `[[organ]]`; required in a scene of several organs"},
      {S, "carried", "file", "file", "`unit`", "required", "a surface (.ply)"},
      {S, "carried", "unit", "choice", "-", "\"mm\"", "m, cm, mm, um"},
      {S, "carried", "within", "number", "scene's `unit`", "0", "0 or above"},
      {S, "motion", "name", "text", "-", "required", "a motion of the bundle"},
      {S, "motion", "organ", "text", "-", "-", "an `[[organ]]`; required in a scene of several organs"},
      {S, "motion", "sine", "table", "-", "-", "not together with `amounts` or `amounts_csv`"},
      {S, "motion", "amounts", "rows", "s, see `[[motion]]`", "-", "times of at least 0 s, ascending"},
      {S, "motion", "amounts_csv", "file", "s, see `[[motion]]`", "-", "as `amounts`"},
      {S, "sine", "amplitude", "number", "see `[[motion]]`", "required", ""},
      {S, "sine", "period", "number", "s", "required", "above 0"},
      {S, "sine", "mean", "number", "see `[[motion]]`", "-", ""},
      {S, "load", "name", "text", "-", "required", "not empty"},
      {S, "load", "organ", "text", "-", "-", "an `[[organ]]`; required in a scene of several organs"},
      {S, "load", "at", "choice", "-", "-", "foremost, hindmost, leftmost, rightmost, uppermost, lowest"},
      {S, "load", "near", "point", "`unit`", "-", "required without `at`"},
      {S, "load", "radius", "number", "`unit`", "required", "above 0, at most 1 m"},
      {S, "load", "force", "point", "N", "-", "one of `force`, `forces`, `traction` and `tractions`"},
      {S, "load", "forces", "rows", "s, N", "-", "times of at least 0 s, ascending"},
      {S, "load", "traction", "point", "Pa", "-", ""},
      {S, "load", "tractions", "rows", "s, Pa", "-", "times of at least 0 s, ascending"},
      {S, "load", "frame", "choice", "-", "\"world\"", "world, organ"},
      {S, "obstacle", "name", "text", "-", "required", "not empty"},
      {S, "obstacle", "organs", "texts", "-", "-", "names of `[[organ]]`; absent: all"},
      {S, "obstacle", "kind", "choice", "-", "required", "rectangle, disc, mesh"},
      {S, "obstacle", "size", "numbers", "`unit`", "-", "two lengths above 0; required of a rectangle"},
      {S, "obstacle", "radius", "number", "`unit`", "-", "above 0, at most 1 m; required of a disc"},
      {S, "obstacle", "file", "file", "`unit`", "-", "a surface (.ply, .stl, .obj, .off); required of a mesh"},
      {S, "obstacle", "unit", "choice", "-", "-", "m, cm, mm, um"},
      {S, "obstacle", "normal", "point", "-", "[0, 0, 1]", "not zero; not of a mesh"},
      {S, "obstacle", "position", "point", "`unit`", "[0, 0, 0]", "not together with `path` or `path_csv`"},
      {S, "obstacle", "path", "rows", "s, `unit`", "-", "times of at least 0 s, ascending"},
      {S, "obstacle", "path_csv", "file", "s, `unit`", "-", "as `path`"},
      {S, "obstacle", "turn", "rows", "s, degrees", "-", "times of at least 0 s, ascending; at most 1e6 degrees"},
      {S, "obstacle", "friction", "number", "1", "0", "0 to 100"},
      {S, "obstacle", "depth", "number", "`unit`", "-", "above 0"},
      {S, "link", "name", "text", "-", "required", "not empty"},
      {S, "link", "organ", "text", "-", "-", "an `[[organ]]`; required in a scene of several organs without `organs`"},
      {S, "link", "organs", "texts", "-", "-", "as many `[[organ]]` as places; not together with `organ`"},
      {S, "link", "kind", "choice", "-", "required", "thread, spring, clip"},
      {S, "link", "places", "points", "`unit`", "required", "two ends with `world`; of a thread up to 1000"},
      {S, "link", "world", "point", "`unit`", "-", ""},
      {S, "link", "rest_length", "number", "`unit`", "-", "0 or above"},
      {S, "link", "rest_lengths", "rows", "s, `unit`", "-", "times of at least 0 s, ascending; lengths of at least 0"},
      {S, "link", "stiffness", "number", "N/m", "-", "above 0"},
      {S, "link", "stiffnesses", "rows", "s, N/m", "-", "times of at least 0 s, ascending; above 0"},
      {S, "link", "breaking_force", "number", "N", "-", "above 0"},
      {S, "link", "radius", "number", "`unit`", "-", "above 0, at most 1 m"},
      {S, "box", "min", "point", "`unit`", "required", "each coordinate at most that of `max`"},
      {S, "box", "max", "point", "`unit`", "required", ""},
  };
  return keys;
}

const ConfigKey* find_config_key(const std::vector<ConfigKey>& keys, ConfigFile file, std::string_view table,
                                 std::string_view key) {
  for (const ConfigKey& one : keys)
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
