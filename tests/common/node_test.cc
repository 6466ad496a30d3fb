// What a process gets from its node: validated messages, counters, health.
#include "common/node.h"

#include <gtest/gtest.h>

#include "common/simulation.h"
#include "foresight/base_pose_t.hpp"
#include "foresight/image_t.hpp"
#include "foresight/slam_command_t.hpp"

namespace foresight {
namespace {

class Listener : public Process {
 public:
  explicit Listener(Node& its_node) : node(its_node) {
    images = its_node.subscribe<image_t>({.channel = "IMAGE"}, Queue::kAll,
                                         [this](const image_t& m) { received.push_back(m.utime); });
    its_node.subscribe<base_pose_t>({.channel = "BASE_POSE"}, Queue::kAll,
                                    [this](const base_pose_t& m) { received.push_back(m.utime); });
  }
  Node& node;
  Input images;
  std::vector<int64_t> received;
};

class NodeTest : public testing::Test {
 protected:
  NodeTest() {
    world_.listen(Domain::kRobot, "HEALTH", [this](auto bytes) {
      ASSERT_GT(health_.decode(bytes.data(), 0, static_cast<int>(bytes.size())), 0);
      ++health_count_;
    });
    listener_ = &static_cast<Listener&>(world_.add(
        "listener", {Domain::kRobot}, [](Node& n) { return std::make_unique<Listener>(n); }));
  }
  void send(std::vector<uint8_t> bytes) {
    world_.inject(world_.now(), Domain::kRobot, "IMAGE", std::move(bytes));
  }
  /// Of a stream whose stamps the node judges.
  void send_base(int64_t utime) {
    base_pose_t base{};
    base.utime = utime;
    world_.inject(world_.now(), Domain::kRobot, "BASE_POSE", encode(base));
  }
  void run_for(Duration d) { world_.run_until(world_.now() + d); }
  const port_health_t& port(const std::string& channel) {
    for (const port_health_t& p : health_.ports) {
      if (p.channel == channel) return p;
    }
    ADD_FAILURE() << "no port " << channel;
    return health_.ports.at(0);
  }
  static image_t make_image(int64_t utime) {
    image_t image{};
    image.utime = utime;
    return image;
  }
  Simulation world_{Time{1'000'000}};
  Listener* listener_ = nullptr;
  health_t health_{};
  int health_count_ = 0;
};

TEST_F(NodeTest, HandsOnValidMessagesAndCountsThem) {
  for (int i = 0; i < 5; ++i) send(encode(make_image(world_.now().us - 20'000)));
  run_for(seconds(1));
  EXPECT_EQ(listener_->received.size(), 5u);
  EXPECT_EQ(port("IMAGE").messages, 5);
  EXPECT_NEAR(port("IMAGE").rate_hz, 5, 0.01);
  EXPECT_NEAR(port("IMAGE").worst_latency_ms, 20, 1e-3);
  EXPECT_GT(port("IMAGE").bytes_per_s, 100);
  run_for(seconds(1));
  EXPECT_EQ(port("IMAGE").rate_hz, 0);
  EXPECT_EQ(port("IMAGE").worst_latency_ms, 0) << "of no meaning: rate_hz is 0";
}

// A negative one was published as -1, which meant that nothing had arrived.
TEST_F(NodeTest, PublishesANegativeLatencyAsItIs) {
  for (int i = 0; i < 5; ++i) {
    send(encode(make_image(world_.now().us + 2'726'000)));
    run_for(milliseconds(100));
  }
  run_for(milliseconds(500));
  EXPECT_EQ(listener_->received.size(), 5u) << "a sender whose clock is ahead is heard";
  EXPECT_NEAR(port("IMAGE").worst_latency_ms, -2726, 1e-3);
  EXPECT_GT(port("IMAGE").rate_hz, 0);
}

TEST_F(NodeTest, RefusesAStampInTheFutureThatInterruptsAStream) {
  int64_t sent = 0;
  for (int i = 0; i < 90; ++i) {
    send_base(world_.now().us);
    ++sent;
    if (i % 3 == 1) send_base(world_.now().us + 1'000'000 * int64_t{i * i});
    run_for(milliseconds(33));
  }
  // Of the forged ones only that of one second (i = 1) is no more than clocks may differ.
  EXPECT_EQ(static_cast<int64_t>(listener_->received.size()), sent + 1);
  run_for(seconds(1));
  EXPECT_EQ(port("BASE_POSE").rejected, 29);
}

TEST_F(NodeTest, AStreamThatIsStampedInTheFutureIsTakenOnceNothingElseComes) {
  send_base(world_.now().us);
  const auto forged = [&] { return world_.now().us + 40'000'000; };
  send_base(forged());
  run_for(milliseconds(900));
  send_base(forged());
  EXPECT_EQ(listener_->received.size(), 1u);
  run_for(milliseconds(200));
  for (int i = 0; i < 5; ++i) {
    send_base(forged());
    run_for(milliseconds(100));
  }
  EXPECT_EQ(listener_->received.size(), 6u);
  send_base(world_.now().us);
  send_base(forged());
  run_for(milliseconds(1));
  EXPECT_EQ(listener_->received.size(), 7u) << "the present takes over at once";
}

TEST_F(NodeTest, ARecordingWithItsOwnStampsMayHaveGaps) {
  for (const double ahead_s : {1e6, 1e6 + 0.1, 1e6 + 40, 1e6 + 40.1}) {
    send_base(world_.now().us + static_cast<int64_t>(1e6 * ahead_s));
    run_for(milliseconds(33));
  }
  EXPECT_EQ(listener_->received.size(), 4u);
}

// slam tells a camera's set clock from a forgery: no image is dropped before it can.
TEST_F(NodeTest, LeavesTheStampsOfImagesToSlam) {
  send(encode(make_image(world_.now().us)));
  send(encode(make_image(world_.now().us + 40'000'000)));
  run_for(milliseconds(1));
  EXPECT_EQ(listener_->received.size(), 2u);
}

TEST_F(NodeTest, RefusesInstantsOfNoAge) {
  for (const int64_t utime : {INT64_MAX, INT64_MIN, INT64_C(9'000'000'000'000'000'000)}) {
    send(encode(make_image(utime)));
  }
  run_for(seconds(1));
  EXPECT_TRUE(listener_->received.empty());
  EXPECT_EQ(port("IMAGE").rejected, 3);
}

TEST_F(NodeTest, APortOnWhichMostIsRejectedDegradesTheProcess) {
  listener_->node.set_state(ProcessState::kOk, "");
  const auto run_second = [&](int good, int bad) {
    for (int i = 0; i < good; ++i) send(encode(make_image(world_.now().us)));
    for (int i = 0; i < bad; ++i) send({1, 2, 3});
    run_for(seconds(1));
  };
  run_second(30, 30);
  EXPECT_EQ(health_.state, +health_t::STATE_OK) << "a stranger's share is counted, no more";
  run_second(0, 30);
  EXPECT_EQ(health_.state, +health_t::STATE_DEGRADED);
  EXPECT_EQ(health_.reason, "IMAGE: 60 of 90 rejected: is not a image_t");
  EXPECT_EQ(port("IMAGE").rejected, 60);
  run_second(30, 0);
  run_second(30, 0);
  EXPECT_EQ(health_.state, +health_t::STATE_OK);
  EXPECT_EQ(health_.reason, "");
}

TEST_F(NodeTest, CountsFramesThatNeverArrived) {
  image_t image{};
  for (const int32_t number : {0, 1, 2, 5, 6, 8, 7, 9, 9, 1'000'000'000, 20, 21, 0, 1}) {
    image.frame_number = number;
    image.utime = world_.now().us;
    send(encode(image));
    run_for(milliseconds(1));
  }
  run_for(seconds(1));
  EXPECT_EQ(port("IMAGE").lost, 2) << "3 and 4; 7 came late, and nobody loses a billion";
}

TEST_F(NodeTest, HealthIsUtf8OfOneLine) {
  listener_->node.set_state(ProcessState::kDegraded,
                            "Stra\xdf"
                            "e\n\x1b[2J \u00e4 \xf0\x9f");
  listener_->node.set_metric("m\xff", 1);
  run_for(seconds(1));
  EXPECT_EQ(health_.reason, "Stra\ufffde  [2J \u00e4 \ufffd\ufffd");
  EXPECT_EQ(health_.metric_names[0], "m\ufffd");
  listener_->node.set_state(ProcessState::kOk, std::string(100'000, 'x'));
  run_for(seconds(1));
  EXPECT_LE(health_.reason.size(), 1000u);
}

// Subscribes one channel in both domains, as the renderer does, and refuses some time later.
class BothSides : public Process {
 public:
  explicit BothSides(Node& node) {
    for (const Domain domain : {Domain::kOperator, Domain::kRobot}) {
      Input& input = inputs_[static_cast<size_t>(domain)];
      input = node.subscribe<image_t>(
          {.channel = "VIEW", .domain = domain}, Queue::kAll, [&node, &input](const image_t&) {
            node.at(node.now() + milliseconds(5), [&input] { input.reject("is damaged"); });
          });
    }
  }

 private:
  std::array<Input, 2> inputs_;
};

TEST(Node, CountsARejectionOnThePortOfItsDomain) {
  Simulation world(Time{1'000'000});
  world.add("both", {}, [](Node& n) { return std::make_unique<BothSides>(n); });
  image_t image{};
  image.utime = world.now().us;
  world.inject(world.now(), Domain::kRobot, "VIEW", encode(image));
  world.run_until(world.now() + milliseconds(10));
  const auto rejected = [&](Domain domain) {
    for (const PortRecord& port : world.node("both").ports()) {
      if (port.is_input && port.spec.domain == domain) return port.rejected;
    }
    return int64_t{-1};
  };
  EXPECT_EQ(rejected(Domain::kRobot), 1);
  EXPECT_EQ(rejected(Domain::kOperator), 0);
}

TEST_F(NodeTest, RejectsTruncatedOversizedAndForeignMessagesAndGoesOn) {
  const std::vector<uint8_t> good = encode(make_image(1'000'000));
  send({});
  send({1, 2, 3});
  send({good.begin(), good.end() - 1});
  std::vector<uint8_t> longer = good;
  longer.push_back(0);
  send(longer);
  send(encode(slam_command_t{}));
  send(good);
  run_for(seconds(1));
  EXPECT_EQ(listener_->received.size(), 1u);
  EXPECT_EQ(port("IMAGE").rejected, 5);
  EXPECT_EQ(port("IMAGE").messages, 1);
}

TEST_F(NodeTest, CountsWhatTheProcessItselfRejects) {
  listener_->images.reject("not of this world");
  run_for(seconds(1));
  EXPECT_EQ(port("IMAGE").rejected, 1);
}

TEST_F(NodeTest, ReportsAtOnceThenOncePerSecondAndWhenTheStateChanges) {
  run_for(milliseconds(1));
  EXPECT_EQ(health_count_, 1);
  run_for(seconds(2.5));
  EXPECT_EQ(health_count_, 3);
  EXPECT_EQ(health_.state, +health_t::STATE_STARTING);
  listener_->node.set_state(ProcessState::kWaiting, "no IMAGE arrives");
  run_for(milliseconds(1));
  EXPECT_EQ(health_count_, 4);
  EXPECT_EQ(health_.reason, "no IMAGE arrives");
  listener_->node.set_state(ProcessState::kWaiting, "still none");
  run_for(milliseconds(1));
  EXPECT_EQ(health_count_, 4) << "a new reason waits for the next second";
  run_for(seconds(1));
  EXPECT_EQ(health_.reason, "still none");
}

TEST_F(NodeTest, HealthCarriesMetricsAndNoFigureOfTheMachine) {
  listener_->node.set_metric("keyframes", 12);
  listener_->node.set_metric("keyframes", 13);
  run_for(seconds(1));
  EXPECT_EQ(health_.metric_names, std::vector<std::string>{"keyframes"});
  EXPECT_EQ(health_.metric_values, std::vector<double>{13});
  EXPECT_EQ(health_.process, "listener");
  EXPECT_EQ(health_.pid, 0);
  EXPECT_EQ(health_.cpu_share, 0);
  EXPECT_EQ(health_.memory_mb, 0);
}

TEST_F(NodeTest, RunsOneJobAtATimeAndAppliesItsResultAfterItsCost) {
  Node& node = listener_->node;
  Time applied{0};
  EXPECT_TRUE(
      node.run_beside([&]() -> std::function<void()> { return [&] { applied = world_.now(); }; },
                      milliseconds(100)));
  EXPECT_TRUE(node.job_running());
  EXPECT_FALSE(node.run_beside([]() -> std::function<void()> { return [] {}; }, seconds(1)));
  const Time begin = world_.now();
  run_for(seconds(1));
  EXPECT_EQ(applied - begin, milliseconds(100));
  EXPECT_FALSE(node.job_running());
}

using NodeDeathTest = NodeTest;

TEST_F(NodeDeathTest, AHandlerThatThrowsIsABug) {
  listener_->node.subscribe<slam_command_t>(
      {.channel = "SLAM_COMMAND"}, Queue::kAll,
      [](const slam_command_t&) { throw std::runtime_error("oops"); });
  world_.inject(world_.now(), Domain::kRobot, "SLAM_COMMAND", encode(slam_command_t{}));
  EXPECT_EXIT(run_for(seconds(1)), testing::ExitedWithCode(70), "oops");
}

}  // namespace
}  // namespace foresight
