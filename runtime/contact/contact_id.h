// Who made a constraint.
#pragma once

#include <compare>
#include <cstdint>

#include "runtime/base/contact_nodes.h"

namespace palpate {

// palpate_contact_source, in the order of their constraints in a step's list. A module that makes constraints has its number in its own header.
enum class ContactSource : std::int32_t { tool = PALPATE_SOURCE_TOOL };

struct ContactId {
  ContactSource source = ContactSource::tool;
  // index: of what a tool holds (tool_of) the tool's place; else the source's own, as is `point`. point: of a tool its point, grip or patch.
  std::int32_t index = -1, point = -1;
  std::strong_ordering operator<=>(const ContactId&) const = default;
};
// A contact may have several constraints, as that of a TRIANGLE has.
struct ConstraintId {
  ContactId contact;
  std::int32_t part = 0;
  std::strong_ordering operator<=>(const ConstraintId&) const = default;
};

inline bool is_of_tool(const ContactId& contact) {
  return contact.source == ContactSource::tool;
}
// The place of the tool that holds tissue by it; -1: no tool does.
inline std::int32_t tool_of(const ContactId& contact) {
  return contact.source <= ContactSource{kLastSourceOfTools} ? contact.index : -1;
}

}  // namespace palpate
