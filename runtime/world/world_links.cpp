#include "runtime/world/world_links.h"

#include <algorithm>

namespace palpate {

bool WorldLinks::create(SceneMemory& memory, palpate_scene* const* organs, std::int32_t organ_count,
                        std::int32_t capacity) {
  for (std::int32_t k = 0; k < organ_count; ++k) {
    palpate_scene& organ = *organs[k];
    organ_[k] =
        linked_organ(organ.def, organ.touch, organ.context.bundle.index.counts.triangles, organ.tensors.stiffness);
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

std::uint32_t WorldLinks::request() {
  place_ends();
  return request_rows();
}

bool WorldLinks::joint(std::int32_t i, JointPair* pair) const {
  const Link& link = links_[i];
  if (!has_rows(link)) return false;
  *pair = JointPair{};
  for (int e = 0; e < 2; ++e) pair->organ[e] = link.ends[e].organ, pair->constraint[e] = link.ends[e].constraint;
  pair->law = law_of(link), pair->target = link.target, pair->reaction = link.reaction;
  for (std::int32_t before = i; before > 0 && links_[before - 1].given.runs_on && !pair->joined;)
    pair->joined = has_rows(links_[--before]);
  return true;
}

void WorldLinks::take_reaction(std::int32_t i, Vec3 reaction) {
  links_[i].reaction = is_finite(reaction) ? reaction : Vec3{};
}

}  // namespace palpate
