#include "runtime/world/world_links.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "runtime/base/error_text.h"
#include "runtime/base/host_struct.h"
#include "runtime/links/links.h"

namespace palpate {
namespace {

palpate_link link_of(const palpate_world_link& from) {
  palpate_link link = palpate_default_link();
  link.kind = from.kind, link.id = from.id, link.runs_on = from.runs_on;
  link.ends[0] = from.ends[0], link.ends[1] = from.ends[1];
  link.rest_length = from.rest_length, link.stiffness = from.stiffness;
  link.breaking_force = from.breaking_force, link.radius = from.radius;
  return link;
}

}  // namespace

template <class Each>
void WorldLinks::for_threads(const Each& each) const {
  palpate::for_threads(
      count_, [this](std::int32_t i) -> Link& { return links_[i].link; }, each);
}

bool WorldLinks::create(SceneMemory& memory, palpate_scene* const* organs, std::int32_t organ_count,
                        std::int32_t capacity) {
  organs_ = organs, organ_count_ = organ_count, capacity_ = capacity;
  for (std::int32_t k = 0; k < organ_count; ++k) {
    palpate_scene& organ = *organs[k];
    surface_[k] = link_surface_of(organ.def, organ.touch, organ.context.bundle.index.counts.triangles);
    if (organ.def.contact == PALPATE_CONTACT_PATCH) most_nodes_ = LinkEnd::kMostNodes;
  }
  links_ = memory.array<WorldLink>(static_cast<std::size_t>(capacity));
  coming_ = memory.array<WorldLink>(static_cast<std::size_t>(capacity));
  memory.keep(count_);
  memory.keep_array(links_, static_cast<std::size_t>(capacity), count_);
  return !memory.failed();
}

// ---- what the host gives ---------------------------------------------------------------------------------------------

// Reads link i of the host's list into coming_.
palpate_status WorldLinks::read(const palpate_world_link* links, std::int32_t count, std::int32_t i,
                                palpate_error* error) {
  const auto* const from = reinterpret_cast<const palpate_world_link*>(
      reinterpret_cast<const unsigned char*>(links) + static_cast<std::size_t>(i) * links->struct_bytes);
  palpate_world_link wanted = palpate_default_world_link();
  if (const palpate_status status = read_host_struct("world_link", from, &wanted, error)) return status;
  WorldLink& of = coming_[i] = WorldLink{};
  const LinkSurface* surface[2] = {};
  const char* fault = from->struct_bytes == links->struct_bytes ? nullptr : "the same struct_bytes in all links";
  for (int e = 0; e < 2 && !fault; ++e) {
    if (wanted.ends[e].kind == PALPATE_END_WORLD) continue;
    of.organ[e] = wanted.organ[e];
    if (of.organ[e] < 0 || of.organ[e] >= organ_count_)
      fault = "of each end on a surface an organ from 0 to organ_count - 1";
    else
      surface[e] = surface_ + of.organ[e];
  }
  const palpate_link given = link_of(wanted);
  if (!fault) fault = fault_of(given, surface);
  if (!fault) fault = fault_in_list(given, i, count, [&](std::int32_t l) -> const Link& { return coming_[l].link; });
  if (fault)
    return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                "palpate_world_link: link %d: expected %s, found something else; the world keeps its links",
                static_cast<int>(i), fault);
  for (int e = 0; e < 2; ++e)
    if (given.ends[e].kind == PALPATE_END_WORLD) of.organ[e] = of.organ[1 - e];
  start_link(of.link, given, i);
  return PALPATE_OK;
}

void WorldLinks::find_ends(WorldLink& of) {
  for (int e = 0; e < 2; ++e) {
    const palpate_link& given = of.link.given;
    find_link_end(surface_[of.organ[e]], given.ends[e], given.radius, &of.link.ends[e]);
    of.rest[e] = of.link.ends[e].rest;
  }
}

palpate_status WorldLinks::set(const palpate_world_link* links, std::int32_t count, palpate_error* error) {
  if (count < 0 || count > capacity_)
    return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                "palpate_world_set_links: expected 0 to max_links (%d) links, found %d; raise max_links",
                static_cast<int>(capacity_), static_cast<int>(count));
  if (count > 0 && !links) return fail(error, PALPATE_ERROR_ARGUMENT, 0, "links must not be NULL");
  for (std::int32_t i = 0; i < count; ++i)
    if (const palpate_status status = read(links, count, i, error)) return status;
  for (std::int32_t i = 0; i < count; ++i) {
    WorldLink& of = coming_[i];
    const WorldLink *const end = links_ + count_, *known = links_;
    while (known != end && known->link.state.id != of.link.state.id) ++known;
    if (known != end && is_same_link(known->link.given, of.link.given) &&
        std::equal(of.organ, of.organ + 2, known->organ)) {
      const Link given = of.link;
      of = *known;
      of.link = given;
      continue_link(of.link, known->link);
    } else {
      find_ends(of);
    }
  }
  std::swap(links_, coming_);
  count_ = count;
  for (std::int32_t i = 0; i < count_; ++i) place_ends(links_[i]);
  for_threads([](const auto& thread) { thread.keep_length(); });
  return succeed(error);
}

void WorldLinks::forget() {
  for (std::int32_t i = 0; i < count_; ++i) {
    WorldLink& of = links_[i];
    start_link(of.link, of.link.given, i);
    of.moved[0] = of.moved[1] = of.reaction = Vec3{};
    place_ends(of);
  }
}

// ---- where the ends are ----------------------------------------------------------------------------------------------

// In the world, under the poses and motions of the organs now.
void WorldLinks::place_ends(WorldLink& of) const {
  for (int e = 0; e < 2; ++e) {
    const OrganPose& organ = touch(of, e).organ;
    LinkEnd& end = of.link.ends[e];
    end.rest = is_free(of, e) ? load3(of.link.given.ends[e].point) : organ.point_to_world(of.rest[e]);
    end.moved = organ.vector_to_world(of.moved[e]);
  }
  drive(of);
  for (int e = 0; e < 2; ++e) store3(of.link.ends[e].at(), of.link.state.ends[e]);
  of.link.state.length = length(of.link.apart());
}

void WorldLinks::drive(WorldLink& of) const {
  for (int e = 0; e < 2; ++e) {
    const TouchState& own = touch(of, e);
    if (!own.offset.exists()) continue;
    const Vec3 driven = driven_by(own.displacement, surface_[of.organ[e]], of.link.given.ends[e], of.link.ends[e]);
    of.link.ends[e].driven = own.organ.vector_to_world(driven);
  }
}

// ---- a step ----------------------------------------------------------------------------------------------------------

// The constraints of a link in the organs that it holds. False where there is no room for one.
bool WorldLinks::request(std::int32_t i) {
  WorldLink& of = links_[i];
  const bool within = of.organ[0] == of.organ[1];
  double softness = of.link.softness() + parts_without_nodes(i).softness;
  for (int side = 0; side < (within ? 1 : 2); ++side) {
    LinkEnd ends[2];
    for (int e = 0; e < 2; ++e)
      if (within || e == side) ends[e] = of.link.ends[e];
    if (ends[0].count + ends[1].count == 0) continue;
    const OrganPose& organ = touch(of, side).organ;
    LinkWish wish = link_wish(of.link, i, {});
    wish.ends = ends, wish.target = {}, wish.softness = softness;
    wish.along = organ.vector_to_organ(of.link.along);
    const Vec3 axis[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    Mat3 frame;
    for (int e = 0; e < 3; ++e) store3(organ.vector_to_organ(axis[e]), frame.m[e]);
    const LinkRow row(wish, kWorldLinkSource, &frame);
    of.constraint[side] = touch(of, side).rows.add_reserved(row.wish);
    if (of.constraint[side] < 0) return false;
    softness = 0;  // the rows of both sides are added
  }
  return true;
}

std::uint32_t WorldLinks::request() {
  std::uint32_t flags = 0;
  for (std::int32_t i = 0; i < count_; ++i) {
    WorldLink& of = links_[i];
    of.constraint[0] = of.constraint[1] = -1;
    of.link.row_of = -1, of.link.before = of.link.state.condition;
    place_ends(of);
  }
  for_threads([&](const auto& thread) {
    if (!thread.acts()) return;
    bool made = true;
    for (std::int32_t i = thread.first; i < thread.end && made; ++i) {
      Link& link = links_[i].link;
      if (link.given.kind != PALPATE_LINK_CLIP) turn_link(link);
      if (!has_nodes(link)) continue;
      made = request(i);
      link.row_of = i;
    }
    if (made) return;
    flags |= PALPATE_STEP_CONTACTS_DROPPED;
    // The last ones come first.
    for (std::int32_t i = thread.end; i-- > thread.first;) take_back(links_[i]);
  });
  return flags;
}

void WorldLinks::take_back(WorldLink& of) {
  for (int side = 1; side >= 0; --side) {
    if (of.constraint[side] >= 0) touch(of, side).rows.take_back(of.constraint[side]);
    of.constraint[side] = -1;
  }
  of.link.row_of = -1;
}

bool WorldLinks::joint(std::int32_t i, JointPair* pair) const {
  const WorldLink& of = links_[i];
  if (of.link.row_of < 0) return false;
  *pair = JointPair{};
  std::copy(of.organ, of.organ + 2, pair->organ);
  std::copy(of.constraint, of.constraint + 2, pair->constraint);
  pair->law = link_wish(of.link, i, {}).law;
  pair->reaction = of.reaction;
  pair->joined = is_joined(i);
  return true;
}

// Whether a part of its thread before it has rows.
bool WorldLinks::is_joined(std::int32_t i) const {
  while (i > 0 && links_[i - 1].link.given.runs_on)
    if (links_[--i].link.row_of >= 0) return true;
  return false;
}

// What the first part of a thread with rows has besides its own target and softness.
LinkWish WorldLinks::parts_without_nodes(std::int32_t i) const {
  LinkWish lead;
  if (is_joined(i)) return lead;
  while (i > 0 && links_[i - 1].link.given.runs_on) --i;
  const auto at = [this](std::int32_t l) -> Link& { return links_[l].link; };
  Thread<decltype(at)>(at, i, count_).add_parts_without_nodes(&lead);
  return lead;
}

Vec3 WorldLinks::target(std::int32_t i) {
  WorldLink& of = links_[i];
  drive(of);
  const LinkEnd *const a = of.link.ends, *const b = of.link.ends + 1;
  return link_wish(of.link, i, b->rest + b->driven - (a->rest + a->driven)).target + parts_without_nodes(i).target;
}

void WorldLinks::take_reaction(std::int32_t i, Vec3 reaction) {
  links_[i].reaction = is_finite(reaction) ? reaction : Vec3{};
}

// m/N, in the world: of the ends of one link against one another by a force on those of the other, without their shares.
Mat3 WorldLinks::compliance_between(const WorldLink& one, const WorldLink& other) const {
  Mat3 sum;
  for (int side = 0; side < 2; ++side)
    for (int of_other = 0; of_other < 2; ++of_other) {
      if (one.constraint[side] < 0 || other.constraint[of_other] < 0 || one.organ[side] != other.organ[of_other])
        continue;
      const TouchState& own = touch(one, side);
      const Mat3 compliance = own.solver.matrix().compliance_between_nodes(own.rows.set(), one.constraint[side],
                                                                           other.constraint[of_other]);
      const Mat3& axes = own.organ.pose().axes;
      add_scaled(sum, 1 / (one.link.share * other.link.share),
                 own.organ.is_set() ? times_transposed(axes * compliance, axes) : compliance);
    }
  return sum;
}

// What the contacts of the step have moved an end by, in the frame of its organ.
void WorldLinks::move_end(WorldLink& of, int e) const {
  const palpate_scene& organ = *organs_[of.organ[e]];
  const TouchState& own = organ.touch;
  const ContactConstraints& set = own.rows.set();
  const bool within = of.organ[0] == of.organ[1];
  const std::int32_t constraint = of.link.row_of < 0 ? -1 : of.constraint[within ? 0 : e];
  std::int32_t first = constraint < 0 ? -1 : set.constraints[constraint].first_node;
  if (first >= 0 && within && e == 1) first += of.link.ends[0].count;
  of.moved[e] = moved_by({set, own.force, own.solver, own.displacement}, of.link.ends[e], first);
}

void WorldLinks::end_link(WorldLink& of) const {
  if (of.link.row_of >= 0)
    of.link.own = compliance_between(of, of);
  else
    of.reaction = Vec3{};
  for (int e = 0; e < 2; ++e) move_end(of, e);
  place_ends(of);
}

std::uint32_t WorldLinks::end(const bool* solved, std::uint64_t step) {
  std::uint32_t flags = 0;
  for_threads([&](const auto& thread) {
    bool all_solved = true;
    for (std::int32_t i = thread.first; i < thread.end; ++i)
      for (const std::int32_t organ : links_[i].organ) all_solved = all_solved && solved[organ];
    std::int32_t row = -1;
    for (std::int32_t i = thread.first; i < thread.end; ++i) {
      WorldLink& of = links_[i];
      slacken_link(of.link);
      if (!all_solved) of.link.row_of = -1;
      row = std::max(row, of.link.row_of);
      end_link(of);
    }
    if (row >= 0) {
      flags |= thread.read(links_[row].reaction, step);
      thread.turn([&](std::int32_t j, std::int32_t k) { return compliance_between(links_[j], links_[k]); });
      if (thread.slides_short()) flags |= PALPATE_STEP_REGULARISED;
    } else if (thread.is_broken()) {
      thread.run_out();
    }
    for (std::int32_t i = thread.first; i < thread.end; ++i)
      links_[i].link.state.rest_length = std::max(0.0, links_[i].link.rest_length);
  });
  return flags;
}

}  // namespace palpate
