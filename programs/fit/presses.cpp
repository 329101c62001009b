#include "programs/fit/presses.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "formats/errors.h"
#include "programs/fit/ball.h"
#include "programs/player/bundle_fields.h"
#include "programs/player/summary.h"

namespace palpate::fit {
namespace {

using Vector = std::array<double, 3>;

constexpr double kTimeStep = 1e-3;  // s; no result depends on it
constexpr double kShareOfRadius =
    1e-3;  // depth of a press: the answer is linear, so that any small depth gives the stiffness
constexpr std::int32_t kMostContactNodes = 3000;  // of palpate.h: 648 MB at most
constexpr std::int32_t kMostDiscNodes = 1000;     // 72 MB at most; a disc on more nodes raises DISCS_THINNED
constexpr double kMostOffAxis = 0.02;             // share of the plate's area that does not look along its axis

struct Destroy {
  void operator()(palpate_scene* scene) const { palpate_scene_destroy(scene); }
};
using Scene = std::unique_ptr<palpate_scene, Destroy>;

double dot(const Vector& a, const double* b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

SceneDef linear_press() {
  SceneDef def;
  def.shape = PALPATE_SHAPE_OFF;
  def.max_tools = 1;
  def.max_tool_speed = def.release_distance = def.force_slew = def.force_limit =
      std::numeric_limits<double>::infinity();
  return def;
}

Scene make_scene(palpate_bundle* bundle, const SceneDef& def, const std::filesystem::path& file) {
  palpate_scene* scene = nullptr;
  palpate_error error{};
  if (palpate_scene_create(bundle, &def, &scene, &error) != PALPATE_OK)
    throw InputError(fmt::format("{}: {}", file.string(), error.text));
  return Scene(scene);
}

// One tool, step after step.
class Toucher {
 public:
  explicit Toucher(palpate_scene* scene) : scene_(scene), bytes_(palpate_contacts_bytes(scene) / sizeof(double) + 1) {}
  const palpate_tool_state& touch(const palpate_tool& tool) {
    auto* contacts = reinterpret_cast<palpate_contacts*>(bytes_.data());
    flags_ = palpate_scene_touch(scene_, &tool, 1, kTimeStep, contacts, bytes_.size() * sizeof(double));
    return *palpate_contacts_tool(contacts, 0);
  }
  palpate_step_flags flags() const { return flags_; }
  const palpate_contacts& contacts() const { return *reinterpret_cast<const palpate_contacts*>(bytes_.data()); }

 private:
  palpate_scene* scene_;
  std::vector<double> bytes_;
  palpate_step_flags flags_ = 0;
};

// Outward normal of the surface at rest, interpolated between the vertices as that of a disc is.
class Normals {
 public:
  Normals(palpate_scene* scene, const palpate_bundle* bundle) : triangles_(palpate_bundle_triangles(bundle)) {
    const std::int32_t count = palpate_bundle_describe(bundle).surface_node_count;
    std::vector<float> rest(palpate_bundle_nodes(bundle), palpate_bundle_nodes(bundle) + 3 * std::size_t(count));
    normals_.resize(rest.size());
    palpate_shape_out shape = palpate_default_shape_out();
    shape.node_capacity = shape.node_count = count, shape.positions = rest.data();
    palpate_scene_normals(scene, &shape, normals_.data(), count);
  }
  Vector at(const palpate_surface_hit& hit) const {
    Vector sum{};
    for (int v = 0; v < 3; ++v)
      for (int d = 0; d < 3; ++d)
        sum[d] += hit.barycentric[v] * normals_[3 * std::size_t(triangles_[3 * std::size_t(hit.triangle) + v]) + d];
    const double length = std::sqrt(dot(sum, sum.data()));
    for (int d = 0; d < 3; ++d) sum[d] = length > 0 ? sum[d] / length : hit.normal[d];
    return sum;
  }

 private:
  const std::int32_t* triangles_;
  std::vector<float> normals_;
};

std::string flags_in_words(palpate_step_flags flags) {
  return fmt::format("{}", fmt::join(flag_names(flags), ", "));
}

}  // namespace

PressedBundle::PressedBundle(const std::filesystem::path& file) : file_(file) {
  const BundleFields fields = read_bundle_fields(file);
  palpate_bundle* bundle = nullptr;
  palpate_error error{};
  if (palpate_bundle_open_file(file.c_str(), nullptr, &bundle, &error) != PALPATE_OK)
    throw InputError(fmt::format("{}: {}", file.string(), error.text));
  bundle_.reset(bundle);
  region_of_ = fields.region, support_nodes_ = fields.support_nodes, support_stiffness_ = fields.support_stiffness;
  read_provenance(fields.provenance);
  std::size_t begin = 0;
  for (std::size_t r = 0; r < fields.young.size(); ++r) {
    const std::size_t end = std::min(fields.region_names.find('\n', begin), fields.region_names.size());
    regions_.push_back({fields.region_names.substr(begin, end - begin), fields.young[r], fields.poisson[r]});
    begin = std::min(end + 1, fields.region_names.size());
  }
}

void PressedBundle::read_provenance(const std::string& text) {
  const auto provenance = nlohmann::json::parse(text, nullptr, false);
  if (!provenance.is_object()) return;
  for (const auto& [key, value] : provenance.items()) {
    if (key == "element" && value.is_string()) element_ = value.get<std::string>();
    if (key == "accuracy_linear_limit_mm" && value.is_number()) linear_limit_ = 1e-3 * value.get<double>();
    if ((key.rfind("foundation ", 0) == 0 || key.rfind("spring ", 0) == 0) && value.is_string())
      soft_supports_[key] = value.get<std::string>();
  }
}

void PressedBundle::expect_same_body(const PressedBundle& other) const {
  const palpate_bundle_info mine = palpate_bundle_describe(bundle_.get()),
                            its = palpate_bundle_describe(other.bundle_.get());
  const auto same = [&](auto* a, auto* b, std::size_t count, std::size_t its_count) {
    return count == its_count && a && b && std::memcmp(a, b, count * sizeof *a) == 0;
  };
  const palpate_bundle *a = bundle_.get(), *b = other.bundle_.get();
  const char* differ = nullptr;
  if (!same(palpate_bundle_nodes(a), palpate_bundle_nodes(b), 3 * std::size_t(mine.node_count),
            3 * std::size_t(its.node_count)) ||
      !same(palpate_bundle_tetrahedra(a), palpate_bundle_tetrahedra(b), 4 * std::size_t(mine.tetrahedron_count),
            4 * std::size_t(its.tetrahedron_count)))
    differ = "the mesh";
  else if (soft_supports_ != other.soft_supports_ ||
           !same(palpate_bundle_fixed(a), palpate_bundle_fixed(b), 3 * std::size_t(mine.node_count),
                 3 * std::size_t(its.node_count)))
    differ = "the supports";
  else if (!same(palpate_bundle_touchable(a), palpate_bundle_touchable(b), mine.touchable_count, its.touchable_count))
    differ = "the touchable nodes";
  else if (!std::equal(regions_.begin(), regions_.end(), other.regions_.begin(), other.regions_.end(),
                       [](const Region& x, const Region& y) { return x.name == y.name; }))
    differ = "the regions";
  if (differ)
    throw InputError(
        fmt::format("{}: expected the mesh, supports, touchable nodes and regions of {}, found others ({}); make the "
                    "bundles from one "
                    "mesh and one boundary file",
                    file_.string(), other.file_.string(), differ));
}

std::vector<double> PressedBundle::stiffness(const std::vector<Spot>& spots, Press press,
                                             const std::filesystem::path& source) {
  warnings_.clear();
  return is_plate(press) ? std::vector<double>(spots.size(), press_plate(press)) : press_discs(spots, press, source);
}

// E / (1 - nu^2) of the tissue behind a triangle of the surface, Pa.
double PressedBundle::plane_modulus(std::int32_t triangle) const {
  const std::int32_t *corner = palpate_bundle_triangles(bundle_.get()) + 3 * std::size_t(triangle),
                     *elements = palpate_bundle_tetrahedra(bundle_.get());
  for (std::size_t e = 0; e < region_of_.size(); ++e) {
    const auto has = [&](std::int32_t node) {
      return std::find(elements + 4 * e, elements + 4 * e + 4, node) != elements + 4 * e + 4;
    };
    if (!has(corner[0]) || !has(corner[1]) || !has(corner[2])) continue;
    const Region& tissue = regions_[region_of_[e]];
    return tissue.young / (1 - tissue.poisson * tissue.poisson);
  }
  throw InputError(fmt::format("{}: triangle {} of its surface belongs to no tetrahedron; compute the bundle again",
                               file_.string(), triangle));
}

// The place of the surface that is nearest to a spot.
palpate_surface_hit PressedBundle::hit_of(palpate_scene* scene, const Spot& spot, const std::string& line) const {
  palpate_surface_hit hit = palpate_default_surface_hit();
  palpate_scene_closest_point(scene, nullptr, spot.at.data(), std::numeric_limits<double>::infinity(), &hit);
  if (!hit.hit || hit.distance > spot.radius)
    throw InputError(
        fmt::format("{}: expected a place within the indenter's radius ({:.3g} mm) of the surface of {}, found "
                    "({:g}, {:g}, {:g}) mm, {:.3g} mm away; give places in the bundle's axes and check the unit",
                    line, 1e3 * spot.radius, file_.string(), 1e3 * spot.at[0], 1e3 * spot.at[1], 1e3 * spot.at[2],
                    1e3 * hit.distance));
  return hit;
}

std::vector<double> PressedBundle::press_discs(const std::vector<Spot>& spots, Press press,
                                               const std::filesystem::path& source) {
  SceneDef def = linear_press();
  def.law = press == Press::sliding ? PALPATE_LAW_SLIDING : PALPATE_LAW_STICKING;
  def.queries.queries = PALPATE_QUERIES_ON;
  def.max_points = 1, def.max_contact_nodes = kMostDiscNodes;
  const Scene scene = make_scene(bundle_.get(), def, file_);
  const Normals normals(scene.get(), bundle_.get());
  Toucher toucher(scene.get());
  std::vector<double> result;
  for (const Spot& spot : spots) {
    const auto line = fmt::format("{}:{}", source.string(), spot.line);
    if (spot.ball_depth > 0 && press != Press::sliding)
      throw InputError(fmt::format(
          "{}: a ball is taken as one without friction, but the law is sticking; give --law sliding", line));
    const palpate_surface_hit hit = hit_of(scene.get(), spot, line);
    const Vector normal = normals.at(hit);
    const double depth = kShareOfRadius * spot.radius;
    Vector point;
    palpate_tool tool = palpate_default_tool();
    tool.points = point.data(), tool.point_count = 1, tool.disc_radius = spot.radius;
    const auto place = [&](double outward) {
      for (int d = 0; d < 3; ++d) point[d] = hit.point[d] + outward * normal[d];
    };
    palpate_scene_reset(scene.get());
    place(depth);
    toucher.touch(tool);
    place(-depth);
    const palpate_tool_state& state = toucher.touch(tool);
    const double force = dot(normal, state.force_raw);
    if (state.contact_count == 0 || !(force > 0) || (toucher.flags() & PALPATE_STEP_NOT_TOUCHABLE))
      throw InputError(
          fmt::format("{}: expected a place of {} that can be touched, found one where the disc meets held nodes or "
                      "nodes that are not touchable{}; "
                      "see \"palpate-bundle info\"",
                      line, file_.string(), toucher.flags() ? " (" + flags_in_words(toucher.flags()) + ")" : ""));
    if (toucher.flags())
      warnings_.push_back(fmt::format("{}: the press on {} raised {}; do not trust this place", line, file_.string(),
                                      flags_in_words(toucher.flags())));
    double stiffness = force / depth;
    if (spot.ball_depth > 0) {
      stiffness = ball_stiffness({plane_modulus(hit.triangle), stiffness}, spot.radius, spot.ball_depth);
      if (std::isnan(stiffness))
        throw InputError(
            fmt::format("{}: expected a depth at which the ball of {:.3g} mm touches with less than its equator, found "
                        "{:.3g} mm; leave such rows out with --most-depth",
                        line, 1e3 * spot.radius, 1e3 * spot.ball_depth));
    }
    result.push_back(stiffness);
  }
  return result;
}

// The axis that the touchable part of the surface looks along; sign: outward.
int PressedBundle::plate_axis(double& sign) const {
  const palpate_bundle_info info = palpate_bundle_describe(bundle_.get());
  const std::int32_t *touchable = palpate_bundle_touchable(bundle_.get()),
                     *triangles = palpate_bundle_triangles(bundle_.get());
  const double* nodes = palpate_bundle_nodes(bundle_.get());
  Vector area{};
  double whole = 0;
  for (int t = 0; t < info.triangle_count; ++t) {
    const std::int32_t* corner = triangles + 3 * std::size_t(t);
    if (!std::all_of(corner, corner + 3, [&](std::int32_t node) {
          return std::binary_search(touchable, touchable + info.touchable_count, node);
        }))
      continue;
    Vector e[2];
    for (int d = 0; d < 3; ++d)
      for (int k = 0; k < 2; ++k)
        e[k][d] = nodes[3 * std::size_t(corner[k + 1]) + d] - nodes[3 * std::size_t(corner[0]) + d];
    Vector normal;
    for (int d = 0; d < 3; ++d)
      normal[d] = e[0][(d + 1) % 3] * e[1][(d + 2) % 3] - e[0][(d + 2) % 3] * e[1][(d + 1) % 3];
    for (int d = 0; d < 3; ++d) area[d] += normal[d];
    whole += std::sqrt(dot(normal, normal.data()));
  }
  const auto largest =
      std::max_element(area.begin(), area.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
  if (!(std::abs(*largest) > (1 - kMostOffAxis) * whole))
    throw InputError(fmt::format(
        "{}: --plate: expected a touchable part of the surface that looks along x, y or z, found another one; turn the "
        "mesh, or let [touchable] select the pressed face alone",
        file_.string()));
  sign = *largest > 0 ? 1 : -1;
  return static_cast<int>(largest - area.begin());
}

BundleBody PressedBundle::body() const {
  const palpate_bundle* bundle = bundle_.get();
  const palpate_bundle_info info = palpate_bundle_describe(bundle);
  BundleBody body;
  body.nodes = palpate_bundle_nodes(bundle), body.tetrahedra = palpate_bundle_tetrahedra(bundle);
  body.region = region_of_.data(), body.fixed = palpate_bundle_fixed(bundle);
  body.node_count = info.node_count, body.tetrahedron_count = info.tetrahedron_count;
  body.surface_count = info.surface_node_count;
  body.support_nodes = &support_nodes_, body.support_stiffness = &support_stiffness_, body.element = element_;
  return body;
}

std::vector<std::int32_t> PressedBundle::touchable() const {
  const std::int32_t* first = palpate_bundle_touchable(bundle_.get());
  return {first, first + palpate_bundle_describe(bundle_.get()).touchable_count};
}

std::vector<HeldDisc> PressedBundle::hold_discs(const std::vector<Spot>& spots, const std::filesystem::path& source) {
  SceneDef def = linear_press();
  def.collision = PALPATE_COLLISION_OFF, def.shape = PALPATE_SHAPE_SURFACE;
  def.queries.queries = PALPATE_QUERIES_ON;
  def.max_points = 1, def.max_contact_nodes = kMostDiscNodes;
  const Scene scene = make_scene(bundle_.get(), def, file_);
  const Normals normals(scene.get(), bundle_.get());
  Toucher toucher(scene.get());
  const auto surface = std::size_t(palpate_bundle_describe(bundle_.get()).surface_node_count);
  std::vector<HeldDisc> discs;
  for (const Spot& spot : spots) {
    const auto line = fmt::format("{}:{}", source.string(), spot.line);
    const palpate_surface_hit hit = hit_of(scene.get(), spot, line);
    HeldDisc disc;
    std::copy_n(hit.point, 3, disc.at.begin());
    disc.outward = normals.at(hit);
    if (spot.ball_depth > 0) {
      discs.push_back(std::move(disc));
      continue;
    }
    palpate_grip grip = palpate_default_grip();
    grip.kind = PALPATE_GRIP_SURFACE_POINT, grip.triangle = hit.triangle;
    std::copy_n(hit.barycentric, 3, grip.barycentric);
    palpate_tool tool = palpate_default_tool();
    tool.grips = &grip, tool.grip_count = 1, tool.disc_radius = spot.radius;
    const double depth = kShareOfRadius * spot.radius;
    Eigen::Matrix3d force, missed;
    for (int i = 0; i < 3; ++i) {
      palpate_scene_reset(scene.get());
      for (int k = 0; k < 3; ++k) grip.displacement[k] = i == k ? depth : 0;
      const palpate_tool_state& state = toucher.touch(tool);
      if (state.contact_count == 0 || (toucher.flags() & PALPATE_STEP_NOT_TOUCHABLE))
        throw InputError(
            fmt::format("{}: expected a place of {} that can be touched, found one where the disc meets held nodes or "
                        "nodes that are not touchable{}; see \"palpate-bundle info\"",
                        line, file_.string(), toucher.flags() ? " (" + flags_in_words(toucher.flags()) + ")" : ""));
      const Eigen::Vector3d whole = -Eigen::Vector3d::Map(state.force_raw);
      const palpate_contacts& contacts = toucher.contacts();
      if (i == 0)
        for (std::int32_t n = 0; n < contacts.node_count; ++n) {
          // The rows along x, y and z share the weights: the force of a node is its weight of the whole.
          const palpate_contact_node& node = *palpate_contacts_node(&contacts, n);
          disc.nodes.push_back(node.node);
          disc.weights.push_back(Eigen::Vector3d::Map(node.force).dot(whole) / whole.squaredNorm());
        }
      std::vector<float> u(3 * surface);
      palpate_shape_out shape = palpate_default_shape_out();
      shape.displacements = u.data(), shape.node_capacity = static_cast<std::int32_t>(surface);
      palpate_scene_shape(scene.get(), &contacts, &shape);
      force.col(i) = whole, missed.col(i) = depth * Eigen::Vector3d::Unit(i);
      for (std::size_t n = 0; n < disc.nodes.size(); ++n)
        missed.col(i) -= disc.weights[n] * Eigen::Vector3f::Map(&u[3 * std::size_t(disc.nodes[n])]).cast<double>();
    }
    const Eigen::Matrix3d compliance = missed * force.inverse();
    Eigen::Matrix3d::Map(&disc.compliance[0][0]) = 0.5 * (compliance + compliance.transpose());
    discs.push_back(std::move(disc));
  }
  return discs;
}

double PressedBundle::press_plate(Press press) {
  const palpate_bundle_info info = palpate_bundle_describe(bundle_.get());
  if (info.touchable_count > kMostContactNodes)
    throw InputError(fmt::format("{}: --plate: expected at most {} touchable nodes, found {}; take a coarser mesh",
                                 file_.string(), kMostContactNodes, info.touchable_count));
  double sign = 1;
  const int axis = plate_axis(sign);
  const double* nodes = palpate_bundle_nodes(bundle_.get());
  double low = nodes[axis], high = low;
  for (int n = 0; n < info.surface_node_count; ++n) {
    low = std::min(low, nodes[3 * std::size_t(n) + axis]);
    high = std::max(high, nodes[3 * std::size_t(n) + axis]);
  }
  plate_height_ = high - low;
  SceneDef def = linear_press();
  def.collision = PALPATE_COLLISION_OFF, def.contact = PALPATE_CONTACT_NODE;
  def.max_points = def.max_contact_nodes = info.touchable_count;
  const Scene scene = make_scene(bundle_.get(), def, file_);
  const double depth = kShareOfRadius * plate_height_;
  std::vector<palpate_grip> grips(info.touchable_count, palpate_default_grip());
  for (int k = 0; k < info.touchable_count; ++k) {
    grips[k].kind = PALPATE_GRIP_NODE, grips[k].node = palpate_bundle_touchable(bundle_.get())[k];
    grips[k].axes = press == Press::plate ? 1u << axis : 7u, grips[k].displacement[axis] = -sign * depth;
  }
  palpate_tool tool = palpate_default_tool();
  tool.grips = grips.data(), tool.grip_count = info.touchable_count;
  Toucher toucher(scene.get());
  const palpate_tool_state& state = toucher.touch(tool);
  const double force = sign * state.force_raw[axis];
  if (!(force > 0))
    throw OperationError(
        fmt::format("{}: the plate gave no force ({})", file_.string(), flags_in_words(toucher.flags())));
  if (toucher.flags())
    warnings_.push_back(fmt::format("{}: the press of the plate raised {}; do not trust it", file_.string(),
                                    flags_in_words(toucher.flags())));
  return force / depth;
}

}  // namespace palpate::fit
