// Where the nodes of a touch step's result lie: behind palpate_contacts, in the same bytes, so that a host copies both as one.
#pragma once

#include "runtime/include/palpate/palpate.h"

namespace palpate {

// [contacts.node_count]. The host's buffer has room for them (palpate_contacts_bytes).
inline palpate_contact_node* nodes_behind(palpate_contacts& contacts) {
  return reinterpret_cast<palpate_contact_node*>(&contacts + 1);
}
inline const palpate_contact_node* nodes_behind(const palpate_contacts& contacts) {
  return reinterpret_cast<const palpate_contact_node*>(&contacts + 1);
}

}  // namespace palpate
