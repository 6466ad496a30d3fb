#include "procs/renderer/camera_predictor.h"

#include <gtest/gtest.h>

#include <deque>
#include <functional>
#include <limits>
#include <random>
#include <set>

namespace foresight {
namespace {

constexpr Time kStart{1'000'000'000};
constexpr Duration kCommandPeriod = microseconds(33'333);

// Two joints in a plane are enough: what is predicted does not depend on the arm's shape.
ArmModel two_joints() {
  ArmModel arm;
  for (int i = 0; i < 2; ++i) {
    ArmJoint joint;
    joint.a_m = 0.5;
    joint.lower_rad = -2;
    joint.upper_rad = 2;
    arm.joints.push_back(joint);
  }
  return arm;
}

// The robot's side: commands arrive after a delay, the reference follows those of the sender that
// drives, and the operator's side sees its state after another. It is what wam_controller's README
// says, written anew.
class Robot {
 public:
  explicit Robot(const ControllerLimits& limits) : limits_(limits), reference_(limits.motion) {
    reference_.rest(kStart, JointVector::Zero(2));
  }
  // The loop as wam_controller runs it, every 2 ms.
  void run_until(Time time) {
    for (; now_ <= time; now_ = now_ + milliseconds(2)) {
      while (!arriving_.empty() && arriving_.front().second <= now_) {
        accept(arriving_.front().first);
        arriving_.pop_front();
      }
      if (driver_ != 0 && now_ - driven_ > limits_.command_timeout) {
        released_.erase(driver_);
        let_go();
      }
    }
  }
  void send(const CommandedJoints& command, Time arrival) {
    arriving_.push_back({command, arrival});
  }
  MeasuredJoints state() const {
    const Time t = now_ - milliseconds(2);
    const JointMotion motion = reference_.at(t);
    return {t,
            motion.position_rad,
            motion.position_rad,
            motion.velocity_rad_per_s,
            reference_.target_rad(),
            command_time_,
            arrival_};
  }
  ControllerFacts controller() const {
    return {.time = now_ - milliseconds(2),
            .is_following = driver_ != 0,
            .driver = driver_,
            .needs_release = driver_ == 0 && released_.empty(),
            .limits = limits_};
  }
  // Power comes and goes: everybody must let go before he drives.
  void revoke() {
    released_.clear();
    let_go();
  }
  int64_t driver() const { return driver_; }

 private:
  void accept(const CommandedJoints& command) {
    if (!command.engaged) released_.insert(command.session);
    if (command.engaged && driver_ != command.session) {
      if (driver_ == 0 && released_.contains(command.session)) driver_ = command.session;
      released_.erase(command.session);
      if (driver_ != command.session) return;
    }
    command_time_ = command.time;
    arrival_ = now_;
    if (driver_ != command.session) return;
    if (!command.engaged) return let_go();
    driven_ = now_;
    reference_.follow(now_, two_joints().clamp(command.position_rad, limits_.joint_margin_rad));
  }
  void let_go() {
    driver_ = 0;
    reference_.stop(now_);
  }
  ControllerLimits limits_;
  JointReference reference_;
  std::deque<std::pair<CommandedJoints, Time>> arriving_;
  std::set<int64_t> released_;
  int64_t driver_ = 0;
  Time now_ = kStart, command_time_, arrival_, driven_;
};

constexpr int64_t kOperator = 1'000, kStranger = 2'000;

// Runs an operator who moves at random with the given delay each way; returns the worst error of
// the predicted joints against where the reference was at the predicted instant, after a second.
struct Session {
  CameraPredictorOptions options = {};
  Duration delay = milliseconds(150);
  double loss = 0, disengaged = 0;
  int silence_from = -1;  // number of the command after which the operator is gone for a second
  std::optional<ControllerLimits> robot = {};  // other than options.limits
  bool controller_tells = true;
  Duration operator_clock = {};  // ahead of the robot's
  // Before each command: what else is on the bus.
  std::function<void(int i, Time now, CameraPredictor&, Robot&)> incident = [](auto...) {};
  int predictions = 0;
  double last_driver = 0;

  double worst_error_rad(uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(0, 1);
    Robot arm(robot.value_or(options.limits));
    CameraPredictor predictor(two_joints(), options);
    EXPECT_TRUE(predictor.set_alignment({7, {}, {}}));
    EXPECT_TRUE(predictor.set_base(kStart, {kStart, 7, {}}));
    std::deque<std::pair<MeasuredJoints, ControllerFacts>> returning;
    std::deque<std::pair<Time, JointVector>> predicted;
    JointVector target = JointVector::Zero(2);
    double worst = 0;
    for (int i = 0; i < 300; ++i) {
      const Time now = kStart + kCommandPeriod * i, here = now + operator_clock;
      arm.run_until(now);
      returning.push_back({arm.state(), arm.controller()});
      while (!returning.empty() && returning.front().first.time + delay <= now) {
        if (controller_tells && i % 3 == 0) {
          EXPECT_TRUE(predictor.set_controller(here, returning.front().second));
        }
        EXPECT_TRUE(predictor.set_joint_state(here, returning.front().first));
        returning.pop_front();
      }
      incident(i, now, predictor, arm);
      if (i % 10 == 0) target << 4 * uniform(random) - 2, 4 * uniform(random) - 2;
      const bool silent = silence_from >= 0 && i >= silence_from && i < silence_from + 30;
      if (!silent) {
        // After a silence, too, the clutch is let go once.
        const bool begins = i == 0 || (silence_from >= 0 && i == silence_from + 30);
        const CommandedJoints command{here, kOperator, !begins && uniform(random) >= disengaged,
                                      target};
        EXPECT_EQ(predictor.add_command(here, command), CommandIntake::kTaken);
        if (uniform(random) >= loss) arm.send(command, now + delay);
      }
      while (!predicted.empty() && predicted.front().first <= now) {
        worst = std::max(worst, error_at(predicted.front(), arm.state()));
        predicted.pop_front();
      }
      if (i <= 30) continue;
      if (const auto p = predictor.predict(here)) {
        predicted.push_back({p->instant, p->position_rad});
        ++predictions;
      }
    }
    last_driver = static_cast<double>(arm.driver());
    return worst;
  }
  // The state is up to one command period newer than the prediction: allow for the way between.
  static double error_at(const std::pair<Time, JointVector>& prediction, const MeasuredJoints& s) {
    const double since_s = (s.time - prediction.first).seconds();
    const JointVector then = s.reference_rad - s.reference_velocity_rad_per_s * since_s;
    return (then - prediction.second).cwiseAbs().maxCoeff() - 0.5 * since_s * since_s * 1.0;
  }
};

// 2 ms of the loop at 1 rad/s, and half as much of its phase.
constexpr double kLoopError_rad = 0.004;

TEST(CameraPredictor, KnowsWhereTheReferenceWillBe) {
  for (const int delay_ms : {0, 50, 150, 500}) {
    for (const bool told : {true, false}) {
      Session session{.delay = milliseconds(delay_ms), .controller_tells = told};
      EXPECT_LT(session.worst_error_rad(3), kLoopError_rad) << delay_ms << " ms";
      EXPECT_GT(session.predictions, 250);
    }
  }
}

TEST(CameraPredictor, FollowsTheLimitsThatTheControllerTells) {
  const ControllerLimits slow{{.velocity = 0.15, .acceleration = 0.5}, 0.2, milliseconds(300)};
  Session untold{.robot = slow, .controller_tells = false};
  EXPECT_GT(untold.worst_error_rad(3), 10 * kLoopError_rad);
  for (const int silence_from : {-1, 120}) {
    Session told{.silence_from = silence_from, .robot = slow};
    Session equal{.options = {.limits = slow}, .silence_from = silence_from};
    EXPECT_LT(told.worst_error_rad(3), kLoopError_rad);
    EXPECT_DOUBLE_EQ(told.worst_error_rad(3), equal.worst_error_rad(3));
  }
}

TEST(CameraPredictor, KnowsThatDisengagingStopsTheArm) {
  for (const bool told : {true, false}) {
    Session session{.disengaged = 0.3, .controller_tells = told};
    EXPECT_LT(session.worst_error_rad(4), kLoopError_rad);
  }
}

TEST(CameraPredictor, KnowsThatSilenceStopsTheArm) {
  Session session{.silence_from = 120};
  EXPECT_LT(session.worst_error_rad(5), kLoopError_rad);
}

TEST(CameraPredictor, LossCostsNoMoreThanTheCommandsLost) {
  Session session{.loss = 0.1};
  // A lost change of target is made good by the next command, one period later: at most 1 rad/s²
  // over a few periods of wrong acceleration.
  EXPECT_LT(session.worst_error_rad(6), 0.05);
}

// A second sender, whose commands reach the robot too. It comes while the operator drives, and is
// let go and engaged at every turn.
TEST(CameraPredictor, AStrangerDoesNotDriveWhileTheOperatorDoes) {
  for (const int64_t session : {kStranger, int64_t{1}}) {
    Session both{};
    both.incident = [session](int i, Time now, CameraPredictor& predictor, Robot& robot) {
      if (i < 60) return;
      JointVector there(2);
      there << -1.5, 1.5;
      const CommandedJoints command{now, session, i % 20 >= 10, there};
      EXPECT_EQ(predictor.add_command(now, command), CommandIntake::kTaken);
      robot.send(command, now + milliseconds(150));
      if (i % 20 == 15) {
        EXPECT_NE(predictor.commanders_complaint(now).find("2 senders command the arm"),
                  std::string::npos);
      }
    };
    EXPECT_LT(both.worst_error_rad(3), kLoopError_rad);
    EXPECT_EQ(both.last_driver, kOperator);
  }
}

TEST(CameraPredictor, KnowsWhenTheOperatorIsTheOneWhoIsNotFollowed) {
  Session both{};
  both.incident = [](int i, Time now, CameraPredictor& predictor, Robot& robot) {
    if (i >= 200) return;
    JointVector there(2);
    there << -0.5, 0.5 + 0.01 * (i % 50);
    // Let go first: it drives from the second command on, before the operator does.
    if (i == 0) {
      const CommandedJoints begin{now - milliseconds(10), kStranger, false, there};
      EXPECT_EQ(predictor.add_command(now, begin), CommandIntake::kTaken);
      robot.send(begin, now + milliseconds(100));
    }
    const CommandedJoints command{now - milliseconds(1), kStranger, true, there};
    EXPECT_EQ(predictor.add_command(now, command), CommandIntake::kTaken);
    robot.send(command, now + milliseconds(149));
    EXPECT_EQ(robot.driver() == kOperator, false);
  };
  EXPECT_LT(both.worst_error_rad(3), kLoopError_rad);
}

TEST(CameraPredictor, NothingMovesUntilTheOperatorHasLetGoOnce) {
  Session session{};
  session.incident = [](int i, Time now, CameraPredictor&, Robot& robot) {
    if (i == 100) robot.revoke();
    static_cast<void>(now);
  };
  // The loss of power itself nobody can foresee: it is seen a delay later.
  EXPECT_LT(session.worst_error_rad(3), 0.4);
  EXPECT_EQ(session.last_driver, 0) << "the button is held all the time";
}

// What a stranger may put on the operator's bus, and the robot never sees.
TEST(CameraPredictor, ForgedSessionsDoNotLockTheOperatorOut) {
  Session session{};
  session.incident = [](int i, Time now, CameraPredictor& predictor, Robot&) {
    const auto forge = [&](Time time, int64_t id, bool engaged) {
      return predictor.add_command(now, {time, id, engaged, JointVector::Ones(2)});
    };
    constexpr int64_t kAbsurd = 9'000'000'000'000'000'000;
    EXPECT_EQ(forge(now, kAbsurd, true), CommandIntake::kFuture);
    EXPECT_EQ(forge(now, std::numeric_limits<int64_t>::max(), false), CommandIntake::kFuture);
    EXPECT_EQ(forge({kAbsurd}, kOperator, true), CommandIntake::kFuture);
    EXPECT_EQ(forge({std::numeric_limits<int64_t>::min()}, kOperator, true), CommandIntake::kStale);
    EXPECT_EQ(forge(now - seconds(3600), kOperator, true), CommandIntake::kStale);
    // Many senders at once, so that the operator's own would be displaced.
    for (int64_t id = 1; id < 20; ++id) {
      if (i > 40) static_cast<void>(forge(now, 5'000 + 20 * i + id, i % 2 == 0));
    }
  };
  EXPECT_LT(session.worst_error_rad(3), kLoopError_rad);
}

// The controller takes commands up to 2 s from its clock: within that the arm follows.
TEST(CameraPredictor, ClocksThatDifferALittleAreReckonedWith) {
  for (const int ahead_ms : {-40, -20, 20, 40}) {
    Session session{.operator_clock = milliseconds(ahead_ms)};
    EXPECT_LT(session.worst_error_rad(3), kLoopError_rad) << ahead_ms;
    EXPECT_GT(session.predictions, 250);
  }
}

class Predictor : public testing::Test {
 protected:
  MeasuredJoints at_rest(Time t) const {
    return {t,
            JointVector::Zero(2),
            JointVector::Zero(2),
            JointVector::Zero(2),
            JointVector::Zero(2),
            {},
            {}};
  }
  void make_ready() {
    ASSERT_TRUE(predictor_.set_joint_state(kStart, at_rest(kStart)));
    ASSERT_TRUE(predictor_.set_alignment({7, {}, {}}));
    ASSERT_TRUE(predictor_.set_base(kStart, {kStart, 7, {}}));
  }
  // Let go at kStart, engaged a command later.
  void engage(const JointVector& position_rad) {
    const Time engaged = kStart + kCommandPeriod;
    ASSERT_EQ(predictor_.add_command(kStart, {kStart, 1, false, joints(0, 0)}),
              CommandIntake::kTaken);
    ASSERT_EQ(predictor_.add_command(engaged, {engaged, 1, true, position_rad}),
              CommandIntake::kTaken);
  }
  JointVector joints(double a, double b) const {
    JointVector q(2);
    q << a, b;
    return q;
  }
  CameraPredictor predictor_{two_joints(), {}};
};

TEST_F(Predictor, SaysWhatIsMissing) {
  EXPECT_FALSE(predictor_.predict(kStart));
  EXPECT_EQ(predictor_.reason(), "no JOINT_STATE yet");
  EXPECT_TRUE(predictor_.set_joint_state(kStart, at_rest(kStart)));
  EXPECT_FALSE(predictor_.predict(kStart));
  EXPECT_EQ(predictor_.reason(), "map and robot are not aligned yet");
  EXPECT_TRUE(predictor_.set_alignment({7, {}, {}}));
  EXPECT_FALSE(predictor_.predict(kStart));
  EXPECT_EQ(predictor_.reason(), "no BASE_POSE yet");
  EXPECT_TRUE(predictor_.set_base(kStart, {kStart, 7, {}}));
  EXPECT_TRUE(predictor_.predict(kStart));
  EXPECT_EQ(predictor_.reason(), "");
}

TEST_F(Predictor, StopsWithoutFreshJointStateAndGoesOnWithIt) {
  make_ready();
  for (int i = 1; i <= 20; ++i) {
    const Time t = kStart + milliseconds(10) * i;
    ASSERT_TRUE(predictor_.set_joint_state(t, at_rest(t)));
  }
  const Time last = kStart + milliseconds(200);
  EXPECT_TRUE(predictor_.predict(last + milliseconds(1000)));
  EXPECT_FALSE(predictor_.predict(last + milliseconds(1200)));
  EXPECT_EQ(predictor_.reason(), "no JOINT_STATE for 1.2 s");
  const Time again = last + seconds(5);
  ASSERT_TRUE(predictor_.set_joint_state(again, at_rest(again)));
  EXPECT_TRUE(predictor_.predict(again));
}

TEST_F(Predictor, AClockThatIsSetBackIsNoticedBeforeTheNextMessage) {
  make_ready();
  EXPECT_TRUE(predictor_.predict(kStart));
  EXPECT_FALSE(predictor_.predict(kStart - seconds(3)));
  EXPECT_EQ(predictor_.reason(), "the clock here was set back");
}

TEST_F(Predictor, RefusesWhatIsNotOfThisArmOrOld) {
  make_ready();
  const auto add = [&](Time time, int64_t session, const JointVector& q) {
    return predictor_.add_command(kStart + seconds(1), {time, session, true, q});
  };
  const Time soon = kStart + milliseconds(500);
  EXPECT_EQ(add(soon, 1, JointVector::Zero(4)), CommandIntake::kOtherArm);
  EXPECT_EQ(add(soon, 2, joints(0.1, 0)), CommandIntake::kTaken);
  EXPECT_EQ(add(soon, 2, joints(0.2, 0)), CommandIntake::kOld) << "the same instant";
  EXPECT_EQ(add(soon - milliseconds(1), 2, joints(0.2, 0)), CommandIntake::kOld);
  EXPECT_EQ(add(soon - milliseconds(1), 3, joints(0.2, 0)), CommandIntake::kTaken) << "of another";
  EXPECT_FALSE(predictor_.set_joint_state(kStart, at_rest(kStart))) << "not newer";
  MeasuredJoints absurd = at_rest(kStart + milliseconds(10));
  absurd.reference_velocity_rad_per_s = joints(1e200, 0);
  EXPECT_FALSE(predictor_.set_joint_state(kStart, absurd));
  absurd = at_rest(kStart + milliseconds(10));
  absurd.command_time = {std::numeric_limits<int64_t>::max()};
  EXPECT_FALSE(predictor_.set_joint_state(kStart, absurd));
}

// One message with an absurd stamp, epoch or limit: the stream that keeps coming wins.
TEST_F(Predictor, NoSingleMessageBendsItForGood) {
  make_ready();
  ControllerFacts facts{.limits = {{0.5, 0.5}, 0.1, milliseconds(400)}};
  int predictions_after_s = 0;
  for (int i = 1; i <= 300; ++i) {
    const Time now = kStart + milliseconds(10) * i;
    static_cast<void>(predictor_.set_joint_state(now, at_rest(now)));
    facts.time = now;
    static_cast<void>(predictor_.set_controller(now, facts));
    if (i % 3 == 0) static_cast<void>(predictor_.set_base(now, {now, 7, {}}));
    if (i % 100 == 0) static_cast<void>(predictor_.set_alignment({7, {}, {}}));
    if (i == 100) {
      for (const int64_t us :
           {std::numeric_limits<int64_t>::max(), int64_t{0}, std::numeric_limits<int64_t>::min(),
            (now + seconds(0.9)).us, (now + seconds(1e6)).us, (now - seconds(1e3)).us}) {
        const int64_t epoch = 9'000'000'000'000'000'000;
        ControllerFacts forged{.time = {us}, .limits = {{9, 9}, 1, seconds(50)}};
        static_cast<void>(predictor_.set_joint_state(now, at_rest({us})));
        static_cast<void>(predictor_.set_controller(now, forged));
        static_cast<void>(predictor_.set_base(now, {{us}, epoch, {}}));
        static_cast<void>(predictor_.set_base(now, {{us}, 7, {}}));
        static_cast<void>(predictor_.set_alignment({epoch, {}, {}}));
        EXPECT_FALSE(predictor_.set_base(now, {now, 7, {}, {1e300, 0, 0}}));
      }
    }
    if (i > 200 && predictor_.predict(now)) ++predictions_after_s;
  }
  EXPECT_EQ(predictions_after_s, 100);
  EXPECT_EQ(predictor_.limits(), facts.limits);
  const Time now = kStart + seconds(3);
  EXPECT_EQ(predictor_.predict(now)->epoch, 7);
  EXPECT_LT(predictor_.predict(now)->world_from_base.translation().norm(), 1e-9);
}

TEST_F(Predictor, ANewMapIsFollowedOnceItPersists) {
  make_ready();
  const auto base = [&](int i, int64_t epoch) {
    const Time t = kStart + milliseconds(33) * i;
    return predictor_.set_base(t, {t, epoch, {}});
  };
  EXPECT_FALSE(predictor_.set_alignment({8, {}, {}})) << "nobody else says so";
  EXPECT_FALSE(base(1, 8));
  EXPECT_FALSE(base(2, 8));
  EXPECT_EQ(predictor_.predict(kStart + milliseconds(66))->epoch, 7);
  EXPECT_TRUE(base(3, 8));
  const auto p = predictor_.predict(kStart + milliseconds(99));
  ASSERT_TRUE(p) << predictor_.reason();
  EXPECT_EQ(p->epoch, 8);
}

// The operator's clock is set, as in a session on two machines: 0.15 s each way, 30 commands a
// second that the robot takes while they are less than 2 s from its own clock.
struct ClockStep {
  double step_s = 0;
  int predicted_wrongly = 0, predicted_after = 0;
  bool said = false;
  double delay_ms = 0;

  void run(Duration until) {
    Robot robot({});
    CameraPredictor predictor(two_joints(), {});
    ASSERT_TRUE(predictor.set_alignment({7, {}, {}}));
    const Duration way = milliseconds(150), tick = milliseconds(10);
    std::deque<MeasuredJoints> returning;
    for (int i = 0; tick * i < until; ++i) {
      const Time now = kStart + tick * i;  // the robot's clock
      const bool is_stepped = tick * i >= seconds(6);
      const Time here = now + (is_stepped ? seconds(step_s) : Duration{});
      robot.run_until(now);
      returning.push_back(robot.state());
      while (returning.front().time + way <= now) {
        static_cast<void>(predictor.set_joint_state(here, returning.front()));
        static_cast<void>(predictor.set_base(here, {returning.front().time, 7, {}}));
        returning.pop_front();
      }
      JointVector target(2);
      target << 0.5 * std::sin(0.01 * i), 0;
      const CommandedJoints command{here, kOperator, i > 0, target};
      if (i % 3 == 0) {
        static_cast<void>(predictor.add_command(here, command));
        const bool robot_takes = std::abs(step_s) < 2 || !is_stepped;
        if (robot_takes) robot.send(command, now + way);
      }
      const auto p = predictor.predict(here);
      if (!is_stepped) continue;
      const std::string complaint = predictor.clocks().complaint() + predictor.reason();
      said = said || complaint.find(" ms ") != std::string::npos;
      const double off_s = p ? std::abs((p->instant - now - way).seconds()) : 0;
      // Of a step that a link might have made the second half is awaited first: a round trip.
      const double allowed_s = std::abs(step_s) > 0.5 ? 0.01 : std::abs(step_s) + 0.01;
      if (p && off_s > allowed_s) ++predicted_wrongly;
      if (p && tick * i >= seconds(9)) ++predicted_after;
    }
    delay_ms = 1e3 * predictor.command_delay().seconds();
  }
};

TEST(PredictorClocks, AClockThatIsSetIsSaidAndNothingIsGuessed) {
  for (const double step_s : {3.0, -3.0, 0.3, -0.3}) {
    ClockStep clocks{.step_s = step_s};
    clocks.run(seconds(16));
    EXPECT_TRUE(clocks.said) << step_s;
    EXPECT_EQ(clocks.predicted_wrongly, 0) << step_s;
    EXPECT_EQ(clocks.predicted_after, 0) << step_s;
    if (step_s == 0.3) {
      EXPECT_NEAR(clocks.delay_ms, -150, 5) << "signed";
    }
  }
}

TEST(PredictorClocks, AStepThatLeavesBothLatenciesPossibleIsReckonedWithAfterAWhile) {
  ClockStep clocks{.step_s = 0.1};
  clocks.run(seconds(16));
  EXPECT_TRUE(clocks.said);
  EXPECT_GT(clocks.predicted_after, 300);
  EXPECT_NEAR(clocks.delay_ms, 50, 5);
}

TEST_F(Predictor, WithoutPowerTheArmStaysWhereItIs) {
  make_ready();
  ASSERT_TRUE(predictor_.set_controller(kStart, {.time = kStart, .is_powered = false}));
  engage(joints(1, 1));
  const auto p = predictor_.predict(kStart + milliseconds(400));
  ASSERT_TRUE(p);
  EXPECT_EQ(p->position_rad, JointVector(JointVector::Zero(2)));
}

TEST_F(Predictor, SaysWhichLimitsDifferAndWhoElseDrives) {
  make_ready();
  EXPECT_EQ(predictor_.limits_note(), "");
  ASSERT_TRUE(predictor_.set_controller(kStart, {.time = kStart, .limits = {}}));
  EXPECT_EQ(predictor_.limits_note(), "") << "the same";
  CameraPredictor slow(two_joints(), {});
  ASSERT_TRUE(
      slow.set_controller(kStart, {.time = kStart, .limits = {{0.15, 1}, 0.05, seconds(0.5)}}));
  EXPECT_EQ(slow.limits_note(),
            "the controller's limits are followed: 0.15 rad/s instead of 1 rad/s");
  engage(joints(1, 1));
  const Time now = kStart + seconds(1);
  ASSERT_TRUE(predictor_.set_controller(now, {.time = now, .is_following = true, .driver = 77}));
  EXPECT_NE(predictor_.commanders_complaint(now).find("not at this site"), std::string::npos);
}

TEST_F(Predictor, TheArmLagsBehindItsReferenceAsItDid) {
  MeasuredJoints state = at_rest(kStart);
  state.position_rad = joints(0.003, -0.001);
  ASSERT_TRUE(predictor_.set_joint_state(kStart, state));
  ASSERT_TRUE(predictor_.set_alignment({7, {}, {}}));
  ASSERT_TRUE(predictor_.set_base(kStart, {kStart, 7, {}}));
  const auto p = predictor_.predict(kStart + milliseconds(100));
  ASSERT_TRUE(p);
  EXPECT_TRUE(p->position_rad.isApprox(state.position_rad));
}

TEST_F(Predictor, CommandModeShowsTheCommandInsideTheLimits) {
  predictor_ = CameraPredictor(two_joints(), {.joints = PredictedJoints::kCommand});
  make_ready();
  engage(joints(5, -1));
  const auto p = predictor_.predict(kStart + kCommandPeriod);
  ASSERT_TRUE(p);
  EXPECT_DOUBLE_EQ(p->position_rad[0], 1.95);
  EXPECT_DOUBLE_EQ(p->position_rad[1], -1);
}

TEST_F(Predictor, TheBaseGoesOnWithItsVelocity) {
  predictor_ = CameraPredictor(two_joints(), {.longest_silence = seconds(60)});
  make_ready();
  const Time then = kStart + milliseconds(100);
  EXPECT_TRUE(predictor_.set_base(then, {then, 7, {}, {0.1, 0, 0}, {0, 0, 0.2}}));
  const auto p = predictor_.predict(then + milliseconds(500));
  ASSERT_TRUE(p);
  EXPECT_NEAR(p->world_from_base.translation().x(), 0.05, 1e-12);
  EXPECT_NEAR(Eigen::AngleAxisd(p->world_from_base.rotation()).angle(), 0.1, 1e-9);
  const auto late = predictor_.predict(kStart + seconds(20));
  EXPECT_NEAR(late->world_from_base.translation().x(), 0.15, 1e-12) << "not for ever";
}

// A ship's heave: 10 cm, 6 s. 0.3 s ahead at full acceleration.
TEST_F(Predictor, TheBaseKeepsItsAccelerationForAWhile) {
  predictor_ = CameraPredictor(two_joints(), {.longest_silence = seconds(60)});
  make_ready();
  const double rate = 2 * 3.14159265 / 6;
  const auto height_m = [&](double t_s) { return 0.1 * std::cos(rate * t_s); };
  for (int i = 0; i <= 90; ++i) {
    const double t_s = i / 30.0;
    BaseMotion base{kStart + seconds(t_s), 7, {}, {0, 0, -0.1 * rate * std::sin(rate * t_s)}, {}};
    base.world_from_base = {Eigen::Quaterniond::Identity(), {0, 0, height_m(t_s)}};
    EXPECT_EQ(predictor_.set_base(base.time, base), i > 0)
        << "the first is not newer than make_ready()'s";
  }
  EXPECT_FALSE(predictor_.set_base(kStart + seconds(3), {kStart + milliseconds(2500), 7, {}}))
      << "not newer";
  const auto p = predictor_.predict(kStart + milliseconds(3300));
  ASSERT_TRUE(p);
  const double error_m = std::abs(p->world_from_base.translation().z() - height_m(3.3));
  const double by_velocity_m =
      std::abs(height_m(3) - 0.1 * rate * std::sin(3 * rate) * 0.3 - height_m(3.3));
  EXPECT_LT(error_m, 0.4 * by_velocity_m);
}

TEST_F(Predictor, TheMapIsReachedThroughTheAlignment) {
  make_ready();
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitY()));
  ASSERT_TRUE(predictor_.set_alignment(
      {7, {2.0, turn, {1, 2, 3}}, {Eigen::Quaterniond::Identity(), {0, 0, 1}}}));
  const auto p = predictor_.predict(kStart);
  ASSERT_TRUE(p);
  // Both joints at 0: the hand is 1 m along x, the camera 1 m above it.
  EXPECT_TRUE(p->world_from_cam.translation().isApprox(Eigen::Vector3d(1, 0, 1)));
  const Eigen::Vector3d in_map = turn.conjugate() * (Eigen::Vector3d(0, -2, -2) / 2.0);
  EXPECT_TRUE(p->map_from_cam.translation().isApprox(in_map));
}

}  // namespace
}  // namespace foresight
