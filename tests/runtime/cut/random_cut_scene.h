// Random scenes of an organ that is cut: blades with and without toughness at up to 2 m/s, strokes that cross, end inside, go back in place or stand still,
// removal, probes that press beside the cut and into it, grips that draw, jaws that take hold before a cut and lift, and threads, springs and clips.
#pragma once

#include <palpate/palpate_scene_def.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "tests/support/open_bundle.h"

namespace palpate::tests {

class RandomCutScene {
 public:
  // bundle: of an organ that may be cut, borrowed. deformation: what is solved in another thread is so once in a few steps.
  RandomCutScene(palpate_bundle* bundle, std::uint64_t seed,
                 palpate_deformation_model deformation = PALPATE_DEFORMATION_LINEAR)
      : random_(seed), bundle_(bundle) {
    palpate_bundle_info info = {};
    palpate_bundle_fill_info(bundle, &info, sizeof info);
    nodes_ = info.surface_node_count;
    const double* const rest = palpate_bundle_nodes(bundle);
    rest_.assign(rest, rest + 3 * nodes_);
    for (int d = 0; d < 3; ++d) {
      low_[d] = high_[d] = rest_[static_cast<std::size_t>(d)];
      for (std::size_t i = static_cast<std::size_t>(d); i < rest_.size(); i += 3)
        low_[d] = std::min(low_[d], rest_[i]), high_[d] = std::max(high_[d], rest_[i]);
    }
    constexpr palpate_contact_model models[] = {PALPATE_CONTACT_NODE, PALPATE_CONTACT_TRIANGLE, PALPATE_CONTACT_POINT,
                                                PALPATE_CONTACT_PATCH};
    constexpr palpate_contact_law laws[] = {PALPATE_LAW_STICKING, PALPATE_LAW_SLIDING, PALPATE_LAW_UNILATERAL,
                                            PALPATE_LAW_COULOMB};
    SceneDef def;
    def.collision = PALPATE_COLLISION_DEFORMED, def.shape = PALPATE_SHAPE_SURFACE;
    def.contact = models[random_() % 4], def.law = laws[random_() % 4];
    def.links.max_links = kMostLinks, def.grasps.grasps = def.contact == PALPATE_CONTACT_PATCH;
    def.cut.cut = PALPATE_CUT_ON, def.cut.cut_rank = random_() % 3 == 0 ? 150 : 600;
    def.cut.cut_operations = random_() % 2 ? 30'000 : 1'000'000;
    is_large_ = deformation != PALPATE_DEFORMATION_LINEAR;
    if (!is_large_ && seed % 3 > 0) def.cut.cut_rebase = seed % 3 == 1 ? 40 : 100;
    if (is_large_) def.large.deformation = deformation;
    palpate_error error = {};
    palpate_scene* made = nullptr;
    if (palpate_scene_create(bundle, &def, &made, &error) != PALPATE_OK) fault_ = error.text;
    scene_.reset(made);
    contacts_.resize(palpate_contacts_bytes(made) / 8 + 1);
    disc_ = def.contact == PALPATE_CONTACT_PATCH ? 0.004 : 0;
    triangles_ = info.triangle_count;
    begin_stroke();
  }

  // Plays one step. The sentence of a fault; empty: none.
  std::string step() {
    if (!fault_.empty()) return fault_;
    if (left_-- <= 0) begin_stroke();
    move_blade();
    if (share() < 0.02) {
      const std::vector<double> centre = somewhere();
      const bool takes_time = share() < 0.5;
      palpate_scene_remove_tissue(scene_.get(), centre.data(), 0.003 + 0.006 * share(), takes_time ? 0.02 : 0,
                                  takes_time ? 0.03 : 0, nullptr);
    }
    move_tools();
    if (share() < 0.03) sew();
    flags = touch();
    flagged += flags != 0;
    for (std::int32_t t = 0; t < contacts()->tool_count; ++t)
      for (const double f : palpate_contacts_tool(contacts(), t)->force_raw)
        if (!(std::fabs(f) < 1e4)) return "a tool's force is " + std::to_string(f) + " N";
    const palpate_blade_state& blade = *palpate_scene_blade_state(scene_.get(), 0);
    for (const double f : blade.force)
      if (!(std::fabs(f) < 1e4)) return "a blade's force is " + std::to_string(f) + " N";
    ++steps_;
    return steps_ % 5 == 0 ? fault_of_surface() : "";
  }

  // Lets everything go: the organ, and each piece that came off, comes back to rest.
  std::string let_go() {
    if (!fault_.empty()) return fault_;
    const palpate_blade none = palpate_default_blade();
    palpate_scene_set_blade(scene_.get(), 0, &none, nullptr);
    tools_.clear();
    palpate_scene_set_links(scene_.get(), nullptr, 0, nullptr);
    for (int s = 0; s < 1000 && (is_large_ || s < 3 || state().left > 0); ++s) touch();
    if (state().left > 0 && !state().is_full) return "the compliance does not follow";
    const std::string fault = fault_of_surface();
    if (!fault.empty()) return fault;
    for (const std::int32_t n : used_)
      for (int d = 0; d < 3; ++d) {
        const double off = at(n, d) - rest_of(n, d);
        if (!(std::fabs(off) < 1e-6)) return "node " + std::to_string(n) + " is " + std::to_string(off) + " m off";
      }
    return "";
  }
  const palpate_cut_state& state() const { return *palpate_scene_cut_state(scene_.get()); }
  const palpate_scene* scene() const { return scene_.get(); }
  const palpate_contacts* told() const { return reinterpret_cast<const palpate_contacts*>(contacts_.data()); }
  // m, of the nodes of the surface; of those in use, as a shape has them.
  const std::vector<float>& positions() {
    fault_of_surface();
    return shape_;
  }
  const std::vector<std::int32_t>& nodes_in_use() const { return used_; }
  long flagged = 0, sewn = 0;
  palpate_step_flags flags = 0;  // of the last step

 private:
  double share() { return std::uniform_real_distribution<double>(0, 1)(random_); }
  std::vector<double> somewhere() {
    std::vector<double> p(3);
    for (int d = 0; d < 3; ++d)
      p[static_cast<std::size_t>(d)] = low_[d] - 0.005 + (high_[d] - low_[d] + 0.01) * share();
    return p;
  }
  std::vector<double> direction() {
    std::vector<double> v = {share() - 0.5, share() - 0.5, share() - 0.5};
    const double size = std::hypot(v[0], v[1], v[2]) + 1e-9;
    for (double& x : v) x /= size;
    return v;
  }
  palpate_contacts* contacts() { return reinterpret_cast<palpate_contacts*>(contacts_.data()); }
  palpate_step_flags touch() {
    if (is_large_ && share() < 0.6) palpate_scene_deform(scene_.get());
    return palpate_scene_touch(scene_.get(), tools_.data(), static_cast<std::int32_t>(tools_.size()), 1e-3, contacts(),
                               8 * contacts_.size());
  }

  void begin_stroke() {
    const std::vector<double> from = somewhere(), along = direction(), edge = direction();
    const double speed = share() < 0.2 ? 2e-3 : 3e-4, length = 0.01 + 0.04 * share();
    const bool back = share() < 0.2 && !points_.empty();
    if (back) {
      for (double& v : velocity_) v = -v;
    } else {
      points_.clear();
      for (int i = 0; i < 3; ++i)
        for (std::size_t d = 0; d < 3; ++d) points_.push_back(from[d] + 0.5 * i * length * edge[d]);
      for (std::size_t d = 0; d < 3; ++d) velocity_[d] = speed * along[d];
      direction_ = along;
      toughness_ = share() < 0.4 ? 2 + 60 * share() * share() : 0;
      friction_ = toughness_ > 0 && share() < 0.5 ? 500 * share() : 0;
    }
    left_ = 20 + static_cast<int>(100 * share());
  }
  void move_blade() {
    if (share() < 0.9)
      for (std::size_t i = 0; i < points_.size(); ++i) points_[i] += velocity_[i % 3];
    palpate_blade blade = palpate_default_blade();
    if (share() < 0.99) {
      blade.points = points_.data(), blade.point_count = 3, blade.toughness = toughness_;
      blade.friction = friction_, blade.width = friction_ > 0 ? 0.01 : 0;
      for (std::size_t d = 0; d < 3; ++d) blade.direction[d] = direction_[d];
    }
    palpate_error error = {};
    if (palpate_scene_set_blade(scene_.get(), 0, &blade, &error) != PALPATE_OK) fault_ = error.text;
  }
  void move_tools() {
    if (probe_.empty() || share() < 0.01) probe_ = somewhere(), way_ = direction();
    if (share() < 0.05) way_ = direction();
    for (std::size_t d = 0; d < 3; ++d) probe_[d] += 2e-4 * way_[d];
    if (share() < 0.01 || grip_.node < 0) {
      if (share() < 0.3 && !used_.empty()) {
        grip_ = palpate_default_grip();
        grip_.kind = PALPATE_GRIP_NODE, grip_.node = used_[random_() % used_.size()];
        drawn_ = direction();
        draws_ = 0;
      } else {
        grip_.node = -1;
      }
    }
    tools_.assign(1, palpate_default_tool());
    tools_[0].points = probe_.data(), tools_[0].point_count = 1, tools_[0].id = 1, tools_[0].disc_radius = disc_;
    tools_[0].friction = 0.3;
    move_jaws();
    if (grip_.node < 0) return;
    draws_ = std::min(0.01, draws_ + 2e-4);
    for (std::size_t d = 0; d < 3; ++d) grip_.displacement[d] = draws_ * drawn_[d];
    tools_.push_back(palpate_default_tool());
    tools_[1].grips = &grip_, tools_[1].grip_count = 1, tools_[1].id = 2;
  }

  // Jaws take the organ's own triangles, of which some may be gone.
  void move_jaws() {
    if (disc_ == 0) return;
    if (share() < 0.015) {
      holds_ = share() < 0.7;
      jaws_ = palpate_default_grasp();
      jaws_.id = ++closings_;
      jaws_.triangle = static_cast<std::int32_t>(random_() % static_cast<std::uint64_t>(triangles_));
      jaws_.radius = 0.003 + 0.004 * share(), jaws_.barycentric[random_() % 3] = 1;
      if (share() < 0.5) jaws_.friction = 0.3, jaws_.clamp_force = 2 * share();
      lifted_ = direction();
    }
    if (!holds_) return;
    for (std::size_t d = 0; d < 3; ++d) jaws_.position[d] += 5e-5 * lifted_[d];
    tools_.push_back(palpate_default_tool());
    tools_.back().parts = &jaws_.part, tools_.back().id = 3;
  }
  // Another list of links between the organ's own triangles, or from one to the world. Refused where a triangle is gone.
  void sew() {
    links_.resize(random_() % (kMostLinks + 1));
    for (palpate_link& link : links_) {
      link = palpate_default_link();
      constexpr palpate_link_kind kinds[] = {PALPATE_LINK_THREAD, PALPATE_LINK_SPRING, PALPATE_LINK_CLIP};
      link.kind = kinds[random_() % 3], link.stiffness = 1 + 20 * share(), link.breaking_force = 0.5 + share();
      link.rest_length = link.kind == PALPATE_LINK_CLIP ? 0 : 0.02 * share();
      link.radius = disc_ > 0 && share() < 0.5 ? 0.004 : 0;
      for (palpate_link_end& end : link.ends) {
        end.kind = PALPATE_END_SURFACE_POINT, end.barycentric[random_() % 3] = 1;
        end.triangle = static_cast<std::int32_t>(random_() % static_cast<std::uint64_t>(triangles_));
      }
      if (share() < 0.4) {
        link.ends[1].kind = PALPATE_END_WORLD;
        std::copy_n(somewhere().data(), 3, link.ends[1].point);
      }
    }
    sewn += palpate_scene_set_links(scene_.get(), links_.data(), static_cast<std::int32_t>(links_.size()), nullptr) ==
            PALPATE_OK;
  }

  std::string fault_of_surface() {
    const std::int32_t count = palpate_scene_cut_surface(scene_.get(), nullptr, nullptr, 0);
    std::vector<std::int32_t> t(3 * static_cast<std::size_t>(count));
    palpate_scene_cut_surface(scene_.get(), t.data(), nullptr, count);
    std::set<std::pair<std::int32_t, std::int32_t>> edges;
    for (std::size_t i = 0; i < t.size(); ++i)
      if (!edges.emplace(t[i], t[i % 3 == 2 ? i - 2 : i + 1]).second)
        return "an edge of the surface stands there twice";
    for (const auto& [a, b] : edges)
      if (!edges.contains({b, a})) return "the surface is open";
    const std::set<std::int32_t> used(t.begin(), t.end());
    used_.assign(used.begin(), used.end());
    shape_.resize(3 * static_cast<std::size_t>(nodes_));
    palpate_shape_out out = palpate_default_shape_out();
    out.positions = shape_.data(), out.node_capacity = nodes_;
    palpate_scene_shape(scene_.get(), contacts(), &out);
    for (const std::int32_t n : used_)
      for (int d = 0; d < 3; ++d)
        if (!(std::fabs(at(n, d)) < 2))
          return "node " + std::to_string(n) + " is at " + std::to_string(at(n, d)) + " m";
    return "";
  }
  double at(std::int32_t n, int d) const { return static_cast<double>(shape_[static_cast<std::size_t>(3 * n + d)]); }
  // Where the surface is at rest: a new node is where some node of the bundle is.
  double rest_of(std::int32_t n, int d) {
    double best = 1, found = 0;
    for (std::size_t i = 0; i < rest_.size(); i += 3) {
      const double off = std::hypot(rest_[i] - at(n, 0), rest_[i + 1] - at(n, 1), rest_[i + 2] - at(n, 2));
      if (off < best) best = off, found = rest_[i + static_cast<std::size_t>(d)];
    }
    return found;
  }

  std::mt19937_64 random_;
  palpate_bundle* bundle_;
  ScenePointer scene_;
  std::vector<std::uint64_t> contacts_;
  std::vector<double> rest_, points_, probe_, way_, direction_, drawn_;
  std::vector<float> shape_;
  std::vector<std::int32_t> used_;
  std::vector<palpate_tool> tools_;
  static constexpr std::uint64_t kMostLinks = 3;
  std::vector<palpate_link> links_;
  palpate_grasp jaws_ = palpate_default_grasp();
  std::vector<double> lifted_;
  std::int32_t triangles_ = 0, closings_ = 0;
  bool holds_ = false;
  palpate_grip grip_ = [] {
    palpate_grip grip = palpate_default_grip();
    grip.node = -1;
    return grip;
  }();
  double low_[3], high_[3], velocity_[3] = {}, toughness_ = 0, friction_ = 0, draws_ = 0, disc_ = 0;
  std::int32_t nodes_ = 0;
  int left_ = 0, steps_ = 0;
  bool is_large_ = false;
  std::string fault_;
};

}  // namespace palpate::tests
