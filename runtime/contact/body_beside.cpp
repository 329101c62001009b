#include "runtime/contact/body_beside.h"

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

template <class A, class B>
int order(const A& a, const B& b) {
  if (a.tool != b.tool) return a.tool < b.tool ? -1 : 1;
  if (a.point != b.point) return a.point < b.point ? -1 : 1;
  return a.part != b.part ? (a.part < b.part ? -1 : 1) : 0;
}

}  // namespace

bool BodyBeside::make_mailbox(SceneMemory& memory, std::size_t bytes, std::uint64_t** box) {
  const std::size_t words = palpate_mailbox_bytes(bytes) / sizeof(std::uint64_t);
  *box = memory.array<std::uint64_t>(words);
  if (!*box) return false;
  memory.keep_array(*box, words);
  return palpate_mailbox_create(*box, bytes) != nullptr;
}

bool BodyBeside::create(SceneMemory& memory, DeformingBody* body, const Limits& limits) {
  body_ = body, limits_ = limits;
  const auto nodes = static_cast<std::size_t>(limits.nodes), constraints = static_cast<std::size_t>(limits.constraints);
  const std::size_t job = sizeof(Job) + nodes * sizeof(ContactNode) +
                          constraints * (sizeof(ContactConstraint) + sizeof(Vec3)),
                    solution = sizeof(Solution) + constraints * sizeof(Solved) +
                               3 * sizeof(float) *
                                   (static_cast<std::size_t>(limits.field_nodes) +
                                    static_cast<std::size_t>(limits.surface_nodes));
  acting_.constraints = memory.array<ContactConstraint>(constraints);
  acting_.target = memory.array<Vec3>(constraints);
  force_ = memory.array<Vec3>(nodes);
  if (!make_mailbox(memory, job, &jobs_) || !make_mailbox(memory, solution, &solutions_) ||
      !added_.create(memory, limits.field_nodes, limits.surface_nodes))
    return false;
  for (double* number : {&told_.residual, &told_.least_volume, &behind_}) memory.keep(*number);
  for (std::int32_t* number : {&told_.steps, &told_.cut, &told_.unfinished, &told_.failed, &follows_, &published_})
    memory.keep(*number);
  memory.keep(begun_), memory.keep(begun_beside_);
  return !memory.failed();
}

void BodyBeside::forget() {
  ++begun_;
  added_.forget();
  told_ = {}, behind_ = 0, follows_ = 0;
}

BodyBeside::Solution* BodyBeside::take_newest(bool* fresh) {
  std::int32_t is_new = 0;
  auto* const newest =
      reinterpret_cast<Solution*>(const_cast<palpate_contacts*>(palpate_mailbox_newest(solutions(), &is_new)));
  const bool counts = newest && newest->begun == begun_;
  *fresh = counts && is_new != 0;
  return counts ? newest : nullptr;
}

void BodyBeside::give(const ContactConstraints& set) {
  auto* const job = reinterpret_cast<Job*>(palpate_mailbox_slot(jobs()));
  *job = {begun_, set.node_count, set.constraint_count};
  std::copy(set.nodes, set.nodes + set.node_count, nodes_of(job));
  std::copy(set.constraints, set.constraints + set.constraint_count, constraints_of(job));
  std::copy(set.target, set.target + set.constraint_count, targets_of(job));
  palpate_mailbox_publish(jobs());
}

// A contact that the solution does not have, or that has ended since, counts with its whole target. Both lists ascend.
double BodyBeside::distance(const ContactConstraints& set, Solution* newest) const {
  const Solved *solved = newest ? solved_of(newest) : nullptr, *const end =
                                                                   solved + (newest ? newest->constraint_count : 0);
  double most = 0;
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const ContactConstraint& now = set.constraints[p];
    for (; solved != end && order(*solved, now) < 0; ++solved) most = std::max(most, length(solved->target));
    const Vec3 target = in_axes(now, only(now.axes, set.target[p]));
    const bool known = solved != end && order(*solved, now) == 0;
    most = std::max(most, length(known ? target - solved->target : target));
    solved += known;
  }
  for (; solved != end; ++solved) most = std::max(most, length(solved->target));
  return most;
}

const ContactConstraints& BodyBeside::take(const ContactConstraints& set, bool* fresh) {
  Solution* const newest = take_newest(fresh);
  if (newest) told_ = newest->told;
  if (*fresh)
    added_.set(added_of(newest));
  else
    added_.keep();
  follows_ = newest != nullptr;
  behind_ = distance(set, newest);
  give(set);
  ContactConstraint* const constraints = acting_.constraints;
  Vec3* const targets = acting_.target;
  acting_ = set;
  acting_.constraints = constraints, acting_.target = targets;
  std::copy(set.constraints, set.constraints + set.constraint_count, constraints);
  std::copy(set.target, set.target + set.constraint_count, targets);
  if (!newest) return acting_;
  const float* const displacement = displacement_of(newest);
  const auto moved = [&](std::int32_t node) {
    const float* const u = displacement + 3 * static_cast<std::size_t>(node);
    return Vec3{static_cast<double>(u[0]), static_cast<double>(u[1]), static_cast<double>(u[2])};
  };
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    ContactConstraint& constraint = constraints[p];
    const ContactNode* const nodes = set.nodes + constraint.first_node;
    Vec3 target = in_axes(constraint, targets[p]);
    for (std::int32_t e = 0; e < constraint.node_count; ++e) target += -nodes[e].weight * added_.now(nodes[e].node);
    if (constraint.framed && turned_.made())
      constraint.frame = times_transposed(constraint.frame, turned_.turn(nodes, constraint.node_count, moved));
    targets[p] = constraint.framed ? constraint.frame * target : target;
  }
  return acting_;
}

std::int32_t BodyBeside::deform() {
  auto* const job = reinterpret_cast<Job*>(const_cast<palpate_contacts*>(palpate_mailbox_newest(jobs(), nullptr)));
  if (!job) return 0;
  if (job->begun != begun_beside_) {
    body_->forget();
    begun_beside_ = job->begun, published_ = 0;
  }
  job_set_.nodes = nodes_of(job), job_set_.constraints = constraints_of(job), job_set_.target = targets_of(job);
  job_set_.node_count = job->node_count, job_set_.constraint_count = job->constraint_count;
  StepWork work;
  work.create(INT64_MAX);
  work.begin();
  const DeformingBody::Outcome outcome = body_->solve(job_set_, &work, force_);
  if (outcome.evaluations == 0 && !outcome.failed && job->constraint_count == published_) return 0;
  publish(job_set_, outcome);
  return std::max(1, outcome.evaluations);
}

void BodyBeside::publish(const ContactConstraints& set, const DeformingBody::Outcome& outcome) {
  auto* const solution = reinterpret_cast<Solution*>(palpate_mailbox_slot(solutions()));
  *solution = Solution{};
  solution->begun = begun_beside_;
  solution->told = {outcome.steps,  outcome.cut,      outcome.unfinished,
                    outcome.failed, outcome.residual, outcome.least_volume};
  solution->constraint_count = published_ = set.constraint_count;
  Solved* const solved = solved_of(solution);
  for (std::int32_t p = 0; p < set.constraint_count; ++p) {
    const ContactConstraint& constraint = set.constraints[p];
    solved[p] = {constraint.tool, constraint.point, constraint.part, 0,
                 in_axes(constraint, only(constraint.axes, set.target[p]))};
  }
  body_->write_field(limits_.surface_nodes, displacement_of(solution));
  body_->write_beyond_linear(limits_.field_nodes, added_of(solution));
  palpate_mailbox_publish(solutions());
}

}  // namespace palpate
