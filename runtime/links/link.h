// One link between two places, or from a place to the world: a suture, clip, ligament or spring. It is a constraint among those of the
// contacts: the weights of its first end are positive and those of its second end negative, so that its row holds the displacement of one
// end against the other.
//     t . (u_a - u_b) + (1/k) T = t . (b - a) - L      a, b: the ends at rest; t: unit, from a to b; L: rest length; T: tension
// A thread is unilateral, T >= 0; a slack one has no row. A clip has three rows, with b - a as its target.
// A thread that runs on through several places slides there without friction: its parts have one tension, and one row holds the sum of
// their lengths.
// All places of a link are in one frame: that of its organ, or the world's for links between organs.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "runtime/contact/contact_rows.h"
#include "runtime/contact/contact_solver.h"
#include "runtime/contact/displacement_field.h"
#include "runtime/contact/touchable_disc.h"
#include "runtime/include/palpate/palpate_links.h"

namespace palpate {

// index: the link, of a constraint's id the first one of its thread.
constexpr ContactSource kLinkSource{PALPATE_SOURCE_LINK};

// The nodes below one end of a link, with weights that sum to one. No nodes: the end does not move with the tissue.
struct LinkEnd {
  static constexpr int kMostNodes = 8;
  std::int32_t count = 0;
  std::int32_t organ = 0;        // that it is on; of an end in the world the other end's
  std::int32_t constraint = -1;  // of this step, in that organ. Where both ends are on one organ the first one has it
  std::int32_t unused = 0;       // in the place of padding, which a saved state would hold
  std::int32_t node[kMostNodes] = {};
  std::int32_t at_rest[kMostNodes] = {};  // the bundle's nodes that they were before a cut
  double weight[kMostNodes] = {};
  Mat3 local;        // m/N, compliance below its disc that the mesh does not resolve
  ContactDisc disc;  // in x, y, z
  // m, in the organ's frame: without contacts; what those of the last step add.
  Vec3 rest_in_organ, moved_in_organ;
  // m, in the link's frame:
  Vec3 rest;
  Vec3 moved;   // by the contacts of the last step
  Vec3 driven;  // by the motions of this step

  Vec3 at() const { return rest + moved + driven; }
};
// Of both ends.
inline std::int32_t nodes_of_a_link(const palpate_scene_def& def) {
  return def.contact == PALPATE_CONTACT_PATCH ? 2 * LinkEnd::kMostNodes : 6;
}

// One link as it asks for its rows in one organ.
struct LinkWish {
  std::int32_t link = 0, thread = 0;  // thread: the first link of the thread that it is a part of
  bool joined = false;                // it shares the row of the part before it
  double share = 1;                   // of the row's reaction that acts on the ends
  const LinkEnd* ends = nullptr;      // [2]
  ContactLaw law = ContactLaw::sticking;
  Vec3 along;           // unit; where the law is not sticking, the direction of its only row
  Vec3 target;          // m: x along the row, or x, y, z
  double softness = 0;  // m/N, of the link itself
};

// What a link is and what the steps have left of it: a saved state holds all of it.
struct Link {
  palpate_link given = {};
  LinkEnd ends[2];
  Vec3 along;        // unit, t; zero: not known yet
  double share = 1;  // of the tension that a part of a thread exerts: less than 1 where its places have come together
  Vec3
      pull;  // of a part, what `share along` becomes in the next step; zero: what follows from the line between its ends
  Vec3 gap;  // m, while lines turn: from one place to the other
  double rest_length =
      0;     // m, L; of a part of a thread what lies between its places without tension: the sum is the thread's
  Mat3 own;  // m/N, the compliance of one end against the other in the last step that had its row
  Vec3 target, reaction;                               // m and N, of its rows in this step; zero without
  std::int32_t taut = 0;                               // its tension was above zero in the last step
  std::int32_t fresh = 0;                              // its ends are where the last step left them
  palpate_link_condition before = PALPATE_LINK_SLACK;  // the step before
  std::int32_t unused = 0;                             // in the place of padding, which a saved state would hold
  double reach =
      0;  // m / sqrt(J): a field of that norm moves one end against the other at most by reach norm (surface_tree.h)
  double path = 0;  // sqrt(J), of the field's changes, when its ends were found
  palpate_link_state state = {};

  // m, from the first end to the second one.
  Vec3 apart() const { return ends[1].at() - ends[0].at(); }
  // m/N, beside the tissue's.
  double softness() const { return 1 / given.stiffness; }
};

// The surface that ends take hold of; borrowed. The disc's patch and measure are nullptr where contacts are no discs.
struct LinkSurface {
  DiscSource disc;
  const std::int32_t* triangles;  // [triangle_count][3]
  std::int32_t triangle_count;
  const std::uint8_t* active;  // as in TouchedSurface
};

// What is wrong with link number `index` of the `count` links of a list, with the organs of its ends; nullptr: nothing. links: the list as far
// as that link. surface: of each end; nullptr for one in the world.
const char* fault_of(const Link* links, std::int32_t index, std::int32_t count, const LinkSurface* const surface[2]);
// The identity of link number `index` of a list.
inline std::int32_t id_of(const palpate_link& link, std::int32_t index) {
  return link.id == -1 ? index : link.id;
}
// Whether both are one link, with other numbers at most.
bool is_same_link(const Link& a, const Link& b);

// The link as it is before its first step; its ends keep their nodes.
void start_link(Link& link, const palpate_link& given, std::int32_t index);
// The link goes on as `known` was, with the numbers that link.given has.
void continue_link(Link& link, const Link& known);
// The place of an end at rest and the nodes below it. Its organ stays.
void find_link_end(const LinkSurface& surface, const palpate_link_end& from, double radius, LinkEnd* to);
// m, in the organ's frame: by how much the motions move an end now.
Vec3 driven_by(const DisplacementField& field, const LinkSurface& surface, const palpate_link_end& given,
               const LinkEnd& end);

// Whether contacts can move an end of it.
inline bool has_nodes(const Link& link) {
  return link.ends[0].count + link.ends[1].count > 0;
}
// Whether its ends are on one organ.
inline bool is_within_one(const Link& link) {
  return link.ends[0].organ == link.ends[1].organ;
}
// Whether it has rows in this step.
inline bool has_rows(const Link& link) {
  return link.ends[0].constraint >= 0 || link.ends[1].constraint >= 0;
}
inline void drop_rows(Link& link) {
  link.ends[0].constraint = link.ends[1].constraint = -1;
}
// Takes the line for this step's rows.
void turn_link(Link& link);
ContactLaw law_of(const Link& link);
// Its rows, in its frame. apart: m, the way from the first end to the second one where no contact moves them.
LinkWish link_wish(const Link& link, std::int32_t index, Vec3 apart);
// The row of a link, with the nodes of both ends: those of the second one have negative weights, so that the row holds the displacement of
// the first end against it.
struct LinkRow {
  // frame: of the rows of a link that sticks; nullptr: x, y, z.
  LinkRow(const LinkWish& link, ContactSource source, const Mat3* frame);
  LinkRow(const LinkRow&) = delete;
  LinkRow& operator=(const LinkRow&) = delete;

  std::int32_t node[2 * LinkEnd::kMostNodes];
  double weight[2 * LinkEnd::kMostNodes];
  RowWish wish;
};
// Before the solution is read: the link bears nothing.
void slacken_link(Link& link);
// reaction: N, of its rows. Returns step flags: whether the link breaks, which it does where it may.
std::uint32_t read_reaction(Link& link, Vec3 reaction, bool may_break, std::uint64_t step);
// m: by how much the contacts of the last solve have moved an end; zero where that is not finite.
Vec3 moved_by(const DisplacementField& field, const LinkEnd& end);

// What turn() of a thread makes of one part; last: its share times its line.
Vec3 turned(const Link& link, double tension, Vec3 last);

// Links first .. end - 1 of a list, each of which but the last runs on into the next one; most links are alone.
struct Thread {
  // Share of its length by which a thread counts as missed. Columns in half precision round by 5e-4.
  static constexpr double kMissed = 1e-3;
  Link* links;
  std::int32_t first, end;

  Thread(Link* of, std::int32_t begin, std::int32_t count) : links(of), first(begin), end(begin) {
    while (end < count && at(end++).given.runs_on) {
    }
  }
  Link& at(std::int32_t i) const { return links[i]; }
  std::int32_t parts() const { return end - first; }
  double rest_length() const {
    double sum = 0;
    for (std::int32_t i = first; i < end; ++i) sum += at(i).rest_length;
    return sum;
  }
  // The host has given lengths anew: the sum does not fall below zero.
  void keep_length() const {
    const double below = std::min(0.0, rest_length());
    for (std::int32_t i = first; i < end && below < 0; ++i) at(i).rest_length -= below / parts();
  }
  bool is_broken() const {
    for (std::int32_t i = first; i < end; ++i)
      if (at(i).state.condition == PALPATE_LINK_BROKEN) return true;
    return false;
  }
  // Whether it asks for rows. A slack thread does where the last step has stretched it. One that is broken runs out of all its places.
  bool acts() const {
    double length_now = 0;
    bool holds = false, fresh = true, taut = false;
    for (std::int32_t i = first; i < end; ++i) {
      const Link& link = at(i);
      holds = holds || has_nodes(link);
      fresh = fresh && link.fresh, taut = taut || link.taut;
      length_now += length(link.apart());
    }
    if (!holds || is_broken()) return false;
    return at(first).given.kind != PALPATE_LINK_THREAD || taut || (fresh && length_now > rest_length());
  }
  // The row's target besides that of its parts with nodes, m, and what these do not give way by, m/N.
  void add_parts_without_nodes(LinkWish* lead) const {
    for (std::int32_t i = first; i < end; ++i) {
      if (has_nodes(at(i))) continue;
      lead->target.x += dot(at(i).along, at(i).apart()) - at(i).rest_length, lead->softness += at(i).softness();
    }
  }
  // When its ends have moved without a row: what a broken thread has run out of its other parts.
  void run_out() const {
    for (std::int32_t i = first; i < end && parts() > 1; ++i)
      if (at(i).state.condition != PALPATE_LINK_BROKEN)
        at(i).rest_length = std::max(at(i).rest_length, length(at(i).apart()));
  }
  // Reads the reaction of its rows, N, after slacken_link(). Returns step flags: of its parts the weakest one breaks.
  std::uint32_t read(Vec3 reaction, std::uint64_t step) const {
    std::uint32_t flags = 0;
    std::int32_t weakest = first;
    for (std::int32_t i = first; i < end; ++i)
      if (at(i).given.breaking_force < at(weakest).given.breaking_force) weakest = i;
    for (std::int32_t i = first; i < end; ++i) flags |= read_reaction(at(i), reaction, i == weakest, step);
    return flags;
  }
  // When its ends have moved under the tension T of its row: the line of each part for the next step. Places that a thread runs through act on
  // one another, so that the parts turn one after the other, each where those before it have left its places:
  //     (l + T C) p = x + T C p_last,   l = |x'|, x' = x - T C (p - p_last).
  // Where its places are apart, p becomes the unit vector between them. Where they have come together, p is shorter: the force that holds them
  // so. For a constant T each turn brings the energy nearer to its least (docs/method.md, section 15).
  // between(i, j): m/N, of part i by a force on part j; parts with nodes only. Cost: two of them for each pair of parts.
  template <class Between>
  void turn(const Between& between) const {
    const double tension = at(first).state.tension;
    for (std::int32_t i = first; i < end; ++i) at(i).gap = at(i).apart(), at(i).pull = Vec3{};
    for (std::int32_t i = first; i < end && parts() > 1 && tension > 0; ++i) {
      Link& link = at(i);
      if (!has_nodes(link)) continue;
      const Vec3 last = link.share * link.along;
      link.pull = turned(link, tension, last);
      for (std::int32_t j = first; j < end; ++j)
        if (has_nodes(at(j))) at(j).gap = at(j).gap - between(j, i) * (tension * (link.pull - last));
    }
  }
  // When its ends have moved under the tension of its row: what lies between its places. The sum stays. Returns whether its tension misses the
  // sum, as where no tension makes the thread shorter.
  bool slides_short() const {
    if (parts() == 1) return false;
    double missed = -rest_length(), whole = 0;
    for (std::int32_t i = first; i < end; ++i) {
      Link& link = at(i);
      link.rest_length = link.share * dot(link.along, link.apart()) - link.state.tension * link.softness();
      missed += link.rest_length, whole += length(link.apart());
    }
    for (std::int32_t i = first; i < end; ++i) at(i).rest_length -= missed / parts();
    return at(first).taut && std::fabs(missed) > kMissed * whole;
  }
};
// each(thread) of all threads in a list of `count` links.
template <class Each>
void for_threads(Link* links, std::int32_t count, const Each& each) {
  for (std::int32_t first = 0; first < count;) {
    const Thread thread(links, first, count);
    each(thread);
    first = thread.end;
  }
}

}  // namespace palpate
