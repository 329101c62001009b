#include "programs/link/contacts_receiver.h"

namespace palpate {

ContactsReceiver::Verdict ContactsReceiver::take(std::span<const unsigned char> bytes, double now,
                                                 palpate_contacts* contacts, DatagramNote* note) {
  ++counts_.received;
  if (const DatagramFault fault = decode_contacts(bytes, limits_, contacts, note); fault != DatagramFault::none) {
    last_fault_ = fault;
    ++counts_.refused[static_cast<std::size_t>(fault)];
    return Verdict::refused;
  }
  const bool forgotten = counts_.sessions == 0 || now - fresh_at_ > kForgetAfter;
  const bool same = counts_.sessions > 0 && note->session == session_;
  if (same && note->sequence > newest_) {
    const std::uint64_t ahead = note->sequence - newest_;
    counts_.lost += ahead - 1;
    seen_ = ahead < 64 ? seen_ << ahead | 1 : 1;
  } else if (forgotten || (!same && note->session > session_)) {
    ++counts_.sessions;
    session_ = note->session;
    seen_ = 1;
  } else {
    return take_older(*note);
  }
  newest_ = note->sequence;
  fresh_at_ = now;
  ++counts_.fresh;
  return Verdict::fresh;
}

ContactsReceiver::Verdict ContactsReceiver::take_older(const DatagramNote& note) {
  const std::uint64_t behind = newest_ - note.sequence;
  if (note.session == session_ && behind < 64) {
    const std::uint64_t bit = std::uint64_t{1} << behind;
    if (seen_ & bit) {
      ++counts_.repeated;
      return Verdict::repeated;
    }
    seen_ |= bit;
    if (counts_.lost > 0) --counts_.lost;  // not lost after all
  }
  ++counts_.late;
  return Verdict::late;
}

}  // namespace palpate
