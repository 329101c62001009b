// Contacts as one datagram, in a fixed little-endian layout that README.md describes byte by byte.
#pragma once

#include <palpate/palpate.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "programs/player/player.h"

namespace palpate {

inline constexpr std::uint32_t kDatagramVersion = 3;
inline constexpr std::size_t kDatagramHeaderBytes = 176, kDatagramToolBytes = 160, kDatagramNodeBytes = 64;
inline constexpr std::size_t kMostDatagramBytes = 65507;  // what UDP over IPv4 carries
inline constexpr int kMostDatagramNodes =
    (kMostDatagramBytes - kDatagramHeaderBytes - PALPATE_MAX_TOOLS * kDatagramToolBytes) / kDatagramNodeBytes;

// What a datagram holds beside the contacts.
struct DatagramNote {
  std::uint64_t bundle = 0;    // its identity (programs/player/bundle_fields.h)
  std::uint64_t session = 0;   // one run of the sender; a later run has a greater one
  std::uint64_t sequence = 0;  // from 1, one more with every datagram of the session
  double time = 0;             // s since the session's first touch
  std::int64_t sent = 0;       // ns since 1970 on the sender's clock
  bool last = false;           // the sender stops after this one
  std::array<SceneConfig::Vector, PALPATE_MAX_TOOLS> positions{};  // [tool] origin, m
};

// Writes contacts of at most kMostDatagramNodes nodes. to: kMostDatagramBytes of room. Returns the bytes written.
// Cost: one pass over the used part and its checksum; no allocation.
std::size_t encode_contacts(const palpate_contacts& contacts, const DatagramNote& note, unsigned char* to);

// The sizes of the receiver's scene; a datagram that exceeds one of them is refused.
struct DatagramLimits {
  std::uint64_t bundle = 0;
  int tools = 0, nodes = 0;
  std::span<const std::int32_t> touchable;  // [S] the node of each column
};

DatagramLimits datagram_limits(const Player& player, std::uint64_t bundle);

// A datagram holds contacts at touchable nodes alone. Errors: InputError where the shape is not made of these, as under large deformation.
void check_deformation(const SceneConfig& scene);

// clang-format off
enum class DatagramFault {
  none,
  size,      // shorter than a header, or not as long as it says
  magic,     // not a datagram of ours
  version,   // of a layout this program does not read
  checksum,  // damaged on the way
  bundle,    // of another bundle
  counts,    // more tools or contact nodes than the scene has room for, or than its bytes hold
  number,    // not finite, or beyond what a contact or a pose can be
  index,     // a node, column or tool that the bundle or the scene does not have
};
// clang-format on
inline constexpr int kDatagramFaults = 9;
const char* name_of(DatagramFault fault);   // one word
const char* cause_of(DatagramFault fault);  // what was found and what to do

// Reads a datagram; safe on any bytes. contacts: of palpate_contacts_bytes for limits.nodes,
// 8-byte aligned. Where the answer is not `none`, *contacts and *note are unspecified.
DatagramFault decode_contacts(std::span<const unsigned char> bytes, const DatagramLimits& limits,
                              palpate_contacts* contacts, DatagramNote* note);

}  // namespace palpate
