// One link between two places, or from a place to the world: a suture, clip, ligament or spring. It is a constraint among those of the
// contacts: the weights of its first end are positive and those of its second end negative, so that its row holds the displacement of one
// end against the other.
//     t . (u_a - u_b) + (1/k) T = t . (b - a) - L      a, b: the ends at rest; t: unit, from a to b; L: rest length; T: tension
// A thread is unilateral, T >= 0; a slack one has no row. A clip has three rows, with b - a as its target.
// All places of a link are in one frame: that of its organ, or the world's for links between organs.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "runtime/contact/contact_rows.h"
#include "runtime/contact/contact_solver.h"
#include "runtime/contact/motions.h"
#include "runtime/contact/touchable_disc.h"

namespace palpate {

// What a link is and what the steps have left of it: a saved state holds all of it.
struct Link {
  static constexpr double kLeastShare = 1.0 / 32,
                          kOnward = 1.1;  // of `share`: the least, and how it grows while tensions come nearer
  palpate_link given = {};
  LinkEnd ends[2];
  Vec3 along;                // unit, t; zero: not known yet
  double rest_length = 0;    // m, L
  Mat3 own;                  // m/N, the compliance of one end against the other in the last step that had its row
  std::int32_t taut = 0;     // its tension was above zero in the last step
  std::int32_t row_of = -1;  // its constraint in this step
  std::int32_t fresh = 0;    // its ends are where the last step left them
  palpate_link_condition before = PALPATE_LINK_SLACK;  // the step before
  double reach =
      0;  // m / sqrt(J): a field of that norm moves one end against the other at most by reach norm (surface_tree.h)
  double path = 0;    // sqrt(J), of the field's changes, when its ends were found
  double uneven = 0;  // N, by how much its tension was above that of its whole thread
  double share =
      1;  // of a thread's first part: of the lengths that would make its tensions equal, the share that moved
  palpate_link_state state = {};

  // m, from the first end to the second one.
  Vec3 apart() const { return ends[1].at() - ends[0].at(); }
  // m/N, beside the tissue's.
  double softness() const { return 1 / given.stiffness; }
};

// The surface that ends take hold of; borrowed. The disc's patch and measure are nullptr where contacts are no discs.
struct LinkSurface {
  DiscSource disc;
  const std::int32_t* triangles;  // [F][3]
  std::int32_t triangle_count;
};

// What is wrong with an end, with a link alone, and with its place in the list of links; nullptr: nothing. surface: of each end; nullptr
// for one in the world. before: the link in front of it, or nullptr.
const char* fault_of(const palpate_link_end& end, std::int32_t triangles);
const char* fault_of(const palpate_link& link, const LinkSurface* const surface[2]);
const char* fault_of_chain(const palpate_link& link, const palpate_link* before, bool is_last);
// The identity of link number `index` of a list.
inline std::int32_t id_of(const palpate_link& link, std::int32_t index) {
  return link.id == -1 ? index : link.id;
}
// What is wrong with link number `index` among the `count` links of a list; nullptr: nothing. link_at(i): the Link that was made of an earlier
// one.
template <class LinkAt>
const char* fault_in_list(const palpate_link& link, std::int32_t index, std::int32_t count, const LinkAt& link_at) {
  if (link.id < -1) return "an id of 0 or more, or -1";
  for (std::int32_t other = 0; other < index; ++other)
    if (link_at(other).state.id == id_of(link, index)) return "another id for each link";
  return fault_of_chain(link, index > 0 ? &link_at(index - 1).given : nullptr, index + 1 == count);
}
// Whether both are one link, with other numbers at most.
bool is_same_link(const palpate_link& a, const palpate_link& b);

// The link as it is before its first step; its ends keep their nodes.
void start_link(Link& link, const palpate_link& given, std::int32_t index);
// The link goes on as `known` was, with the numbers that link.given has.
void continue_link(Link& link, const Link& known);
// m, in the organ's frame.
Vec3 place_at_rest(const LinkSurface& surface, const palpate_link_end& end);
// The place of an end at rest and the nodes below it.
void find_link_end(const LinkSurface& surface, const palpate_link_end& from, double radius, LinkEnd* to);
// m, in the organ's frame: by how much the motions move an end now.
Vec3 driven_by(const Motions& motions, const LinkSurface& surface, const palpate_link_end& given, const LinkEnd& end);

// Whether the link asks for rows. A slack thread does where the last step has stretched it.
bool link_acts(const Link& link);
// Takes the line for this step's rows.
void turn_link(Link& link);
// Its rows, in its frame. apart: m, the way from the first end to the second one where no contact moves them.
LinkWish link_wish(const Link& link, std::int32_t index, Vec3 apart);
// Before the solution is read: the link bears nothing.
void slacken_link(Link& link);
// reaction: N, of its rows. Returns step flags: whether the link breaks.
std::uint32_t read_reaction(Link& link, Vec3 reaction, std::uint64_t step);
// What the contacts of a step did to the tissue: their nodes, N and m of each.
struct SolvedContacts {
  const Tensors& tensors;
  const ContactConstraints& set;
  const Vec3 *force, *modified;
  const ContactSolver& solver;
};
// m: by how much they have moved an end; zero where that is not finite. first: its first node among theirs; -1: the link has no rows.
// Cost: for each node of the end 9 multiply-adds for each contact node.
Vec3 moved_by(const SolvedContacts& contacts, const LinkEnd& end, std::int32_t first);
// Lets two neighbours on one thread share its length, of which one is slack or broken.
void run_on(Link& one, Link& next);

// Lets the `count` parts of one thread, which all have rows, share its length. With A the compliance between their rows, changes dL of their
// lengths change the tensions T by -A^-1 dL. So dL = A (T - t), t the same for all, makes them equal to t; the sum of dL is zero.
// Where contacts hold the tissue beside, that is too much: where the tensions turn back, a smaller share of dL moves.
// part(i): Link&; compliance(i, j): m/N. Cost: two entries for each pair of parts.
template <class Part, class Compliance>
void share_length(std::int32_t count, const Part& part, const Compliance& compliance) {
  double sum = 0, whole = 0;
  for (std::int32_t i = 0; i < count; ++i)
    for (std::int32_t j = 0; j < count; ++j) {
      const double c = compliance(i, j);
      sum += c * part(j).state.tension, whole += c;
    }
  if (!(whole > 0) || !std::isfinite(sum)) return;
  const double level = sum / whole;
  double agrees = 0;
  for (std::int32_t i = 0; i < count; ++i) {
    const double uneven = part(i).state.tension - level;
    agrees += uneven * part(i).uneven, part(i).uneven = uneven;
  }
  double& share = part(0).share;
  share = agrees < 0 ? std::max(Link::kLeastShare, 0.5 * share) : std::min(1.0, Link::kOnward * share);
  const auto way_of = [&](std::int32_t i) {
    double way = 0;
    for (std::int32_t j = 0; j < count; ++j) way += compliance(i, j) * part(j).uneven;
    return way;
  };
  double within = share;  // no length falls below zero
  for (std::int32_t i = 0; i < count; ++i)
    if (const double way = way_of(i); - way * within > part(i).rest_length) within = part(i).rest_length / -way;
  for (std::int32_t i = 0; i < count; ++i)
    part(i).rest_length = std::max(0.0, part(i).rest_length + within * way_of(i));
}

// A step of all threads in a list of `count` links. link(i): Link&; compliance(i, j): m/N, between the rows of two links that have some.
template <class LinkAt, class Compliance>
void run_threads(std::int32_t count, const LinkAt& link, const Compliance& compliance) {
  const auto runs = [&](std::int32_t i) {
    return i + 1 < count && link(i).given.runs_on && link(i).row_of >= 0 && link(i + 1).row_of >= 0 &&
           link(i).state.condition != PALPATE_LINK_BROKEN && link(i + 1).state.condition != PALPATE_LINK_BROKEN;
  };
  for (std::int32_t first = 0, end = 0; first < count; first = end) {
    for (end = first + 1; runs(end - 1);) ++end;
    if (end - first > 1)
      share_length(
          end - first, [&](std::int32_t i) -> Link& { return link(first + i); },
          [&](std::int32_t i, std::int32_t j) { return compliance(first + i, first + j); });
    if (end < count && link(end - 1).given.runs_on) run_on(link(end - 1), link(end));
  }
  for (std::int32_t i = 0; i < count; ++i) link(i).state.rest_length = link(i).rest_length;
}

}  // namespace palpate
