// The mailbox between the two loops: the reader gets the newest contacts, complete and in order, and neither loop waits.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <set>
#include <thread>

#include "runtime/include/palpate/palpate_mailbox.h"

namespace {

constexpr std::size_t kWords = 500, kBytes = 8 * kWords;  // about sixty contact nodes

class Mailbox {
 public:
  Mailbox() : memory_(std::aligned_alloc(64, palpate_mailbox_bytes(kBytes))) {
    box_ = palpate_mailbox_create(memory_.get(), kBytes);
  }
  void publish(std::uint64_t number) {
    auto* word = reinterpret_cast<std::uint64_t*>(palpate_mailbox_slot(box_));
    for (std::size_t i = 0; i < kWords; ++i) word[i] = number + i;
    palpate_mailbox_publish(box_);
  }
  const std::uint64_t* newest(std::int32_t* fresh = nullptr) {
    return reinterpret_cast<const std::uint64_t*>(palpate_mailbox_newest(box_, fresh));
  }
  palpate_mailbox* get() { return box_; }

 private:
  struct Free {
    void operator()(void* memory) const { std::free(memory); }
  };
  std::unique_ptr<void, Free> memory_;
  palpate_mailbox* box_;
};

TEST(Mailbox, HandsOutTheNewestAndKeepsItUntilTheNextCall) {
  Mailbox box;
  std::int32_t fresh = 7;
  EXPECT_EQ(box.newest(&fresh), nullptr);
  EXPECT_EQ(fresh, 0);
  for (const std::uint64_t number : {10, 20, 30}) box.publish(number);
  const std::uint64_t* first = box.newest(&fresh);
  ASSERT_NE(first, nullptr);
  EXPECT_EQ(first[0], 30u);
  EXPECT_EQ(first[kWords - 1], 30u + kWords - 1);
  EXPECT_EQ(fresh, 1);
  box.publish(40);
  box.publish(50);
  box.publish(60);
  EXPECT_EQ(first[0], 30u) << "the reader's slot is written while it reads";
  EXPECT_EQ(box.newest(&fresh)[0], 60u);
  EXPECT_EQ(fresh, 1);
  EXPECT_EQ(box.newest(&fresh)[0], 60u);
  EXPECT_EQ(fresh, 0);
}

TEST(Mailbox, NeverGivesTheWriterTheReadersSlot) {
  Mailbox box;
  std::uint32_t state = 1;
  std::set<const void*> slots;
  const void* reading = nullptr;
  for (int turn = 0; turn < 1000; ++turn) {
    state = state * 1664525u + 1013904223u;
    if (state >> 31)
      palpate_mailbox_publish(box.get());
    else
      reading = palpate_mailbox_newest(box.get(), nullptr);
    slots.insert(palpate_mailbox_slot(box.get()));
    ASSERT_NE(palpate_mailbox_slot(box.get()), reading);
  }
  EXPECT_EQ(slots.size(), 3u);
}

TEST(Mailbox, NeedsAlignedMemory) {
  EXPECT_EQ(palpate_mailbox_create(nullptr, kBytes), nullptr);
  alignas(64) static unsigned char memory[64];
  EXPECT_EQ(palpate_mailbox_create(memory + 8, 0), nullptr);
}

// Under ThreadSanitizer (preset tsan) this also shows that no byte is read while another thread writes it.
TEST(Mailbox, IsWholeAndInOrderBetweenTwoThreads) {
  Mailbox box;
  constexpr std::uint64_t kStride = 1000, kEnough = 2000;
  std::atomic<bool> enough{false};
  std::atomic<std::uint64_t> final_number{0};
  std::thread writer([&] {
    std::uint64_t number = 0;
    while (!enough) {
      for (int burst = 0; burst < 16; ++burst) box.publish(number += kStride);
      std::this_thread::yield();  // so that the two alternate on a machine with one free core as well
    }
    box.publish(number += kStride);
    final_number = number;
  });
  std::uint64_t last = 0, seen = 0, torn = 0, backwards = 0;
  while (final_number == 0 || last < final_number) {
    std::int32_t fresh = 0;
    const std::uint64_t* word = box.newest(&fresh);
    if (!fresh) {
      std::this_thread::yield();
      continue;
    }
    for (std::size_t i = 0; i < kWords; ++i) torn += word[i] != word[0] + i;
    backwards += word[0] <= last;
    last = word[0];
    enough = ++seen >= kEnough;
  }
  writer.join();
  EXPECT_EQ(torn, 0u);
  EXPECT_EQ(backwards, 0u);
  EXPECT_GE(seen, kEnough);
  EXPECT_EQ(last, final_number) << "the last one published is never lost";
}

}  // namespace
