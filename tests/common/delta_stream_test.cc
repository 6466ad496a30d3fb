// A sender and receivers of a grown state, through losses, restarts and late starts.
#include <gtest/gtest.h>

#include <random>

#include "common/delta_input.h"
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
    for (int32_t i = 0; i < points; ++i) {
      delta.points_set.push_back({PointId(next_id_++), Eigen::Vector3f::Zero()});
    }
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
  for (const MapPoint& p : delta.points_set) ids.push_back(p.id.value());
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
      results.push_back(receiver->receive(m, world_.now()));
      apply(receiver);
    }
    return results;
  }
  void apply(Receiver* receiver) {
    for (const auto& step : receiver->take()) {
      if (step.is_snapshot) state_ = {};
      for (const MapPoint& p : step.delta.points_set) state_.points_set.push_back(p);
    }
  }
  // What a forger makes of a message that he has seen: that of another stream, say.
  template <class Change>
  static map_delta_t forged(map_delta_t message, const Change& change) {
    change(&message);
    return message;
  }
  void wait(Duration d) { world_.run_until(world_.now() + d); }
  Simulation world_{Time{1'000'000}};
  Sender* sender_ = nullptr;
  std::vector<map_delta_t> sent_;
  MapDelta state_;
};

using enum Received;

// The sender has just answered somebody, so he may answer at the end of the interval.
constexpr Duration kLongestDoubt = kSnapshotInterval + Receiver::kAnswer;

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

TEST_F(DeltaStream, ANewEpochIsTakenAQuarterOfASecondAfterTheOldOneDidNotAnswer) {
  Receiver receiver;
  sender_->send(7);
  feed(&receiver);
  wait(seconds(2));
  sender_->send(8);
  sender_->send(8);
  EXPECT_EQ(feed(&receiver), (std::vector{kHeld, kHeld}));
  EXPECT_TRUE(receiver.wants_snapshot());
  EXPECT_EQ(receiver.deadline(), world_.now() + milliseconds(250));
  wait(milliseconds(249));
  receiver.settle(world_.now());
  EXPECT_EQ(receiver.epoch(), 7);
  wait(milliseconds(1));
  receiver.settle(world_.now());
  apply(&receiver);
  EXPECT_EQ(receiver.epoch(), 8);
  EXPECT_FALSE(receiver.wants_snapshot());
  sender_->send(8);
  EXPECT_EQ(feed(&receiver), (std::vector{kDelta}));
  EXPECT_EQ(ids(state_), ids(sender_->state()));
}

TEST_F(DeltaStream, AReceiverThatMissedTheNewEpochNotices) {
  Receiver receiver;
  sender_->send(7);
  sender_->send(8);
  sender_->send(8);
  sent_.erase(sent_.begin() + 1);
  EXPECT_EQ(feed(&receiver), (std::vector{kSnapshot, kGap}));
  EXPECT_TRUE(receiver.wants_snapshot());
  sender_->send_snapshot();
  EXPECT_EQ(feed(&receiver), (std::vector{kHeld}));
  wait(kLongestDoubt);
  receiver.settle(world_.now());
  apply(&receiver);
  EXPECT_EQ(ids(state_), ids(sender_->state()));
}

TEST_F(DeltaStream, ARestartedSenderIsANewStreamEvenInTheSameEpoch) {
  Receiver receiver;
  sender_->send(7);
  sender_->send(7);
  feed(&receiver);
  world_.remove("sender");
  wait(seconds(1));
  add_sender();
  sender_->send(7);
  EXPECT_EQ(feed(&receiver), (std::vector{kHeld}));
  wait(seconds(1));
  sender_->send(7);
  EXPECT_EQ(feed(&receiver), (std::vector{kDelta}));
  EXPECT_EQ(ids(state_), ids(sender_->state()));
}

// One message with an absurd epoch ended the stream for good: every later one was "older".
TEST_F(DeltaStream, AForgedEpochChangesNothingWhileTheStreamKeepsComing) {
  Receiver receiver;
  sender_->send(7);
  sender_->send(7);
  const map_delta_t first = sent_[0], second = sent_[1];
  feed(&receiver);
  for (int i = 0; i < 300; ++i) {
    // A whole forged stream, of a new name each time or always of the same, and a lone delta.
    const int64_t epoch = i % 2 == 0 ? 9'000'000'000'000 + i : 5;
    const auto rename = [&](map_delta_t* m) { m->header.epoch = epoch; };
    sent_ = {forged(first, rename), forged(second, rename)};
    if (i % 3 == 0) sent_.erase(sent_.begin());
    feed(&receiver);
    EXPECT_TRUE(receiver.wants_snapshot());
    wait(milliseconds(50));
    receiver.settle(world_.now());
    apply(&receiver);
    // Its sender answers twice a second, and has something new now and then.
    if (i % 10 == 0) sender_->send_snapshot();
    if (i % 7 == 0) sender_->send(7);
    feed(&receiver);
    ASSERT_EQ(receiver.epoch(), 7) << i;
    ASSERT_EQ(ids(state_), ids(sender_->state())) << i;
  }
}

TEST_F(DeltaStream, AForgedStreamThatTookOverLosesToTheOneThatKeepsComing) {
  Receiver receiver;
  sender_->send(7);
  const map_delta_t first = sent_[0];
  feed(&receiver);
  wait(seconds(2));
  sent_ = {forged(first, [](map_delta_t* m) { m->header.epoch = 9'000'000'000'000; })};
  feed(&receiver);
  wait(seconds(1));  // and nobody answers
  receiver.settle(world_.now());
  apply(&receiver);
  ASSERT_EQ(receiver.epoch(), 9'000'000'000'000);
  sender_->send(7);
  feed(&receiver);
  EXPECT_TRUE(receiver.wants_snapshot());
  sender_->send_snapshot();
  feed(&receiver);
  wait(kLongestDoubt);
  receiver.settle(world_.now());
  apply(&receiver);
  EXPECT_EQ(receiver.epoch(), 7);
  EXPECT_EQ(ids(state_), ids(sender_->state()));
}

// Numbers of the present stream itself: far ahead (in a delta, in a snapshot), far behind, or the
// next one with other contents.
TEST_F(DeltaStream, AForgedNumberIsRepairedByTheNextSnapshot) {
  const auto number = [](int32_t seq, int8_t is_snapshot) {
    return [=](map_delta_t* m) {
      m->header.seq = seq;
      m->header.is_snapshot = is_snapshot;
      m->point_ids[0] = 4711;
    };
  };
  for (const int32_t seq : {0, 1, 2, 3, 4, 1000, INT32_MAX}) {
    for (const int8_t is_snapshot : {0, 1}) {
      Receiver receiver;
      sender_->send(100 + seq % 50 + is_snapshot);  // an epoch of its own
      sender_->send(100 + seq % 50 + is_snapshot);
      sender_->send(100 + seq % 50 + is_snapshot);
      const map_delta_t second = sent_[1];
      feed(&receiver);
      sent_ = {forged(second, number(seq, is_snapshot))};
      feed(&receiver);
      for (int i = 0; i < 4; ++i) {
        wait(milliseconds(500));
        receiver.settle(world_.now());
        apply(&receiver);
        if (i == 1) sender_->send(100 + seq % 50 + is_snapshot);
        feed(&receiver);
        if (receiver.wants_snapshot()) sender_->send_snapshot();
        feed(&receiver);
      }
      EXPECT_EQ(ids(state_), ids(sender_->state())) << seq << " " << int{is_snapshot};
      EXPECT_FALSE(receiver.wants_snapshot()) << seq << " " << int{is_snapshot};
    }
  }
}

TEST_F(DeltaStream, ARefusedDeltaMayStillComeRight) {
  Receiver receiver;
  sender_->send(7);
  feed(&receiver);
  sender_->send(7);
  const map_delta_t genuine = sent_[0];
  EXPECT_EQ(
      receiver.receive(forged(genuine, [](map_delta_t* m) { m->point_ids[0] = 99; }), world_.now()),
      kDelta);
  receiver.refuse(receiver.take().at(0));
  EXPECT_TRUE(receiver.wants_snapshot());
  EXPECT_EQ(feed(&receiver), (std::vector{kDelta}));
  EXPECT_FALSE(receiver.wants_snapshot());
  EXPECT_EQ(ids(state_), ids(sender_->state()));
}

TEST_F(DeltaStream, PartsWithoutEndFillNoMemory) {
  Receiver receiver;
  sender_->send(7);
  map_delta_t endless = sent_[0];
  endless.header.part_count = INT32_MAX;
  EXPECT_EQ(receiver.receive(endless, world_.now()), kBad);
}

TEST_F(DeltaStream, ARestartOfTheStreamIsASnapshot) {
  Receiver receiver;
  sender_->send(7);
  sender_->restart(Time{0});
  sender_->send(7);
  EXPECT_EQ(feed(&receiver), (std::vector{kSnapshot, kHeld}));
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
    Receiver receiver;  // knows no stream
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
    EXPECT_EQ(receiver.receive(bad, world_.now()), kBad);
  }
  map_delta_t bad = sent_.front();
  bad.point_ids[0] = -3;
  EXPECT_EQ(receiver.receive(bad, world_.now()), kBad);
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
    wait(milliseconds(100));
    receiver.settle(world_.now());
    apply(&receiver);
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
  wait(kLongestDoubt);
  receiver.settle(world_.now());
  apply(&receiver);
  EXPECT_EQ(ids(state_), ids(sender_->state()));
}

class Asker : public Process {
 public:
  explicit Asker(Node& node) : requester(node, "MAP_DELTA", Domain::kRobot) {}
  SnapshotRequester requester;
};

TEST(SnapshotRequester, AsksEveryHalfSecondUntilSatisfied) {
  Simulation world(Time{0});
  int requests = 0;
  world.set_tap([&](Time, Domain, const std::string& channel, auto) {
    requests += channel == "SNAPSHOT_REQUEST" ? 1 : 0;
  });
  auto& asker = static_cast<Asker&>(
      world.add("asker", {}, [](Node& node) { return std::make_unique<Asker>(node); }));
  EXPECT_EQ(requests, 0) << "not before it runs";
  world.run_until(Time{1'000});
  EXPECT_EQ(requests, 1) << "a receiver starts late and asks by itself, at once";
  world.run_until(Time{1'250'000});
  EXPECT_EQ(requests, 3);
  asker.requester.satisfied();
  world.run_until(Time{6'000'000});
  EXPECT_EQ(requests, 3);
  asker.requester.want();
  asker.requester.want();
  EXPECT_EQ(requests, 4) << "at once, but once";
  world.run_until(Time{6'750'000});
  EXPECT_EQ(requests, 5);
}

class Responder : public Process {
 public:
  explicit Responder(Node& node) : responder(node, "MAP_DELTA", "", [this] { ++answers; }) {}
  int answers = 0;
  SnapshotResponder responder;
};

TEST(SnapshotResponder, AFloodOfRequestsIsAnsweredTwiceASecond) {
  Simulation world(Time{0});
  auto& responder = static_cast<Responder&>(
      world.add("responder", {}, [](Node& node) { return std::make_unique<Responder>(node); }));
  snapshot_request_t request{};
  request.channel = "MAP_DELTA";
  for (int i = 0; i < 4000; ++i) {
    world.inject(Time{1000 * i}, Domain::kRobot, "SNAPSHOT_REQUEST", encode(request));
  }
  world.run_until(Time{0});
  EXPECT_EQ(responder.answers, 1) << "at once";
  world.run_until(Time{3'999'999});
  EXPECT_EQ(responder.answers, 8);
  world.run_until(Time{10'000'000});
  EXPECT_EQ(responder.answers, 9) << "who asked last is served too";
}

}  // namespace
}  // namespace foresight
