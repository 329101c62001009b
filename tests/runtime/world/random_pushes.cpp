#include "tests/runtime/world/random_pushes.h"

namespace palpate::tests {

std::string sentence_of(const PassedThrough& found) {
  return "seed " + std::to_string(found.seed) + ", step " + std::to_string(found.step) + ": vertex " +
         std::to_string(found.node) + " of organ " + std::to_string(found.organ) + " is " +
         std::to_string(1e3 * found.depth) + " mm inside organ " + std::to_string(found.other) +
         ", and has moved against it by " + std::to_string(1e3 * found.moved) + " mm in this step";
}

RandomPushes::RandomPushes(std::uint64_t seed, palpate_deformation_model deformation)
    : random_(seed), deformation_(deformation), kind_(static_cast<int>(random_() % 3)) {
  const double friction[] = {0, 0.1, 0.5};
  const std::vector<Stack> stack = bodies();
  for (const Stack& organ : stack) {
    bodies_.push_back(organ.body), place_.push_back(organ.place), truths_.emplace_back(organ.body->body);
    edges_.push_back(mean_edge(organ.body->body));
  }
  for (const TouchedBody* body : bodies_)
    faces_.emplace_back(bodies_.size(), std::vector<char>(static_cast<std::size_t>(body->body.surface_nodes), 1));
  if (kind_ == 1) upside_down_ = Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX());
  before_ = truths_;
  organs_ = std::make_unique<Touching>(stack, friction[random_() % 3], 300, deformation);
  at_ = start_ = goal_ = place_[0];
  turn_ = goal_turn_ = Eigen::Vector3d::Zero();
  pose_ = pose_at(at_, upside_down_), was_ = pose_;
  set_pose();
}

palpate_step_flags RandomPushes::step(int s) {
  if (s % 40 == 0) {
    goal_ = start_ + Eigen::Vector3d(between(-0.01, 0.01), between(-0.01, 0.01), between(-0.008, 0.002));
    for (int d = 0; d < 3; ++d) goal_turn_[d] = between(-0.12, 0.12);
  }
  const double fastest = s % 80 < 40 ? 2e-3 : 2e-4;  // m in a step
  const Eigen::Vector3d way = goal_ - at_;
  const double share = way.norm() > 0 ? std::min(1.0, fastest / way.norm()) : 1;
  at_ += share * way, turn_ += 0.5 * share * (goal_turn_ - turn_);
  set_pose();
  const palpate_step_flags flags = organs_->step();
  std::swap(truths_, before_);
  for (std::size_t k = 0; k < bodies_.size(); ++k)
    truths_[k].move(organs_->shape(static_cast<std::int32_t>(k), *bodies_[k]));
  return flags;
}

bool RandomPushes::leaves_nothing() {
  at_ = start_ + Eigen::Vector3d(0, 0, 0.05);
  set_pose();
  for (int s = 0; s < (deformation_ == PALPATE_DEFORMATION_LINEAR ? 3 : 300); ++s) organs_->step();
  bool nothing = organs_->contacts->get()->pair_count == 0 || kind_ == 2;
  for (const float u : organs_->shape(0, *bodies_[0])) nothing = nothing && u == 0;
  return nothing && organs_->pressed(0).norm() == 0;
}

double RandomPushes::deepest_seen() const {
  double deepest = 0;
  for (std::size_t a = 0; a < bodies_.size(); ++a)
    for (std::size_t b = 0; b < bodies_.size(); ++b)
      for (std::int32_t n = 0; a != b && n < bodies_[a]->body.surface_nodes; ++n) {
        const Eigen::Vector3d p = in_organ(b, pose_, in_world(a, pose_, before_[a].place(n)));
        deepest = std::max({deepest, -before_[b].signed_distance(p) / edges_[b], given_way(a, n, b) / edges_[b]});
      }
  return deepest;
}

void RandomPushes::look(std::uint64_t seed, int s, bool told, PushCounts* counts,
                        const std::function<void(const PassedThrough&)>& tell) {
  for (std::size_t a = 0; a < bodies_.size(); ++a)
    for (std::size_t b = 0; b < bodies_.size(); ++b)
      if (a != b) look_at(seed, s, told, a, b, counts, tell);
}

double RandomPushes::between(double low, double high) {
  return low + (high - low) * static_cast<double>(random_() >> 11) / 9007199254740992.0;
}

std::vector<Stack> RandomPushes::bodies() const {
  if (kind_ == 0) return {{&upper_block(), {0, 0, 0.034}}, {&lower_block(), {0, 0, 0}}};
  if (kind_ == 1) return {{&dome(), {0.004, 0.003, 2 * kDomeHeight + 0.001}}, {&dome(), {0, 0, 0}}};
  return {{&upper_block(), {0, 0, 0.046}}, {&side_plate(), {0, 0, 0.0301}}, {&lower_block(), {0, 0, 0}}};
}

double RandomPushes::mean_edge(const SurfaceFirst& body) {
  double sum = 0;
  for (const auto& t : body.triangles)
    for (int v = 0; v < 3; ++v)
      sum += (Eigen::Vector3d(body.mesh.nodes[t[v]].data()) - Eigen::Vector3d(body.mesh.nodes[t[(v + 1) % 3]].data()))
                 .norm();
  return sum / (3.0 * static_cast<double>(body.triangles.size()));
}

void RandomPushes::set_pose() {
  was_ = pose_;
  const double angle = turn_.norm();
  const Eigen::Quaterniond tilt(
      Eigen::AngleAxisd(angle, angle > 0 ? Eigen::Vector3d(turn_ / angle) : Eigen::Vector3d::UnitZ()));
  pose_ = pose_at(at_, tilt * upside_down_);
  palpate_scene_set_pose(palpate_world_scene(organs_->world.get(), 0), &pose_, nullptr);
}

Eigen::Vector3d RandomPushes::turned(std::size_t organ, const palpate_pose& pose, const Eigen::Vector3d& v) const {
  if (organ != 0) return v;
  Eigen::Vector3d out;
  palpate_vector_to_world(pose.orientation, v.data(), out.data());
  return out;
}

Eigen::Vector3d RandomPushes::in_world(std::size_t organ, const palpate_pose& pose, const Eigen::Vector3d& p) const {
  return turned(organ, pose, p) + (organ == 0 ? Eigen::Vector3d(pose.position) : place_[organ]);
}

Eigen::Vector3d RandomPushes::in_organ(std::size_t organ, const palpate_pose& pose, const Eigen::Vector3d& p) const {
  if (organ != 0) return p - place_[organ];
  Eigen::Vector3d out;
  palpate_point_to_organ(pose.position, pose.orientation, p.data(), out.data());
  return out;
}

double RandomPushes::given_way(std::size_t a, std::int32_t node, std::size_t b) const {
  const palpate_world_contacts* const contacts = organs_->contacts->get();
  for (std::int32_t i = 0; i < contacts->pair_count; ++i) {
    const palpate_world_pair& pair = *palpate_world_contacts_pair(contacts, i);
    if (pair.organ[0] == static_cast<std::int32_t>(a) && pair.organ[1] == static_cast<std::int32_t>(b) &&
        pair.node == node)
      return std::max(0.0, -pair.gap);
  }
  return 0;
}

void RandomPushes::look_at(std::uint64_t seed, int s, bool told, std::size_t a, std::size_t b, PushCounts* counts,
                           const std::function<void(const PassedThrough&)>& tell) {
  for (std::int32_t n = 0; n < bodies_[a]->body.surface_nodes; ++n) {
    ++counts->looked;
    const Eigen::Vector3d place = truths_[a].place(n), p = in_organ(b, pose_, in_world(a, pose_, place));
    const double depth = -truths_[b].signed_distance(p);
    char& faces = faces_[a][b][static_cast<std::size_t>(n)];
    if (depth <= 0) {
      faces = depth < -3 * edges_[b] || faces_other(a, n, b);
      continue;
    }
    ++counts->inside;
    const std::size_t nearest = nearest_triangle(truths_[b], bodies_[b]->body.triangles.size(), p);
    double moved = (p - in_organ(b, was_, in_world(a, was_, before_[a].place(n)))).norm();
    double gave_way = 0;
    for (int v = 0; v < 3; ++v)
      gave_way = std::max(gave_way, (truths_[b].corner(nearest, v) - before_[b].corner(nearest, v)).norm());
    moved += gave_way;
    const bool faced = std::exchange(faces, faces_other(a, n, b));
    const double deep = (depth - moved - given_way(a, n, b)) / edges_[b];
    const bool past_side = !faced || !faces;
    counts->past_sides += past_side && deep > kSlack;
    if (!past_side) counts->deepest = std::max(counts->deepest, deep);
    if (past_side ? told || deep <= kUntold : deep <= kSlack) continue;
    ++counts->found;
    tell({seed, s, static_cast<std::int32_t>(a), n, static_cast<std::int32_t>(b), depth, moved});
  }
}

std::size_t RandomPushes::nearest_triangle(const DeformedTruth& organ, std::size_t triangles,
                                           const Eigen::Vector3d& p) const {
  std::size_t nearest = 0;
  double least = INFINITY;
  for (std::size_t t = 0; t < triangles; ++t) {
    double k[3];
    const Eigen::Vector3d x = organ.corner(t, 0) - p, y = organ.corner(t, 1) - p, z = organ.corner(t, 2) - p;
    const double square = closest_on_triangle({}, {x[0], x[1], x[2]}, {y[0], y[1], y[2]}, {z[0], z[1], z[2]}, k);
    if (square < least) least = square, nearest = t;
  }
  return nearest;
}

bool RandomPushes::faces_other(std::size_t a, std::int32_t node, std::size_t b) const {
  for (const std::vector<DeformedTruth>* truths : {&truths_, &before_}) {
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    const auto& own = bodies_[a]->body.triangles;
    for (std::size_t t = 0; t < own.size(); ++t)
      if (std::find(own[t].begin(), own[t].end(), node) != own[t].end()) normal += (*truths)[a].outward(t);
    const Eigen::Vector3d there = in_organ_direction(b, turned(a, pose_, normal.normalized()));
    const Eigen::Vector3d p = in_organ(b, pose_, in_world(a, pose_, (*truths)[a].place(node)));
    const std::size_t nearest = nearest_triangle((*truths)[b], bodies_[b]->body.triangles.size(), p);
    if ((*truths)[b].outward(nearest).dot(there) > kFacing) return false;
  }
  return true;
}

Eigen::Vector3d RandomPushes::in_organ_direction(std::size_t organ, const Eigen::Vector3d& v) const {
  if (organ != 0) return v;
  Eigen::Vector3d out;
  palpate_vector_to_organ(pose_.orientation, v.data(), out.data());
  return out;
}

void play_pushes(std::uint64_t seed, int steps, int every, PushCounts* counts,
                 const std::function<void(const PassedThrough&)>& tell, palpate_deformation_model deformation) {
  RandomPushes pushes(seed, deformation);
  for (int s = 0; s < steps; ++s) {
    const palpate_step_flags flags = pushes.step(s);
    const bool told = flags == PALPATE_STEP_NOT_TOUCHABLE, flagged = flags != 0 && !told;
    ++counts->steps, counts->pressed += pushes.presses(), counts->flagged += flagged, counts->told += told;
    if (!(pushes.pressed() <= counts->largest)) counts->largest = pushes.pressed();
    // Shapes are in single precision.
    counts->told_in_vain += told && pushes.deepest_seen() < 0.999 * kUntold;
    if (!flagged && s % every == 0) pushes.look(seed, s, told, counts, tell);
  }
  if (!pushes.leaves_nothing()) {
    ++counts->found;
    tell({seed, steps, 0, -1, 1, 0, 0});
  }
}

}  // namespace palpate::tests
