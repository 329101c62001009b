#include "formats/organ_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "formats/bundle_layout.h"
#include "formats/errors.h"
#include "formats/toml_reader.h"

namespace palpate {
namespace {

using Units = std::vector<std::pair<std::string, double>>;
const std::vector<std::pair<std::string, Element>> kElements = {
    {"p1", Element::p1}, {"p1-anp", Element::p1_anp}, {"p1-ang", Element::p1_ang}, {"p2-p0", Element::p2_p0}};
const Units kLengths = {{"m", 1}, {"cm", 1e-2}, {"mm", 1e-3}, {"um", 1e-6}};
const Units kPressures = {{"Pa", 1}, {"kPa", 1e3}, {"MPa", 1e6}, {"GPa", 1e9}};
const Units kDensities = {{"kg/m^3", 1}, {"g/cm^3", 1e3}};
const Units kAccelerations = {{"m/s^2", 1}};
const Units kFoundations = {{"N/m^3", 1}, {"kPa/cm", 1e5}, {"kPa/mm", 1e6}};
const Units kSprings = {{"N/m", 1}, {"N/mm", 1e3}};

// { value = ..., unit = "...", source = "..." }; units empty: a bare number of dimension one.
SourcedValue sourced(TomlTable& parent, const char* key, const Units& units) {
  TomlTable table = parent.table(key);
  SourcedValue result;
  result.value = table.number("value") * (units.empty() ? 1.0 : table.choice("unit", units));
  result.source = table.text("source", "\"Author year, table 2\"");
  table.finish();
  return result;
}

double length(TomlTable& parent, const char* key) {
  TomlTable table = parent.table(key);
  const double value = table.number("value") * table.choice("unit", kLengths);
  if (value <= 0) table.wrong("value", "a length above 0");
  table.finish();
  return value;
}

// Beyond these limits the unit is wrong, or the solver would overflow.
constexpr double kSoftest = 1e-6, kStiffest = 1e15;  // Pa
constexpr double kHeaviest = 1e6;                    // kg/m^3
constexpr double kMostStiffening = 1e4;              // exp(b x) would be without bound at strains of 1 %
constexpr double kStrongestGravity = 1e6;            // m/s^2
constexpr double kStiffestSupport = 1e15;            // N/m^3, N/m
constexpr double kFarthest = 1e15;                   // mesh_unit; the square of a distance must not overflow
constexpr std::size_t kMostCorridors = 16;
// At 1/2 the tissue is incompressible, at -1 it does not shear: nearer to either, the stiffness matrix has no correct digits.
constexpr double kFromTheEnds = 1e-6;

NamedFile named_file(TomlTable& table, const char* key, const char* example) {
  return {table.text(key, example), table.path(key, example)};
}

SourcedValue young(TomlTable& parent) {
  const SourcedValue result = sourced(parent, "young", kPressures);
  if (result.value <= 0) parent.wrong("young", "a modulus above 0");
  if (!(result.value >= kSoftest && result.value <= kStiffest)) parent.wrong("young", "a modulus from 1e-6 to 1e15 Pa");
  return result;
}

SourcedValue poisson(TomlTable& parent) {
  const SourcedValue result = sourced(parent, "poisson", {});
  if (!(result.value >= -1 + kFromTheEnds && result.value <= 0.5 - kFromTheEnds))
    parent.wrong("poisson", "a ratio with -1 < value < 0.5, at least 1e-6 away from both");
  return result;
}

// { c2 = ..., c3 = ..., unit = "...", source = "..." }. shear: Pa, near rest.
StoredTissueLaw yeoh(TomlTable& parent, double shear) {
  TomlTable table = parent.table("yeoh");
  const double unit = table.choice("unit", kPressures), c2 = unit * table.number("c2"), c3 = unit * table.number("c3");
  if (!formats::yeoh_law_takes(shear, c2, c3))
    table.wrong(
        "c2",
        fmt::format("with c1 = mu / 2 = {:g} Pa a c3 of 0 or above, a c2 of 0 or above or with 3 c2^2 < 5 c1 c3, and "
                    "neither beyond {:g} mu; with others the tissue gives way",
                    shear / 2, formats::kMostOfShear));
  StoredTissueLaw law = {{static_cast<double>(formats::StoredLaw::yeoh), c2, c3, 0},
                         table.text("source", "\"Author year, table 2\"")};
  table.finish();
  return law;
}

// { exponent = ..., source = "..." }, of two terms with share and second_exponent.
StoredTissueLaw ogden(TomlTable& parent) {
  TomlTable table = parent.table("ogden");
  const double exponent = table.number("exponent");
  const std::string limits = fmt::format("a number from 1.5 to {0:g}, or from -{0:g} to -3", formats::kMostExponent);
  if (!formats::ogden_law_takes(exponent)) table.wrong("exponent", limits);
  double share = 0, second = 2;
  if (table.has("share")) {
    share = table.number("share"), second = table.number("second_exponent");
    if (!(share > 0 && share < 1)) table.wrong("share", "a share of the shear modulus above 0 and below 1");
    if (!formats::ogden_law_takes(second)) table.wrong("second_exponent", limits);
  } else if (table.has("second_exponent")) {
    table.wrong("second_exponent", "share beside it, the second term's part of the shear modulus");
  }
  StoredTissueLaw law = {{static_cast<double>(formats::StoredLaw::ogden), exponent, share, second},
                         table.text("source", "\"Author year, table 2\"")};
  table.finish();
  return law;
}

OrganConfig::Region region(TomlTable& table) {
  OrganConfig::Region result;
  result.name = table.text("name", "\"liver\"");
  result.young = young(table);
  result.poisson = poisson(table);
  if (table.has("density")) {
    result.density = sourced(table, "density", kDensities);
    if (!(result.density->value > 0 && result.density->value <= kHeaviest))
      table.wrong("density", "a density above 0 and up to 1e6 kg/m^3");
  }
  if (table.has("stiffening")) {
    result.stiffening = sourced(table, "stiffening", {});
    if (!(result.stiffening->value > 0 && result.stiffening->value <= kMostStiffening))
      table.wrong("stiffening", "a number above 0 and up to 1e4");
  }
  if (table.has("yeoh")) result.law = yeoh(table, result.young.value / (2 * (1 + result.poisson.value)));
  if (table.has("ogden")) {
    if (result.law) table.wrong("ogden", "one law, found yeoh too");
    result.law = ogden(table);
  }
  if (result.law && result.stiffening) table.wrong("stiffening", "one law, found yeoh or ogden too");
  table.finish();
  return result;
}

OrganConfig::Response response(TomlTable table) {
  OrganConfig::Response result;
  result.curve = table.path("curve", "\"curves/NAME.csv\"");
  result.source = table.text("source", "\"Author year, figure 3\"");
  result.height = length(table, "height");
  result.radius = length(table, "radius");
  result.young = young(table).value;
  result.poisson = poisson(table).value;
  if (table.has("degree")) {
    const auto degree = table.integer("degree");
    if (degree < 4 || degree > 10) table.wrong("degree", "an integer from 4 to 10");
    result.degree = static_cast<int>(degree);
  }
  table.finish();
  return result;
}

// inside: the nodes may lie inside the organ, unless `where` says other.
std::vector<Selector> selectors(TomlTable& table, const char* key = "select", bool inside = false);

void require_direction(TomlTable& table, const char* key, const std::array<double, 3>& direction) {
  if (direction == std::array<double, 3>{}) table.wrong(key, "a vector that is not zero");
}

void read_box(TomlTable& t, Selector& s) {
  s.a = t.vector("min"), s.b = t.vector("max");
  for (int d = 0; d < 3; ++d)
    if (s.a[d] > s.b[d]) t.wrong("min", "each coordinate at most that of max");
}
void read_sphere(TomlTable& t, Selector& s) {
  s.a = t.vector("center"), s.number = t.number("radius");
  if (s.number <= 0) t.wrong("radius", "a radius above 0");
}
void read_half_space(TomlTable& t, Selector& s) {
  s.a = t.vector("point"), s.b = t.vector("normal");
  require_direction(t, "normal", s.b);
}
void read_nearest(TomlTable& t, Selector& s) {
  s.points = t.points("points");
}
void read_below_quantile(TomlTable& t, Selector& s) {
  s.a = t.vector("direction"), s.number = t.number("quantile");
  require_direction(t, "direction", s.a);
  if (!(s.number > 0 && s.number <= 1)) t.wrong("quantile", "a share with 0 < value <= 1");
}
void read_patch(TomlTable& t, Selector& s) {
  s.names = {t.text("patch", "\"name\"")};
}
void read_contact(TomlTable& t, Selector& s) {
  s.names = t.texts("contact");
  if (s.names.size() != 2) t.wrong("contact", "the names of two regions");
}
void read_everything(TomlTable& t, Selector&) {
  if (!t.boolean("everything")) t.wrong("everything", "true");
}
void read_facing(TomlTable& t, Selector& s) {
  s.a = t.vector("direction"), s.number = t.number("within");
  require_direction(t, "direction", s.a);
  if (!(s.number > 0 && s.number <= 180)) t.wrong("within", "an angle above 0 and up to 180 degrees");
}
void read_label(TomlTable& t, Selector& s) {
  s.labels = t.numbers("labels");
  if (t.has("within")) s.number = t.number("within");
  if (s.number < 0) t.wrong("within", "a distance of 0 or above");
  if (t.has("image")) s.image = named_file(t, "image", "\"painted.nrrd\"");
}

struct SelectorForm {
  const char* key;
  Selector::Kind kind;
  bool whole_mesh;  // unless `where` says: the nodes may lie inside the organ
  bool table;       // the key's value is a table, which read gets; else read gets the selector's own
  void (*read)(TomlTable&, Selector&);  // null: selectors, which say themselves where their nodes are
};
constexpr SelectorForm kSelectors[] = {
    {"box", Selector::Kind::box, false, true, read_box},
    {"sphere", Selector::Kind::sphere, false, true, read_sphere},
    {"half_space", Selector::Kind::half_space, false, true, read_half_space},
    {"nearest", Selector::Kind::nearest, false, true, read_nearest},
    {"below_quantile", Selector::Kind::below_quantile, false, true, read_below_quantile},
    {"patch", Selector::Kind::patch, true, false, read_patch},
    {"contact", Selector::Kind::contact, true, false, read_contact},
    {"everything", Selector::Kind::everything, false, false, read_everything},
    {"facing", Selector::Kind::facing, false, true, read_facing},
    {"label", Selector::Kind::label, false, true, read_label},
    {"and", Selector::Kind::all_of, true, false, nullptr},
    {"or", Selector::Kind::any_of, true, false, nullptr},
    {"not", Selector::Kind::none_of, false, false, nullptr}};

// The one form whose key the table has.
const SelectorForm& form_of(TomlTable& table) {
  const SelectorForm* form = nullptr;
  int found = 0;
  std::string keys;
  for (const SelectorForm& one : kSelectors) {
    keys += std::string(keys.empty() ? "" : ", ") + one.key;
    if (table.has(one.key)) form = &one, ++found;
  }
  if (found == 1) return *form;
  throw InputError(fmt::format("{}:{}: select: expected exactly one of {}, found {}", table.file().string(),
                               table.line(), keys, found));
}

Selector selector(TomlTable table, bool inside) {
  Selector result;
  result.line = table.line();
  const SelectorForm& form = form_of(table);
  result.kind = form.kind;
  result.whole_mesh = form.whole_mesh || (inside && form.kind != Selector::Kind::facing);
  if (form.table) {
    TomlTable inner = table.table(form.key);
    form.read(inner, result);
    inner.finish();
  } else if (form.read) {
    form.read(table, result);
  } else {
    result.inner = selectors(table, form.key, inside);
  }
  if (table.has("where")) result.whole_mesh = table.choice<bool>("where", {{"surface", false}, {"all", true}});
  if (result.whole_mesh && result.kind == Selector::Kind::facing)
    table.wrong("where", "\"surface\": nodes inside the organ have no normal");
  table.finish();
  return result;
}

std::vector<Selector> selectors(TomlTable& table, const char* key, bool inside) {
  std::vector<Selector> result;
  for (auto& item : table.one_or_more(key, "select")) result.push_back(selector(item, inside));
  return result;
}

BoundaryConfig::Fixed fixed(TomlTable& table) {
  BoundaryConfig::Fixed result;
  result.line = table.line();
  const std::string dofs = table.text("dofs", "\"xyz\"");
  for (const char c : dofs) {
    if (c < 'x' || c > 'z' || result.dofs[c - 'x']) table.wrong("dofs", "some of the letters x, y, z, each once");
    result.dofs[c - 'x'] = true;
  }
  result.select = selectors(table);
  table.finish();
  return result;
}

SourcedValue foundation_stiffness(TomlTable& table, const char* key) {
  const SourcedValue result = sourced(table, key, kFoundations);
  if (!(result.value >= 0 && result.value <= kStiffestSupport)) table.wrong(key, "a stiffness from 0 to 1e15 N/m^3");
  return result;
}

BoundaryConfig::Foundation foundation(TomlTable& table) {
  BoundaryConfig::Foundation result;
  result.line = table.line();
  result.name = table.text("name", "\"diaphragm\"");
  result.normal = foundation_stiffness(table, "normal");
  if (table.has("tangential")) result.tangential = foundation_stiffness(table, "tangential");
  if (result.normal.value == 0 && result.tangential.value == 0)
    table.wrong("normal", "a stiffness above 0, as tangential has none either");
  result.select = selectors(table);
  table.finish();
  return result;
}

BoundaryConfig::Spring spring(TomlTable& table) {
  BoundaryConfig::Spring result;
  result.line = table.line();
  result.name = table.text("name", "\"falciform ligament\"");
  result.stiffness = sourced(table, "stiffness", kSprings);
  if (!(result.stiffness.value > 0 && result.stiffness.value <= kStiffestSupport))
    table.wrong("stiffness", "a stiffness above 0 and up to 1e15 N/m");
  result.from = selectors(table, "from");
  if (table.has("to")) result.to = selectors(table, "to");
  if (table.has("anchor")) result.anchor = table.vector("anchor");
  if (!result.to.empty() && result.anchor)
    table.wrong("anchor", "either to, where the spring ends in the organ, or anchor, where it ends in the world");
  table.finish();
  return result;
}

// The bundle holds the names one a line.
std::string name_in_bundle(TomlTable& table, const char* example) {
  constexpr std::size_t longest = 60;
  const std::string name = table.text("name", example);
  const bool printable =
      std::all_of(name.begin(), name.end(), [](char c) { return static_cast<unsigned char>(c) >= ' ' && c != 127; });
  if (!printable || name.size() > longest) table.wrong("name", "a name of at most 60 bytes without control characters");
  return name;
}

std::array<double, 3> axis_of(TomlTable& table) {
  const auto axis = table.vector("axis");
  const double size = std::hypot(axis[0], axis[1], axis[2]);
  if (!(size > 1e-100 && size < 1e100)) table.wrong("axis", "a vector that is not zero");
  return axis;
}

BoundaryConfig::Motion motion(TomlTable& table) {
  using Kind = BoundaryConfig::Motion::Kind;
  BoundaryConfig::Motion result;
  result.line = table.line();
  result.name = name_in_bundle(table, "\"diaphragm\"");
  result.kind = table.choice<Kind>("kind", {{"piston", Kind::piston},
                                            {"rotation", Kind::rotation},
                                            {"field", Kind::field},
                                            {"pressure", Kind::pressure},
                                            {"gravity", Kind::gravity}});
  const auto only_for = [&](const char* key, std::initializer_list<Kind> kinds, const char* which) {
    if (std::find(kinds.begin(), kinds.end(), result.kind) == kinds.end() && table.has(key))
      table.wrong(key, fmt::format("no {} with this kind; it is for {}", key, which));
  };
  only_for("axis", {Kind::piston, Kind::rotation}, "piston and rotation");
  only_for("point", {Kind::rotation}, "rotation");
  only_for("file", {Kind::field}, "field");
  only_for("select", {Kind::piston, Kind::rotation, Kind::field, Kind::pressure}, "all kinds but gravity");
  if (result.kind == Kind::piston || result.kind == Kind::rotation) result.axis = axis_of(table);
  if (result.kind == Kind::rotation) result.point = table.vector("point");
  if (result.kind == Kind::field) result.file = named_file(table, "file", "\"diaphragm.csv\"");
  if (result.kind == Kind::pressure || table.has("select")) result.select = selectors(table);
  table.finish();
  return result;
}

std::array<double, 3> corridor_end(TomlTable& table, const char* key) {
  const auto end = table.vector(key);
  if (std::any_of(end.begin(), end.end(), [](double x) { return std::abs(x) > kFarthest; }))
    table.wrong(key, "coordinates of at most 1e15");
  return end;
}

BoundaryConfig::Corridor corridor(TomlTable& table) {
  BoundaryConfig::Corridor result;
  result.line = table.line();
  result.name = name_in_bundle(table, "\"biopsy\"");
  result.from = corridor_end(table, "from"), result.to = corridor_end(table, "to");
  result.radius = table.number("radius");
  if (!(result.radius > 0 && result.radius <= kFarthest)) table.wrong("radius", "a radius above 0 and up to 1e15");
  table.finish();
  return result;
}

// The provenance names them, so that names differ.
template <class Named, class Read>
std::vector<Named> named(TomlTable& table, const char* key, Read read) {
  std::vector<Named> result;
  for (auto& item : table.tables(key)) {
    result.push_back(read(item));
    for (std::size_t i = 0; i + 1 < result.size(); ++i)
      if (result[i].name == result.back().name) item.wrong("name", fmt::format("a name that no other [[{}]] has", key));
  }
  return result;
}

}  // namespace

const char* name_of(Element element) {
  for (const auto& [name, value] : kElements)
    if (value == element) return name.c_str();
  return "";
}

OrganConfig read_organ_config(const std::filesystem::path& file) {
  TomlTable table(file, ConfigFile::organ);
  OrganConfig result;
  result.name = table.text("name", "\"liver\"");
  std::vector<std::pair<std::string, LengthUnit>> units;
  for (const auto& [unit, metres] : kLengths) units.emplace_back(unit, LengthUnit{unit, metres});
  result.mesh_unit = table.choice("mesh_unit", units);
  result.frame = table.choice<std::string>("frame", {{"LPS", "LPS"}, {"RAS", "RAS"}, {"none", "none"}});
  result.element = table.choice("element", kElements);
  result.regions = named<OrganConfig::Region>(table, "region", region);
  if (result.regions.empty())
    throw InputError(
        fmt::format("{}: expected at least one [[region]] with name, young and poisson, found none", file.string()));
  if (table.has("response")) result.response = response(table.table("response"));
  table.finish();
  return result;
}

std::map<std::string, std::filesystem::path> files_of(const OrganConfig& organ, const BoundaryConfig& boundary) {
  std::map<std::string, std::filesystem::path> files;
  if (organ.response) files["curve_sha256"] = organ.response->curve;
  const std::function<void(const std::vector<Selector>&)> add = [&](const std::vector<Selector>& selectors) {
    for (const auto& one : selectors) {
      if (one.image) files["label_image_sha256 " + one.image->name] = one.image->path;
      add(one.inner);
    }
  };
  for (const auto& fixed : boundary.fixed) add(fixed.select);
  for (const auto& foundation : boundary.foundations) add(foundation.select);
  for (const auto& spring : boundary.springs) add(spring.from), add(spring.to);
  for (const auto& motion : boundary.motions) {
    if (!motion.file.name.empty()) files["motion_file_sha256 " + motion.file.name] = motion.file.path;
    add(motion.select);
  }
  if (boundary.cut) add(boundary.cut->region);
  add(boundary.touchable);
  return files;
}

BoundaryConfig read_boundary_config(const std::filesystem::path& file) {
  TomlTable table(file, ConfigFile::boundary);
  BoundaryConfig result;
  result.name = table.text("name", "\"back\"");
  for (auto& item : table.tables("fixed")) result.fixed.push_back(fixed(item));
  result.foundations = named<BoundaryConfig::Foundation>(table, "foundation", foundation);
  result.springs = named<BoundaryConfig::Spring>(table, "spring", spring);
  if (result.fixed.empty() && result.foundations.empty() && result.springs.empty())
    throw InputError(
        fmt::format("{}: expected at least one [[fixed]], [[foundation]] or [[spring]], found none; an organ that "
                    "is held nowhere has no shape to compute",
                    file.string()));
  result.motions = named<BoundaryConfig::Motion>(table, "motion", motion);
  result.corridors = named<BoundaryConfig::Corridor>(table, "corridor", corridor);
  if (result.corridors.size() > kMostCorridors)
    throw InputError(fmt::format("{}:{}: expected at most {} [[corridor]] tables, found {}; unite some of them",
                                 file.string(), result.corridors[kMostCorridors].line, kMostCorridors,
                                 result.corridors.size()));
  if (table.has("cut")) {
    TomlTable cut = table.table("cut");
    result.cut = {selectors(cut, "region", true), cut.line()};
    if (cut.has("reserve")) {
      const std::int64_t reserve = cut.integer("reserve");
      if (reserve < 0 || reserve > formats::kMostCutNodes)
        cut.wrong("reserve", fmt::format("a number of nodes, 0 to {}", formats::kMostCutNodes));
      result.cut->reserve = reserve;
    }
    cut.finish();
  }
  if (table.has("touchable")) {
    TomlTable touchable = table.table("touchable");
    result.touchable = selectors(touchable);
    touchable.finish();
  }
  if (table.has("preload")) {
    TomlTable preload = table.table("preload");
    TomlTable gravity = preload.table("gravity");
    const double unit = gravity.choice("unit", kAccelerations);
    result.gravity = gravity.vector("value");
    for (double& g : *result.gravity) {
      g *= unit;
      if (std::abs(g) > kStrongestGravity) gravity.wrong("value", "components of at most 1e6 m/s^2");
    }
    gravity.finish();
    preload.finish();
  }
  if (table.has("store")) {
    TomlTable store = table.table("store");
    if (store.has("interior")) result.store_interior = store.boolean("interior");
    if (store.has("large_deformation")) result.store_large_deformation = store.boolean("large_deformation");
    store.finish();
  }
  table.finish();
  return result;
}

}  // namespace palpate
