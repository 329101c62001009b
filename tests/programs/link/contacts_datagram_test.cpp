// A datagram arrives as it was sent, and harmful bytes are refused.
#include "programs/link/contacts_datagram.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

#include "formats/checksum.h"
#include "formats/errors.h"
#include "tests/programs/link/linked_scene.h"

namespace palpate {
namespace {

using tests::Bytes;

// Writes the right checksum for any bytes, as an attacker would.
void seal(Bytes& bytes) {
  if (bytes.size() < kDatagramHeaderBytes) return;
  std::memset(bytes.data() + 16, 0, 8);
  const std::uint64_t sum = formats::xxh64(bytes.data(), bytes.size());
  for (int i = 0; i < 8; ++i) bytes[16 + i] = static_cast<unsigned char>(sum >> 8 * i);
}

void put(Bytes& bytes, std::size_t at, std::uint64_t value, int count) {
  for (int i = 0; i < count; ++i) bytes[at + i] = static_cast<unsigned char>(value >> 8 * i);
}

class ContactsDatagram : public tests::LinkedScene {
 protected:
  void SetUp() override {
    LinkedScene::SetUp();
    player_ = std::make_unique<Player>(scene(), bundle());
    identity_ = read_bundle_fields(bundle()).identity;
    all_ = tests::datagrams_of(*player_, identity_, 7);
    pressed_ = all_[120];
    limits_ = datagram_limits(*player_, identity_);
  }

  DatagramFault decode(const Bytes& bytes) {
    // A copy of the exact size: a sanitizer finds a read of one byte behind it.
    const std::unique_ptr<unsigned char[]> copy(new unsigned char[bytes.size()]);
    std::copy(bytes.begin(), bytes.end(), copy.get());
    got_ = std::make_unique<tests::OwnContacts>(*player_);
    return decode_contacts({copy.get(), bytes.size()}, limits_, got_->get(), &note_);
  }

  DatagramFault decode_changed(std::size_t at, std::uint64_t value, int count) {
    Bytes bytes = pressed_;
    put(bytes, at, value, count);
    seal(bytes);
    return decode(bytes);
  }

  std::unique_ptr<Player> player_;
  std::uint64_t identity_ = 0;
  std::vector<Bytes> all_;
  Bytes pressed_;  // one with contact nodes of both tools
  DatagramLimits limits_;
  std::unique_ptr<tests::OwnContacts> got_;
  DatagramNote note_;
};

TEST_F(ContactsDatagram, ComesAsItWasSentInEveryStep) {
  tests::OwnContacts sent(*player_);
  palpate_scene_reset(player_->runtime_scene());
  int with_nodes = 0;
  for (std::uint64_t step = 0; step < player_->touch_count(); ++step) {
    const double time = static_cast<double>(step) / 1000;
    player_->move_tools(time);
    player_->touch(1e-3, sent.get(), sent.bytes());
    ASSERT_EQ(decode(all_[step]), DatagramFault::none) << step;
    palpate_contacts* got = got_->get();
    EXPECT_EQ(got->node_capacity, player_->contact_node_limit());
    got->node_capacity = sent.get()->node_capacity;  // of its own memory
    ASSERT_EQ(got->used_bytes, sent.get()->used_bytes) << step;
    EXPECT_EQ(0, std::memcmp(got, sent.get(), got->used_bytes)) << step;
    EXPECT_EQ(note_.session, 7u);
    EXPECT_EQ(note_.sequence, step + 1);
    EXPECT_EQ(note_.time, time);
    EXPECT_EQ(note_.positions[1], player_->positions()[1]);
    with_nodes += got->node_count > 3;
  }
  EXPECT_GT(with_nodes, 50);  // the scene touches, with both tools
}

// The drawing machine must place the organ where the touch felt it.
TEST_F(ContactsDatagram, HoldsThePoseAndTheTorque) {
  palpate_pose pose = palpate_default_pose();
  pose.position[0] = 0.25, pose.position[2] = -3;
  pose.orientation[0] = 0.6, pose.orientation[3] = 0.8;
  ASSERT_EQ(palpate_scene_set_pose(player_->runtime_scene(), &pose, nullptr), PALPATE_OK);
  player_->move_tools(0);
  tests::OwnContacts sent(*player_);
  player_->touch(1e-3, sent.get(), sent.bytes());
  auto& tool = const_cast<palpate_tool_state&>(*palpate_contacts_tool(sent.get(), 1));
  for (int d = 0; d < 3; ++d) tool.torque[d] = 0.5 + d, tool.torque_raw[d] = -7.5 - d;
  note_.bundle = identity_;
  ASSERT_EQ(decode(tests::encoded(*sent.get(), note_)), DatagramFault::none);
  for (int d = 0; d < 3; ++d) {
    EXPECT_EQ(got_->get()->organ_position[d], pose.position[d]);
    EXPECT_EQ(palpate_contacts_tool(got_->get(), 1)->torque[d], 0.5 + d);
    EXPECT_EQ(palpate_contacts_tool(got_->get(), 1)->torque_raw[d], -7.5 - d);
  }
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(got_->get()->organ_orientation[i], pose.orientation[i], 1e-15);
}

// Some bytes of the README's byte map.
TEST_F(ContactsDatagram, HasTheLayoutThatTheReadmeGives) {
  const auto u32 = [&](std::size_t at) {
    std::uint32_t value = 0;
    for (int i = 0; i < 4; ++i) value |= static_cast<std::uint32_t>(pressed_[at + i]) << 8 * i;
    return value;
  };
  ASSERT_EQ(decode(pressed_), DatagramFault::none);
  EXPECT_EQ(0, std::memcmp(pressed_.data(), "PALPLINK", 8));
  EXPECT_EQ(u32(8), 3u);
  EXPECT_EQ(u32(12), pressed_.size());
  EXPECT_EQ(u32(40), 121u);  // sequence
  EXPECT_EQ(u32(84), 2u);    // tools
  const std::uint32_t nodes = u32(88);
  EXPECT_EQ(nodes, static_cast<std::uint32_t>(got_->get()->node_count));
  EXPECT_EQ(pressed_.size(), 176 + 2 * 160 + 64 * nodes);
  EXPECT_EQ(u32(176 + 2 * 160), static_cast<std::uint32_t>(palpate_contacts_node(got_->get(), 0)->column));
}

TEST_F(ContactsDatagram, CutAtAnyByteIsRefused) {
  for (std::size_t count = 0; count < pressed_.size(); ++count) {
    Bytes cut(pressed_.begin(), pressed_.begin() + static_cast<std::ptrdiff_t>(count));
    EXPECT_EQ(decode(cut), DatagramFault::size) << count;
    if (count < kDatagramHeaderBytes) continue;
    put(cut, 12, count, 4);  // and one that states the length it has
    seal(cut);
    EXPECT_EQ(decode(cut), DatagramFault::counts) << count;
  }
  Bytes longer = pressed_;
  longer.push_back(0);
  EXPECT_EQ(decode(longer), DatagramFault::size);
}

TEST_F(ContactsDatagram, WithAnyByteChangedIsRefused) {
  for (std::size_t at = 0; at < pressed_.size(); ++at)
    for (const unsigned char change : {0x01, 0x80, 0xff}) {
      Bytes bytes = pressed_;
      bytes[at] ^= change;
      EXPECT_NE(decode(bytes), DatagramFault::none) << at;
    }
}

TEST_F(ContactsDatagram, SaysWhatIsWrong) {
  const std::uint64_t nan = std::bit_cast<std::uint64_t>(std::nan(""));
  const std::uint64_t infinity = std::bit_cast<std::uint64_t>(std::numeric_limits<double>::infinity());
  const std::size_t tool = kDatagramHeaderBytes, node = tool + 2 * kDatagramToolBytes;
  EXPECT_EQ(decode_changed(0, 'p', 1), DatagramFault::magic);
  EXPECT_EQ(decode_changed(8, 1, 4), DatagramFault::version);
  EXPECT_EQ(decode_changed(24, identity_ + 1, 8), DatagramFault::bundle);
  EXPECT_EQ(decode_changed(84, 3, 4), DatagramFault::counts);  // a tool the scene does not have
  EXPECT_EQ(decode_changed(84, 1, 4), DatagramFault::counts);  // one fewer than the bytes hold
  EXPECT_EQ(decode_changed(88, 0xffffffff, 4), DatagramFault::counts);
  EXPECT_EQ(decode_changed(56, nan, 8), DatagramFault::number);        // time
  EXPECT_EQ(decode_changed(104, infinity, 8), DatagramFault::number);  // residual
  for (std::size_t number = 0; number < 7; ++number)                   // pose
    EXPECT_EQ(decode_changed(112 + 8 * number, nan, 8), DatagramFault::number) << number;
  EXPECT_EQ(decode_changed(136, std::bit_cast<std::uint64_t>(0.99), 8), DatagramFault::number);  // no rotation
  for (std::size_t number = 0; number < 18; ++number)
    EXPECT_EQ(decode_changed(tool + 8 * number, nan, 8), DatagramFault::number) << number;
  EXPECT_EQ(decode_changed(tool + 72, std::bit_cast<std::uint64_t>(2.0), 8), DatagramFault::number);  // no direction
  EXPECT_EQ(decode_changed(tool + 144, 0xffffffff, 4), DatagramFault::counts);
  for (std::size_t index = 0; index < 4; ++index)  // column, source, index, point
    EXPECT_EQ(decode_changed(node + 4 * index, 0xfffffffe, 4), DatagramFault::index) << index;
  EXPECT_EQ(decode_changed(node, limits_.touchable.size(), 4), DatagramFault::index);
  EXPECT_EQ(decode_changed(node + 8, 2, 4), DatagramFault::index);
  for (std::size_t number = 0; number < 6; ++number)
    EXPECT_EQ(decode_changed(node + 16 + 8 * number, nan, 8), DatagramFault::number) << number;

  Bytes damaged = pressed_;
  damaged[node + 20] ^= 1;
  EXPECT_EQ(decode(damaged), DatagramFault::checksum);
  for (int fault = 0; fault < kDatagramFaults; ++fault) {
    EXPECT_GT(std::strlen(name_of(static_cast<DatagramFault>(fault))), 3u);
    EXPECT_GT(std::strlen(cause_of(static_cast<DatagramFault>(fault))), 10u);
  }
}

// The length of a tool's direction is the share of P and Q that acts (palpate.h): less than 1 where its displacements cancel.
TEST_F(ContactsDatagram, HasDirectionsOfAnyLengthUpToOne) {
  const std::size_t direction = kDatagramHeaderBytes + 72;
  Bytes bytes = pressed_;
  for (const double length : {0.0, 1e-9, 0.25, 0.999, 1.0, 1.001, -1.001}) {
    for (int d = 0; d < 3; ++d)
      put(bytes, direction + 8 * static_cast<std::size_t>(d), std::bit_cast<std::uint64_t>(d == 1 ? length : 0.0), 8);
    seal(bytes);
    const bool fits = std::fabs(length) <= 1;
    EXPECT_EQ(decode(bytes), fits ? DatagramFault::none : DatagramFault::number) << length;
    if (fits) {
      EXPECT_EQ(palpate_contacts_tool(got_->get(), 0)->direction[1], length);
    }
  }
}

// An attacker sends extreme values with a right checksum: what the receiver accepts must be safe for palpate_scene_shape.
TEST_F(ContactsDatagram, SealedWithExtremesIsRefusedOrDrawsAFiniteShape) {
  Player drawing(scene(), bundle(), Half::shape);
  int taken = 0, refused = 0;
  for (std::size_t at = 0; at + 4 <= pressed_.size(); at += 4)
    for (const std::uint32_t value : {0u, 1u, 0x7fu, 0x7fffffffu, 0x80000000u, 0x7ff80000u, 0xffffffffu}) {
      if (decode_changed(at, value, 4) != DatagramFault::none) {
        ++refused;
        continue;
      }
      ++taken;
      for (const float x : tests::shape_of(drawing, got_->get())) ASSERT_TRUE(std::isfinite(x)) << at;
    }
  EXPECT_GT(taken, 100);  // forces and displacements may be anything finite
  EXPECT_GT(refused, 100);
}

TEST_F(ContactsDatagram, HoldsAsManyNodesAsItSays) {
  std::vector<std::uint64_t> words((sizeof(palpate_contacts) + PALPATE_MAX_TOOLS * sizeof(palpate_tool_state) +
                                    kMostDatagramNodes * sizeof(palpate_contact_node)) /
                                   8);
  auto* contacts = reinterpret_cast<palpate_contacts*>(words.data());
  contacts->struct_bytes = sizeof(palpate_contacts);
  contacts->tool_state_bytes = sizeof(palpate_tool_state), contacts->node_bytes = sizeof(palpate_contact_node);
  contacts->nodes_offset = contacts->struct_bytes + PALPATE_MAX_TOOLS * contacts->tool_state_bytes;
  contacts->tool_count = PALPATE_MAX_TOOLS;
  contacts->node_count = kMostDatagramNodes;
  EXPECT_LE(tests::encoded(*contacts, {}).size(), kMostDatagramBytes);
  EXPECT_GT(tests::encoded(*contacts, {}).size() + kDatagramNodeBytes, kMostDatagramBytes);
}

TEST(ContactsOfADatagram, AreNotThoseOfANeedle) {
  SceneConfig scene;
  scene.tools.emplace_back();
  EXPECT_NO_THROW(check_deformation(scene));
  scene.tools[0].needle.emplace();
  EXPECT_THROW(check_deformation(scene), InputError);
}

}  // namespace
}  // namespace palpate
