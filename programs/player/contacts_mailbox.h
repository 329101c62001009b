// A palpate_mailbox that owns its memory. With each contacts travels a Note, which the writer fills.
#pragma once

#include <palpate/palpate_complete.h>

#include <cstring>
#include <memory>
#include <type_traits>
#include <vector>

namespace palpate {

template <typename Note>
class ContactsMailbox {
  static_assert(std::is_trivially_copyable_v<Note>);

 public:
  // contacts_bytes: palpate_contacts_bytes of the scene that the contacts belong to.
  explicit ContactsMailbox(std::size_t contacts_bytes)
      : note_at_(contacts_bytes), memory_((palpate_mailbox_bytes(contacts_bytes + sizeof(Note)) + 63) / 64 * 8 + 8) {
    void* at = memory_.data();
    std::size_t room = 8 * memory_.size();
    const std::size_t bytes = contacts_bytes + sizeof(Note);
    mailbox_ = palpate_mailbox_create(std::align(64, palpate_mailbox_bytes(bytes), at, room), bytes);
  }

  std::size_t contacts_bytes() const { return note_at_; }

  // For the writing thread.
  palpate_contacts* slot() { return palpate_mailbox_slot(mailbox_); }
  void publish(const Note& note) {
    std::memcpy(reinterpret_cast<char*>(slot()) + note_at_, &note, sizeof note);
    palpate_mailbox_publish(mailbox_);
  }

  // For the reading thread: as palpate_mailbox_newest, with the note of the returned contacts.
  const palpate_contacts* newest(Note* note, bool* fresh = nullptr) {
    std::int32_t is_fresh = 0;
    const palpate_contacts* contacts = palpate_mailbox_newest(mailbox_, &is_fresh);
    if (contacts) std::memcpy(note, reinterpret_cast<const char*>(contacts) + note_at_, sizeof *note);
    if (fresh) *fresh = is_fresh != 0;
    return contacts;
  }

 private:
  std::size_t note_at_;
  std::vector<std::uint64_t> memory_;
  palpate_mailbox* mailbox_ = nullptr;
};

}  // namespace palpate
