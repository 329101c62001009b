// Decides which datagrams to use: the newest one of the newest session, although the network may lose, repeat or reorder
// them.
#pragma once

#include <array>

#include "programs/link/contacts_datagram.h"

namespace palpate {

// Counts of datagrams. received is the sum of fresh, late, repeated and refused.
struct LinkCounts {
  std::uint64_t received = 0;
  std::uint64_t fresh = 0;     // newer than all before: these are drawn
  std::uint64_t late = 0;      // older than one that had come before, or of a session that has ended
  std::uint64_t repeated = 0;  // came twice (told from late within the last 64 of a session)
  std::uint64_t lost = 0;      // sent since the first that came, and not come so far
  std::uint64_t sessions = 0;  // starts of a sender that were seen
  std::array<std::uint64_t, kDatagramFaults> refused{};  // by DatagramFault
};

class ContactsReceiver {
 public:
  // After this time without a fresh datagram, the next correct one is used whatever its session and sequence are: the clock
  // of the sender may have been set back.
  static constexpr double kForgetAfter = 1;  // s

  explicit ContactsReceiver(const DatagramLimits& limits) : limits_(limits) {}

  enum class Verdict { fresh, late, repeated, refused };

  // now: s on a clock that never goes back. contacts and note as decode_contacts; they are the newest only where
  // the verdict is fresh.
  Verdict take(std::span<const unsigned char> bytes, double now, palpate_contacts* contacts, DatagramNote* note);

  const LinkCounts& counts() const { return counts_; }
  DatagramFault last_fault() const { return last_fault_; }

 private:
  Verdict take_older(const DatagramNote& note);

  DatagramLimits limits_;
  LinkCounts counts_;
  DatagramFault last_fault_ = DatagramFault::none;
  std::uint64_t session_ = 0, newest_ = 0;
  std::uint64_t seen_ = 0;  // bit i: sequence newest_ - i has come
  double fresh_at_ = 0;
};

}  // namespace palpate
