#include "runtime/links/link_list.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "runtime/contact/divided_nodes.h"
#include "runtime/contact/touch.h"

namespace palpate {

LinkedOrgan linked_organ(const palpate_scene_def& def, TouchState& touch, const double* stiffness) {
  TouchedSurface& surface = touch.surface;
  LinkedOrgan organ = {&touch, {surface.discs(), surface.triangles, surface.triangle_count, surface.active}, stiffness};
  if (def.contact != PALPATE_CONTACT_PATCH) organ.surface.disc.measure = nullptr, organ.surface.disc.patch = nullptr;
  return organ;
}

bool LinkList::create(SceneMemory& memory, const LinkedOrgan* organs, std::int32_t organ_count, bool in_world,
                      std::int32_t capacity) {
  organs_ = organs, organ_count_ = organ_count, in_world_ = in_world, capacity_ = capacity;
  links_ = memory.array<Link>(static_cast<std::size_t>(capacity));
  coming_ = memory.array<Link>(static_cast<std::size_t>(capacity));
  seen_ = memory.array<std::int32_t>(static_cast<std::size_t>(organ_count));
  memory.keep(count_);
  memory.keep(path_);
  memory.keep_array(seen_, static_cast<std::size_t>(organ_count));
  memory.keep_array(links_, static_cast<std::size_t>(capacity), count_);
  return !memory.failed();
}

// ---- what the host gives ---------------------------------------------------------------------------------------------

palpate_status LinkList::begin_set(const Names& names, std::int32_t count, bool missing, palpate_error* error) const {
  if (count < 0 || count > capacity_)
    return fail(error, PALPATE_ERROR_ARGUMENT, 0, "%s: expected 0 to max_links (%d) links, found %d; raise max_links",
                names.function, static_cast<int>(capacity_), static_cast<int>(count));
  if (count > 0 && missing) return fail(error, PALPATE_ERROR_ARGUMENT, 0, "links must not be NULL");
  return PALPATE_OK;
}

const char* LinkList::fault_of_coming(std::int32_t i, std::int32_t count, bool alike) const {
  const palpate_link& given = coming_[i].given;
  const LinkSurface* surface[2] = {};
  if (!alike) return "the same struct_bytes in all links";
  for (int e = 0; e < 2; ++e) {
    if (enum_number(given.ends[e].kind) == PALPATE_END_WORLD) continue;
    const std::int32_t organ = coming_[i].ends[e].organ;
    if (organ < 0 || organ >= organ_count_) return "of each end on a surface an organ from 0 to organ_count - 1";
    surface[e] = &organs_[organ].surface;
  }
  return fault_of(coming_, i, count, surface);
}

palpate_status LinkList::check_coming(const Names& names, std::int32_t i, std::int32_t count, bool alike,
                                      palpate_error* error) {
  if (const char* fault = fault_of_coming(i, count, alike))
    return fail(error, PALPATE_ERROR_ARGUMENT, 0,
                "%s: link %d: expected %s, found something else; the %s keeps its links", names.link,
                static_cast<int>(i), fault, names.owner);
  Link& link = coming_[i];
  for (int e = 0; e < 2; ++e)
    if (link.given.ends[e].kind == PALPATE_END_WORLD) link.ends[e].organ = link.ends[1 - e].organ;
  start_link(link, link.given, i);
  return PALPATE_OK;
}

void LinkList::end_set(std::int32_t count) {
  for (std::int32_t i = 0; i < count; ++i) {
    Link& link = coming_[i];
    const Link *const end = links_ + count_, *known = links_;
    while (known != end && known->state.id != link.state.id) ++known;
    if (known != end && is_same_link(*known, link)) {
      continue_link(link, *known);
      continue;
    }
    for (int e = 0; e < 2; ++e) {
      find_link_end(organs_[link.ends[e].organ].surface, link.given.ends[e], link.given.radius, &link.ends[e]);
      link.reach += reach_of(link.ends[e]);
      LinkEnd& found = link.ends[e];
      const DividedNodes* const divided = touch(found).surface.divided;
      for (std::int32_t v = 0; v < found.count; ++v)
        found.at_rest[v] = divided ? divided->at_rest(found.node[v]) : found.node[v];
    }
  }
  std::swap(links_, coming_);
  count_ = count;
  for (std::int32_t i = 0; i < count_; ++i) place(links_[i]);
  for_threads(links_, count_, [](const auto& thread) { thread.keep_length(); });
}

// |u| <= reach norm of the weighted mean of the end's nodes: the largest eigenvalue of a node's compliance is at most its trace.
double LinkList::reach_of(const LinkEnd& end) const {
  const LinkedOrgan& organ = organs_[end.organ];
  double reach = 0;
  for (int v = 0; v < end.count; ++v) {
    Mat3 compliance;
    self_compliance(organ.stiffness + 9 * static_cast<std::size_t>(organ.surface.disc.column_of_node[end.node[v]]),
                    &compliance);
    reach += std::fabs(end.weight[v]) *
             std::sqrt(std::max(0.0, compliance.m[0][0] + compliance.m[1][1] + compliance.m[2][2]));
  }
  return reach;
}

void LinkList::forget() {
  std::fill_n(seen_, organ_count_, 0);
  for (std::int32_t i = 0; i < count_; ++i) {
    for (LinkEnd& end : links_[i].ends) std::copy_n(end.at_rest, end.count, end.node);
    start_link(links_[i], links_[i].given, i);
    place(links_[i]);
  }
}

// ---- where the ends are ----------------------------------------------------------------------------------------------

// In the frame of the links, under the poses and the offsets of the organs now.
void LinkList::place(Link& link) const {
  for (int e = 0; e < 2; ++e) {
    LinkEnd& end = link.ends[e];
    const TouchState& own = touch(end);
    const palpate_link_end& given = link.given.ends[e];
    if (given.kind == PALPATE_END_WORLD)
      end.rest = in_world_ ? load3(given.point) : own.organ.point_to_organ(load3(given.point));
    else
      end.rest = in_world_ ? own.organ.point_to_world(end.rest_in_organ) : end.rest_in_organ;
    end.moved = in_world_ ? own.organ.vector_to_world(end.moved_in_organ) : end.moved_in_organ;
    if (!own.offset.exists()) continue;
    const Vec3 driven = driven_by(own.displacement, organs_[end.organ].surface, given, end);
    end.driven = in_world_ ? own.organ.vector_to_world(driven) : driven;
  }
}

void LinkList::move_end(Link& link, int e) const {
  LinkEnd& end = link.ends[e];
  const TouchState& own = touch(end);
  const bool second = e == 1 && is_within_one(link);
  const std::int32_t constraint = link.ends[second ? 0 : e].constraint;
  if (constraint < 0) {
    end.moved_in_organ = moved_by(own.displacement, end);
  } else {
    const std::int32_t first = own.rows.set().constraints[constraint].first_node + (second ? link.ends[0].count : 0);
    Vec3 moved;
    for (int v = 0; v < end.count; ++v) moved += end.weight[v] * own.body->moved_node(own, first + v);
    end.moved_in_organ = is_finite(moved) ? moved : Vec3{};
  }
  end.moved = in_world_ ? own.organ.vector_to_world(end.moved_in_organ) : end.moved_in_organ;
}

const palpate_link_state* LinkList::state(std::int32_t i) const {
  if (i < 0 || i >= count_) return nullptr;
  Link& link = links_[i];
  Vec3 now[2];
  for (int e = 0; e < 2; ++e) {
    const LinkEnd& end = link.ends[e];
    now[e] = end.rest + (link.fresh ? end.moved : moved_by(touch(end).displacement, end)) + end.driven;
    store3(now[e], link.state.ends[e]);
  }
  link.state.length = length(now[1] - now[0]);
  return &link.state;
}

// ---- a step ----------------------------------------------------------------------------------------------------------

// A link holds the tissue that it was given: where a cut divides it, the side that the end touches.
void LinkList::follow_surfaces() {
  for (std::int32_t k = 0; k < organ_count_; ++k) {
    const DividedNodes* const divided = organs_[k].touch->surface.divided;
    if (!divided || divided->made() == seen_[k]) continue;
    for (std::int32_t i = 0; i < count_; ++i)
      for (int e = 0; e < 2; ++e) {
        LinkEnd& end = links_[i].ends[e];
        const palpate_link_end& given = links_[i].given.ends[e];
        if (end.organ == k && given.kind == PALPATE_END_SURFACE_POINT)
          follow_divided(*divided, seen_[k], surface_point_of(given.triangle, given.barycentric),
                         links_[i].given.radius, end.node, end.count);
      }
    seen_[k] = divided->made();
  }
}

void LinkList::place_ends() {
  follow_surfaces();
  for (std::int32_t i = 0; i < count_; ++i) {
    Link& link = links_[i];
    drop_rows(link);
    link.before = link.state.condition;
    place(link);
  }
}

std::uint32_t LinkList::request_rows() {
  std::uint32_t flags = 0;
  for_threads(links_, count_, [&](const auto& thread) {
    if (!thread.acts()) return;
    for (std::int32_t i = thread.first; i < thread.end; ++i)
      if (links_[i].given.kind != PALPATE_LINK_CLIP) turn_link(links_[i]);
    const Link* first = nullptr;
    bool made = true;
    for (std::int32_t i = thread.first; i < thread.end && made; ++i) {
      Link& link = links_[i];
      if (!has_nodes(link)) continue;
      // In one organ, Offset::acting() takes what the offset does to an end on nodes.
      const auto unmoved = [&](const LinkEnd& end) {
        return end.count > 0 && !in_world_ ? end.rest : end.rest + end.driven;
      };
      LinkWish wish = link_wish(link, i, unmoved(link.ends[1]) - unmoved(link.ends[0]));
      wish.thread = thread.first, wish.joined = first != nullptr;
      if (!first) thread.add_parts_without_nodes(&wish), first = &link;
      made = add_rows(link, wish);
    }
    if (!made) flags |= PALPATE_STEP_CONTACTS_DROPPED;
    if (made && admits(*first, &flags)) return;
    // The last ones come first.
    for (std::int32_t i = thread.end; i-- > thread.first;) take_back(links_[i]);
  });
  return flags;
}

void LinkList::take_back(Link& link) const {
  for (int e = 1; e >= 0; --e)
    if (link.ends[e].constraint >= 0) touch(link.ends[e]).rows.take_back(link.ends[e].constraint);
  drop_rows(link);
}

// m/N, in the frame of the links: of the ends of one link against one another by a force on those of the other, without their shares.
Mat3 LinkList::compliance_between(const Link& one, const Link& other) const {
  Mat3 sum;
  for (const LinkEnd& end : one.ends)
    for (const LinkEnd& of_other : other.ends) {
      if (end.constraint < 0 || of_other.constraint < 0 || end.organ != of_other.organ) continue;
      const TouchState& own = touch(end);
      const Mat3 compliance = own.body->compliance_between(own, end.constraint, of_other.constraint);
      const Mat3& axes = own.organ.pose().axes;
      add_scaled(sum, 1 / (one.share * other.share),
                 in_world_ && own.organ.is_set() ? times_transposed(axes * compliance, axes) : compliance);
    }
  return sum;
}

std::uint32_t LinkList::read_reactions(const bool* solved, std::uint64_t step) {
  std::uint32_t flags = 0;
  for_threads(links_, count_, [&](const auto& thread) {
    bool all_solved = true;
    for (std::int32_t i = thread.first; i < thread.end; ++i)
      for (const LinkEnd& end : links_[i].ends) all_solved = all_solved && solved[end.organ];
    const Link* last = nullptr;
    for (std::int32_t i = thread.first; i < thread.end; ++i) {
      Link& link = links_[i];
      const bool is_spared = rests(i);
      slacken_link(link);
      if (!all_solved) drop_rows(link);
      link.fresh = !is_spared;
      if (is_spared) continue;
      if (has_rows(link))
        last = &link, link.own = compliance_between(link, link);
      else
        link.reaction = Vec3{};
      for (int e = 0; e < 2; ++e) move_end(link, e);
      link.path = path_;
    }
    if (last) {
      flags |= thread.read(last->reaction, step);
      thread.turn([&](std::int32_t j, std::int32_t k) { return compliance_between(links_[j], links_[k]); });
      if (thread.slides_short()) flags |= PALPATE_STEP_REGULARISED;
    } else if (thread.is_broken()) {
      thread.run_out();
    }
    for (std::int32_t i = thread.first; i < thread.end; ++i)
      links_[i].state.rest_length = std::max(0.0, links_[i].rest_length);
  });
  return flags;
}

}  // namespace palpate
