#include "runtime/large/body_beside.h"

#include <algorithm>

namespace palpate {
namespace {

// The targets along a constraint's rows, in the organ's axes.
Vec3 in_axes(const ContactConstraint& constraint, Vec3 target) {
  return constraint.framed ? transposed_times(constraint.frame, target) : target;
}

Vec3 only(std::uint32_t axes, Vec3 v) {
  for (int i = 0; i < 3; ++i)
    if (!(axes >> i & 1u)) v[i] = 0;
  return v;
}

// The same of those that the constraint has. One that holds nothing, as organs that touch leave it where they part, has gone all the way to
// its target.
Vec3 target_of(const ContactConstraints& set, std::int32_t p) {
  const ContactConstraint& constraint = set.constraints[p];
  return in_axes(constraint, held_axes(constraint) == 0 ? set.target[p] : only(held_axes(constraint), set.target[p]));
}

// m, the weighted mean over the constraint's nodes: of at(node); of a field [nodes][3].
template <class At>
Vec3 mean_at_nodes(const ContactConstraints& set, const ContactConstraint& constraint, At at) {
  Vec3 sum;
  for (std::int32_t e = constraint.first_node; e < constraint.first_node + constraint.node_count; ++e)
    sum += set.nodes[e].weight * at(set.nodes[e].node);
  return sum;
}
Vec3 mean_of(const ContactConstraints& set, const ContactConstraint& constraint, const float* field) {
  return mean_at_nodes(set, constraint, [&](std::int32_t node) {
    const float* const u = field + 3 * static_cast<std::size_t>(node);
    return Vec3{static_cast<double>(u[0]), static_cast<double>(u[1]), static_cast<double>(u[2])};
  });
}

bool is_unfinished(const DeformingBody::Outcome& outcome) {
  return outcome.residual > BodyBeside::kUnfinished || outcome.unheld;
}
bool is_doubted(const DeformingBody::Outcome& outcome) {
  return outcome.cut || outcome.failed || is_unfinished(outcome);
}

}  // namespace

bool BodyBeside::make_mailbox(SceneMemory& memory, std::size_t bytes, std::uint64_t** box) {
  const std::size_t words = palpate_mailbox_bytes(bytes) / sizeof(std::uint64_t);
  *box = memory.array<std::uint64_t>(words);
  if (!*box) return false;
  memory.keep_array(*box, words);
  return palpate_mailbox_create(*box, bytes) != nullptr;
}

bool BodyBeside::create(SceneMemory& memory, DeformingBody* body, Offset* offset, const Limits& limits) {
  body_ = body, offset_ = offset, limits_ = limits;
  const auto nodes = static_cast<std::size_t>(limits.nodes), constraints = static_cast<std::size_t>(limits.constraints);
  const auto amounts = static_cast<std::size_t>(offset->count()), volumes = static_cast<std::size_t>(volume_count());
  const std::size_t job = sizeof(Job) + nodes * sizeof(ContactNode) +
                          constraints * (sizeof(ContactConstraint) + sizeof(Vec3)) + amounts * sizeof(double) +
                          volumes * sizeof(RowVolume) +
                          (limits_.stream ? MeshStream::kMostOfJob * sizeof(std::int32_t) : 0),
                    solution = sizeof(Solution) + constraints * sizeof(Solved) + amounts * sizeof(double) +
                               volumes * sizeof(RowVolume) +
                               3 * sizeof(float) *
                                   (static_cast<std::size_t>(limits.field_nodes) +
                                    static_cast<std::size_t>(limits.surface_nodes));
  acting_.constraints = memory.array<ContactConstraint>(constraints);
  acting_.target = memory.array<Vec3>(constraints), left_.target = memory.array<Vec3>(constraints);
  thread_.force = memory.array<Vec3>(nodes);
  if (volumes > 0 && !thread_.followers.create(memory, &offset->rows())) return false;
  for (int i = 0; i < 2; ++i) {
    const std::size_t numbers = 3 * static_cast<std::size_t>(limits.field_nodes);
    beyond_[i] = memory.array<float>(numbers), solved_[i] = memory.array<Solved>(constraints);
    amounts_[i] = memory.array<double>(amounts);
    memory.keep_array(amounts_[i], amounts);
    memory.keep(solved_count_[i]);
    memory.keep_array(beyond_[i], numbers), memory.keep_array(solved_[i], constraints, solved_count_[i]);
  }
  if (!make_mailbox(memory, job, &jobs_) || !make_mailbox(memory, solution, &solutions_) ||
      !added_.create(memory, limits.field_nodes, limits.surface_nodes))
    return false;
  for (double* number : {&told_.residual, &told_.least_volume, &told_.off, &told_.energy, &told_.given, &told_.spring})
    memory.keep(*number);
  memory.keep(borne_.share), memory.keep(miss_), memory.keep(moved_by_);
  for (std::int32_t* number :
       {&told_.steps, &told_.cut, &told_.unfinished, &told_.failed, &newest_, &solutions_taken_, &behind_, &goes_on_,
        &settled_, &told_.followed, &told_.awaits_mesh, &thread_.published, &thread_.doubted, &thread_.followed})
    memory.keep(*number);
  memory.keep(begun_), memory.keep(thread_.begun), memory.keep(thread_.given);
  return !memory.failed();
}

void BodyBeside::forget() {
  ++begun_;
  added_.forget();
  for (double* const amounts : amounts_) std::fill_n(amounts, offset_->count(), 0.0);
  told_ = {}, moved_by_ = {}, borne_ = {}, forget_miss(), behind_ = goes_on_ = settled_ = 0,
  solutions_taken_ = solved_count_[0] = solved_count_[1] = 0;
}

BodyBeside::Solution* BodyBeside::take_newest(bool* fresh) {
  std::int32_t is_new = 0;
  auto* const newest =
      reinterpret_cast<Solution*>(const_cast<palpate_contacts*>(palpate_mailbox_newest(solutions(), &is_new)));
  const bool counts = newest && newest->begun == begun_;
  *fresh = counts && is_new != 0;
  // The o of a solution of an older mesh lacks what the changes since then do to the linear organ under its forces.
  if (*fresh && limits_.stream && newest->told.followed != limits_.stream->end() &&
      (told_.awaits_mesh != 0 || opens_too_far(newest->told))) {
    told_.awaits_mesh = 1;
    told_.followed = newest->told.followed;  // jobs go on from there
    *fresh = false;
  }
  return counts ? newest : nullptr;
}

void BodyBeside::send(const ContactConstraints& set) {
  auto* const job = reinterpret_cast<Job*>(palpate_mailbox_slot(jobs()));
  *job = {begun_, set.node_count, set.constraint_count, told_.followed, 0};
  std::copy(set.nodes, set.nodes + set.node_count, nodes_of(job));
  std::copy(set.constraints, set.constraints + set.constraint_count, constraints_of(job));
  std::copy(set.target, set.target + set.constraint_count, targets_of(job));
  std::copy_n(offset_->amounts(), offset_->count(), amounts_of(job));
  std::copy_n(offset_->volumes(), volume_count(), volumes_of(job));
  if (limits_.stream)
    job->change_numbers = limits_.stream->copy(told_.followed, MeshStream::kMostOfJob, changes_of(job));
  palpate_mailbox_publish(jobs());
}

void BodyBeside::forget_miss() {
  miss_ = {};
}

// What a contact at this target misses, `along` of the way on which it is known.
void BodyBeside::expect(const Solved& solved, Vec3 target, Vec3 along, Miss* miss) const {
  const Vec3 aside = target - solved.target - along;
  const double way = solved.metres * length(along);
  miss->displacement = std::max(miss->displacement, (miss_.missed.displacement + miss_.grown.displacement) * way +
                                                        miss_.at_rest * solved.metres * length(aside));
  miss->force = std::max(miss->force, (miss_.missed.force + miss_.grown.force) * way +
                                          miss_.share * length(solved.stiffness * aside) / solved.metres);
}

// m, at most, from one set of the offset's amounts to another.
double BodyBeside::way_between(const double* from, const double* to) const {
  double sum = 0;
  for (std::int32_t m = 0; m < offset_->count(); ++m) sum += std::fabs(to[m] - from[m]) * offset_->rows().longest[m];
  return sum;
}

// After the fields of two solutions, one after the other, have become that of the touch.
void BodyBeside::measure_moved() {
  const double way = way_between(amounts_[1 - newest_], amounts_[newest_]);
  constexpr double least_way = 1e-5;  // m; below, the solver's tolerance decides
  if (way <= least_way) return;
  moved_by_.rate = added_.change() / way;
  moved_by_.is_known = 1;
}

// largest: m, of the contacts' targets; 0: there are no contacts.
bool BodyBeside::is_moved_too_far(double largest) const {
  const double way = offset_->exists() ? way_between(amounts_[newest_], offset_->amounts()) : 0;
  if (!moved_by_.is_known) return way > kBehindUnknown;
  const double miss = moved_by_.rate * way;
  return miss > kLeastMiss && miss > kBehind * (largest > 0 ? largest : offset_->longest());
}

// m: how far a contact that the newest solution does not have is from it along its rows. Of nodes inside a solution does not tell where they are.
double BodyBeside::way_to_new(const ContactConstraints& set, std::int32_t p) const {
  const ContactConstraint& constraint = set.constraints[p];
  const ContactNode* const nodes = set.nodes + constraint.first_node;
  const bool is_known = displacement_ && std::all_of(nodes, nodes + constraint.node_count, [&](const ContactNode& e) {
                          return e.node < limits_.surface_nodes;
                        });
  if (!is_known || held_axes(constraint) == 0) return length(target_of(set, p));
  const Vec3 there = mean_of(set, constraint, displacement_);
  return length(only(held_axes(constraint), set.target[p] - (constraint.framed ? constraint.frame * there : there)));
}

// A contact that has ended since the solution is as far from it as its whole target, if it had a force there. Both lists ascend.
bool BodyBeside::is_behind(const ContactConstraints& set) const {
  const Solved *solved = solved_[newest_], *const end = solved + solved_count_[newest_];
  const double s = same_contacts(solved, solved_count_[newest_], set)
                       ? share(set.constraint_count, [&](std::int32_t p) { return target_of(set, p); })
                       : 0;
  const auto farthest = [](const Solved& of) { return length(of.force) > 0 ? of.metres * length(of.target) : 0; };
  double unknown = 0, way = 0, largest = 0, force = 0;
  Miss miss;
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const ContactConstraint& now = set.constraints[p];
    for (; solved != end && solved->id < now.id; ++solved) unknown = std::max(unknown, farthest(*solved));
    const Vec3 target = target_of(set, p);
    const double metres = metres_of(now);
    largest = std::max(largest, metres * length(only(held_axes(now), offset_->left_of_target(acting_, p))));
    if (solved == end || solved->id != now.id) {
      unknown = std::max(unknown, metres * way_to_new(set, p));
      continue;
    }
    // What holds nothing, now and in the solution, moves nothing, wherever its target is: a new one makes no new solution.
    if (held_axes(now) == 0 && is_zero(solved->force)) {
      ++solved;
      continue;
    }
    const Vec3 expected = solved->force + solved->stiffness * (target - solved->target);
    force = std::max(force, std::min(length(solved->force), length(expected)) / metres);
    way = std::max(way, metres * length(target - solved->target));
    const Vec3 along = s != 0 ? s * (solved->target - solved_[1 - newest_][p].target) : Vec3{};
    expect(*solved++, target, along, &miss);
  }
  for (; solved != end; ++solved) unknown = std::max(unknown, farthest(*solved));
  const double own = told_.residual + told_.off;
  if (unknown > kBehindUnknown || own > kBehind || is_moved_too_far(largest)) return true;
  if (!miss_.is_known) return way > kBehindUnknown;
  return miss.displacement > kLeastMiss && (miss.displacement + told_.residual * largest > kBehind * largest ||
                                            miss.force + own * force > kBehind * force);
}

void BodyBeside::copy(Solution* newest) {
  settled_ = solved_count_[newest_] > 0 && !told_.failed && (settled_ || (!told_.cut && told_.residual <= kUnfinished));
  newest_ = 1 - newest_;
  told_ = newest->told;
  solved_count_[newest_] = newest->constraint_count;
  std::copy_n(solved_of(newest), newest->constraint_count, solved_[newest_]);
  std::copy_n(amounts_of(newest), offset_->count(), amounts_[newest_]);
  if (volume_count() > 0) offset_->take_told(volumes_of(newest));
  std::copy_n(added_of(newest), 3 * static_cast<std::size_t>(limits_.field_nodes), beyond_[newest_]);
  solutions_taken_ = std::min(2, solutions_taken_ + 1);
  borne_.share = 1;
}

void BodyBeside::hold_back(const float* released, double energy) {
  added_.subtract(released);
  for (float* const field : beyond_)
    for (std::size_t i = 0; i < 3 * static_cast<std::size_t>(limits_.surface_nodes); ++i) field[i] -= released[i];
  // The body's energy goes on from where it was.
  told_.spring += energy;
  told_.awaits_mesh = 1;
}

// The share of o that the forces force_of(p) of a step bear, N, in the organ's axes. Both lists ascend.
template <class Force>
double BodyBeside::share_borne(const ContactConstraints& set, Force force_of) const {
  const double had = std::sqrt(std::fabs(told_.energy)), linear = std::sqrt(std::max(0.0, told_.spring)),
               beyond = linear > had ? std::min(1.0, (linear - had) / had) : 0;
  if (beyond == 0) return 1;
  const auto norm = [](const Solved& of, Vec3 force) {
    return std::sqrt(0.5 * std::max(0.0, dot(force, of.compliance * force)));
  };
  double all = 0, ended = 0, other = 0;  // sqrt(J)
  const Solved *solved = solved_[newest_], *const end = solved + solved_count_[newest_];
  for (std::int32_t p = 0; solved != end; ++solved) {
    while (p < set.constraint_count && set.constraints[p].id < solved->id) ++p;
    const bool is_here = p < set.constraint_count && set.constraints[p].id == solved->id;
    const Vec3 force = is_here ? force_of(p, *solved) : Vec3{};
    const double own = norm(*solved, solved->force);
    all += own;
    if (is_zero(force))
      ended += own;
    else
      other += norm(*solved, force - solved->force);
  }
  // Where all forces have gone on, as targets do, they differ by a part of themselves. Of a changed mesh the solution's compliances do not hold, so that all of
  // the difference counts.
  const double kept = told_.awaits_mesh ? 0 : 0.5;
  const double lost = ended + std::max(0.0, other - kept * all);
  return lost > had ? 1 - beyond * (1 - had / lost) : 1;
}

// Whether this makes o less than it is.
bool BodyBeside::bear(const ContactConstraints& set, double share) {
  borne_.share = std::min(borne_.share, share);
  double most = offset_->exists() ? offset_->longest() : 0;
  if (set.constraint_count > 0) most = std::max({most, borne_.share * borne_.whole, kBehindUnknown});
  if (borne_.share == 1 || added_.longest() <= most) return false;
  added_.bound(most);
  return borne_.is_less = true;
}

bool BodyBeside::lose(const ContactSolver& solver) {
  const auto force_of = [&](std::int32_t p, const Solved&) {
    return in_axes(acting_.constraints[p], solver.reaction(p));
  };
  if (borne_.is_known || solved_count_[newest_] == 0) return false;
  return borne_.is_known = bear(left_, share_borne(left_, force_of));
}

bool BodyBeside::same_contacts(const Solved* solved, std::int32_t count, const ContactConstraints& set) const {
  if (count != set.constraint_count) return false;
  for (std::int32_t p = 0; p < count; ++p)
    if (solved[p].id != set.constraints[p].id) return false;
  return true;
}

// m, at the constraint, of o since the newest solution.
Vec3 BodyBeside::moved_on(const ContactConstraint& constraint) const {
  Vec3 sum = -1 * mean_of(acting_, constraint, beyond_[newest_]);
  for (std::int32_t e = constraint.first_node; e < constraint.first_node + constraint.node_count; ++e)
    sum += acting_.nodes[e].weight * added_.now(acting_.nodes[e].node);
  return sum;
}

// u is a state o, at which the linear organ has no force, and Y f. So E is that of o and f^T (d - W o) / 2. Where o goes on, it takes
// the work of the forces on its way.
double BodyBeside::energy(const Vec3* force) const {
  double sum = told_.energy - told_.spring;
  for (std::int32_t p = 0; p < acting_.constraint_count; ++p) {
    const ContactConstraint& constraint = acting_.constraints[p];
    const Solved* const solved = solved_of(constraint);
    sum += 0.5 * dot(force[p], in_axes(constraint, offset_->left_of_target(acting_, p)));
    if (solved) sum += 0.5 * dot(force[p] + solved->force, moved_on(constraint));
  }
  return sum;
}

// The constraint in the newest solution; nullptr where it is not there.
const BodyBeside::Solved* BodyBeside::solved_of(const ContactConstraint& constraint) const {
  const Solved *const first = solved_[newest_], *const end = first + solved_count_[newest_];
  const Solved* const at =
      std::partition_point(first, end, [&](const Solved& solved) { return solved.id < constraint.id; });
  return at != end && at->id == constraint.id ? at : nullptr;
}

// s. Zero where the two solutions have other contacts, or where one had no solution.
template <class Target>
double BodyBeside::share(std::int32_t count, Target target) const {
  const Solved *const now = solved_[newest_], *const before = solved_[1 - newest_];
  if (solutions_taken_ < 2 || told_.failed || count != solved_count_[newest_] || count != solved_count_[1 - newest_])
    return 0;
  double along = 0, squared = 0;
  for (std::int32_t p = 0; p < count; ++p) {
    if (now[p].id != before[p].id) return 0;
    const Vec3 went = now[p].target - before[p].target;
    const double square = now[p].metres * now[p].metres;
    along += square * dot(target(p) - now[p].target, went), squared += square * dot(went, went);
  }
  return squared > 0 ? std::clamp(along / squared, -1.0, 1.0) : 0;
}

// N, by which a force along the last solution's normal misses that along the new one's.
double BodyBeside::by_turning(const ContactConstraint& constraint, const Solved& now, const Solved& before) {
  if (!constraint.turns) return 0;
  const Mat3 frame_now = constraint.frame * now.frame, frame_before = constraint.frame * before.frame;
  return length(now.force) * length(load3(frame_now.m[0]) - load3(frame_before.m[0]));
}

// Before copy(): by how much what the touch would have added at the targets of the new solution misses what this adds.
void BodyBeside::measure_miss(const ContactConstraints& set, Solution* newest) {
  const Solved* const solved = solved_of(newest);
  const std::int32_t count = newest->constraint_count;
  const bool same = solutions_taken_ > 0 && count > 0 && same_contacts(solved, count, set) &&
                    same_contacts(solved_[newest_], solved_count_[newest_], set);
  const bool goes_on = goes_on_ != 0;
  goes_on_ = 0;
  if (!same || newest->told.failed) return forget_miss();
  const double s = share(count, [&](std::int32_t p) { return solved[p].target; });
  Miss going_on, at_rest;  // with o going on; as it was
  double way = 0, linear = 0;
  for (std::int32_t p = 0; p < count; ++p) {
    const ContactConstraint& constraint = set.constraints[p];
    Vec3 change, miss;
    for (std::int32_t e = constraint.first_node; e < constraint.first_node + constraint.node_count; ++e)
      for (int i = 0; i < 3; ++i) {
        const std::size_t at = 3 * static_cast<std::size_t>(set.nodes[e].node) + static_cast<std::size_t>(i);
        const auto last = static_cast<double>(beyond_[newest_][at]),
                   earlier = static_cast<double>(beyond_[1 - newest_][at]);
        change[i] += set.nodes[e].weight * (last - static_cast<double>(added_of(newest)[at]));
        miss[i] += set.nodes[e].weight * s * (last - earlier);
      }
    miss += change;
    const Vec3 went = solved[p].target - solved_[newest_][p].target;
    const double turned = by_turning(constraint, solved[p], solved_[newest_][p]);
    const double metres = solved[p].metres;
    const auto force_of = [&](Vec3 way_of) { return length(solved[p].stiffness * way_of) / metres; };
    going_on.displacement = std::max(going_on.displacement, metres * length(miss));
    at_rest.displacement = std::max(at_rest.displacement, metres * length(change));
    going_on.force = std::max(going_on.force, turned + force_of(miss));
    at_rest.force = std::max(at_rest.force, turned + force_of(change));
    way = std::max(way, metres * length(went)), linear = std::max(linear, force_of(went));
  }
  goes_on_ = going_on.displacement < 0.5 * at_rest.displacement;
  constexpr double least_way = 1e-5;  // m; below, the solver's tolerance decides
  if (way <= least_way) return;
  const Miss& now = goes_on ? going_on : at_rest;
  const auto learn = [&](double miss, double* rate, double* grown) {
    constexpr double forgets = 0.7;  // from one solution to the next
    *grown = miss_.is_known ? std::max(0.0, miss / way - *rate) : 0;
    *rate = std::max(miss / way, forgets * *rate);
  };
  double ignored = 0;
  learn(now.displacement, &miss_.missed.displacement, &miss_.grown.displacement);
  learn(now.force, &miss_.missed.force, &miss_.grown.force);
  learn(at_rest.displacement, &miss_.at_rest, &ignored);
  miss_.share = linear > 0 ? at_rest.force / linear : 0;
  miss_.is_known = 1;
}

const ContactConstraints& BodyBeside::take(const ContactConstraints& requested, bool knows_targets, bool* fresh) {
  Vec3* const left = left_.target;
  left_ = requested, left_.target = left;
  take_left(requested);
  const ContactConstraints& set = left_;
  Solution* const newest = take_newest(fresh);
  if (*fresh) measure_miss(set, newest), copy(newest);
  const bool same = newest && same_contacts(solved_[newest_], solved_count_[newest_], set);
  const auto target = [&](std::int32_t p) { return target_of(set, p); };
  if (newest)
    added_.set(beyond_[newest_], beyond_[same ? 1 - newest_ : newest_],
               same && goes_on_ && knows_targets ? share(set.constraint_count, target) : 0, *fresh);
  else
    added_.keep();
  // Contacts that have ended have lost their force. Where none is left, the body is where motions and loads have moved it.
  borne_ = {borne_.share, added_.longest()};
  if (newest && solved_count_[newest_] > 0)
    bear(set, set.constraint_count > 0
                  ? share_borne(set, [](std::int32_t, const Solved& solved) { return solved.force; })
                  : 0);
  if (*fresh) measure_moved();
  ContactConstraint* const constraints = acting_.constraints;
  Vec3* const targets = acting_.target;
  acting_ = requested;
  acting_.constraints = constraints, acting_.target = targets;
  std::copy(set.constraints, set.constraints + set.constraint_count, constraints);
  std::copy(requested.target, requested.target + set.constraint_count, targets);
  displacement_ = newest ? displacement_of(newest) : nullptr;
  if (newest) turn_frames(displacement_), aim(requested);
  return acting_;
}

void BodyBeside::give() {
  send(left_);
  behind_ = is_behind(left_);
}

Vec3 BodyBeside::added_on(std::int32_t p) const {
  const ContactConstraint& constraint = acting_.constraints[p];
  const Vec3 mean = mean_at_nodes(acting_, constraint, [&](std::int32_t node) { return added_.now(node); });
  return constraint.framed ? constraint.frame * mean : mean;
}

// The frames of the constraints: those of the newest solution, or as that has turned the surface.
void BodyBeside::turn_frames(const float* displacement) {
  const auto moved = [&](std::int32_t node) {
    const float* const u = displacement + 3 * static_cast<std::size_t>(node);
    const Vec3 from_offset = {static_cast<double>(u[0]), static_cast<double>(u[1]), static_cast<double>(u[2])};
    return offset_->exists() ? from_offset + offset_->now(node) : from_offset;
  };
  for (std::int32_t p = 0; p < acting_.constraint_count; ++p) {
    ContactConstraint& constraint = acting_.constraints[p];
    if (const Solved* const solved = solved_of(constraint); constraint.turns && solved) {
      constraint.frame = constraint.frame * solved->frame;
    } else if (constraint.turns && turned_.made()) {
      const TurnedSurface::Normals normal =
          turned_.normals(acting_.nodes + constraint.first_node, constraint.node_count, moved);
      constraint.frame = times_transposed(constraint.frame, TurnedSurface::rotation(normal.rest, normal.now));
    }
  }
}

void BodyBeside::take_targets(const ContactConstraints& set) {
  take_left(set);
  aim(set);
}

void BodyBeside::take_left(const ContactConstraints& set) {
  for (std::int32_t p = 0; p < set.constraint_count; ++p) left_.target[p] = offset_->left_of_target(set, p);
}

// The targets of the linear organ: those of the constraints, along the turned frames, less what the solution adds.
void BodyBeside::aim(const ContactConstraints& set) {
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const ContactConstraint& constraint = acting_.constraints[p];
    Vec3 target = in_axes(set.constraints[p], set.target[p]);
    for (std::int32_t e = constraint.first_node; e < constraint.first_node + constraint.node_count; ++e)
      target += -acting_.nodes[e].weight * added_.now(acting_.nodes[e].node);
    acting_.target[p] = constraint.framed ? constraint.frame * target : target;
  }
}

// The changes of the mesh that it does not have yet. False: there are none.
bool BodyBeside::follow_changes(Job* job) {
  const std::int32_t known = thread_.followed - job->first_change, count = job->change_numbers - known;
  if (known < 0 || count <= 0) return false;
  limits_.stream->follow(changes_of(job) + known, count, false);
  thread_.followed += count;
  return true;
}

void BodyBeside::copy_node(std::int32_t from, std::int32_t to) {
  added_.copy_node(from, to);
  for (float* const field : beyond_)
    std::copy_n(field + 3 * static_cast<std::size_t>(from), 3, field + 3 * static_cast<std::size_t>(to));
}

void BodyBeside::restored() {
  if (limits_.stream) limits_.stream->restore(thread_.followed);
  body_->restored();
}

std::int32_t BodyBeside::deform() {
  auto* const job = reinterpret_cast<Job*>(const_cast<palpate_contacts*>(palpate_mailbox_newest(jobs(), nullptr)));
  if (!job) return 0;
  if (job->begun != thread_.begun) {
    body_->forget();
    if (limits_.stream) limits_.stream->forget();
    thread_.begun = job->begun, thread_.published = thread_.doubted = thread_.followed = 0, thread_.given = 0;
  }
  thread_.set.nodes = nodes_of(job), thread_.set.constraints = constraints_of(job),
  thread_.set.target = targets_of(job);
  thread_.set.node_count = job->node_count, thread_.set.constraint_count = job->constraint_count;
  StepWork work;
  work.create(INT64_MAX);
  work.begin();
  const bool is_cut = follow_changes(job);
  body_->move_by(amounts_of(job), volume_count() > 0 ? volumes_of(job) : nullptr);
  const DeformingBody::Outcome outcome = body_->solve(thread_.set, &work, thread_.force);
  // A body that has come to rest says so, though it took no step for it.
  const bool doubted = is_doubted(outcome), is_news = thread_.doubted && !doubted;
  if (outcome.evaluations == 0 && !outcome.failed && job->constraint_count == thread_.published && !is_news && !is_cut)
    return 0;
  thread_.doubted = doubted;
  publish(thread_.set, job, outcome);
  body_->renew();
  return std::max(1, outcome.evaluations);
}

// Subtracts from `beyond` what the pressures that hold volumes do in the linear response to the contacts' forces: the touch adds that itself.
void BodyBeside::leave_out_followers(const ContactConstraints& set, const RowVolume* volumes, float* beyond) {
  offset_->follow_held(volumes, &thread_.followers);
  if (thread_.followers.count() == 0) return;
  double given[kMostOffsetRows] = {};
  for (std::int32_t e = 0; e < set.node_count; ++e)
    thread_.followers.subtract_force(set.nodes[e].node, thread_.force[e], given);
  thread_.followers.solve(given);
  for (std::int32_t n = 0; n < limits_.field_nodes; ++n) {
    const Vec3 moved = offset_->rows().sum_at(given, n);
    for (int i = 0; i < 3; ++i) *beyond++ -= static_cast<float>(moved[i]);
  }
}

void BodyBeside::publish(const ContactConstraints& set, Job* job, const DeformingBody::Outcome& outcome) {
  auto* const solution = reinterpret_cast<Solution*>(palpate_mailbox_slot(solutions()));
  *solution = Solution{};
  solution->begun = thread_.begun;
  thread_.given += body_->take_given();
  solution->told = {outcome.steps,        outcome.cut,     is_unfinished(outcome), outcome.failed, outcome.residual,
                    outcome.least_volume, body_->off(set), body_->energy(),        thread_.given,  0,
                    thread_.followed};
  std::copy_n(amounts_of(job), offset_->count(), amounts_of(solution));
  std::copy_n(volumes_of(job), volume_count(), volumes_of(solution));
  if (volume_count() > 0) body_->tell_volumes(volumes_of(solution));
  solution->constraint_count = thread_.published = set.constraint_count;
  Solved* const solved = solved_of(solution);
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const ContactConstraint& constraint = set.constraints[p];
    Mat3 turn;
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k)
        for (int d = 0; d < 3; ++d) turn.m[i][k] += constraint.frame.m[d][i] * body_->frame(p).m[d][k];
    solved[p] = {
        constraint.id,           target_of(set, p),        turn,
        body_->own_stiffness(p), body_->own_compliance(p), transposed_times(body_->frame(p), body_->reaction(p)),
        metres_of(constraint)};
  }
  body_->write_field(limits_.surface_nodes, displacement_of(solution));
  body_->write_beyond_linear(limits_.field_nodes, added_of(solution));
  if (volume_count() > 0) leave_out_followers(set, volumes_of(job), added_of(solution));
  for (std::int32_t p = 0; p < set.constraint_count; ++p)
    solution->told.spring +=
        0.5 * dot(solved[p].force, solved[p].target - mean_of(set, set.constraints[p], added_of(solution)));
  palpate_mailbox_publish(solutions());
}

}  // namespace palpate
