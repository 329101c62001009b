#include "formats/checksum.h"

#include <bit>
#include <cstring>

namespace palpate::formats {

namespace {

// The constants and steps of Yann Collet's XXH64 specification (xxHash, doc/xxhash_spec.md).
constexpr std::uint64_t kPrime1 = 0x9e3779b185ebca87ull;
constexpr std::uint64_t kPrime2 = 0xc2b2ae3d27d4eb4full;
constexpr std::uint64_t kPrime3 = 0x165667b19e3779f9ull;
constexpr std::uint64_t kPrime4 = 0x85ebca77c2b2ae63ull;
constexpr std::uint64_t kPrime5 = 0x27d4eb2f165667c5ull;
constexpr std::size_t kStripe = 32;

static_assert(std::endian::native == std::endian::little, "bundles are little-endian");

template <class Integer>
Integer load(const unsigned char* at) {
  Integer value;
  std::memcpy(&value, at, sizeof value);
  return value;
}

std::uint64_t round(std::uint64_t lane, std::uint64_t input) {
  return std::rotl(lane + input * kPrime2, 31) * kPrime1;
}

std::uint64_t merge(std::uint64_t hash, std::uint64_t lane) {
  return (hash ^ round(0, lane)) * kPrime1 + kPrime4;
}

void consume_stripe(std::uint64_t lane[4], const unsigned char* at) {
  for (int i = 0; i < 4; ++i) lane[i] = round(lane[i], load<std::uint64_t>(at + 8 * i));
}

}  // namespace

void Xxh64::update(const void* bytes, std::size_t count) {
  if (count == 0) return;
  const auto* at = static_cast<const unsigned char*>(bytes);
  total_ += count;
  // Complete the stripe an earlier call began.
  if (tail_count_ > 0) {
    const std::size_t take = count < kStripe - tail_count_ ? count : kStripe - tail_count_;
    std::memcpy(tail_ + tail_count_, at, take);
    tail_count_ += take;
    at += take;
    count -= take;
    if (tail_count_ < kStripe) return;
    consume_stripe(lane_, tail_);
    tail_count_ = 0;
  }
  for (; count >= kStripe; at += kStripe, count -= kStripe) consume_stripe(lane_, at);
  std::memcpy(tail_, at, count);
  tail_count_ = count;
}

std::uint64_t Xxh64::digest() const {
  std::uint64_t hash = lane_[2] + kPrime5;  // the seed, 0, sits in the third lane while no stripe was consumed
  if (total_ >= kStripe) {
    hash = std::rotl(lane_[0], 1) + std::rotl(lane_[1], 7) + std::rotl(lane_[2], 12) + std::rotl(lane_[3], 18);
    for (const std::uint64_t lane : lane_) hash = merge(hash, lane);
  }
  hash += total_;
  // The last 0 .. 31 bytes: by eight, by four, by one.
  const unsigned char* at = tail_;
  std::size_t left = tail_count_;
  for (; left >= 8; at += 8, left -= 8)
    hash = std::rotl(hash ^ round(0, load<std::uint64_t>(at)), 27) * kPrime1 + kPrime4;
  if (left >= 4) {
    hash = std::rotl(hash ^ load<std::uint32_t>(at) * kPrime1, 23) * kPrime2 + kPrime3;
    at += 4;
    left -= 4;
  }
  for (; left > 0; ++at, --left) hash = std::rotl(hash ^ *at * kPrime5, 11) * kPrime1;
  // Avalanche.
  hash = (hash ^ hash >> 33) * kPrime2;
  hash = (hash ^ hash >> 29) * kPrime3;
  return hash ^ hash >> 32;
}

std::uint64_t xxh64(const void* bytes, std::size_t count) {
  Xxh64 state;
  state.update(bytes, count);
  return state.digest();
}

}  // namespace palpate::formats
