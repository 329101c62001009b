#include "programs/player/played_organ.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "formats/errors.h"
#include "programs/player/tool_places.h"
#include "programs/player/tool_points.h"

namespace palpate {
namespace {

using Vector = SceneConfig::Vector;

Vector node_position(const palpate_bundle* bundle, std::int32_t node) {
  const double* p = palpate_bundle_nodes(bundle) + 3 * static_cast<std::size_t>(node);
  return {p[0], p[1], p[2]};
}

double distance(const Vector& a, const Vector& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

bool inside(const Vector& p, const Vector& low, const Vector& high) {
  for (int d = 0; d < 3; ++d)
    if (p[d] < low[d] || p[d] > high[d]) return false;
  return true;
}

// In triangles: those in the region of a cut that lie inside are touchable too, once they are on a lip.
std::vector<std::int32_t> touchable_on_surface(const palpate_bundle* bundle) {
  const palpate_bundle_info info = palpate_bundle_describe(bundle);
  std::vector<char> in_triangle(static_cast<std::size_t>(info.surface_node_count));
  const std::int32_t* corners = palpate_bundle_triangles(bundle);
  for (std::ptrdiff_t c = 0; c < 3 * std::ptrdiff_t{info.triangle_count}; ++c)
    in_triangle[static_cast<std::size_t>(corners[c])] = 1;
  const std::int32_t* touchable = palpate_bundle_touchable(bundle);
  std::vector<std::int32_t> nodes;
  std::copy_if(touchable, touchable + info.touchable_count, std::back_inserter(nodes),
               [&](std::int32_t node) { return in_triangle[static_cast<std::size_t>(node)] != 0; });
  return nodes;
}

std::vector<palpate_grip> resolve_grips(const SceneConfig::Tool& tool, const palpate_bundle* bundle,
                                        const std::filesystem::path& file) {
  std::vector<palpate_grip> grips;
  for (const auto& grip : tool.grips)
    for (const std::int32_t node : gripped_nodes(grip, bundle, file)) {
      palpate_grip resolved = palpate_default_grip();
      resolved.kind = PALPATE_GRIP_NODE;
      resolved.node = node;
      resolved.axes = grip.axes;
      grips.push_back(resolved);
    }
  return grips;
}

SceneDef scene_def(const SceneConfig& scene, int max_points, const HeldTissue& held, const PlayedNeedles& needles) {
  SceneDef def = scene.def;
  def.dent.dent = PALPATE_DENT_OFF;  // until there is a mesh to draw it on
  def.max_tools = static_cast<int>(scene.tools.size());
  if (def.max_points == 0) def.max_points = std::max(1, max_points);
  // A disc covers a dozen nodes of a coarse mesh, and a hundred of a fine one.
  constexpr int nodes_of_blade_point = 12;  // of the library's blades, each of which may feel the tissue
  const int nodes_of_cut = def.cut.cut == PALPATE_CUT_ON
                               ? nodes_of_blade_point * PALPATE_MAX_BLADES * def.cut.cut_points + 2 * def.cut.cut_lips
                               : 0;
  const int nodes_per_point = def.contact == PALPATE_CONTACT_PATCH ? 100 : 3, most = 3000;  // of palpate.h
  if (def.max_contact_nodes == 0)
    def.max_contact_nodes = std::min(
        most, std::max(3 * def.max_points, std::min(1000, nodes_per_point * def.max_points)) + held.most_nodes() +
                  needles.most_nodes() + nodes_of_cut + (scene.obstacles.empty() ? 0 : def.obstacles.max_nodes));
  def.links.max_links = static_cast<std::int32_t>(held.links().size()), def.grasps.grasps = held.has_grasps();
  def.needles.needles = needles.any(), def.needles.needle_places = needles.places();
  def.motions.motions = !scene.motions.empty();
  def.force_control.force_control = std::any_of(scene.tools.begin(), scene.tools.end(),
                                                [](const auto& tool) { return tool.given_force.has_value(); });
  return def;
}

// The limits are those of the whole scene, so that the contacts of one half fit the other half.
SceneDef half_of(SceneDef def, Half half) {
  if (half == Half::touch) def.inside.inside = PALPATE_INSIDE_OFF, def.crossings.crossings = PALPATE_CROSSINGS_OFF;
  // Under large deformation the touch half solves for the nodes of the shape.
  if (half == Half::touch && def.large.deformation == PALPATE_DEFORMATION_LINEAR)
    def.shape = PALPATE_SHAPE_OFF, def.radial = PALPATE_RADIAL_OFF;
  if (half == Half::shape) {
    def.collision = PALPATE_COLLISION_OFF, def.contact = PALPATE_CONTACT_NODE, def.law = PALPATE_LAW_STICKING;
    def.force = PALPATE_FORCE_OFF, def.relaxation.terms = 0;
    def.links.max_links = def.grasps.grasps = def.force_control.force_control = 0;
    def.cut.cut = PALPATE_CUT_OFF;
  }
  return def;
}

}  // namespace

std::vector<std::int32_t> gripped_nodes(const SceneConfig::Grip& grip, const palpate_bundle* bundle,
                                        const std::filesystem::path& file) {
  const std::vector<std::int32_t> candidates = touchable_on_surface(bundle);
  std::vector<std::int32_t> nodes;
  if (grip.nearest && !candidates.empty()) {
    const auto nearer = [&](std::int32_t a, std::int32_t b) {
      return distance(node_position(bundle, a), *grip.nearest) < distance(node_position(bundle, b), *grip.nearest);
    };
    nodes.push_back(*std::min_element(candidates.begin(), candidates.end(), nearer));
  } else if (!grip.nearest) {
    for (const std::int32_t node : candidates)
      if (inside(node_position(bundle, node), grip.box_min, grip.box_max)) nodes.push_back(node);
  }
  if (nodes.empty())
    throw InputError(
        fmt::format("{}:{}: [[tool.grip]]: expected touchable nodes of the bundle there, found none; "
                    "compare with \"palpate-bundle info\"",
                    file.string(), grip.line));
  return nodes;
}

PlayedOrgan::PlayedOrgan(SceneConfig scene, std::filesystem::path bundle, Half half, const RenderMesh* render_mesh,
                         std::string name)
    : scene_(std::move(scene)),
      bundle_file_(std::move(bundle)),
      half_(half),
      render_mesh_(render_mesh),
      name_(std::move(name)) {
  palpate_error error{};
  palpate_bundle* opened = nullptr;
  palpate_bundle_options options = palpate_default_bundle_options();
  // A bundle may be computed anew while the player reads it. These programs have no handler of SIGBUS of their own, and a flag in
  // the summary tells more than a process that ends.
  options.file_access = PALPATE_FILE_MAP_GUARDED;
  options.log = hear, options.log_user = this;
  if (palpate_bundle_open_file(bundle_file_.c_str(), &options, &opened, &error) != PALPATE_OK) refuse(error);
  bundle_.reset(opened);
  resolve_places(scene_, bundle_.get());
  for (const auto& tool : scene_.tools) grips_.push_back(resolve_grips(tool, bundle_.get(), scene_.file));
  held_ = std::make_unique<HeldTissue>(scene_, bundle_.get());
  needles_ = std::make_unique<PlayedNeedles>(scene_, bundle_.get());
  motions_ = std::make_unique<OrganMotions>(scene_, bundle_.get());
  loads_ = std::make_unique<OrganLoads>(scene_, bundle_.get());
  obstacles_ = std::make_unique<OrganObstacles>(scene_);
  cuts_ = std::make_unique<OrganCuts>(scene_);
}

void PlayedOrgan::hear(void* organ, palpate_log_level level, const char* text) {
  PlayedOrgan& self = *static_cast<PlayedOrgan*>(organ);
  const bool of_bundle = !self.bundle_, warns = level == PALPATE_LOG_WARNING;
  if (self.runtime_scene_ || (of_bundle && !warns) || std::strstr(text, "preload is OFF")) return;
  (warns ? self.log_.warnings : self.log_.notes)
      .push_back(self.name_.empty() ? text : fmt::format("organ \"{}\": {}", self.name_, text));
}

void PlayedOrgan::refuse(const palpate_error& error) const {
  const std::string at = error.byte_offset ? fmt::format("byte {}: ", error.byte_offset) : "";
  const bool of_surface = scene_.surface && std::string_view(error.text).starts_with("palpate_fine_surface");
  const auto& file = of_surface                               ? scene_.surface->file
                     : error.status == PALPATE_ERROR_ARGUMENT ? scene_.file
                                                              : bundle_file_;
  const std::string text = error.status == PALPATE_ERROR_ARGUMENT && !of_surface
                               ? obstacles_->named(error.text)
                               : fmt::format("{}: {}{}", file.string(), at, error.text);
  if (error.status == PALPATE_ERROR_MEMORY) throw OperationError(text);
  throw InputError(text);
}

int PlayedOrgan::points_and_grips() const {
  std::size_t total = 0;
  for (const auto& tool : scene_.tools) total += tool_points(tool).size();
  for (const auto& grips : grips_) total += grips.size();
  return static_cast<int>(std::min<std::size_t>(total, 1 << 20));
}

SceneDef PlayedOrgan::definition(int max_points) {
  SceneDef def = half_of(scene_def(scene_, max_points, *held_, *needles_), half_);
  scene_.def.shape = def.shape, scene_.def.inside.inside = def.inside.inside;
  scene_.def.crossings.crossings = def.crossings.crossings;
  contact_node_limit_ = def.max_contact_nodes;
  if (render_mesh_) {
    skin_.positions = render_mesh_->positions.data(), skin_.normals = render_mesh_->normals.data();
    skin_.vertex_count = static_cast<std::int32_t>(render_mesh_->positions.size() / 3);
    def.render_mesh = skin_;
    if (scene_.def.dent.dent == PALPATE_DENT_DISCS && half_ == Half::both)
      def.dent.dent = PALPATE_DENT_DISCS, def.report.report = PALPATE_REPORT_CONTACTS;
  }
  if (scene_.surface && def.collision != PALPATE_COLLISION_OFF) {
    RenderMesh met = read_render_mesh(scene_.surface->file, scene_.surface->metres_per_unit);
    met_positions_ = std::move(met.positions);
    met_triangles_.assign(met.indices.begin(), met.indices.end());
    met_surface_.positions = met_positions_.data(), met_surface_.triangles = met_triangles_.data();
    met_surface_.vertex_count = static_cast<std::int32_t>(met_positions_.size() / 3);
    met_surface_.triangle_count = static_cast<std::int32_t>(met_triangles_.size() / 3);
    def.fine_surface = met_surface();
  }
  def.loads = loads_->definition();
  if (half_ != Half::shape) obstacles_->put(&def.obstacles);
  holds_ = def.links.max_links > 0 || def.grasps.grasps;
  pierced_ = def.needles.needles != 0, forced_ = def.force_control.force_control != 0;
  is_cut_ = def.cut.cut == PALPATE_CUT_ON;
  moves_ = (motions_->any() || loads_->any() || obstacles_->any()) && half_ != Half::shape;
  return def;
}

void PlayedOrgan::play_on(palpate_scene* scene) {
  runtime_scene_ = scene;
  if (holds_) held_->hold_links(scene, 0);
  if (scene_.def.crossings.crossings == PALPATE_CROSSINGS_ON) crossings_ = std::make_unique<OrganCrossings>(scene);
  if (scene_.def.inside.inside == PALPATE_INSIDE_ON)
    inside_ = std::make_unique<OrganInside>(scene_, scene, shape_node_count());
}

int PlayedOrgan::shape_node_count() const {
  if (scene_.def.shape == PALPATE_SHAPE_OFF) return 0;
  const palpate_bundle_info info = palpate_bundle_describe(bundle_.get());
  return scene_.def.shape == PALPATE_SHAPE_SURFACE ? info.surface_node_count : info.node_count;
}

void PlayedOrgan::move(double time) {
  if (holds_) held_->close_grasps(time), held_->hold_links(runtime_scene_, time);
  if (moves_)
    motions_->set(runtime_scene_, time), loads_->set(runtime_scene_, time), obstacles_->set(runtime_scene_, time);
  if (is_cut_) cuts_->set(runtime_scene_, time);
}

}  // namespace palpate
