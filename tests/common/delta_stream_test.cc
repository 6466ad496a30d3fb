// A sender and receivers of a grown state, through losses, restarts and late starts.
#include "common/delta_stream.h"

#include <gtest/gtest.h>

#include <random>

#include "common/simulation.h"

namespace foresight {
namespace {

using Receiver = DeltaReceiver<map_delta_t, MapDelta>;

// Sends deltas of numbered points and knows the whole state.
class Sender : public Process {
 public:
  explicit Sender(Node& node)
      : sender_(node.advertise<map_delta_t>({.channel = "MAP_DELTA"}), node.now()) {}

  void send(int64_t epoch, int32_t points = 1) {
    if (epoch != epoch_) state_ = {};
    epoch_ = epoch;
    MapDelta delta;
    for (int32_t i = 0; i < points; ++i)
      delta.points_set.push_back({next_id_++, Eigen::Vector3f::Zero()});
    state_.points_set.insert(state_.points_set.end(), delta.points_set.begin(),
                             delta.points_set.end());
    sender_.send_delta(Time{1}, epoch, delta);
  }
  void send_snapshot() { sender_.send_snapshot(Time{1}, state_); }
  void restart(Time session) { sender_.restart(session); }
  const MapDelta& state() const { return state_; }

 private:
  DeltaSender<map_delta_t> sender_;
  MapDelta state_;
  int64_t epoch_ = 0;
  int32_t next_id_ = 0;
};

std::vector<int32_t> ids(const MapDelta& delta) {
  std::vector<int32_t> ids;
  for (const MapPoint& p : delta.points_set) ids.push_back(p.id);
  return ids;
}

class DeltaStream : public testing::Test {
 protected:
  DeltaStream() {
    world_.set_tap([this](Time, Domain, const std::string& channel, auto bytes) {
      if (channel != "MAP_DELTA") return;
      map_delta_t m;
      ASSERT_GT(m.decode(bytes.data(), 0, static_cast<int>(bytes.size())), 0);
      sent_.push_back(m);
    });
    add_sender();
  }
  void add_sender() {
    sender_ = &static_cast<Sender&>(
        world_.add("sender", {}, [](Node& node) { return std::make_unique<Sender>(node); }));
  }
  // What the next messages are to the receiver; applies them to state_.
  std::vector<Received> feed(Receiver* receiver) {
    std::vector<Received> results;
    for (const map_delta_t& m : std::exchange(sent_, {})) {
      results.push_back(receiver->receive(m));
      if (results.back() == Received::kSnapshot) state_ = {};
      if (results.back() == Received::kSnapshot || results.back() == Received::kDelta) {
        for (const MapPoint& p : receiver->take().points_set) state_.points_set.push_back(p);
      }
    }
    return results;
  }
  Simulation world_{Time{1'000'000}};
  Sender* sender_ = nullptr;
  std::vector<map_delta_t> sent_;
  MapDelta state_;
};

using enum Received;

TEST_F(DeltaStream, FollowsFromTheBeginning) {
  Receiver receiver;
  for (int i = 0; i < 3; ++i) sender_->send(7);
  EXPECT_EQ(feed(&receiver), (std::vector{kSnapshot, kDelta, kDelta}));
  EXPECT_EQ(ids(state_), ids(sender_->state()));
  EXPECT_EQ(receiver.epoch(), 7);
}

TEST_F(DeltaStream, ALateReceiverNeedsASnapshot) {
  Receiver receiver;
  sender_->send(7);
  sent_.clear();
  sender_->send(7);
  EXPECT_EQ(feed(&receiver), (std::vector{kGap}));
  EXPECT_FALSE(receiver.is_synchronised());
  sender_->send_snapshot();
  sender_->send(7);
  EXPECT_EQ(feed(&receiver), (std::vector{kSnapshot, kDelta}));
  EXPECT_EQ(ids(state_), ids(sender_->state()));
}

TEST_F(DeltaStream, AGapIsNoticedAndNothingAppliedUntilASnapshot) {
  Receiver receiver;
  for (int i = 0; i < 5; ++i) sender_->send(7);
  sent_.erase(sent_.begin() + 2);
  EXPECT_EQ(feed(&receiver), (std::vector{kSnapshot, kDelta, kGap, kGap}));
  EXPECT_EQ(ids(state_).size(), 2u);
  sender_->send_snapshot();
  EXPECT_EQ(feed(&receiver), (std::vector{kSnapshot}));
  EXPECT_EQ(ids(state_), ids(sender_->state()));
}

TEST_F(DeltaStream, DuplicatesAndSnapshotsForOthersAreIgnored) {
  Receiver receiver;
  sender_->send(7);
  sender_->send(7);
  sent_.push_back(sent_.back());
  sender_->send_snapshot();
  EXPECT_EQ(feed(&receiver), (std::vector{kSnapshot, kDelta, kIgnored, kIgnored}));
  EXPECT_EQ(ids(state_), ids(sender_->state()));
}

TEST_F(DeltaStream, ANewEpochBeginsAnew) {
  Receiver receiver;
  sender_->send(7);
  sender_->send(8);
  sender_->send(8);
  EXPECT_EQ(feed(&receiver), (std::vector{kSnapshot, kSnapshot, kDelta}));
  EXPECT_EQ(receiver.epoch(), 8);
  EXPECT_EQ(ids(state_), ids(sender_->state()));
}

TEST_F(DeltaStream, AReceiverThatMissedTheNewEpochNotices) {
  Receiver receiver;
  sender_->send(7);
  sender_->send(8);
  sender_->send(8);
  sent_.erase(sent_.begin() + 1);
  EXPECT_EQ(feed(&receiver), (std::vector{kSnapshot, kGap}));
}

TEST_F(DeltaStream, ARestartedSenderIsANewStreamEvenInTheSameEpoch) {
  Receiver receiver;
  sender_->send(7);
  sender_->send(7);
  feed(&receiver);
  world_.remove("sender");
  world_.run_until(Time{2'000'000});
  add_sender();
  sender_->send(7);
  sender_->send(7);
  EXPECT_EQ(feed(&receiver), (std::vector{kSnapshot, kDelta}));
  EXPECT_EQ(ids(state_), ids(sender_->state()));
}

TEST_F(DeltaStream, ARestartOfTheStreamIsASnapshot) {
  Receiver receiver;
  sender_->send(7);
  sender_->restart(Time{0});
  sender_->send(7);
  EXPECT_EQ(feed(&receiver), (std::vector{kSnapshot, kSnapshot}));
}

TEST_F(DeltaStream, LargeDeltasComeInParts) {
  Receiver receiver;
  sender_->send(7, 60'000);  // 16 bytes each: three parts
  ASSERT_EQ(sent_.size(), 3u);
  sender_->send(7);
  EXPECT_EQ(feed(&receiver), (std::vector{kIncomplete, kIncomplete, kSnapshot, kDelta}));
  EXPECT_EQ(ids(state_), ids(sender_->state()));
}

TEST_F(DeltaStream, AMissingPartIsAGap) {
  for (size_t lost = 0; lost < 3; ++lost) {
    Receiver receiver;
    sent_.clear();
    state_ = {};
    sender_->send(8 + static_cast<int64_t>(lost), 60'000);
    sender_->send(8 + static_cast<int64_t>(lost));
    sent_.erase(sent_.begin() + static_cast<long>(lost));
    const auto results = feed(&receiver);
    EXPECT_EQ(results.back(), kGap) << lost;
    EXPECT_TRUE(ids(state_).empty()) << lost;
    sender_->send_snapshot();
    EXPECT_EQ(feed(&receiver).back(), kSnapshot) << lost;
    EXPECT_EQ(ids(state_), ids(sender_->state()));
  }
}

TEST_F(DeltaStream, ABadPartIsRefused) {
  Receiver receiver;
  sender_->send(7);
  for (const auto& [part, count] : {std::pair{-1, 1}, {1, 1}, {0, 0}, {5, 2}}) {
    map_delta_t bad = sent_.front();
    bad.header.part = part;
    bad.header.part_count = count;
    EXPECT_EQ(receiver.receive(bad), kBad);
  }
  map_delta_t bad = sent_.front();
  bad.point_ids[0] = -3;
  EXPECT_EQ(receiver.receive(bad), kBad);
  EXPECT_EQ(feed(&receiver), (std::vector{kSnapshot}));
}

// Whatever is lost, repeated or restarted, a receiver that asks for a snapshot after each gap never
// holds a wrong state and is up to date after the next snapshot.
TEST_F(DeltaStream, EndsUpRightAfterRandomLosses) {
  std::mt19937 random(9);
  Receiver receiver;
  int64_t epoch = 1;
  for (int i = 0; i < 3000; ++i) {
    if (random() % 100 == 0) ++epoch;
    sender_->send(epoch, random() % 200 == 0 ? 30'000 : 1);
    if (random() % 10 == 0) sender_->send_snapshot();
    std::erase_if(sent_, [&](const auto&) { return random() % 12 == 0; });
    const auto results = feed(&receiver);
    const bool complete = !results.empty() && receiver.is_synchronised() &&
                          (results.back() == kDelta || results.back() == kSnapshot);
    if (complete) {
      const std::vector<int32_t> have = ids(state_), want = ids(sender_->state());
      // The last delta itself may have been lost; what is there is a prefix, without a hole.
      ASSERT_LE(have.size(), want.size() + 30'000);
      if (receiver.epoch() == epoch) {
        ASSERT_TRUE(std::equal(have.begin(), have.end(), want.begin())) << "at step " << i;
      }
    }
  }
  sent_.clear();
  sender_->send_snapshot();
  feed(&receiver);
  EXPECT_EQ(ids(state_), ids(sender_->state()));
}

class Asker : public Process {
 public:
  explicit Asker(Node& node) : requester(node, "MAP_DELTA", Domain::kRobot) {}
  SnapshotRequester requester;
};

TEST(SnapshotRequester, AsksEverySecondUntilSatisfied) {
  Simulation world(Time{0});
  int requests = 0;
  world.set_tap([&](Time, Domain, const std::string& channel, auto) {
    requests += channel == "SNAPSHOT_REQUEST" ? 1 : 0;
  });
  auto& asker = static_cast<Asker&>(
      world.add("asker", {}, [](Node& node) { return std::make_unique<Asker>(node); }));
  world.run_until(Time{3'500'000});
  EXPECT_EQ(requests, 3) << "a receiver starts late and asks by itself";
  asker.requester.satisfied();
  world.run_until(Time{6'000'000});
  EXPECT_EQ(requests, 3);
  asker.requester.want();
  asker.requester.want();
  EXPECT_EQ(requests, 4) << "at once, but once";
  world.run_until(Time{7'500'000});
  EXPECT_EQ(requests, 5);
}

}  // namespace
}  // namespace foresight
