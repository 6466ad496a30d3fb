// Where the motors' counts have their zero: what a person must confirm, and what a restart may
// believe. Against a fake CAN bus; no real arm has been met.
#include <gtest/gtest.h>

#include <fstream>

#include "common/errors.h"
#include "procs/wam_controller/can_start.h"
#include "procs/wam_controller/home_reference.h"
#include "procs/wam_controller/transmission.h"
#include "tests/common/files.h"
#include "tests/wam_controller/fake_bus.h"
#include "tests/wam_controller/joints.h"

namespace foresight {
namespace {

constexpr Time kNow{1'700'000'000'000'000};
constexpr int64_t kNow_s = 1'700'000'000;

// The arm's own bus outlives the processes that use it.
class SharedBus : public CanBus {
 public:
  explicit SharedBus(FakeBus& bus) : bus_(bus) {}
  bool send(const CanFrame& frame) override { return bus_.send(frame); }
  bool receive(Duration longest, CanFrame* frame) override { return bus_.receive(longest, frame); }

 private:
  FakeBus& bus_;
};

class CanHome : public testing::Test {
 protected:
  CanHome() {
    params_.can_torque_units_per_nm.assign(4, 1000);
    params_.can_home_file = folder_.path() + "/deeper/can_home.txt";
  }
  // The joints as a process that starts now believes them; or its refusal.
  JointVector start() {
    refusal_.clear();
    try {
      can_ = start_can_arm(params_, arm_, now_, std::make_unique<SharedBus>(bus_));
    } catch (const StartupError& error) {
      refusal_ = error.what();
      return JointVector::Zero(4);
    }
    ArmReading reading;
    EXPECT_TRUE(can_.arm->read(now_, &reading));
    return reading.position_rad;
  }
  // By so much from where the arm stands.
  void move(const JointVector& way_rad) {
    const JointVector counts = Transmission(arm_).motor_counts(way_rad);
    for (size_t i = 0; i < 4; ++i) {
      bus_.positions[i + 1] += static_cast<int32_t>(std::lround(counts[static_cast<int>(i)]));
    }
  }
  // What a running process does once a second.
  void look() {
    ArmReading reading;
    ASSERT_TRUE(can_.arm->read(now_, &reading));
    const auto counts = can_.arm->position_counts();
    can_.home.counts_last_seen.assign(counts.begin(), counts.end());
    ASSERT_TRUE(keep_home_reference(params_.can_home_file, can_.home));
  }
  void confirm() { params_.can_home_confirmed_at_s = static_cast<double>(now_.us / 1'000'000); }
  void expect_refusal(const std::string& why) {
    EXPECT_NE(refusal_.find(why), std::string::npos) << refusal_;
    EXPECT_NE(refusal_.find("can_home_confirmed_at_s"), std::string::npos) << refusal_;
  }
  const ArmModel arm_ = load_arm_file(kArms + "/wam4.yaml");
  const JointVector way_rad_ = joints({0.2, -0.4, 0.3, -0.8});
  TemporaryFolder folder_;
  WamControllerParams params_;
  FakeBus bus_;
  Time now_ = kNow;
  StartedCanArm can_;
  std::string refusal_;
};

TEST_F(CanHome, NeedsAPersonsWordAfterPowerOn) {
  start();
  expect_refusal("no reference of an earlier start is known");
  confirm();
  EXPECT_LT((start() - arm_.home()).norm(), 1e-3) << refusal_;
  EXPECT_EQ(refusal_, "");
}

// It used to take the present place for home: 0.8 rad wrong.
TEST_F(CanHome, ARestartInMidMotionKeepsTheReferenceOfPucksThatKeptCounting) {
  confirm();
  start();
  move(way_rad_);
  look();
  move(joints({0, 0.1, 0, 0}));  // it sank before the new process came
  now_ = now_ + seconds(30);
  EXPECT_LT((start() - arm_.home() - way_rad_ - joints({0, 0.1, 0, 0})).norm(), 2e-3) << refusal_;
  params_.can_home_confirmed_at_s = 0;
  now_ = now_ + seconds(86'400);
  EXPECT_LT((start() - arm_.home() - way_rad_ - joints({0, 0.1, 0, 0})).norm(), 2e-3) << refusal_;
}

TEST_F(CanHome, ARestartAfterThePucksWereSwitchedOffNeedsANewWord) {
  confirm();
  start();
  move(way_rad_);
  look();
  bus_.switch_off_and_on();
  now_ = now_ + seconds(60);
  start();
  expect_refusal("the motor controllers were switched off since the last start");
  expect_refusal("the word that was given is used, or old");
  now_ = now_ + seconds(60);
  confirm();
  EXPECT_LT((start() - arm_.home()).norm(), 1e-3) << refusal_;
}

TEST_F(CanHome, OnePuckThatWasSwitchedOffIsEnough) {
  confirm();
  start();
  bus_.status[4] = 0;
  start();
  expect_refusal("switched off");
}

TEST_F(CanHome, AWordLastsAQuarterOfAnHour) {
  confirm();
  now_ = now_ + seconds(901);
  start();
  expect_refusal("no reference");
  params_.can_home_confirmed_at_s = static_cast<double>(kNow_s + 86'400);
  start();
  expect_refusal("no reference");
}

TEST_F(CanHome, AnArmFarFromWhereItWasLastSeenIsNotBelieved) {
  confirm();
  start();
  move(joints({0, 0, 0.6, 0}));
  start();
  expect_refusal("the arm is 0.60 rad (joint 3) from where it was last seen");
}

TEST_F(CanHome, AReferenceThatPutsTheArmOutsideItsLimitsIsNotBelieved) {
  confirm();
  start();
  for (int i = 0; i < 7; ++i) {
    move(joints({0.4, 0, 0, 0}));
    if (i < 6) look();
  }
  start();
  expect_refusal("outside the limits (joint 1)");
}

TEST_F(CanHome, AWordThatTheRunningPucksContradictIsRefused) {
  confirm();
  start();
  move(way_rad_);
  look();
  now_ = now_ + seconds(60);
  confirm();
  start();
  expect_refusal("say that the arm is 0.80 rad (joint 4) from home");
}

TEST_F(CanHome, AFileThatIsDamagedOrOfAnotherArmIsNone) {
  confirm();
  start();
  params_.can_home_confirmed_at_s = 0;
  std::string text;
  {
    std::ifstream file(params_.can_home_file);
    text.assign(std::istreambuf_iterator<char>(file), {});
  }
  EXPECT_TRUE(read_home_reference(text));
  for (size_t size = 0; size + 1 < text.size(); ++size) {
    EXPECT_FALSE(read_home_reference(text.substr(0, size))) << size;
  }
  std::ofstream(params_.can_home_file) << "arm wam4 confirmed_at_s 9 motors 4 1 2 3";
  start();
  expect_refusal("no reference");
  std::ofstream(params_.can_home_file) << text.replace(text.find("wam4"), 4, "wam7");
  start();
  expect_refusal("of another arm");
}

TEST_F(CanHome, AFileThatCannotBeWrittenEndsTheStart) {
  confirm();
  params_.can_home_file = "/proc/nowhere/can_home.txt";
  start();
  EXPECT_NE(refusal_.find("cannot be written"), std::string::npos) << refusal_;
}

}  // namespace
}  // namespace foresight
