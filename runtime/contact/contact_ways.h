// The ways on which contacts hold their places, as SurfaceField tells them (deepest_but, sum_of_changes).
#pragma once

#include <algorithm>
#include <cstdint>

#include "runtime/contact/contact_constraints.h"
#include "runtime/contact/contact_id.h"

namespace palpate {

// m, along x, y and z: the target of a constraint.
inline Vec3 held_way(const ContactConstraints& set, std::int32_t p) {
  const ContactConstraint& constraint = set.constraints[p];
  Vec3 way;
  for (int i = 0; i < 3; ++i)
    if (constraint.axes >> i & 1u) way[i] = set.target[p][i];
  return constraint.framed ? transposed_times(constraint.frame, way) : way;
}

// Of contacts that ascend by `id`.
template <class Contact>
const Contact* find_contact(const Contact* contacts, std::int32_t count, const ContactId& id) {
  const Contact* const end = contacts + count;
  const Contact* const at = std::partition_point(contacts, end, [&](const Contact& c) { return c.id < id; });
  return at != end && at->id == id ? at : nullptr;
}

// m.
struct ContactWays {
  double deepest = 0, second = 0, sum_of_changes = 0;
  ContactId deepest_id;
  std::int32_t unused = 0;  // in the place of padding, which a saved state would hold

  double deepest_but(const ContactId& id) const { return deepest_id == id ? second : deepest; }

  // Contacts have `id`, `way`, and `place` and `radius` of their disc. As a disc moves over the surface by its radius, what it does to others
  // changes by as much as it does.
  template <class Contact>
  void measure(const Contact* now, std::int32_t count, const Contact* before, std::int32_t count_before) {
    deepest = second = 0, deepest_id = {};
    double change = 0;
    for (std::int32_t c = 0; c < count; ++c) {
      const Contact& contact = now[c];
      const double way = length(contact.way);
      if (way > deepest)
        second = deepest, deepest = way, deepest_id = contact.id;
      else
        second = std::max(second, way);
      const Contact* const old = find_contact(before, count_before, contact.id);
      double own = old ? length(contact.way - old->way) : way;
      if (old && contact.radius > 0) own += way * std::min(1.0, length(contact.place - old->place) / contact.radius);
      change = std::max(change, own);
    }
    for (std::int32_t c = 0; c < count_before; ++c)
      if (!find_contact(now, count, before[c].id)) change = std::max(change, length(before[c].way));
    sum_of_changes += change;
  }
};

}  // namespace palpate
