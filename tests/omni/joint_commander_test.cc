#include "procs/omni/joint_commander.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "procs/omni/clutch.h"
#include "procs/omni/omni_model.h"
#include "tests/omni/arms.h"

namespace foresight {
namespace {

constexpr Duration kPeriod = microseconds(33'333);
const double kPeriod_s = kPeriod.seconds();
const std::vector<double> kHomeAxes{0, (1.5707963267948966 - 0.25) / 1.8,
                                    1.5707963267948966 - 2.25};

class JointCommanderTest : public testing::Test {
 protected:
  void use(CommanderOptions options, JointMapping mapping = paper_mapping()) {
    options_ = options;
    commander_ = std::make_unique<JointCommander>(arm_, mapping, options);
    arm_follows_ = true;
  }
  void step(const DeviceReading& reading, bool engage = true) {
    if (arm_follows_) {
      EXPECT_TRUE(commander_->set_measured(now_, command()));
    }
    now_ = now_ + kPeriod;
    commander_->update(now_, reading, engage);
  }
  void steps(int count, const DeviceReading& reading, bool engage = true) {
    for (int i = 0; i < count; ++i) step(reading, engage);
  }
  /// From now on the arm is known to be where the test says, or not known when it says nothing.
  void measure(const JointVector& position_rad) {
    arm_follows_ = false;
    ASSERT_TRUE(commander_->set_measured(now_, position_rad));
  }
  const JointVector& command() const { return commander_->position_rad(); }
  static JointVector joints(double a, double b, double c, double d) {
    return (JointVector(4) << a, b, c, d).finished();
  }
  static double distance(const JointVector& a, const JointVector& b) {
    return (a - b).cwiseAbs().maxCoeff();
  }

  ArmModel arm_ = wam4();
  CommanderOptions options_;
  std::unique_ptr<JointCommander> commander_;
  Time now_{1'000'000};
  bool arm_follows_ = true;  // at once
};

TEST_F(JointCommanderTest, SaysHomeAndNotEngagedAtFirst) {
  use({});
  EXPECT_FALSE(commander_->is_engaged());
  EXPECT_EQ(command(), arm_.home());
  step(positions({0.5, 0.5, 0.5}), false);
  EXPECT_FALSE(commander_->is_engaged());
  EXPECT_EQ(command(), arm_.home());
}

// A stick at rest would otherwise drive the arm home, a stylus to where it points.
TEST_F(JointCommanderTest, DoesNotEngageWithoutKnowingWhereTheArmIs) {
  for (const bool has_sticks : {false, true}) {
    use({}, has_sticks ? gamepad_mapping() : paper_mapping());
    arm_follows_ = false;
    const DeviceReading hand =
        has_sticks ? deflections(std::vector<double>(8, 0)) : positions({0.4, 0.5, 0.5});
    steps(60, hand);
    EXPECT_FALSE(commander_->is_engaged());
    EXPECT_EQ(commander_->problem(), "cannot engage: no JOINT_STATE");
    const JointVector arm_rad = joints(0.6, 0.1, 0, 2);
    measure(arm_rad);
    step(hand);
    EXPECT_TRUE(commander_->is_engaged());
    EXPECT_EQ(commander_->problem(), "");
    EXPECT_LT(distance(command(), arm_rad), 1e-12);
  }
}

TEST_F(JointCommanderTest, BeginsWhereTheArmIsAndAlignsSlowly) {
  use({});
  const JointVector arm_rad = joints(-0.3, 0, 0.1, 2);
  measure(arm_rad);
  step(positions(kHomeAxes));
  EXPECT_LT(distance(command(), arm_rad), 1e-12);
  JointVector last = command();
  for (int i = 0; i < 300; ++i) {
    step(positions(kHomeAxes));
    EXPECT_LE(distance(command(), last), options_.align_velocity_rad_per_s * kPeriod_s + 1e-12);
    last = command();
  }
  EXPECT_LT(distance(command(), arm_.home()), 1e-9) << "in the end it is where the device points";
}

TEST_F(JointCommanderTest, FollowsTheHandAtOnceWhileItAligns) {
  use({});
  measure(joints(-0.5, 0, 0, 2));
  step(positions({0, 0.8, 0}));
  step(positions({0.02, 0.8, 0}));
  EXPECT_NEAR(command()[0], -0.5 + 0.02 + options_.align_velocity_rad_per_s * kPeriod_s, 1e-9);
}

TEST_F(JointCommanderTest, IgnoresAnOldMeasurement) {
  use({});
  measure(joints(-0.3, 0, 0.1, 2));
  now_ = now_ + seconds(2);
  step(positions(kHomeAxes));
  EXPECT_FALSE(commander_->is_engaged());
}

TEST_F(JointCommanderTest, RefusesAMeasurementOfAnotherArm) {
  use({});
  EXPECT_FALSE(commander_->set_measured(now_, JointVector::Zero(7)));
  EXPECT_FALSE(
      commander_->set_measured(now_, joints(0, std::numeric_limits<double>::quiet_NaN(), 0, 0)));
}

TEST_F(JointCommanderTest, GoesOnFromTheLastCommandAfterAShortRelease) {
  use({});
  steps(5, positions(kHomeAxes));
  const JointVector last = command();
  measure(joints(-0.3, 0, 0.1, 2));  // of the time before the arm stopped
  steps(10, positions({0.5, 0.5, 0.5}), false);
  EXPECT_EQ(command(), last) << "held while released";
  step(positions({0.5, 0.5, 0.5}));
  EXPECT_EQ(command(), last);
}

TEST_F(JointCommanderTest, GoesOnFromTheArmAfterALongRelease) {
  use({});
  steps(5, positions(kHomeAxes));
  steps(60, positions(kHomeAxes), false);
  const JointVector arm_rad = joints(0.1, -0.2, 0, 2.2);
  measure(arm_rad);
  step(positions({0.5, 0.5, 0.5}));
  EXPECT_LT(distance(command(), arm_rad), 1e-12);
}

// Where the arm came to rest is measured a round trip later than it does.
TEST_F(JointCommanderTest, ALongRoundTripIsPartOfAShortRelease) {
  use({});
  commander_->set_round_trip(seconds(2.0));
  steps(5, positions(kHomeAxes));
  const JointVector last = command();
  for (int i = 0; i < 80; ++i) {
    measure(joints(-0.3, 0, 0.1, 2));
    step(positions(kHomeAxes), false);
  }
  EXPECT_EQ(command(), last) << "2.7 s";
  step(positions(kHomeAxes));
  EXPECT_EQ(command(), last);
}

TEST_F(JointCommanderTest, IsTheMeasuredArmWhileNotEngaged) {
  use({});
  steps(5, positions(kHomeAxes));
  for (int i = 0; i < 60; ++i) {
    measure(joints(0.01 * i, 0, 0, 2));
    step(positions({0.5, 0.5, 0.5}), false);
  }
  EXPECT_LT(distance(command(), joints(0.59, 0, 0, 2)), 1e-12);
}

// E-stop at full command: the arm stands still, so the last command means nothing any more.
TEST_F(JointCommanderTest, IsTheMeasuredArmAtOnceWhenTheArmDoesNotFollow) {
  use({}, gamepad_mapping());
  const JointVector arm_rad = joints(0.45, 0, 0, 2);
  const DeviceReading stick = deflections({-1, 0, 0, 0, 0, 0, 0, 0});
  measure(arm_rad);
  for (int i = 0; i < 150; ++i) {
    measure(arm_rad);
    step(stick);
  }
  EXPECT_GT(command()[0], 2) << "it has run ahead";
  commander_->stand_down();
  EXPECT_FALSE(commander_->is_engaged());
  step(stick, false);
  EXPECT_LT(distance(command(), arm_rad), 1e-12);
  step(stick);
  EXPECT_TRUE(commander_->is_engaged());
  EXPECT_LT(distance(command(), arm_rad), 1e-12) << "a fresh engagement begins at the arm";
}

TEST_F(JointCommanderTest, RelativeModeKeepsTheOffsetForGood) {
  use({.mode = MotionMode::kRelative});
  step(positions({0.5, 0.5, 0.5}));
  EXPECT_LT(distance(command(), arm_.home()), 1e-12) << "begins at home";
  steps(100, positions({0.6, 0.5, 0.5}));
  EXPECT_NEAR(command()[0], 0.1, 1e-9);
  EXPECT_NEAR(command()[1], arm_.home()[1], 1e-9);
  steps(40, positions({-0.9, 0.5, 0.5}), false);
  steps(100, positions({-0.8, 0.5, 0.5}));
  EXPECT_NEAR(command()[0], 0.1, 1e-9) << "the hand was moved back while released";
  steps(100, positions({-0.7, 0.5, 0.5}));
  EXPECT_NEAR(command()[0], 0.2, 1e-9);
}

TEST_F(JointCommanderTest, RelativeModeTurnsBackFromALimitAtOnce) {
  use({.mode = MotionMode::kRelative});
  JointMapping mapping = paper_mapping();
  mapping.joints[0].scale = 10;
  use(options_, mapping);
  step(positions({0, 0.5, 0.5}));
  steps(200, positions({0.9, 0.5, 0.5}));  // 9 rad; the limit is 2.6
  const double limit_rad = 2.6 - options_.limit_margin_rad;
  EXPECT_NEAR(command()[0], limit_rad, 1e-12);
  steps(200, positions({0.85, 0.5, 0.5}));
  EXPECT_NEAR(command()[0], limit_rad - 0.5, 1e-9);
}

TEST_F(JointCommanderTest, StaysInsideTheLimitsWhateverTheSigns) {
  JointMapping mapping = paper_mapping();
  mapping.axis_signs = {1, 1, 1};
  use({}, mapping);
  steps(600, positions({0, 1.7, 0}));  // asks for −4.6 rad
  EXPECT_NEAR(command()[1], -2.0 + options_.limit_margin_rad, 1e-12);
  EXPECT_TRUE(commander_->is_limited());
  steps(600, positions({0, 0, 0}));
  EXPECT_FALSE(commander_->is_limited());
}

TEST_F(JointCommanderTest, BoundsTheVelocityOfACommand) {
  use({});
  step(positions({-0.9, 0.5, 0.5}));
  step(positions({0.9, 0.5, 0.5}));  // a glitch, or a hand that slips
  EXPECT_NEAR(command()[0], options_.max_velocity_rad_per_s * kPeriod_s, 1e-9);
}

TEST_F(JointCommanderTest, DoesNotMakeUpForAPauseOfTheProcess) {
  use({});
  step(positions({0, 0.5, 0.5}));
  now_ = now_ + seconds(5);
  step(positions({0.9, 0.5, 0.5}));
  EXPECT_LE(command()[0], 0.1 * options_.max_velocity_rad_per_s + 1e-9);
}

TEST_F(JointCommanderTest, IntegratesDeflectionsFromWhereTheArmIs) {
  use({}, gamepad_mapping());
  const JointVector arm_rad = joints(0.2, 0.1, 0, 2);
  measure(arm_rad);
  step(deflections({-1, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_LT(distance(command(), arm_rad), 1e-12);
  steps(30, deflections({-1, 0, 0, 0, 0.5, 0, 0, 0}));
  const double way_rad = 30 * kPeriod_s * options_.axis_velocity_rad_per_s;
  EXPECT_LT(distance(command(), joints(0.2 + way_rad, 0.1, 0, 2 + way_rad / 2)), 1e-9);
  steps(30, deflections({0, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_LT(distance(command(), joints(0.2 + way_rad, 0.1, 0, 2 + way_rad / 2)), 1e-9);
}

TEST_F(JointCommanderTest, StopsIntegratingAtTheLimits) {
  use({}, gamepad_mapping());
  steps(1000, deflections({-1, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_NEAR(command()[0], 2.6 - options_.limit_margin_rad, 1e-12);
  EXPECT_NEAR(command()[3], arm_.home()[3], 1e-12);
  steps(1, deflections({1, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_LT(command()[0], 2.6 - options_.limit_margin_rad - 1e-3) << "no wind-up";
}

// Otherwise the arm would go on when the stick is back at rest, and after the next press.
TEST_F(JointCommanderTest, DoesNotRunAheadOfASlowerArm) {
  use({}, gamepad_mapping());
  commander_->set_velocity_limit(0.15);
  step(deflections({-1, 0, 0, 0, 0, 0, 0, 0}));
  const double begin_rad = command()[0];
  steps(90, deflections({-1, 0, 0, 0, 0, 0, 0, 0}));
  const double way_rad = 90 * kPeriod_s * 0.15;
  EXPECT_NEAR(command()[0], begin_rad + way_rad, 1e-9);
  steps(90, deflections({0, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_NEAR(command()[0], begin_rad + way_rad, 1e-9) << "nothing to make up for";
  commander_->set_velocity_limit(0);
  steps(30, deflections({-1, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_NEAR(command()[0], begin_rad + way_rad + 30 * kPeriod_s * 0.4, 1e-9);
}

TEST_F(JointCommanderTest, ADeviceThatHasGoneOrTalksNonsenseIsNotFollowed) {
  use({});
  steps(3, positions(kHomeAxes));
  DeviceReading gone = positions({0.5, 0.5, 0.5});
  gone.connected = false;
  step(gone);
  EXPECT_FALSE(commander_->is_engaged());
  step(positions({0.5, std::nan(""), 0.5}));
  EXPECT_FALSE(commander_->is_engaged());
  EXPECT_NE(commander_->problem(), "");
  step(positions({0.5, 0.5}));
  EXPECT_FALSE(commander_->is_engaged());
  EXPECT_NE(commander_->problem().find("the mapping needs 3"), std::string::npos);
  step(positions(kHomeAxes));
  EXPECT_TRUE(commander_->is_engaged());
  EXPECT_EQ(commander_->problem(), "");
}

// What must hold for any hand: no jump, no limit passed.
struct Hand {
  std::mt19937 random;
  std::vector<double> axes{0, 0.8, 0};
  bool engage = false;
  double uniform() { return static_cast<double>(random()) / 4294967296.0; }
  void move() {
    if (uniform() < 0.05) engage = !engage;
    for (size_t i = 0; i < axes.size(); ++i) {
      const AxisRange range = kOmniRanges[i];
      const bool slip = uniform() < 0.01;
      if (slip) axes[i] = range.lower_rad + (range.upper_rad - range.lower_rad) * uniform();
      axes[i] = std::clamp(axes[i] + 0.1 * (uniform() - 0.5), range.lower_rad, range.upper_rad);
    }
  }
};

TEST_F(JointCommanderTest, NeverJumpsHoweverTheClutchIsUsed) {
  for (const MotionMode mode : {MotionMode::kAbsolute, MotionMode::kRelative}) {
    for (uint32_t seed = 1; seed <= 40; ++seed) {
      use({.mode = mode});
      Hand hand{std::mt19937(seed)};
      JointVector arm_rad = arm_.home();  // follows commands, late
      JointVector last = command();
      bool was_engaged = false;
      for (int i = 0; i < 1500; ++i) {
        hand.move();
        measure(arm_rad);
        step(positions(hand.axes), hand.engage);
        const double reach_rad = options_.max_velocity_rad_per_s * kPeriod_s + 1e-9;
        ASSERT_LT(distance(command(), arm_.clamp(command(), options_.limit_margin_rad)), 1e-12);
        if (commander_->is_engaged() && was_engaged) {
          ASSERT_LE(distance(command(), last), reach_rad);
        } else if (commander_->is_engaged()) {
          ASSERT_LT(std::min(distance(command(), last), distance(command(), arm_rad)), 1e-9);
        }
        was_engaged = commander_->is_engaged();
        last = command();
        if (was_engaged) arm_rad += 0.2 * (command() - arm_rad);
      }
    }
  }
}

TEST(ClutchTest, HoldFollowsTheButtonAndToggleItsPresses) {
  Clutch hold(ClutchMode::kHold), toggle(ClutchMode::kToggle);
  const bool pressed[] = {false, true, true, false, false, true, false};
  const bool held[] = {false, true, true, false, false, true, false};
  const bool toggled[] = {false, true, true, true, true, false, false};
  for (int i = 0; i < 7; ++i) {
    EXPECT_EQ(hold.update(true, pressed[i]), held[i]) << i;
    EXPECT_EQ(toggle.update(true, pressed[i]), toggled[i]) << i;
  }
}

TEST(ClutchTest, MustBeLetGoAtFirstAndAfterTheDeviceHadGone) {
  for (const ClutchMode mode : {ClutchMode::kHold, ClutchMode::kToggle}) {
    Clutch clutch(mode);
    EXPECT_FALSE(clutch.update(true, true)) << "held at the start";
    EXPECT_TRUE(clutch.needs_release());
    EXPECT_FALSE(clutch.update(true, false));
    EXPECT_FALSE(clutch.needs_release());
    EXPECT_TRUE(clutch.update(true, true));
    EXPECT_FALSE(clutch.update(false, true));
    EXPECT_FALSE(clutch.update(true, true)) << "returned with its button held";
    EXPECT_FALSE(clutch.update(true, false));
    EXPECT_TRUE(clutch.update(true, true));
  }
}

}  // namespace
}  // namespace foresight
