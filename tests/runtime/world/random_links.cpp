#include "tests/runtime/world/random_links.h"

namespace palpate::tests {

RandomLinks::RandomLinks(std::uint64_t seed, LinkCounts* counts, Tell tell)
    : random_(seed), counts_(*counts), tell_(std::move(tell)) {
  touch_ = draw(2) == 0, patch_ = draw(3) == 0;
  friction_ = touch_ ? 0.25 * draw(3) : 0;
  place_organs();
  now_ = make();
  links_.resize(1 + draw(12));
  for (std::size_t l = 0; l < links_.size(); ++l) links_[l] = any_link(l);
  for (std::size_t l = 0; l + 1 < links_.size(); ++l)
    links_[l].runs_on =
        links_[l].kind == PALPATE_LINK_THREAD && links_[l + 1].kind == PALPATE_LINK_THREAD && draw(2) == 0;
  set_links(now_);
}

void RandomLinks::play(int steps) {
  for (int s = 0; s < steps; ++s) {
    at_ = s;
    if (s == steps / 2) restore();
    move_organs(s);
    if (s % 20 == 19) change_links();
    const std::vector<palpate_tool> tools = tools_at(s);
    const palpate_step_flags flags = step(now_, tools);
    look(flags);
    if (restored_.world) expect_same(flags, step(restored_, tools));
  }
  if (!touch_) leaves_nothing();
}

double RandomLinks::between(double low, double high) {
  return low + (high - low) * static_cast<double>(random_() >> 11) / 9007199254740992.0;
}

void RandomLinks::find(const std::string& what) {
  ++counts_.found;
  tell_("step " + std::to_string(at_) + ": " + what);
}

void RandomLinks::place_organs() {
  const TouchedBody* const bodies[] = {&upper_block(), &side_plate(), &dome()};
  const double height[] = {0.02, 0.015, kDomeHeight};
  double z = 0;
  for (int k = 2 + draw(3); k > 0; --k) {
    const int body = draw(3);
    const Eigen::Vector3d axis = touch_ ? Eigen::Vector3d::UnitZ() : any_vector(1).normalized();
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(between(-3, 3), axis));
    const Eigen::Vector3d at =
        touch_ ? Eigen::Vector3d(between(-0.004, 0.004), between(-0.004, 0.004), z) : Eigen::Vector3d(any_vector(0.05));
    z += height[body] + 0.0003;
    organs_.push_back({bodies[body], pose_at(at, turn), pose_at(at, turn), any_vector(touch_ ? 0.0008 : 0.006)});
    if (draw(3) == 0) organs_.back().sway.setZero();
  }
}

RandomLinks::Played RandomLinks::make() const {
  SceneDef scene = touch_ ? touching_def() : unlimited_def();
  if (!touch_) scene.collision = PALPATE_COLLISION_OFF;
  scene.contact = patch_ ? PALPATE_CONTACT_PATCH : PALPATE_CONTACT_POINT;
  std::vector<palpate_world_organ> organs;
  for (const Placed& organ : organs_) organs.push_back(organ_of(organ.body->bundle(), &scene, &organ.base));
  palpate_world_def def = palpate_default_world_def();
  def.organs = organs.data(), def.organ_count = static_cast<std::int32_t>(organs.size());
  def.max_links = 12, def.max_pairs = touch_ ? 200 : 0, def.friction = friction_;
  palpate_world* made = nullptr;
  palpate_error error = {};
  if (palpate_world_create(&def, &made, &error) != PALPATE_OK) throw std::runtime_error(error.text);
  return {WorldPointer(made), std::make_unique<WorldContacts>(made)};
}

void RandomLinks::move_organs(int s) {
  for (std::size_t k = 0; k < organs_.size(); ++k) {
    Placed& organ = organs_[k];
    Eigen::Map<Eigen::Vector3d>(organ.pose.position) =
        Eigen::Vector3d(organ.base.position) + std::sin(0.05 * s + static_cast<double>(k)) * organ.sway;
    for (const Played* played : {&now_, &restored_})
      if (played->world)
        palpate_scene_set_pose(palpate_world_scene(played->world.get(), static_cast<std::int32_t>(k)), &organ.pose,
                               nullptr);
  }
}

Eigen::Quaterniond RandomLinks::turn_of(std::size_t organ) const {
  const double* const q = organs_[organ].pose.orientation;
  return {q[0], q[1], q[2], q[3]};
}

bool RandomLinks::is_free(const TouchedBody& body, std::int32_t node) {
  return std::find(body.touchable.begin(), body.touchable.end(), node) != body.touchable.end();
}

double RandomLinks::free_share(const palpate_world_link& link, int e) const {
  if (link.ends[e].kind == PALPATE_END_WORLD) return 0;
  const TouchedBody& body = *organs_[static_cast<std::size_t>(link.organ[e])].body;
  double share = 0;
  for (int v = 0; v < 3; ++v)
    if (is_free(body,
                body.body.triangles[static_cast<std::size_t>(link.ends[e].triangle)][static_cast<std::size_t>(v)]))
      share += link.ends[e].barycentric[v];
  return share;
}

palpate_link_end RandomLinks::any_end(std::int32_t* organ) {
  palpate_link_end end = {};
  if (draw(8) == 0) {
    end.kind = PALPATE_END_WORLD;
    Eigen::Map<Eigen::Vector3d>(end.point) = any_vector(0.06);
    return end;
  }
  *organ = draw(static_cast<int>(organs_.size()));
  end.kind = PALPATE_END_SURFACE_POINT;
  end.triangle = draw(static_cast<int>(organs_[static_cast<std::size_t>(*organ)].body->body.triangles.size()));
  const Eigen::Vector3d k(between(0.1, 1), between(0.1, 1), between(0.1, 1));
  Eigen::Map<Eigen::Vector3d>(end.barycentric) = draw(6) ? Eigen::Vector3d(k / k.sum()) : Eigen::Vector3d::UnitX();
  return end;
}

palpate_world_link RandomLinks::any_link(std::size_t index) {
  palpate_world_link link = palpate_default_world_link();
  const palpate_link_kind kinds[] = {PALPATE_LINK_THREAD, PALPATE_LINK_THREAD, PALPATE_LINK_SPRING, PALPATE_LINK_CLIP};
  link.kind = kinds[draw(4)];
  for (int e = 0; e < 2; ++e) link.ends[e] = any_end(link.organ + e);
  if (index > 0 && draw(3) == 0) {
    const palpate_world_link& earlier = links_[static_cast<std::size_t>(draw(static_cast<int>(index)))];
    link.ends[0] = earlier.ends[1], link.organ[0] = earlier.organ[1];
  }
  while (link.ends[0].kind == PALPATE_END_WORLD && link.ends[1].kind == PALPATE_END_WORLD)
    link.ends[1] = any_end(link.organ + 1);
  link.radius = patch_ && draw(2) ? between(0.001, 0.008) : 0;
  change(&link);
  return link;
}

void RandomLinks::change(palpate_world_link* link) {
  link->rest_length = link->kind == PALPATE_LINK_CLIP || draw(4) == 0 ? 0 : between(0, 0.05);
  link->stiffness = draw(2) ? INFINITY : std::pow(10, between(-2, 6));
  link->breaking_force = draw(4) ? INFINITY : std::pow(10, between(-3, 2));
}

void RandomLinks::change_links() {
  change(&links_[static_cast<std::size_t>(draw(static_cast<int>(links_.size())))]);
  for (const Played* played : {&now_, &restored_})
    if (played->world) set_links(*played);
}

void RandomLinks::set_links(const Played& played) {
  palpate_error error = {};
  if (palpate_world_set_links(played.world.get(), links_.data(), static_cast<std::int32_t>(links_.size()), &error) !=
      PALPATE_OK)
    find(std::string("links are refused: ") + error.text);
}

std::vector<palpate_tool> RandomLinks::tools_at(int s) {
  const double phase = 0.11 * s;
  point_ = Eigen::Vector3d(organs_[0].base.position) +
           Eigen::Vector3d(0.01 * std::sin(phase), 0.004, 0.02 * std::cos(phase));
  const std::size_t gripped = organs_.size() - 1;
  const std::vector<std::int32_t>& nodes = organs_[gripped].body->touchable;
  grips_ = {grip_at_node(nodes[static_cast<std::size_t>(s / 30) % nodes.size()],
                         Eigen::Vector3d(0.003 * std::sin(phase), 0, 0.002))};
  std::vector<palpate_tool> tools;
  if (touch_) tools.push_back(point_tool(point_.data()));
  tools.push_back(tool_of(grips_));
  tools.back().organ = static_cast<std::int32_t>(gripped);
  if (s % 90 > 60) tools.pop_back();
  return tools;
}

palpate_step_flags RandomLinks::step(Played& played, const std::vector<palpate_tool>& tools) {
  return palpate_world_touch(played.world.get(), tools.data(), static_cast<std::int32_t>(tools.size()), 1e-3,
                             played.contacts->get(), played.contacts->bytes());
}

void RandomLinks::restore() {
  std::vector<std::uint64_t> state(palpate_world_state_bytes(now_.world.get()) / 8 + 1);
  palpate_error error = {};
  restored_ = make();
  set_links(restored_);
  if (palpate_world_save(now_.world.get(), state.data(), 8 * state.size(), &error) != PALPATE_OK ||
      palpate_world_restore(restored_.world.get(), state.data(), 8 * state.size(), &error) != PALPATE_OK)
    find(std::string("the state is refused: ") + error.text);
}

void RandomLinks::expect_same(palpate_step_flags one, palpate_step_flags other) {
  const palpate_world_contacts *const a = now_.contacts->get(), *const b = restored_.contacts->get();
  bool same = one == other && a->used_bytes == b->used_bytes && std::memcmp(a, b, a->used_bytes) == 0;
  for (std::size_t l = 0; l < links_.size(); ++l)
    same = same && std::memcmp(state(now_, l), state(restored_, l), sizeof(palpate_link_state)) == 0;
  if (!same) find("the restored world has other bytes");
}

void RandomLinks::leaves_nothing() {
  palpate_world_set_links(now_.world.get(), nullptr, 0, nullptr);
  palpate_step_flags flags = 0;
  for (int s = 0; s < 3; ++s) flags = step(now_, {});
  if (flags) find("flags without links: " + std::to_string(flags));
  for (std::size_t k = 0; k < organs_.size(); ++k)
    if (now_.contacts->organ(static_cast<std::int32_t>(k)).node_count != 0) find("nodes without links");
}

const palpate_link_state* RandomLinks::state(const Played& played, std::size_t link) {
  return palpate_world_link_state(played.world.get(), static_cast<std::int32_t>(link));
}

double RandomLinks::softness_of(const palpate_world_link& link, int e) const {
  if (free_share(link, e) == 0) return 0;
  static std::map<const TouchedBody*, Eigen::MatrixXd> known;
  const TouchedBody& body = *organs_[static_cast<std::size_t>(link.organ[e])].body;
  Eigen::MatrixXd& compliance = known[&body];
  if (compliance.size() == 0) compliance = compliance_of(body);
  Eigen::Matrix3d own = Eigen::Matrix3d::Zero();
  const auto& corner = body.body.triangles[static_cast<std::size_t>(link.ends[e].triangle)];
  for (int v = 0; v < 3; ++v)
    for (int w = 0; w < 3; ++w)
      own += link.ends[e].barycentric[v] * link.ends[e].barycentric[w] *
             compliance.block<3, 3>(3 * corner[static_cast<std::size_t>(v)], 3 * corner[static_cast<std::size_t>(w)]);
  const double least = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(own).eigenvalues()[0];
  return link.radius > 0 ? least / 4 : least;
}

// A thread through several places is one row: it is too short by the sum of its parts' ways.
double RandomLinks::bound() const {
  double most = 0;
  int parts = 1, most_parts = 1;
  for (const palpate_world_link& link : links_) {
    if (const double soft = softness_of(link, 0) + softness_of(link, 1); soft > 0) most = std::max(most, 1 / soft);
    most_parts = std::max(most_parts, parts);
    parts = link.runs_on ? parts + 1 : 1;
  }
  return std::sqrt(3.0) * 1024 * 0.3 * most_parts * most;
}

void RandomLinks::look(palpate_step_flags flags) {
  constexpr palpate_step_flags kMissed = PALPATE_STEP_REGULARISED | PALPATE_STEP_SOLVE_INEXACT | PALPATE_STEP_UNSOLVED |
                                         PALPATE_STEP_WORK_DEFERRED | PALPATE_STEP_CONTACTS_DROPPED;
  ++counts_.steps, counts_.flagged += (flags & kMissed) != 0, counts_.broken += (flags & PALPATE_STEP_LINK_BROKE) != 0;
  if (flags & PALPATE_STEP_UNSOLVED) find("the step is unsolved");
  if (at_ == 0) most_ = bound();
  for (std::size_t l = 0; l < links_.size(); ++l) {
    look_at_forces(l, most_);
    if (!(flags & kMissed)) look_at_law(l);
  }
  look_at_pairs();
  for (std::size_t k = 0; k < organs_.size(); ++k)
    for (const float u :
         displacements(palpate_world_scene(now_.world.get(), static_cast<std::int32_t>(k)),
                       &now_.contacts->organ(static_cast<std::int32_t>(k)), organs_[k].body->body.surface_nodes))
      if (!std::isfinite(u)) return find("a displacement of organ " + std::to_string(k) + " is not finite");
}

Eigen::Vector3d RandomLinks::on_organ(std::size_t organ, std::size_t link) {
  const palpate_contacts& of = now_.contacts->organ(static_cast<std::int32_t>(organ));
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::int32_t n = 0; n < of.node_count; ++n) {
    const palpate_contact_node& node = *palpate_contacts_node(&of, n);
    if (node.source == PALPATE_SOURCE_WORLD_LINK && node.index == static_cast<std::int32_t>(link))
      sum += Eigen::Vector3d(node.force);
  }
  return turn_of(organ) * sum;
}

void RandomLinks::look_at_forces(std::size_t l, double most) {
  const palpate_world_link& link = links_[l];
  const palpate_link_state& found = *state(now_, l);
  const Eigen::Vector3d force(found.force);
  const std::string name = "link " + std::to_string(l);
  if (!force.allFinite() || !std::isfinite(found.length) || !std::isfinite(found.rest_length) ||
      !std::isfinite(found.tension) || !Eigen::Vector3d(found.ends[0]).allFinite() ||
      !Eigen::Vector3d(found.ends[1]).allFinite())
    return find(name + ": a number is not finite");
  counts_.largest = std::max(counts_.largest, force.norm() / most);
  if (force.norm() > most)
    find(name + ": " + std::to_string(force.norm()) + " N, the bound is " + std::to_string(most));
  if (link.kind == PALPATE_LINK_THREAD && found.tension < 0) find(name + ": a thread pushes");
  for (int e = 0; e < 2; ++e) {
    const bool within = link.organ[0] == link.organ[1] && link.ends[1 - e].kind != PALPATE_END_WORLD;
    // The support bears the share of a place that is on fixed nodes.
    if (within || link.radius > 0 || free_share(link, e) < 1 - 1e-12) continue;
    const Eigen::Vector3d on = on_organ(static_cast<std::size_t>(link.organ[e]), l);
    // Rounding of two turns and of sums over three nodes.
    if (!((on - (e == 0 ? 1 : -1) * force).norm() <= 1e-12 * force.norm()))
      find(name + ": end " + std::to_string(e) + " has another force than the link");
  }
}

void RandomLinks::look_at_law(std::size_t l) {
  const palpate_world_link& link = links_[l];
  const palpate_link_state& found = *state(now_, l);
  const Eigen::Vector3d force(found.force), apart = Eigen::Vector3d(found.ends[1]) - Eigen::Vector3d(found.ends[0]);
  const bool runs = link.runs_on || (l > 0 && links_[l - 1].runs_on);
  if (found.condition != PALPATE_LINK_TAUT || found.tension == 0 || runs) return;
  // What the mesh does not resolve of a disc gives way too, and the state does not tell it.
  if (link.radius > 0 || free_share(link, 0) + free_share(link, 1) == 0) return;
  const double missed =
      link.kind == PALPATE_LINK_CLIP
          ? (apart - force / link.stiffness).norm()
          : std::fabs(force.dot(apart) / found.tension - found.rest_length - found.tension / link.stiffness);
  // 1e-6 of the largest target, and columns in single precision, 6e-8 of displacements of the same size.
  const double allowed = 1e-9 + 2e-6 * 0.3;
  counts_.missed = std::max(counts_.missed, missed / allowed);
  if (!(missed <= allowed))
    find("link " + std::to_string(l) + " misses its law by " + std::to_string(1e6 * missed) + " um without a flag");
}

void RandomLinks::look_at_pairs() {
  if (!touch_) return;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double most = 0;
  for (std::int32_t k = 0; k < static_cast<std::int32_t>(organs_.size()); ++k) {
    const Eigen::Vector3d pressed(now_.contacts->state(k).pressed);
    sum += pressed, most = std::max(most, pressed.norm());
  }
  counts_.touching += most > 1e-6;
  if (!(sum.norm() <= 1e-9 * most)) find("organs press one another with forces that are not opposite");
}

}  // namespace palpate::tests
