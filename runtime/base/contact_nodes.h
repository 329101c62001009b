// Where the parts of a touch step's result lie: tool states behind the head and contact nodes behind these, in the same bytes,
// so that a host copies all of it as one.
#pragma once

#include <cstddef>
#include <cstdint>

#include "runtime/include/palpate/palpate.h"

namespace palpate {

// Numbers of palpate_contact_source: up to which one a node's index is that of a tool, and the last one.
constexpr int kLastSourceOfTools = 1, kLastSource = 7;

// Bytes of contacts of this library, with the displacements of field_nodes nodes behind the contact nodes, and the amounts of the
// offset behind these. No sum overflows: the first two counts are below 2^13, and a bundle has less than 2^31 nodes.
inline std::size_t bytes_of_contacts(std::int32_t tools, std::int32_t nodes, std::int32_t field_nodes,
                                     std::int32_t amounts) {
  return sizeof(palpate_contacts) + static_cast<std::size_t>(tools) * sizeof(palpate_tool_state) +
         static_cast<std::size_t>(nodes) * sizeof(palpate_contact_node) +
         (3 * static_cast<std::size_t>(field_nodes) * sizeof(float) + 7) / 8 * 8 +
         static_cast<std::size_t>(amounts) * sizeof(double);
}

// The displacements that a scene's contacts hold. adds: to superposition.
struct HeldField {
  std::int32_t nodes = 0;
  bool adds = false;
};

// Writes the layout of contacts with that many tools, nodes, displacements and amounts.
inline void lay_out_contacts(palpate_contacts& contacts, std::int32_t tools, std::int32_t nodes, HeldField field,
                             std::int32_t amounts) {
  const std::int32_t field_nodes = field.nodes;
  contacts.struct_bytes = sizeof(palpate_contacts);
  contacts.used_bytes = static_cast<std::uint32_t>(bytes_of_contacts(tools, nodes, field_nodes, amounts));
  contacts.tool_state_bytes = sizeof(palpate_tool_state);
  contacts.nodes_offset = static_cast<std::uint32_t>(bytes_of_contacts(tools, 0, 0, 0));
  contacts.node_bytes = sizeof(palpate_contact_node);
  contacts.tool_count = tools, contacts.node_count = nodes;
  contacts.field_nodes = field_nodes, contacts.field_adds = field.adds;
  contacts.field_offset = field_nodes > 0 ? static_cast<std::uint32_t>(bytes_of_contacts(tools, nodes, 0, 0)) : 0;
  contacts.amount_count = amounts;
  contacts.amounts_offset =
      amounts > 0 ? static_cast<std::uint32_t>(bytes_of_contacts(tools, nodes, field_nodes, 0)) : 0;
}

// Whether contacts, which may have come through a socket, have the layout that lay_out_contacts writes, with at most that many
// nodes, these displacements and that many amounts. Then no access through the functions below leaves the bytes of a scene with that many nodes.
inline bool has_layout(const palpate_contacts& contacts, std::int32_t most_nodes, HeldField field,
                       std::int32_t amounts) {
  if (contacts.tool_count < 0 || contacts.tool_count > PALPATE_MAX_TOOLS || contacts.node_count < 0 ||
      contacts.node_count > most_nodes)
    return false;
  palpate_contacts expected;
  lay_out_contacts(expected, contacts.tool_count, contacts.node_count, field, amounts);
  return contacts.struct_bytes == expected.struct_bytes && contacts.used_bytes == expected.used_bytes &&
         contacts.tool_state_bytes == expected.tool_state_bytes && contacts.nodes_offset == expected.nodes_offset &&
         contacts.node_bytes == expected.node_bytes && contacts.field_nodes == expected.field_nodes &&
         contacts.field_adds == expected.field_adds && contacts.field_offset == expected.field_offset &&
         contacts.amount_count == expected.amount_count && contacts.amounts_offset == expected.amounts_offset;
}

// The contacts must be laid out. [tool_count] and [node_count].
inline palpate_tool_state* tools_behind(palpate_contacts& contacts) {
  return const_cast<palpate_tool_state*>(palpate_contacts_tool(&contacts, 0));
}
inline const palpate_tool_state* tools_behind(const palpate_contacts& contacts) {
  return palpate_contacts_tool(&contacts, 0);
}
inline palpate_contact_node* nodes_behind(palpate_contacts& contacts) {
  return const_cast<palpate_contact_node*>(palpate_contacts_node(&contacts, 0));
}
inline const palpate_contact_node* nodes_behind(const palpate_contacts& contacts) {
  return palpate_contacts_node(&contacts, 0);
}

inline float* field_behind(palpate_contacts& contacts) {
  return const_cast<float*>(palpate_contacts_field(&contacts));
}

// An odd number of displacements ends four bytes before what follows them.
inline void clear_behind_field(palpate_contacts& contacts) {
  if (contacts.field_nodes % 2 != 0) field_behind(contacts)[3 * static_cast<std::size_t>(contacts.field_nodes)] = 0;
}

inline double* amounts_behind(palpate_contacts& contacts) {
  return const_cast<double*>(palpate_contacts_amounts(&contacts));
}

}  // namespace palpate
