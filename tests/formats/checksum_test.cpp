#include "formats/checksum.h"

#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <vector>

namespace palpate::formats {
namespace {

// The buffer of xxHash's own self-test (tests/sanity_test.c): bytes of a 64-bit generator that starts at PRIME32.
std::vector<unsigned char> sanity_buffer(std::size_t count) {
  std::vector<unsigned char> buffer;
  std::uint64_t state = 2654435761u;
  for (std::size_t i = 0; i < count; ++i) {
    buffer.push_back(static_cast<unsigned char>(state >> 56));
    state *= 11400714785074694797ull;
  }
  return buffer;
}

TEST(Checksum, EqualsThePublishedVectors) {
  // Empty input and strings: xxHash's README and its ports; the buffer: xxHash tests/sanity_test_vectors.h, seed 0.
  const auto of = [](const char* text) { return xxh64(text, std::strlen(text)); };
  EXPECT_EQ(of(""), 0xef46db3751d8e999ull);
  EXPECT_EQ(of("a"), 0xd24ec4f1a98c6e5bull);
  EXPECT_EQ(of("abc"), 0x44bc2cf5ad770999ull);
  EXPECT_EQ(of("Nobody inspects the spammish repetition"), 0xfbcea83c8a378bf1ull);
  const auto buffer = sanity_buffer(222);
  EXPECT_EQ(xxh64(buffer.data(), 1), 0xe934a84adb052768ull);
  EXPECT_EQ(xxh64(buffer.data(), 4), 0x9136a0dca57457eeull);
  EXPECT_EQ(xxh64(buffer.data(), 14), 0x8282dcc4994e35c8ull);
  EXPECT_EQ(xxh64(buffer.data(), 222), 0xb641ae8cb691c174ull);
}

TEST(Checksum, IsTheSameHoweverTheBytesArrive) {
  const auto buffer = sanity_buffer(300);
  for (std::size_t count = 0; count <= buffer.size(); ++count)
    for (std::size_t step = 1; step < 70; step += 7) {
      Xxh64 pieces;
      for (std::size_t at = 0; at < count; at += step) pieces.update(buffer.data() + at, std::min(step, count - at));
      ASSERT_EQ(pieces.digest(), xxh64(buffer.data(), count)) << count << " bytes by " << step;
    }
}

}  // namespace
}  // namespace palpate::formats
