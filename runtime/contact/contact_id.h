// Who made a constraint.
#pragma once

#include <compare>
#include <cstdint>

namespace palpate {

// palpate_contact_source, in the order of their constraints in a step's list.
enum class ContactSource : std::int32_t { tool, needle, link, pair, world_link };

struct ContactId {
  ContactSource source = ContactSource::tool;
  // index: of a tool and of its needle the tool's place; of a link the link, or the first one of its thread; of two organs that touch the
  // other organ. point: of a tool its point, grip or patch; of a needle its place; of two organs which vertex, and of which of them; else 0.
  std::int32_t index = -1, point = -1;
  std::strong_ordering operator<=>(const ContactId&) const = default;
};
// A contact may have several constraints: those of a TRIANGLE, of a patch, of a thread's links.
struct ConstraintId {
  ContactId contact;
  std::int32_t part = 0;
  std::strong_ordering operator<=>(const ConstraintId&) const = default;
};

inline bool is_of_tool(const ContactId& contact) {
  return contact.source == ContactSource::tool;
}
// The place of the tool that holds tissue by it, with its points or its needle; -1: no tool does.
inline std::int32_t tool_of(const ContactId& contact) {
  return contact.source <= ContactSource::needle ? contact.index : -1;
}

}  // namespace palpate
