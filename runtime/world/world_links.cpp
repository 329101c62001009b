#include "runtime/world/world_links.h"

#include <cmath>
#include <utility>

namespace palpate {

bool WorldLinks::create(SceneMemory& memory, palpate_scene* const* organs, std::int32_t organ_count,
                        std::int32_t capacity) {
  for (std::int32_t k = 0; k < organ_count; ++k) {
    palpate_scene& organ = *organs[k];
    organ_[k] = linked_organ(organ.def, organ.touch, organ.tensors.stiffness);
    if (organ.def.contact == PALPATE_CONTACT_PATCH) most_nodes_ = LinkEnd::kMostNodes;
  }
  return LinkList::create(memory, organ_, organ_count, true, capacity);
}

palpate_status WorldLinks::set(const palpate_world_link* links, std::int32_t count, palpate_error* error) {
  return LinkList::set({"palpate_world_set_links", "palpate_world_link", "world"}, links, count, error,
                       [](const palpate_world_link* from, Link* link, palpate_error* found) {
                         palpate_world_link wanted = palpate_default_world_link();
                         const palpate_status status = read_host_struct("world_link", from, &wanted, found);
                         palpate_link& given = link->given = palpate_default_link();
                         given.kind = wanted.kind, given.id = wanted.id, given.runs_on = wanted.runs_on;
                         given.rest_length = wanted.rest_length, given.stiffness = wanted.stiffness;
                         given.breaking_force = wanted.breaking_force, given.radius = wanted.radius;
                         for (int e = 0; e < 2; ++e)
                           given.ends[e] = wanted.ends[e], link->ends[e].organ = wanted.organ[e];
                         return status;
                       });
}

// ---- a step ----------------------------------------------------------------------------------------------------------

// The constraints of a link in the organs that it holds. False where there is no room for one.
bool WorldLinks::add_rows(Link& link, const LinkWish& wish) {
  const bool within = is_within_one(link);
  LinkWish of_organ = wish;
  of_organ.thread = of_organ.link, of_organ.joined = false, of_organ.target = {};
  link.target = wish.target;
  for (int side = 0; side < (within ? 1 : 2); ++side) {
    LinkEnd ends[2];
    for (int e = 0; e < 2; ++e)
      if (within || e == side) ends[e] = link.ends[e];
    if (ends[0].count + ends[1].count == 0) continue;
    TouchState& own = touch(link.ends[side]);
    of_organ.ends = ends, of_organ.along = own.organ.vector_to_organ(link.along);
    const Vec3 axis[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    Mat3 frame;
    for (int e = 0; e < 3; ++e) store3(own.organ.vector_to_organ(axis[e]), frame.m[e]);
    const LinkRow row(of_organ, kWorldLinkSource, &frame);
    link.ends[side].constraint = own.rows.add_reserved(row.wish);
    if (link.ends[side].constraint < 0) return false;
    of_organ.softness = 0;  // the rows of both sides are added
  }
  return true;
}

std::int32_t WorldLinks::begin(WorldStep&) {
  place_ends();
  return count_;
}

// A part of a thread is joined to the one before.
void WorldLinks::request(WorldStep& step) {
  step.flags |= request_rows();
  first_ = step.joint_count;
  for_threads(links_, count_, [&](const auto& thread) {
    bool joined = false;
    for (std::int32_t i = thread.first; i < thread.end; ++i) {
      const Link& link = links_[i];
      if (!has_rows(link)) continue;
      JointConstraint& joint = step.joints[step.joint_count++] = JointConstraint{};
      for (int e = 0; e < 2; ++e) joint.organ[e] = link.ends[e].organ, joint.constraint[e] = link.ends[e].constraint;
      joint.law = law_of(link), joint.target = link.target, joint.reaction = link.reaction;
      joint.joined = std::exchange(joined, true);
    }
  });
}

// By how much a link with a force, joint j of the step, misses its target in the solution. The organs' own solvers take what it has been given
// for its target.
bool WorldLinks::is_missed(const WorldStep& step, std::int32_t j) {
  const JointConstraint& joint = step.joints[j];
  if (joint.law == ContactLaw::unilateral && !(joint.reaction.x > 0)) return false;
  Vec3 missed, target;
  do {  // the parts of a thread have one row
    missed += step.missed(step.joints[j]), target += step.joints[j].target;
  } while (++j < step.joint_count && step.joints[j].joined);
  const double most = SystemSolver::kMet * length(target) + SystemSolver::kLeastMiss;
  return !((joint.law == ContactLaw::sticking ? length(missed) : std::fabs(missed.x)) <= most);
}

void WorldLinks::end(WorldStep& step) {
  std::int32_t j = first_;
  for (std::int32_t i = 0; i < count_; ++i) {
    if (!has_rows(links_[i])) continue;
    const JointConstraint& joint = step.joints[j];
    links_[i].reaction = is_finite(joint.reaction) ? joint.reaction : Vec3{};
    if (step.solved[joint.organ[0]] && step.solved[joint.organ[1]] && !joint.joined && is_missed(step, j))
      step.flags |= PALPATE_STEP_REGULARISED;
    ++j;
  }
  step.flags |= read_reactions(step.solved, step.number);
}

}  // namespace palpate
