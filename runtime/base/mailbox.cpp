// Three slots and one atomic word, which holds the index of the middle slot and whether the reader has not seen it yet.
#include <atomic>
#include <cstring>
#include <new>

#include "runtime/include/palpate/palpate_mailbox.h"

namespace {

constexpr std::uint32_t kFresh = 4, kSlot = 3;

constexpr std::size_t whole_lines(std::size_t bytes) {
  return (bytes + 63) / 64 * 64;
}

}  // namespace

// Each side's word has a cache line of its own, so that the two threads do not slow each other down.
struct alignas(64) palpate_mailbox {
  std::uint64_t slot_bytes;
  alignas(64) std::uint32_t writing;
  alignas(64) std::atomic<std::uint32_t> middle;
  alignas(64) std::uint32_t reading;
  std::uint32_t has_any;

  palpate_contacts* slot(std::uint32_t which) {
    return reinterpret_cast<palpate_contacts*>(reinterpret_cast<unsigned char*>(this + 1) + which % 3 * slot_bytes);
  }
};
static_assert(std::atomic<std::uint32_t>::is_always_lock_free);

size_t palpate_mailbox_bytes(size_t contacts_bytes) {
  return sizeof(palpate_mailbox) + 3 * whole_lines(contacts_bytes);
}

palpate_mailbox* palpate_mailbox_create(void* memory, size_t contacts_bytes) {
  if (!memory || reinterpret_cast<std::uintptr_t>(memory) % 64 != 0) return nullptr;
  std::memset(memory, 0, palpate_mailbox_bytes(contacts_bytes));
  auto* mailbox = new (memory) palpate_mailbox;
  mailbox->slot_bytes = whole_lines(contacts_bytes);
  mailbox->writing = 0;
  mailbox->middle.store(1);
  mailbox->reading = 2;
  mailbox->has_any = 0;
  return mailbox;
}

palpate_contacts* palpate_mailbox_slot(palpate_mailbox* mailbox) {
  return mailbox->slot(mailbox->writing);
}

void palpate_mailbox_publish(palpate_mailbox* mailbox) {
  // Release: the reader sees what was written to the slot. Acquire: the reader has finished with the slot that comes back.
  mailbox->writing = mailbox->middle.exchange(mailbox->writing | kFresh, std::memory_order_acq_rel) & kSlot;
}

const palpate_contacts* palpate_mailbox_newest(palpate_mailbox* mailbox, int32_t* fresh) {
  const bool is_fresh = mailbox->middle.load(std::memory_order_relaxed) & kFresh;
  if (is_fresh) {
    mailbox->reading = mailbox->middle.exchange(mailbox->reading, std::memory_order_acq_rel) & kSlot;
    mailbox->has_any = 1;
  }
  if (fresh) *fresh = is_fresh;
  return mailbox->has_any ? mailbox->slot(mailbox->reading) : nullptr;
}
