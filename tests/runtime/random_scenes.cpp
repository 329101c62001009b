#include "tests/runtime/random_scenes.h"

namespace palpate::tests {

SceneDef deformed_def() {
  return unlimited_def(PALPATE_COLLISION_DEFORMED, PALPATE_CONTACT_POINT);
}

void Watched::step(const Eigen::Vector3d& p, const std::vector<palpate_grip>& grips) {
  before_ = now_, now_ = next_;
  moved_ = (known_ ? (p - last_).norm() : 0) + now_.largest_move(before_);
  const palpate_tool tools[2] = {tool_of(grips), point_tool(p.data())};
  flags_ = palpate_scene_touch(scene_.get(), tools, 2, 1e-3, contacts_.get(), contacts_.bytes());
  height_ = now_.signed_distance(p);
  const std::vector<float> u = displacements(scene_.get(), contacts_.get(), body_.body.surface_nodes);
  next_.move(fine_ ? fine_->moved_by(u) : u);
  last_ = p, known_ = true;
}

QuickTruth::QuickTruth(const SurfaceFirst& body) : body_(&body), place_(body.surface_nodes), seen_(body.surface_nodes) {
  move(std::vector<float>(3 * static_cast<std::size_t>(body.surface_nodes), 0.f));
}

void QuickTruth::move(const std::vector<float>& displacement) {
  if (displacement == moved_by_) return;
  moved_by_ = displacement;
  for (std::int32_t n = 0; n < body_->surface_nodes; ++n) {
    place_[n] = Eigen::Vector3d(body_->mesh.nodes[n].data()) +
                Eigen::Map<const Eigen::Vector3f>(&displacement[3 * n]).cast<double>();
    seen_[n] = along_ray() * place_[n];
  }
  balls_.clear();
  for (const auto& t : body_->triangles) {
    const Eigen::Vector3d middle = (place_[t[0]] + place_[t[1]] + place_[t[2]]) / 3;
    double squared = 0;
    for (const std::int32_t n : t) squared = std::max(squared, (place_[n] - middle).squaredNorm());
    balls_.push_back({middle, std::sqrt(squared)});
  }
}

double QuickTruth::signed_distance(const Eigen::Vector3d& p) const {
  double nearest = squared_distance(p, nearest_before_), reach = std::sqrt(nearest);
  for (std::size_t f = 0; f < balls_.size(); ++f) {
    const double limit = reach + balls_[f].radius;
    if ((balls_[f].middle - p).squaredNorm() > limit * limit) continue;
    const double squared = squared_distance(p, f);
    if (squared >= nearest) continue;
    nearest = squared, reach = std::sqrt(squared), nearest_before_ = f;
  }
  return winding(p) > 0 ? -reach : reach;
}

int QuickTruth::winding(const Eigen::Vector3d& p) const {
  const Eigen::Vector3d q = along_ray() * p;
  int turns = 0;
  for (const auto& t : body_->triangles) {
    const Eigen::Vector3d &a = seen_[t[0]], &b = seen_[t[1]], &c = seen_[t[2]];
    if ((a[0] < q[0]) == (b[0] < q[0]) && (b[0] < q[0]) == (c[0] < q[0])) continue;
    if ((a[1] < q[1]) == (b[1] < q[1]) && (b[1] < q[1]) == (c[1] < q[1])) continue;
    const double ab = side(t[0], t[1], q), bc = side(t[1], t[2], q), ca = side(t[2], t[0], q);
    if (!((ab > 0 && bc > 0 && ca > 0) || (ab < 0 && bc < 0 && ca < 0))) continue;
    const double height = (bc * a[2] + ca * b[2] + ab * c[2]) / (ab + bc + ca);
    if (height > q[2]) turns += ab > 0 ? 1 : -1;
  }
  return turns;
}

bool QuickTruth::looks_away(const Eigen::Vector3d& p, double reach, const Eigen::Vector3d& from, double most) const {
  for (std::size_t f = 0; f < balls_.size(); ++f)
    if (squared_distance(p, f) < reach * reach && outward(f).dot(from) < most) return true;
  return false;
}

double QuickTruth::displaced_within(const Eigen::Vector3d& p, double reach) const {
  double most = 0;
  const auto take = [&](std::size_t n) {
    most = std::max(most, (place_[n] - Eigen::Vector3d(body_->mesh.nodes[n].data())).norm());
  };
  for (std::size_t n = 0; n < place_.size(); ++n) {
    const Eigen::Vector3d rest(body_->mesh.nodes[n].data());
    if (std::min((place_[n] - p).norm(), (rest - p).norm()) < reach) take(n);
  }
  // Of a coarse surface no node may be so near.
  for (std::size_t f = 0; f < balls_.size(); ++f)
    if (squared_distance(p, f) < reach * reach)
      for (const std::int32_t n : body_->triangles[f]) take(static_cast<std::size_t>(n));
  return most;
}

double QuickTruth::largest_move(const QuickTruth& other) const {
  double most = 0;
  for (std::size_t n = 0; n < place_.size(); ++n) most = std::max(most, (place_[n] - other.place_[n]).squaredNorm());
  return std::sqrt(most);
}

Eigen::Vector3d QuickTruth::outward(std::size_t triangle) const {
  const auto& t = body_->triangles[triangle];
  return (place_[t[1]] - place_[t[0]]).cross(place_[t[2]] - place_[t[0]]).normalized();
}

const Eigen::Matrix3d& QuickTruth::along_ray() {
  static const Eigen::Matrix3d turn =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d(.5377, .2713, .8019), Eigen::Vector3d::UnitZ())
          .toRotationMatrix();
  return turn;
}

double QuickTruth::side(std::int32_t from, std::int32_t to, const Eigen::Vector3d& q) const {
  if (from > to) return -side(to, from, q);
  const Eigen::Vector3d &a = seen_[from], &b = seen_[to];
  return (b[0] - a[0]) * (q[1] - a[1]) - (b[1] - a[1]) * (q[0] - a[0]);
}

double QuickTruth::squared_distance(const Eigen::Vector3d& p, std::size_t triangle) const {
  const auto& t = body_->triangles[triangle];
  const Eigen::Vector3d a = place_[t[0]] - p, b = place_[t[1]] - p, c = place_[t[2]] - p;
  double k[3];
  return closest_on_triangle({}, {a[0], a[1], a[2]}, {b[0], b[1], b[2]}, {c[0], c[1], c[2]}, k);
}

std::string sentence_of(const Contradiction& found) {
  char text[240];
  std::snprintf(
      text, sizeof text,
      "seed %llu, step %d, tool %d, point %d: %s; the point is %.6f mm over the surface, the tolerance is %.6f mm",
      static_cast<unsigned long long>(found.seed), found.step, found.tool, found.point, found.what, 1e3 * found.height,
      1e3 * found.tolerance);
  return text;
}

double Dice::between(double low, double high) {
  return low + (high - low) * static_cast<double>(random_() >> 11) / 9007199254740992.0;
}

Eigen::Vector3d Dice::direction() {
  const double x = between(-1, 1), y = between(-1, 1), z = between(-1, 1);
  return {x, y, z};
}

void OrganPath::step(Dice& dice) {
  if (!moves_) return;
  before_ = now_;
  is_new_ = left_ == 0;
  if (left_ == 0) choose(dice);
  --left_, ++stepped_;
  now_.position += velocity_;
  now_.orientation = turn_by(angular_) * now_.orientation;
}

void OrganPath::send(palpate_scene* scene) const {
  if (moves_ && (is_new_ || stepped_ % sent_every_ == 0)) set(scene, now_, velocity_ / kStep, angular_ / kStep);
}

void OrganPath::send_before(palpate_scene* scene) const {
  if (moves_) set(scene, before_, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero());
}

Eigen::Vector3d OrganPath::to_organ(const Eigen::Vector3d& p) const {
  return now_.orientation.conjugate() * (p - now_.position);
}

Eigen::Quaterniond OrganPath::turn_by(const Eigen::Vector3d& angle) {
  const double length = angle.norm();
  if (!(length > 0)) return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond(Eigen::AngleAxisd(length, angle / length));
}

void OrganPath::choose(Dice& dice) {
  const Eigen::Vector3d way = .01 * dice.direction() - now_.position;
  const Eigen::AngleAxisd turn(turn_by(.2 * dice.direction()) * now_.orientation.conjugate());
  left_ = static_cast<int>(std::clamp(std::max(way.norm() / speed_, turn.angle() / turn_), 1.0, 60.0));
  velocity_ = way * std::min(1.0 / left_, speed_ / way.norm());
  angular_ = turn.axis() * std::min(turn.angle() / left_, turn_);
}

void OrganPath::set(palpate_scene* scene, const Place& place, const Eigen::Vector3d& velocity,
                    const Eigen::Vector3d& angular) {
  palpate_pose pose = palpate_default_pose();
  const Eigen::Quaterniond& q = place.orientation;
  Eigen::Map<Eigen::Vector3d>(pose.position) = place.position;
  Eigen::Map<Eigen::Vector4d>(pose.orientation) = Eigen::Vector4d(q.w(), q.x(), q.y(), q.z());
  Eigen::Map<Eigen::Vector3d>(pose.velocity) = velocity;
  Eigen::Map<Eigen::Vector3d>(pose.angular_velocity) = angular;
  if (palpate_scene_set_pose(scene, &pose, nullptr) != PALPATE_OK) throw std::logic_error("a pose was refused");
}

RandomGrips::RandomGrips(Dice& dice, const TouchedBody& body, double usual_reach) {
  const bool is_wide = dice.one_in(3);
  reach_ = is_wide ? .0173 : usual_reach, speed_ = is_wide ? dice.decade(-4, -3) : 2e-4;
  const int count = dice.one_in(6) ? dice.below(3) : 3;
  for (int g = 0; g < count; ++g) held_.push_back(body.touchable[dice.below(body.touchable.size())]);
  std::sort(held_.begin(), held_.end());
  held_.erase(std::unique(held_.begin(), held_.end()), held_.end());
  for (std::size_t g = 0; g < held_.size(); ++g) aim_.push_back(reach_ * dice.direction());
  at_.resize(held_.size(), Eigen::Vector3d::Zero());
}

std::vector<palpate_grip> RandomGrips::step(int s, Dice& dice) {
  std::vector<palpate_grip> grips;
  for (std::size_t g = 0; g < held_.size(); ++g) {
    if (s % 150 == 50 * static_cast<int>(g)) aim_[g] = reach_ * dice.direction();
    const Eigen::Vector3d to = aim_[g] - at_[g];
    at_[g] += to * std::min(1.0, speed_ / std::max(1e-12, to.norm()));
    grips.push_back(grip_at_node(held_[g], at_[g]));
  }
  return grips;
}

RandomNeedle::RandomNeedle(std::uint64_t seed, const TouchedBody& body)
    : dice_(seed ^ 0x6e6565646c65), body_(body), is_there_(dice_.one_in(3)), speed_(dice_.decade(-4.5, -3)) {
  needle_ = palpate_default_needle();
  needle_.radius = dice_.decade(-4, -2.7), needle_.spacing = dice_.decade(-2.7, -2);
  needle_.friction = dice_.one_in(3) ? 0 : dice_.decade(-1, 1);
  needle_.cutting_force = dice_.one_in(3) ? 0 : dice_.decade(-3, -1);
  needle_.puncture_force = needle_.cutting_force * dice_.between(0, 4);
  if (is_there_) enter();
}

void RandomNeedle::draw(SceneDef& def) const {
  if (is_there_) def.needles.needles = 1, def.needles.needle_places = kPlaces;
}

void RandomNeedle::step() {
  if (!is_there_) return;
  before_ = depth_;
  const double way = goal_ - depth_;
  depth_ += std::clamp(way, -speed_, speed_);
  if (std::abs(way) > speed_) return;
  if (goal_ < 0) return enter();
  goal_ = dice_.one_in(2) ? dice_.between(.001, .03) : -.003;
}

bool RandomNeedle::has_gone_on(const palpate_needle_state& state) {
  const bool is_still = state.slipping == 0 && state.depth == last_.depth && state.places == last_.places &&
                        state.condition == last_.condition && state.condition != PALPATE_NEEDLE_CUTS;
  last_ = state;
  return !is_still;
}

void RandomNeedle::enter() {
  const auto triangle = static_cast<std::int32_t>(dice_.below(body_.body.triangles.size()));
  const Eigen::Vector3d k(dice_.between(.1, 1), dice_.between(.1, 1), dice_.between(.1, 1));
  ++needle_.id, needle_.triangle = triangle;
  Eigen::Map<Eigen::Vector3d>(needle_.barycentric) = k / k.sum();
  entry_ = body_.place(triangle, k / k.sum());
  inwards_ = (.5 * dice_.direction() - body_.outward(triangle)).normalized();
  before_ = depth_ = -.002, goal_ = dice_.between(.005, .03);
}

RandomScene::RandomScene(std::uint64_t seed, const TouchedBody& body, double usual_reach, const FineHost* host,
                         const BoundFine* fine)
    : dice_(seed),
      body_(body),
      host_(host),
      fine_(fine),
      surface_(host ? host->surface() : body.body),
      organ_(dice_),
      grips_(dice_, body, usual_reach),
      needle_(seed, body),
      def_(draw_def()),
      scene_(body.scene(def_)),
      twin_(body.scene(def_)),
      contacts_(scene_.get()),
      twins_(twin_.get()),
      truths_(4, QuickTruth(surface_)),
      seed_(seed) {
  draw_points();
}

RandomScene::Seen RandomScene::see(const RandomPoint& p, const std::vector<bool>& touches, double surface_moved) {
  bool others_ended = false;
  for (std::size_t k = 0; k < points_.size(); ++k)
    others_ended = others_ended || (points_[k].touches && !touches[k] && &points_[k] != &p);
  // What is tested behind a contact that ends meets the surface without it.
  const double moved = p.moved + surface_moved + (others_ended ? next().largest_move(now()) : 0);
  const std::size_t own = static_cast<std::size_t>(&p - points_.data());
  // A disc meets the surface where its row has no force. What others press near it moves that place by less than half of what they have
  // displaced the surface there (docs/method.md, section 9: 1.7 mm of 4 mm).
  bool is_beside = !grip_list_.empty();
  for (std::size_t k = 0; k < points_.size(); ++k)
    is_beside = is_beside || (k != own && (touches[k] || points_[k].touches));
  const double sunk = radius_ > 0 && is_beside ? 0.5 * now().displaced_within(p.organ, 0.02) : 0;
  const bool touches_now = touches[own];
  return {now().signed_distance(p.organ), moved + p.unseen + kStored + sunk, touches_now, others_ended,
          palpate_contacts_tool(contacts_, p.tool)->flags};
}

void RandomScene::remember(RandomPoint& p) const {
  const palpate_contact* contact = contact_of(scene_.get(), p);
  p.touches = contact != nullptr;
  if (contact) p.anchor = anchor_of(*contact), p.slips = contact->state == PALPATE_CONTACT_SLIPS;
}

SceneDef RandomScene::draw_def() {
  const bool is_shipped = dice_.one_in(3);
  SceneDef def = is_shipped ? SceneDef() : deformed_def();
  constexpr palpate_contact_model models[] = {PALPATE_CONTACT_POINT, PALPATE_CONTACT_POINT, PALPATE_CONTACT_TRIANGLE,
                                              PALPATE_CONTACT_NODE, PALPATE_CONTACT_PATCH};
  constexpr palpate_contact_law laws[] = {PALPATE_LAW_STICKING, PALPATE_LAW_STICKING, PALPATE_LAW_SLIDING,
                                          PALPATE_LAW_UNILATERAL, PALPATE_LAW_COULOMB};
  def.collision = PALPATE_COLLISION_DEFORMED, def.report.report = PALPATE_REPORT_CONTACTS;
  def.contact = models[dice_.below(std::size(models))], def.law = laws[dice_.below(std::size(laws))];
  // The fewest that a step needs are some 40,000, and on a fine surface 160,000.
  const double least = host_ ? 200000 : 45000, most = host_ ? 300000 : 100000;
  if (is_shipped && dice_.one_in(2)) def.max_operations = static_cast<std::int64_t>(dice_.between(least, most));
  radius_ = def.contact == PALPATE_CONTACT_PATCH ? dice_.between(0, .006) : 0;
  friction_ = dice_.between(0, 1);
  if (host_) view_ = host_->view(), def.fine_surface = view_;
  needle_.draw(def);
  def.allocator = memory_.allocator();
  return def;
}

void RandomScene::draw_points() {
  // A step on a fine surface takes several times as long.
  const int count = 1 + dice_.below(host_ ? 2 : 4);
  tools_ = count > 1 ? 1 + dice_.below(2) : 1;
  high_ = body_.node(0);
  for (std::int32_t n = 0; n < body_.body.surface_nodes; ++n) high_ = high_.cwiseMax(body_.node(n));
  int in_tool[3] = {};
  for (int k = 0; k < count; ++k) {
    RandomPoint p;
    p.tool = tools_ == 1 || k < (count + 1) / 2 ? 1 : 2, p.point = in_tool[p.tool]++;
    p.rides = !dice_.one_in(3);
    p.organ = p.goal = high_ + Eigen::Vector3d::Constant(.01 * (1 + k));
    p.world = p.organ, p.organ_before = p.organ, p.world_before = p.world;
    points_.push_back(p);
  }
}

void RandomScene::choose_goal(RandomPoint& p) {
  p.goal = body_.node(dice_.below(body_.body.surface_nodes)) + dice_.between(0, .012) * dice_.direction();
  if (dice_.one_in(4)) p.goal = points_[dice_.below(points_.size())].goal + .003 * dice_.direction();
  p.speed = dice_.decade(-5, -2.3);
}

void RandomScene::move(RandomPoint& p, int s) {
  if ((p.goal - p.organ).norm() < 1e-9 || s % 97 == 0) choose_goal(p);
  p.organ_before = p.organ, p.world_before = p.world;
  const auto ahead = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) -> Eigen::Vector3d {
    const Eigen::Vector3d way = to - from;
    return from + way * std::min(1.0, p.speed / std::max(1e-12, way.norm()));
  };
  if (p.rides)
    p.organ = ahead(p.organ, p.goal), p.world = organ_.to_world(p.organ);
  else
    p.world = ahead(p.world, organ_.to_world(p.goal)), p.organ = organ_.to_organ(p.world);
  p.moved = (p.organ - p.organ_before).norm();
}

palpate_step_flags RandomScene::touch(palpate_scene* scene, Contacts& contacts, bool again, int without,
                                      const Eigen::Vector3d& far) {
  std::vector<double> places[3];
  for (std::size_t k = 0; k < points_.size(); ++k) {
    const RandomPoint& p = points_[k];
    const Eigen::Vector3d at = static_cast<int>(k) == without ? far : again ? p.world_before : p.world;
    places[p.tool].insert(places[p.tool].end(), at.data(), at.data() + 3);
  }
  palpate_tool tools[3] = {tool_of(again ? grips_before_ : grip_list_)};
  const palpate_needle needle = needle_.now(
      again, [&](const Eigen::Vector3d& p) { return again ? organ_.to_world_before(p) : organ_.to_world(p); });
  if (needle_.is_there()) tools[0].parts = &needle.part;
  for (int t = 1; t <= tools_; ++t)
    tools[t] = point_tool(places[t].data(), static_cast<std::int32_t>(places[t].size() / 3), radius_, friction_);
  return palpate_scene_touch(scene, tools, 1 + tools_, kStep, contacts.get(), contacts.bytes());
}

const palpate_contact* RandomScene::contact_of(const palpate_scene* scene, const RandomPoint& p) const {
  const palpate_contact_report* report = palpate_scene_report(scene);
  for (std::int32_t c = 0; c < report->contact_count; ++c) {
    const palpate_contact* contact = palpate_report_contact(report, c);
    if (contact->tool == p.tool && contact->point == p.point) return contact;
  }
  return nullptr;
}

std::vector<bool> RandomScene::touching(const palpate_scene* scene) const {
  std::vector<bool> touches;
  for (const RandomPoint& p : points_) touches.push_back(contact_of(scene, p) != nullptr);
  return touches;
}

std::vector<float> RandomScene::displaced(Contacts& contacts) {
  const std::vector<float> u = displacements(twin_.get(), contacts, body_.body.surface_nodes);
  return fine_ ? fine_->moved_by(u) : u;
}

WithoutContact RandomScene::ask_without(const RandomPoint& p, double tolerance) {
  const palpate_contact& contact = *contact_of(scene_.get(), p);
  const Eigen::Vector3d outward = body_.outward(contact.triangle);
  WithoutContact found;
  found.outward = outward;
  take_out(p, outward, &found.pulls);
  found.own = without_contact().signed_distance(p.organ);
  // The normal of a fine surface's triangle at rest is not known here.
  found.asked = found.own > -tolerance || found.pulls > (fine_ ? .5 : -1e-9);
  if (!found.asked) return found;
  const double over_own = over_plane(p, contact, outward);
  found.is_known = end_in_twin(p, outward);
  found.predicted = without_contact().signed_distance(p.organ);
  found.is_far_side =
      without_contact().looks_away(p.organ, std::abs(found.predicted) + tolerance, outward, fine_ ? .3 : -.3);
  if (!fine_) found.over_plane = std::min(over_own, over_plane(p, contact, outward));
  return found;
}

void RandomScene::take_out(const RandomPoint& p, const Eigen::Vector3d& outward, double* pulls) {
  Contacts& rest = twins_;
  std::memcpy(rest.get(), contacts_.get(), contacts_->used_bytes);
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  for (std::int32_t e = 0; e < rest->node_count; ++e) {
    auto* node = const_cast<palpate_contact_node*>(palpate_contacts_node(rest, e));
    if (node->source != PALPATE_SOURCE_TOOL || node->index != p.tool || node->point != p.point) continue;
    force += Eigen::Vector3d(node->force);
    std::fill(node->modified_displacement, node->modified_displacement + 3, 0.0);
  }
  *pulls = force.norm() > 0 ? force.normalized().dot(outward) : 0;
  without_contact().move(displaced(rest));
}

double RandomScene::over_plane(const RandomPoint& p, const palpate_contact& contact, const Eigen::Vector3d& outward) {
  if (fine_) return -INFINITY;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  for (int v = 0; v < 3; ++v)
    place += contact.barycentric[v] * without_contact().place(body_.body.triangles[contact.triangle][v]);
  return (p.organ - place).dot(outward);
}

void RandomScene::save_state() {
  if (std::none_of(points_.begin(), points_.end(), [](const RandomPoint& p) { return p.touches; })) return;
  state_bytes_ = palpate_scene_state_bytes(scene_.get());
  state_.resize(state_bytes_ / 8 + 1);
  if (palpate_scene_save(scene_.get(), state_.data(), 8 * state_.size(), nullptr) != PALPATE_OK)
    throw std::logic_error("a state was not saved");
}

bool RandomScene::end_in_twin(const RandomPoint& p, const Eigen::Vector3d& outward) {
  if (palpate_scene_restore(twin_.get(), state_.data(), state_bytes_, nullptr) != PALPATE_OK)
    throw std::logic_error("a state was refused");
  organ_.send_before(twin_.get());
  const Eigen::Vector3d far = organ_.to_world_before(p.organ_before + .5 * outward);
  const int own = static_cast<int>(&p - points_.data());
  const palpate_step_flags flags = touch(twin_.get(), twins_, true, own, far);
  without_contact().move(displaced(twins_));
  return !((flags | flags_before_) & kUndecided) && !needle_has_gone_on_ && twin_holds_the_others(p);
}

bool RandomScene::twin_holds_the_others(const RandomPoint& ended) const {
  return std::all_of(points_.begin(), points_.end(), [&](const RandomPoint& p) {
    const palpate_contact* contact = contact_of(twin_.get(), p);
    if (!contact || &p == &ended) return !contact && (!p.touches || &p == &ended);
    return p.touches && !p.slips && (anchor_of(*contact) - p.anchor).norm() < kStored;
  });
}

Eigen::Vector3d RandomScene::anchor_of(const palpate_contact& contact) const {
  return body_.place(contact.triangle, Eigen::Vector3d(contact.barycentric));
}

const char* RandomScene::compare(RandomPoint& p, Seen& seen, WithoutContact& without, Contradictions* all) {
  ++all->points, all->touched += seen.touches, all->near += std::abs(seen.height) < .002;
  all->begun += seen.touches && !p.touches, all->ended += p.touches && !seen.touches;
  if (seen.flags & PALPATE_STEP_BAD_INPUT) return "good input was refused";
  if (seen.flags & PALPATE_STEP_TRACKING_LOST) p.blind = !seen.touches;
  if (seen.flags & PALPATE_STEP_WORK_DEFERRED) {
    ++all->deferred;
    p.unseen = seen.tolerance, p.may_be_through = true;
    return nullptr;
  }
  p.unseen = 0;
  if (seen.flags & PALPATE_STEP_TRACKING_LOST || (p.blind && seen.height < seen.tolerance)) {
    ++all->lost, p.may_be_through = true;
    return nullptr;
  }
  p.blind = false;
  const bool is_over_held = seen.flags & PALPATE_STEP_NOT_TOUCHABLE;
  if (!p.touches) return compare_free(p, seen, is_over_held, all);
  return compare_in_contact(p, seen, without, is_over_held, all);
}

const char* RandomScene::compare_free(RandomPoint& p, const Seen& seen, bool is_over_held, Contradictions* all) {
  p.may_be_through = seen.height > -seen.tolerance;
  if (seen.touches || seen.height >= -seen.tolerance) p.was_over_held = false;
  if (seen.touches) return seen.height > seen.tolerance ? "a contact began in the air" : nullptr;
  if (seen.height >= -seen.tolerance) return nullptr;
  // A contact that was not made may end in this step, unseen.
  const bool is_excused = is_over_held || p.was_over_held;
  p.was_over_held = is_over_held;
  all->over_held += is_excused;
  return is_excused ? nullptr : "a contact was missed";
}

const char* RandomScene::compare_in_contact(RandomPoint& p, Seen& seen, WithoutContact& without, bool is_over_held,
                                            Contradictions* all) {
  if (is_over_held) return ++all->over_held, p.may_be_through = true, nullptr;
  if (!without.asked) {
    p.may_be_through = false;
    if (seen.touches || seen.others_ended) return nullptr;
    without.is_known = end_in_twin(p, without.outward);
    without.predicted = without_contact().signed_distance(p.organ);
  }
  if (!without.is_known || seen.others_ended) return ++all->out_unknown, p.may_be_through = true, nullptr;
  ++all->out;
  seen.height = without.predicted;
  if (without.predicted < -seen.tolerance) {
    p.may_be_through = false;
    return seen.touches ? nullptr : "a contact ended inside";
  }
  p.may_be_through = p.may_be_through || without.is_far_side;
  const bool is_asked_there = without.own > seen.tolerance || without.pulls > (fine_ ? .7 : 1e-9);
  const bool is_out = is_asked_there && without.predicted > seen.tolerance,
             must_end = is_out && (!p.may_be_through || without.over_plane > seen.tolerance);
  return must_end && seen.touches ? "a contact stayed in the air" : nullptr;
}

RandomScenes::RandomScenes(double bump) {
  if (!(bump > 0)) return;
  for (int b = 0; b < 3; ++b) {
    hosts_.push_back(fine_of(bodies_[b]->body, 1, bump));
    fine_.push_back(std::make_unique<BoundFine>(hosts_.back(), bodies_[b]->body));
  }
}

TouchedBody RandomScenes::pierceable(const DenseBody& dense) {
  return TouchedBody(dense, [&](BundleParts& parts) { add_whole_corridor(parts, dense); });
}

}  // namespace palpate::tests
