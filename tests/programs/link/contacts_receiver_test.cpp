// The receiver draws what was sent last, although the network loses, repeats and reorders datagrams.
#include "programs/link/contacts_receiver.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "tests/programs/link/linked_scene.h"

namespace palpate {
namespace {

using tests::Bytes;
using Verdict = ContactsReceiver::Verdict;

class ContactsReceiving : public tests::LinkedScene {
 protected:
  void SetUp() override {
    LinkedScene::SetUp();
    feeling_ = std::make_unique<Player>(scene(), bundle(), Half::touch);
    drawing_ = std::make_unique<Player>(scene(), bundle(), Half::shape);
    identity_ = read_bundle_fields(bundle()).identity;
    sent_ = tests::datagrams_of(*feeling_, identity_, 1000);
    receiver_ = std::make_unique<ContactsReceiver>(datagram_limits(*drawing_, identity_));
    contacts_ = std::make_unique<tests::OwnContacts>(*drawing_);
  }

  Verdict take(const Bytes& bytes, double now = 0) { return receiver_->take(bytes, now, contacts_->get(), &note_); }

  std::unique_ptr<Player> feeling_, drawing_;
  std::uint64_t identity_ = 0;
  std::vector<Bytes> sent_;
  std::unique_ptr<ContactsReceiver> receiver_;
  std::unique_ptr<tests::OwnContacts> contacts_;
  DatagramNote note_;
};

// Two halves in two scenes, joined by datagrams, give the same bits as one scene.
TEST_F(ContactsReceiving, DrawsTheBitsThatOneProcessDraws) {
  for (const std::string effects : {"", "[effects]\nshape = \"volume\"\n", "[effects]\ncollision = \"deformed\"\n",
                                    "[effects]\ncontact = \"triangle\"\n"}) {
    const SceneConfig both = scene("both", effects);
    Player one(both, bundle()), feeling(both, bundle(), Half::touch), drawing(both, bundle(), Half::shape);
    const auto sent = tests::datagrams_of(feeling, identity_, 1);
    ContactsReceiver receiver(datagram_limits(drawing, identity_));
    tests::OwnContacts own(one), came(drawing);
    std::vector<float> rest;  // before the first contact
    float most = 0;
    for (std::size_t step = 0; step < sent.size(); ++step) {
      one.move_tools(static_cast<double>(step) / 1000);
      one.touch(1e-3, own.get(), own.bytes());
      ASSERT_EQ(receiver.take(sent[step], 0, came.get(), &note_), Verdict::fresh);
      const auto expected = tests::shape_of(one, own.get());
      ASSERT_EQ(tests::shape_of(drawing, came.get()), expected) << effects << step;
      if (step == 0) rest = expected;
      for (std::size_t i = 0; i < rest.size(); ++i) most = std::max(most, std::abs(expected[i] - rest[i]));
    }
    EXPECT_GT(most, 1e-3f);  // m: the shape is pressed in
  }
}

TEST_F(ContactsReceiving, KeepsTheNewestWhateverIsLostRepeatedOrReordered) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::mt19937 random(seed);
    std::vector<std::size_t> arrivals;
    std::set<std::size_t> came;
    for (std::size_t i = 0; i < sent_.size(); ++i) {
      if (random() % 10 < 3) continue;  // lost
      arrivals.push_back(i);
      if (random() % 10 < 2) arrivals.push_back(i);  // repeated
    }
    for (std::size_t i = 0; i + 5 < arrivals.size(); ++i)  // overtaken by up to five others
      if (random() % 10 < 3) std::swap(arrivals[i], arrivals[i + 1 + random() % 5]);

    ContactsReceiver receiver(datagram_limits(*drawing_, identity_));
    std::size_t newest = 0;
    std::uint64_t fresh = 0, repeated = 0;
    tests::OwnContacts slot(*drawing_);
    std::vector<float> drawn;
    for (std::size_t n = 0; n < arrivals.size(); ++n) {
      const std::size_t i = arrivals[n];
      const Verdict verdict = receiver.take(sent_[i], 0, slot.get(), &note_);
      const bool first_time = came.insert(i).second;
      ASSERT_EQ(verdict == Verdict::fresh, n == 0 || i > newest);
      repeated += !first_time;
      if (verdict != Verdict::fresh) continue;
      ++fresh;
      newest = i;
      drawn = tests::shape_of(*drawing_, slot.get());
    }
    const LinkCounts& counts = receiver.counts();
    EXPECT_EQ(counts.received, arrivals.size());
    EXPECT_EQ(counts.fresh, fresh);
    EXPECT_EQ(counts.repeated, repeated);
    EXPECT_EQ(counts.late, arrivals.size() - fresh - repeated);
    const std::size_t first = arrivals.front();
    const auto since_first = static_cast<std::size_t>(std::distance(came.lower_bound(first), came.end()));
    const std::size_t before_first = came.size() - since_first;  // came late, and were never counted as lost
    EXPECT_LE(counts.lost, newest - first + 1 - since_first);
    EXPECT_GE(counts.lost + before_first, newest - first + 1 - since_first);

    ASSERT_EQ(decode_contacts(sent_[newest], datagram_limits(*drawing_, identity_), contacts_->get(), &note_),
              DatagramFault::none);
    EXPECT_EQ(drawn, tests::shape_of(*drawing_, contacts_->get())) << "seed " << seed;
  }
}

TEST_F(ContactsReceiving, TakesARestartedSenderAtOnceAndNothingOfTheEndedSessionAfterIt) {
  const auto restarted = tests::datagrams_of(*feeling_, identity_, 1001);
  EXPECT_EQ(take(sent_[150]), Verdict::fresh);
  EXPECT_EQ(take(restarted[0]), Verdict::fresh);
  EXPECT_EQ(take(sent_[151]), Verdict::late);
  EXPECT_EQ(take(restarted[1]), Verdict::fresh);
  EXPECT_EQ(receiver_->counts().sessions, 2u);
  EXPECT_EQ(receiver_->counts().lost, 0u);
}

TEST_F(ContactsReceiving, TakesASenderWhoseClockWasSetBackAfterSilence) {
  const auto earlier = tests::datagrams_of(*feeling_, identity_, 999);
  const double after = 10 + ContactsReceiver::kForgetAfter;
  EXPECT_EQ(take(sent_[150], 10), Verdict::fresh);
  EXPECT_EQ(take(earlier[0], after), Verdict::late);
  EXPECT_EQ(take(earlier[1], after + 0.01), Verdict::fresh);
  EXPECT_EQ(take(earlier[2], after + 0.01), Verdict::fresh);
  EXPECT_EQ(receiver_->counts().sessions, 2u);
}

TEST_F(ContactsReceiving, CountsWhatItRefusesAndGoesOn) {
  Bytes damaged = sent_[0];
  damaged.back() ^= 1;
  EXPECT_EQ(take(damaged), Verdict::refused);
  EXPECT_EQ(receiver_->last_fault(), DatagramFault::checksum);
  EXPECT_EQ(take({}), Verdict::refused);
  EXPECT_EQ(take(sent_[0]), Verdict::fresh);
  EXPECT_EQ(receiver_->counts().refused[static_cast<int>(DatagramFault::checksum)], 1u);
  EXPECT_EQ(receiver_->counts().refused[static_cast<int>(DatagramFault::size)], 1u);
  EXPECT_EQ(receiver_->counts().received, 3u);
}

}  // namespace
}  // namespace palpate
