// Which commands may move the arm, and whose: the gate alone.
#include "procs/wam_controller/command_gate.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/wam_controller/joints.h"

namespace foresight {
namespace {

using enum CommandVerdict;

constexpr int64_t kEnd = std::numeric_limits<int64_t>::max();
constexpr int64_t kBegin = std::numeric_limits<int64_t>::min();

class CommandGateTest : public testing::Test {
 protected:
  // A session that sends at 30 Hz with this age.
  struct Sender {
    int64_t session;
    int64_t seq = 0;
    Duration age = milliseconds(100);
  };
  JointCommand make(Sender& sender, bool engaged) {
    return {now_ - sender.age, sender.session, ++sender.seq, engaged, joints({0, 0})};
  }
  CommandVerdict admit(const JointCommand& command) {
    return gate_.admit(now_, command, is_active_);
  }
  CommandVerdict engage(Sender& sender) { return admit(make(sender, true)); }
  CommandVerdict let_go(Sender& sender) { return admit(make(sender, false)); }
  void pass(Duration duration) {
    now_ = now_ + duration;
    gate_.expire(now_);
  }
  CommandVerdict press(Sender& sender) {
    EXPECT_EQ(let_go(sender), kAccepted);
    pass(milliseconds(33));
    return engage(sender);
  }
  Time now_{100'000'000};
  bool is_active_ = true;
  CommandGate gate_{{.joint_count = 2, .max_age = seconds(2), .lease = milliseconds(500)}};
  Sender a_{10'000'000}, b_{20'000'000};
};

TEST_F(CommandGateTest, AnEngageIsFreshWhenItsSenderWasSeenLetGo) {
  EXPECT_TRUE(gate_.needs_release());
  EXPECT_EQ(engage(a_), kNeedsRelease);
  EXPECT_EQ(let_go(a_), kAccepted);
  EXPECT_FALSE(gate_.needs_release());
  EXPECT_FALSE(gate_.has_driver());
  EXPECT_EQ(engage(a_), kAccepted);
  EXPECT_EQ(gate_.driver_session(), a_.session);
  gate_.revoke();
  EXPECT_TRUE(gate_.needs_release());
  EXPECT_EQ(engage(a_), kNeedsRelease);
  EXPECT_EQ(press(a_), kAccepted);
}

TEST_F(CommandGateTest, LettingGoOfAnArmThatIsNotActiveDoesNotCount) {
  is_active_ = false;
  EXPECT_EQ(press(a_), kNeedsRelease);
  is_active_ = true;
  EXPECT_EQ(engage(a_), kNeedsRelease);
  EXPECT_EQ(press(a_), kAccepted);
}

TEST_F(CommandGateTest, WhoDrivesIsNotDisturbedByAnother) {
  ASSERT_EQ(press(a_), kAccepted);
  for (int i = 0; i < 30; ++i) {
    pass(milliseconds(33));
    EXPECT_EQ(i % 2 == 0 ? engage(b_) : let_go(b_), i % 2 == 0 ? kOfOthers : kAccepted);
    EXPECT_EQ(engage(a_), kAccepted);
    EXPECT_EQ(gate_.driver_session(), a_.session);
  }
  EXPECT_EQ(gate_.count(kOfOthers), 15);
}

// Else the arm would drive off for the second at the moment at which the first lets go.
TEST_F(CommandGateTest, WhoPressedWhileAnotherDroveMustPressAgain) {
  ASSERT_EQ(press(a_), kAccepted);
  EXPECT_EQ(press(b_), kOfOthers);
  EXPECT_EQ(let_go(a_), kAccepted);
  EXPECT_EQ(engage(b_), kNeedsRelease);
  EXPECT_EQ(press(b_), kAccepted);
  EXPECT_EQ(press(a_), kOfOthers);
}

TEST_F(CommandGateTest, ADriverWhoIsSilentForTheLeaseMustPressAgain) {
  ASSERT_EQ(press(a_), kAccepted);
  pass(milliseconds(500));
  EXPECT_TRUE(gate_.has_driver());
  EXPECT_EQ(engage(a_), kAccepted);
  pass(microseconds(500'001));
  EXPECT_FALSE(gate_.has_driver());
  EXPECT_EQ(engage(a_), kNeedsRelease);
  EXPECT_EQ(press(a_), kAccepted);
}

// What happened to the button during the silence is not known.
TEST_F(CommandGateTest, ALettingGoBeforeASilenceDoesNotCount) {
  EXPECT_EQ(let_go(a_), kAccepted);
  pass(milliseconds(501));
  EXPECT_TRUE(gate_.needs_release());
  EXPECT_EQ(engage(a_), kNeedsRelease);
}

TEST_F(CommandGateTest, ASessionNeedNotBeNewerThanTheOneBefore) {
  ASSERT_EQ(press(b_), kAccepted);
  EXPECT_EQ(let_go(b_), kAccepted);
  EXPECT_EQ(press(a_), kAccepted);
}

TEST_F(CommandGateTest, KeepsOrderPerSession) {
  ASSERT_EQ(press(a_), kAccepted);
  const JointCommand old = make(a_, true), older_release = make(a_, false);
  pass(milliseconds(33));
  EXPECT_EQ(engage(a_), kAccepted);
  EXPECT_EQ(admit(old), kOutOfOrder);
  EXPECT_EQ(admit(older_release), kOutOfOrder);
  EXPECT_TRUE(gate_.has_driver());
  EXPECT_EQ(let_go(b_), kAccepted);
  EXPECT_EQ(admit(old), kOutOfOrder) << "another session in between forgets nothing";
}

TEST_F(CommandGateTest, LettingGoOvertakesAndCancelsEverythingOlder) {
  ASSERT_EQ(press(a_), kAccepted);
  const JointCommand under_way = make(a_, true);
  EXPECT_EQ(let_go(a_), kAccepted);
  EXPECT_FALSE(gate_.has_driver());
  EXPECT_EQ(admit(under_way), kOutOfOrder);
}

// Whatever is wrong with it otherwise: stamps of a clock that was set, positions that are missing.
TEST_F(CommandGateTest, TheDriversLettingGoIsHeededWhateverItsStamp) {
  for (const int64_t stamp_us : {kEnd, int64_t{0}, kBegin}) {
    ASSERT_EQ(press(a_), kAccepted);
    JointCommand release = make(a_, false);
    release.time = {stamp_us};
    release.position_rad.resize(0);
    EXPECT_NE(admit(release), kAccepted);
    EXPECT_FALSE(gate_.has_driver());
    EXPECT_EQ(engage(a_), kNeedsRelease) << "but it is no release to engage after";
  }
}

TEST_F(CommandGateTest, OneAbsurdSeqDoesNotLockTheSessionOut) {
  ASSERT_EQ(press(a_), kAccepted);
  JointCommand forged = make(a_, true);
  for (const int64_t seq : {kEnd, a_.seq + 20'000}) {
    forged.seq = seq;
    EXPECT_EQ(admit(forged), kOutOfOrder);
  }
  forged.seq = a_.seq + 5'000;
  EXPECT_EQ(admit(forged), kAccepted);
  pass(milliseconds(33));
  EXPECT_EQ(let_go(a_), kOutOfOrder);
  EXPECT_FALSE(gate_.has_driver()) << "the stamp shows that it is newer";
  int dropped = 0;
  for (int i = 0; i < 40; ++i) {
    pass(milliseconds(33));
    if (let_go(a_) != kAccepted) ++dropped;
  }
  EXPECT_LE(dropped, 16) << "a lease at 30 Hz";
  EXPECT_EQ(press(a_), kAccepted);
}

TEST_F(CommandGateTest, AFirstCommandWithTheSmallestSeqIsNoFault) {
  a_.seq = kBegin;
  EXPECT_EQ(press(a_), kAccepted);
}

TEST_F(CommandGateTest, AnOldSessionsCommandsAreNotTakenForNewOnes) {
  ASSERT_EQ(press(a_), kAccepted);
  const JointCommand release = make(a_, false), engaged = make(a_, true);
  EXPECT_EQ(admit(release), kAccepted);
  EXPECT_EQ(admit(engaged), kAccepted);
  EXPECT_EQ(let_go(a_), kAccepted);
  for (int i = 0; i < 6; ++i) {
    Sender other{30'000'000 + i};
    EXPECT_EQ(press(other), kAccepted);
    EXPECT_EQ(let_go(other), kAccepted);
    pass(milliseconds(100));
  }
  EXPECT_EQ(admit(release), kOutOfOrder);
  EXPECT_EQ(admit(engaged), kOutOfOrder);
}

TEST_F(CommandGateTest, AThousandSessionsForgetTheOldestButNeverTheDriver) {
  ASSERT_EQ(press(a_), kAccepted);
  const JointCommand old = make(a_, true);
  for (int i = 0; i < 1000; ++i) {
    pass(milliseconds(1));
    Sender stranger{i + 1};
    EXPECT_EQ(engage(stranger), kOfOthers);
    if (i % 30 == 0) {
      EXPECT_EQ(engage(a_), kAccepted);
    }
  }
  EXPECT_EQ(admit(old), kOutOfOrder);
  EXPECT_EQ(gate_.driver_session(), a_.session);
}

TEST_F(CommandGateTest, DropsWhatIsStale) {
  a_.age = seconds(2.1);
  EXPECT_EQ(let_go(a_), kStale);
  a_.age = seconds(1.9);
  EXPECT_EQ(let_go(a_), kAccepted);
}

// Out of a stall of the link: what was meant before is not meant any more.
TEST_F(CommandGateTest, DropsEngagedCommandsThatTravelledLongerThanOthersByMoreThanTheLease) {
  a_.age = milliseconds(600);
  ASSERT_EQ(press(a_), kAccepted);
  for (const int64_t more_ms : {0, 100, 499, 600, 1000, 499}) {
    pass(milliseconds(33));
    a_.age = milliseconds(600 + more_ms);
    EXPECT_EQ(engage(a_), more_ms <= 500 ? kAccepted : kStale) << more_ms;
  }
}

TEST_F(CommandGateTest, ALinkThatStaysSlowerIsFollowedAgainAfterSomeSeconds) {
  ASSERT_EQ(press(a_), kAccepted);
  a_.age = milliseconds(1000);
  const Time slow_since = now_;
  while (press(a_) != kAccepted && now_ - slow_since < seconds(20)) {
  }
  EXPECT_GT(now_ - slow_since, seconds(3));
  EXPECT_LT(now_ - slow_since, seconds(6.5));
}

TEST_F(CommandGateTest, RefusesWhatComesFromTheFuture) {
  Sender tomorrow{(now_ + seconds(1.1)).us};
  EXPECT_EQ(let_go(tomorrow), kAhead);
  Sender absurd{kEnd};
  EXPECT_EQ(let_go(absurd), kAhead);
  JointCommand command = make(a_, false);
  command.time = {kEnd};
  EXPECT_EQ(admit(command), kAhead);
  command.time = {kBegin};
  EXPECT_EQ(admit(command), kStale);
  EXPECT_EQ(press(a_), kAccepted);
}

TEST_F(CommandGateTest, RefusesAnotherJointCountAndWhatIsNoNumber) {
  ASSERT_EQ(press(a_), kAccepted);
  JointCommand wrong = make(a_, true);
  wrong.position_rad = joints({0, 0, 0});
  EXPECT_EQ(admit(wrong), kMisshapen);
  JointCommand nan = make(a_, true);
  nan.position_rad[1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(admit(nan), kMisshapen);
  EXPECT_EQ(gate_.count(kMisshapen), 2);
  EXPECT_EQ(engage(a_), kAccepted);
}

TEST_F(CommandGateTest, AStampFromTheNearFutureMakesTheOthersNotLate) {
  ASSERT_EQ(press(a_), kAccepted);
  pass(milliseconds(33));
  a_.age = seconds(-1.9);
  EXPECT_EQ(engage(a_), kAccepted);
  pass(milliseconds(33));
  a_.age = milliseconds(300);
  EXPECT_EQ(engage(a_), kAccepted);
}

TEST_F(CommandGateTest, ASenderWithoutASessionDoesNotDrive) {
  Sender nobody{0}, less{-5};
  EXPECT_EQ(let_go(nobody), kMisshapen);
  EXPECT_EQ(let_go(less), kMisshapen);
}

TEST_F(CommandGateTest, AClockThatIsSetBackNeedsAFreshEngageToo) {
  ASSERT_EQ(press(a_), kAccepted);
  now_ = now_ - seconds(50);
  EXPECT_EQ(engage(a_), kNeedsRelease);
  EXPECT_FALSE(gate_.has_driver());
  EXPECT_EQ(press(a_), kAccepted);
}

}  // namespace
}  // namespace foresight
