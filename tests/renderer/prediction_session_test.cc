// The predictor in sessions with a robot: where it will be, whom it follows, and by which clock.
#include <gtest/gtest.h>

#include <cmath>
#include <deque>
#include <functional>
#include <limits>
#include <random>
#include <string>

#include "tests/renderer/predicted_robot.h"

namespace foresight {
namespace {

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
    std::deque<std::pair<JointState, ControllerState>> returning;
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
        const JointCommand command{here, kOperator, 0, !begins && uniform(random) >= disengaged,
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
  static double error_at(const std::pair<Time, JointVector>& prediction, const JointState& s) {
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
      const JointCommand command{now, session, i, i % 20 >= 10, there};
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
      const JointCommand begin{now - milliseconds(10), kStranger, 1, false, there};
      EXPECT_EQ(predictor.add_command(now, begin), CommandIntake::kTaken);
      robot.send(begin, now + milliseconds(100));
    }
    const JointCommand command{now - milliseconds(1), kStranger, 2, true, there};
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
      return predictor.add_command(now, {time, id, 0, engaged, JointVector::Ones(2)});
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
    std::deque<JointState> returning;
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
      const JointCommand command{here, kOperator, i, i > 0, target};
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

}  // namespace
}  // namespace foresight
