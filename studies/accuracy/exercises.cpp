#include "studies/accuracy/exercises.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <palpate/palpate.hpp>

#include "formats/errors.h"
#include "studies/timing/timing.h"

namespace palpate::accuracy {
namespace {

constexpr double kTick = 1e-3;  // s
constexpr int kPressTicks = 80, kDragTicks = 40, kHoldTicks = 1000;
constexpr double kStart = 0.1, kDepth = 0.5;  // of the radius: above the surface, below it
constexpr int kRounds = 3;

// Prony series of swine brain (Miller and Chinzei 1997): shares g, times tau in s. Any series would show the cost of leaving
// relaxation out.
constexpr double kShares[] = {0.450, 0.365}, kTimes[] = {0.5, 50};

using Motion = std::vector<Vec3>;  // a tool point's position at each tick

template <class Value>
Value chosen(const std::map<std::string, Value>& values, const std::string& name) {
  return values.at(name);
}

SceneDef scene_def(const SceneSetting& setting, int contact_nodes) {
  SceneDef def;
  def.contact = chosen<palpate_contact_model>({{"node", PALPATE_CONTACT_NODE},
                                               {"triangle", PALPATE_CONTACT_TRIANGLE},
                                               {"point", PALPATE_CONTACT_POINT},
                                               {"patch", PALPATE_CONTACT_PATCH}},
                                              setting.contact);
  def.law = chosen<palpate_contact_law>({{"sticking", PALPATE_LAW_STICKING},
                                         {"sliding", PALPATE_LAW_SLIDING},
                                         {"unilateral", PALPATE_LAW_UNILATERAL},
                                         {"coulomb", PALPATE_LAW_COULOMB}},
                                        setting.law);
  def.collision = setting.collision == "deformed" ? PALPATE_COLLISION_DEFORMED : PALPATE_COLLISION_REST;
  if (setting.response) def.force = PALPATE_FORCE_RESPONSE, def.radial = PALPATE_RADIAL_RESPONSE;
  if (setting.relaxation) {
    def.relaxation.terms = 2;
    std::copy(kShares, kShares + 2, def.relaxation.share);
    std::copy(kTimes, kTimes + 2, def.relaxation.time);
  }
  def.max_tools = PALPATE_MAX_TOOLS, def.max_points = std::max(PALPATE_MAX_TOOLS, setting.contacts);
  def.max_contact_nodes = contact_nodes;
  def.force_limit = def.force_slew = INFINITY;
  return def;
}

// A fine surface as the runtime takes it.
struct FineSurface {
  std::vector<float> positions;
  palpate_fine_surface view = palpate_default_fine_surface();

  explicit FineSurface(const StudySurface& from) : positions(from.nodes.begin(), from.nodes.end()) {
    view.positions = positions.data(), view.triangles = from.triangles.data();
    view.vertex_count = static_cast<std::int32_t>(positions.size() / 3);
    view.triangle_count = static_cast<std::int32_t>(from.triangles.size() / 3);
  }
};

// From above the site along its inward direction, down to depth.
Motion press(Vec3 at, const TouchSite& site, double radius, double depth) {
  Motion motion;
  for (int tick = 0; tick <= kPressTicks; ++tick)
    motion.push_back(at +
                     (depth * tick / kPressTicks - kStart * radius * (kPressTicks - tick) / kPressTicks) * site.inward);
  return motion;
}

// The motions of all tools of one exercise; at: the sites' points on this mesh.
std::vector<Motion> motions(const SceneSetting& setting, const StudySites& sites, const std::vector<Vec3>& at,
                            const std::vector<Vec3>& neighbour_at, std::size_t first) {
  const double r = sites.radius, depth = kDepth * r;
  std::vector<Motion> all;
  if (setting.exercise == "neighbour") {
    all.push_back(press(at[first], sites.touch[first], r, 2 * depth));
    all.push_back(Motion(kPressTicks + 1, neighbour_at[first] - kStart * r * sites.neighbour[first].inward));
    all.back()[0] = neighbour_at[first] - 2 * kStart * r * sites.neighbour[first].inward;
    all[0].resize(2 * kPressTicks + 2, all[0].back());
    const Motion second = press(neighbour_at[first], sites.neighbour[first], r, depth);
    all[1].insert(all[1].end(), second.begin(), second.end());
    return all;
  }
  for (std::size_t p = first; p < first + static_cast<std::size_t>(setting.contacts); ++p) {
    Motion motion = press(at[p], sites.touch[p], r, depth);
    const Vec3 end = motion.back();
    if (setting.exercise == "drag")
      for (int tick = 1; tick <= kDragTicks; ++tick)
        motion.push_back(end + (kDragDistance * r * tick / kDragTicks) * sites.touch[p].across);
    if (setting.exercise == "hold") motion.resize(motion.size() + kHoldTicks, end);
    all.push_back(std::move(motion));
  }
  return all;
}

StepTime step_time(const std::vector<double>& microseconds) {
  return {studies::percentile(microseconds, 0.5), studies::percentile(microseconds, 0.99)};
}

class Player {
 public:
  // fine: nullptr where tools meet the mesh.
  Player(const Bundle& bundle, Scene scene, const SceneSetting& setting, const StudySites& sites,
         const StudySurface* fine)
      : bundle_(bundle),
        scene_(std::move(scene)),
        contacts_(scene_.make_contacts()),
        setting_(setting),
        sites_(sites),
        u_(3 * static_cast<std::size_t>(bundle.describe().surface_node_count)) {
    const SurfaceView surface = {bundle_.nodes(),
                                 {bundle_.triangles(), 3 * static_cast<std::size_t>(bundle.describe().triangle_count)}};
    const auto find = [&](Vec3 p) {
      const FoundPoint found = closest_point(surface, p);
      seen_.farthest_site = std::max(seen_.farthest_site, length(found.at - p));
      return found;
    };
    for (const auto& site : sites.touch)
      at_.push_back(fine ? closest_point({fine->nodes.data(), fine->triangles}, site.at).at : find(site.at).at);
    for (const auto& site : sites.neighbour) neighbour_at_.push_back(find(site.at).at);
    for (const Vec3 p : sites.samples) samples_.push_back(find(p).on);
  }

  Observation observe() {
    const std::size_t exercises = setting_.exercise == "neighbour"
                                      ? sites_.neighbour.size()
                                      : sites_.touch.size() / static_cast<std::size_t>(setting_.contacts);
    const auto step = setting_.exercise == "neighbour" ? 1 : static_cast<std::size_t>(setting_.contacts);
    for (int round = 0; round < kRounds; ++round)
      for (std::size_t e = 0; e < exercises; ++e) {
        Press end = play(motions(setting_, sites_, at_, neighbour_at_, e * step));
        if (round == 0) seen_.presses.push_back(std::move(end));
      }
    seen_.touch = step_time(touch_us_);
    seen_.shape = step_time(shape_us_);
    return seen_;
  }

 private:
  Press play(const std::vector<Motion>& all) {
    scene_.reset();
    // One tool for each contact. If there are more contacts than tools, neighbouring contacts share a tool.
    std::vector<palpate_tool> tools(std::min<std::size_t>(all.size(), PALPATE_MAX_TOOLS));
    std::vector<std::array<double, 3>> points(all.size());
    for (std::size_t t = 0; t < tools.size(); ++t) {
      const std::size_t first = t * all.size() / tools.size(), end = (t + 1) * all.size() / tools.size();
      tools[t] = palpate_default_tool();
      tools[t].points = points[first].data(), tools[t].point_count = static_cast<std::int32_t>(end - first);
      tools[t].disc_radius = sites_.radius, tools[t].friction = 0.3;
    }
    const std::size_t ticks = all[0].size();
    for (std::size_t tick = 0; tick < ticks; ++tick) {
      for (std::size_t p = 0; p < all.size(); ++p) store3(all[p][tick], points[p].data());
      const auto begun = studies::Clock::now();
      const auto flags = scene_.touch(tools.data(), static_cast<std::int32_t>(tools.size()), kTick, contacts_);
      const double took = 1e6 * studies::seconds_since(begun);
      seen_.flags |= flags;
      seen_.contact_nodes = std::max(seen_.contact_nodes, contacts_->node_count);
      if (contacts_->node_count == 0) continue;
      touch_us_.push_back(took);
      if (tick % 8 == 0 || tick + 1 == ticks) shape();
    }
    return end();
  }

  void shape() {
    palpate_shape_out out = palpate_default_shape_out();
    out.displacements = u_.data(), out.node_capacity = static_cast<std::int32_t>(u_.size() / 3);
    const auto begun = studies::Clock::now();
    seen_.flags |= scene_.shape(contacts_, out);
    shape_us_.push_back(1e6 * studies::seconds_since(begun));
  }

  Press end() const {
    Press press;
    for (std::int32_t t = 0; t < contacts_->tool_count; ++t) {
      const double* f = contacts_.tool(t).force_raw;
      press.forces.push_back({f[0], f[1], f[2]});
    }
    for (const SurfacePoint& point : samples_) {
      std::array<double, 3> u{};
      for (int v = 0; v < 3; ++v) {
        const std::size_t n = 3 * static_cast<std::size_t>(bundle_.triangles()[3 * point.triangle + v]);
        for (std::size_t d = 0; d < 3; ++d) u[d] += point.barycentric[v] * u_[n + d];
      }
      press.field.push_back(u);
    }
    return press;
  }

  const Bundle& bundle_;
  Scene scene_;
  Contacts contacts_;
  const SceneSetting& setting_;
  const StudySites& sites_;
  std::vector<float> u_;
  std::vector<Vec3> at_, neighbour_at_;
  std::vector<SurfacePoint> samples_;
  std::vector<double> touch_us_, shape_us_;
  Observation seen_;
};

}  // namespace

namespace {

Observation observe_with(const std::filesystem::path& file, const SceneSetting& setting, const StudySites& sites,
                         const StudySurface* fine, int contact_nodes) {
  SceneDef def = scene_def(setting, contact_nodes);
  std::optional<FineSurface> met;
  if (fine) def.fine_surface = met.emplace(*fine).view;
  std::vector<double> open_us;
  for (int round = 0; round < kRounds; ++round) {
    const auto begun = studies::Clock::now();
    const Bundle bundle(file.c_str());
    const Scene scene(bundle, def);
    open_us.push_back(1e6 * studies::seconds_since(begun));
  }
  Bundle bundle(file.c_str());
  Scene scene(bundle, def);
  palpate_error ignored;
  palpate_bundle_prefault(bundle.get(), 0, &ignored);
  Observation seen = Player(bundle, std::move(scene), setting, sites, fine).observe();
  seen.open_ms = 1e-3 * studies::percentile(open_us, 0.5);
  return seen;
}

}  // namespace

Observation observe(const std::filesystem::path& file, const SceneSetting& setting, const StudySites& sites,
                    const StudySurface* fine) try {
  if (setting.surface != "fine") fine = nullptr;
  // A scene's memory grows with the square of max_contact_nodes, so the limit is no larger than the mesh needs.
  for (int room = setting.contacts > PALPATE_MAX_TOOLS ? 16 * setting.contacts : 64 * std::max(setting.contacts, 2);;
       room *= 2) {
    Observation seen = observe_with(file, setting, sites, fine, room);
    if (!(seen.flags & (PALPATE_STEP_CONTACTS_DROPPED | PALPATE_STEP_DISCS_THINNED)) || room > 3000) return seen;
  }
} catch (const Error& error) {
  throw OperationError(fmt::format("{}: {}", file.string(), error.what()));
}

}  // namespace palpate::accuracy
