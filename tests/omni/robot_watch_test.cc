#include "procs/omni/robot_watch.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

namespace foresight {
namespace {

constexpr int64_t kOurs = 77, kOther = 99;

// Messages as they arrive; the robot's clock runs an hour ahead, as nothing compares the clocks.
class RobotWatchTest : public testing::Test {
 protected:
  RobotWatchTest() { robot_.begin_session(kOurs); }
  Time robot_time(double ago_s) const { return now_ + seconds(3600 - ago_s); }
  void joints(double ago_s = 0.15, Time command_time = {}) {
    robot_.on_joints(now_, robot_time(ago_s), command_time, round_trip_);
  }
  void report(ArmState state, int64_t driver = 0, double ago_s = 0.15, bool needs_release = false) {
    robot_.on_report(now_, {.time = robot_time(ago_s),
                            .state = state,
                            .reason = "its reason",
                            .driver_session = driver,
                            .needs_release = needs_release});
  }
  /// Time passes; the robot goes on saying where it is.
  void pass(double span_s) {
    for (double t = 0; t < span_s - 1e-9; t += 0.05) {
      now_ = now_ + seconds(0.05);
      joints();
      if (repeat_) repeat_();
      robot_.on_command(now_, now_, engaged_);
    }
  }
  void be_ready() {
    joints();
    report(ArmState::kHolding);
    repeat_ = [this] { report(ArmState::kHolding); };
  }
  void engage(bool engaged) {
    engaged_ = engaged;
    robot_.on_command(now_, now_, engaged);
    stamp_ = now_;
  }
  std::string obstacle() const { return robot_.obstacle(now_); }

  RobotWatch robot_{{}, 4};
  std::optional<Duration> round_trip_ = seconds(0.3);
  std::function<void()> repeat_;
  bool engaged_ = false;
  Time now_{100'000'000}, stamp_;
};

TEST_F(RobotWatchTest, SaysWhatIsMissingInOrder) {
  EXPECT_EQ(obstacle(), "cannot engage: no JOINT_STATE");
  joints();
  EXPECT_EQ(obstacle(), "cannot engage: no CONTROLLER_STATE");
  report(ArmState::kHolding);
  EXPECT_EQ(obstacle(), "");
  now_ = now_ + seconds(1.1);
  EXPECT_EQ(obstacle(), "cannot engage: no JOINT_STATE");
  joints();
  EXPECT_EQ(obstacle(), "cannot engage: no CONTROLLER_STATE");
}

TEST_F(RobotWatchTest, NamesAnArmWithOtherJoints) {
  be_ready();
  robot_.on_other_arm(now_, 7);
  EXPECT_NE(obstacle().find("has 7 joints"), std::string::npos) << obstacle();
  EXPECT_NE(obstacle().find("has 4"), std::string::npos) << obstacle();
  pass(1.1);
  EXPECT_EQ(obstacle(), "") << "gone";
}

TEST_F(RobotWatchTest, GivesTheControllersWords) {
  joints();
  report(ArmState::kIdle);
  EXPECT_EQ(obstacle(), "the arm is idle: its reason");
  report(ArmState::kFault);
  EXPECT_EQ(obstacle(), "the arm has a fault: its reason");
  report(ArmState::kFollowing, kOther);
  EXPECT_EQ(obstacle(), "another operator drives (session 99)");
  report(ArmState::kFollowing, kOurs);
  EXPECT_EQ(obstacle(), "");
  report(ArmState::kHolding, 0, 0.15, true);
  EXPECT_EQ(obstacle(), "the arm waits for the clutch to be let go: its reason");
  report(static_cast<ArmState>(77));
  EXPECT_NE(obstacle(), "");
}

TEST_F(RobotWatchTest, AnEngagementIsGivenItsRoundTrip) {
  be_ready();
  engage(true);
  pass(0.3);
  EXPECT_EQ(obstacle(), "") << "what the robot said before it knew is no answer";
  EXPECT_FALSE(robot_.is_followed());
  joints(0.15, stamp_);
  report(ArmState::kFollowing, kOurs);
  EXPECT_TRUE(robot_.is_followed());
  repeat_ = [this] { report(ArmState::kFollowing, kOurs); };
  pass(60);
  EXPECT_EQ(obstacle(), "");
}

TEST_F(RobotWatchTest, AnythingButFollowingEndsAnEngagementThatWasFollowed) {
  for (const ArmState state : {ArmState::kHolding, ArmState::kStopping}) {
    be_ready();
    engage(true);
    joints(0.15, stamp_);
    report(ArmState::kFollowing, kOurs);
    report(state, kOurs, 0.1);
    EXPECT_EQ(obstacle(), "the arm does not follow: its reason");
    engage(false);
    EXPECT_EQ(obstacle(), "") << "one may engage again";
    now_ = now_ + seconds(1.0);
  }
}

// Let go and pressed again within the round trip: the states of the first engagement and of its end
// arrive during the second one.
TEST_F(RobotWatchTest, AQuickSecondPressIsNotEndedByTheEndOfTheFirst) {
  be_ready();
  engage(true);
  const Time first = stamp_;
  pass(0.3);
  joints(0.15, first);
  report(ArmState::kFollowing, kOurs);
  engage(false);
  pass(0.1);
  engage(true);
  repeat_ = nullptr;
  joints(0.15, first);
  report(ArmState::kFollowing, kOurs);
  pass(0.05);
  report(ArmState::kStopping);
  EXPECT_EQ(obstacle(), "");
  pass(0.1);
  report(ArmState::kHolding);
  EXPECT_EQ(obstacle(), "");
  joints(0.15, stamp_);
  report(ArmState::kFollowing, kOurs);
  EXPECT_TRUE(robot_.is_followed());
}

TEST_F(RobotWatchTest, AnEngagementThatIsNotFollowedEnds) {
  be_ready();
  engage(true);
  pass(1);
  EXPECT_EQ(obstacle(), "");
  pass(0.2);
  EXPECT_EQ(obstacle(), "the arm does not follow: its reason") << "2 x 0.3 s + 0.5 s";
  engage(false);
  EXPECT_EQ(robot_.complaint(), "the arm has not followed: its reason");
  engage(true);
  joints(0.15, stamp_);
  report(ArmState::kFollowing, kOurs, 0.1);
  EXPECT_EQ(robot_.complaint(), "");
}

TEST_F(RobotWatchTest, WithoutARoundTripItWaitsForTheLongestOne) {
  round_trip_.reset();
  be_ready();
  engage(true);
  pass(4.9);
  EXPECT_EQ(obstacle(), "");
  pass(0.2);
  EXPECT_NE(obstacle(), "");
}

TEST_F(RobotWatchTest, SilenceEndsAnEngagement) {
  be_ready();
  engage(true);
  joints(0.15, stamp_);
  report(ArmState::kFollowing, kOurs);
  now_ = now_ + seconds(1.01);
  EXPECT_EQ(obstacle(), "cannot engage: no JOINT_STATE");
}

TEST_F(RobotWatchTest, OldReportsAreNoNews) {
  be_ready();
  report(ArmState::kIdle, 0, 5);
  EXPECT_EQ(obstacle(), "");
}

TEST_F(RobotWatchTest, AStampFromTheFutureDoesNotShutOutWhatFollows) {
  be_ready();
  robot_.on_report(now_,
                   {.time = {std::numeric_limits<int64_t>::max()}, .state = ArmState::kHolding});
  pass(1.2);
  EXPECT_EQ(obstacle(), "") << "the stream that keeps coming wins";
  report(ArmState::kIdle);
  EXPECT_EQ(obstacle(), "the arm is idle: its reason");
}

}  // namespace
}  // namespace foresight
