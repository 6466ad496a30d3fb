#include "procs/renderer/camera_predictor.h"

#include <gtest/gtest.h>

#include <random>

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

// The robot's side: commands arrive after a delay, the reference follows them, and the operator's
// side sees its state after another.
class Robot {
 public:
  explicit Robot(const CameraPredictorOptions& options) : options_(options), reference_({1, 1}) {
    reference_.rest(kStart, JointVector::Zero(2));
  }
  // The loop as wam_controller runs it, every 2 ms.
  void run_until(Time time) {
    for (; now_ <= time; now_ = now_ + milliseconds(2)) {
      while (!arriving_.empty() && arriving_.front().second <= now_) {
        accept(arriving_.front().first);
        arriving_.pop_front();
      }
      if (moves_ && now_ - arrival_ > options_.command_timeout) {
        reference_.stop(now_);
        moves_ = false;
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

 private:
  void accept(const CommandedJoints& command) {
    command_time_ = command.time;
    arrival_ = now_;
    moves_ = command.engaged;
    if (command.engaged) {
      reference_.follow(now_, two_joints().clamp(command.position_rad, options_.joint_margin_rad));
    } else {
      reference_.stop(now_);
    }
  }
  CameraPredictorOptions options_;
  JointReference reference_;
  std::deque<std::pair<CommandedJoints, Time>> arriving_;
  Time now_ = kStart, command_time_, arrival_;
  bool moves_ = false;
};

// Runs an operator who moves at random with the given delay each way; returns the worst error of
// the predicted joints against where the reference was at the predicted instant, after a second.
struct Session {
  CameraPredictorOptions options;
  Duration delay = milliseconds(150);
  double loss = 0, disengaged = 0;
  int silence_from = -1;  // number of the command after which the operator is gone for a second

  double worst_error_rad(uint32_t seed) const {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(0, 1);
    Robot robot(options);
    CameraPredictor predictor(two_joints(), options);
    predictor.set_alignment({7, {}, {}});
    predictor.set_base({kStart, 7, {}});
    std::deque<MeasuredJoints> returning;
    std::deque<std::pair<Time, JointVector>> predictions;
    JointVector target = JointVector::Zero(2);
    double worst = 0;
    for (int i = 0; i < 300; ++i) {
      const Time now = kStart + kCommandPeriod * i;
      robot.run_until(now);
      returning.push_back(robot.state());
      while (!returning.empty() && returning.front().time + delay <= now) {
        EXPECT_TRUE(predictor.set_joint_state(returning.front()));
        returning.pop_front();
      }
      if (i % 10 == 0) target << 4 * uniform(random) - 2, 4 * uniform(random) - 2;
      const bool silent = silence_from >= 0 && i >= silence_from && i < silence_from + 30;
      if (!silent) {
        const CommandedJoints command{now, 1, uniform(random) >= disengaged, target};
        EXPECT_TRUE(predictor.add_command(command));
        if (uniform(random) >= loss) robot.send(command, now + delay);
      }
      while (!predictions.empty() && predictions.front().first <= now) {
        const MeasuredJoints s = robot.state();
        worst = std::max(worst, error_at(predictions.front(), s));
        predictions.pop_front();
      }
      if (i > 30) {
        const auto p = predictor.predict(now);
        if (p) predictions.push_back({p->instant, p->position_rad});
      }
    }
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
    const Session session{.options = {}, .delay = milliseconds(delay_ms)};
    EXPECT_LT(session.worst_error_rad(3), kLoopError_rad) << delay_ms << " ms";
  }
}

TEST(CameraPredictor, NeedsTheLimitsOfTheController) {
  const Session session{.options = {.limits = {.velocity = 1, .acceleration = 2}}};
  EXPECT_GT(session.worst_error_rad(3), 10 * kLoopError_rad);
}

TEST(CameraPredictor, KnowsThatDisengagingStopsTheArm) {
  const Session session{.options = {}, .disengaged = 0.3};
  EXPECT_LT(session.worst_error_rad(4), kLoopError_rad);
}

TEST(CameraPredictor, KnowsThatSilenceStopsTheArm) {
  const Session session{.options = {}, .silence_from = 120};
  EXPECT_LT(session.worst_error_rad(5), kLoopError_rad);
}

TEST(CameraPredictor, LossCostsNoMoreThanTheCommandsLost) {
  const Session session{.options = {}, .loss = 0.1};
  // A lost change of target is made good by the next command, one period later: at most 1 rad/s²
  // over a few periods of wrong acceleration.
  EXPECT_LT(session.worst_error_rad(6), 0.05);
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
    ASSERT_TRUE(predictor_.set_joint_state(at_rest(kStart)));
    predictor_.set_alignment({7, {}, {}});
    predictor_.set_base({kStart, 7, {}});
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
  predictor_.set_joint_state(at_rest(kStart));
  EXPECT_FALSE(predictor_.predict(kStart));
  EXPECT_EQ(predictor_.reason(), "map and robot are not aligned yet");
  predictor_.set_alignment({7, {}, {}});
  predictor_.set_base({kStart, 6, {}});  // of another map
  EXPECT_FALSE(predictor_.predict(kStart));
  EXPECT_EQ(predictor_.reason(), "no BASE_POSE yet");
  predictor_.set_base({kStart, 7, {}});
  EXPECT_TRUE(predictor_.predict(kStart));
  EXPECT_EQ(predictor_.reason(), "");
}

TEST_F(Predictor, RefusesWhatIsNotOfThisArmOrOld) {
  make_ready();
  EXPECT_FALSE(predictor_.add_command({kStart, 1, true, JointVector::Zero(4)}));
  EXPECT_TRUE(predictor_.add_command({kStart, 2, true, joints(0.1, 0)}));
  EXPECT_FALSE(predictor_.add_command({kStart, 2, true, joints(0.2, 0)})) << "the same instant";
  EXPECT_FALSE(predictor_.add_command({kStart + seconds(1), 1, true, joints(0.2, 0)}))
      << "an earlier session";
  EXPECT_TRUE(predictor_.add_command({kStart - seconds(1), 3, true, joints(0.2, 0)}))
      << "a new session begins anew";
  EXPECT_FALSE(predictor_.set_joint_state(at_rest(kStart))) << "not newer";
}

TEST_F(Predictor, WithoutPowerTheArmStaysWhereItIs) {
  make_ready();
  predictor_.set_powered(false);
  predictor_.add_command({kStart, 1, true, joints(1, 1)});
  const auto p = predictor_.predict(kStart + milliseconds(400));
  ASSERT_TRUE(p);
  EXPECT_EQ(p->position_rad, JointVector(JointVector::Zero(2)));
}

TEST_F(Predictor, TheArmLagsBehindItsReferenceAsItDid) {
  MeasuredJoints state = at_rest(kStart);
  state.position_rad = joints(0.003, -0.001);
  ASSERT_TRUE(predictor_.set_joint_state(state));
  predictor_.set_alignment({7, {}, {}});
  predictor_.set_base({kStart, 7, {}});
  const auto p = predictor_.predict(kStart + milliseconds(100));
  ASSERT_TRUE(p);
  EXPECT_TRUE(p->position_rad.isApprox(state.position_rad));
}

TEST_F(Predictor, CommandModeShowsTheCommandInsideTheLimits) {
  predictor_ = CameraPredictor(two_joints(), {.joints = PredictedJoints::kCommand});
  make_ready();
  predictor_.add_command({kStart, 1, true, joints(5, -1)});
  const auto p = predictor_.predict(kStart);
  ASSERT_TRUE(p);
  EXPECT_DOUBLE_EQ(p->position_rad[0], 1.95);
  EXPECT_DOUBLE_EQ(p->position_rad[1], -1);
}

TEST_F(Predictor, TheBaseGoesOnWithItsVelocity) {
  make_ready();
  const Time then = kStart + milliseconds(100);
  EXPECT_TRUE(predictor_.set_base({then, 7, {}, {0.1, 0, 0}, {0, 0, 0.2}}));
  const auto p = predictor_.predict(then + milliseconds(500));
  ASSERT_TRUE(p);
  EXPECT_NEAR(p->world_from_base.translation().x(), 0.05, 1e-12);
  EXPECT_NEAR(Eigen::AngleAxisd(p->world_from_base.rotation()).angle(), 0.1, 1e-9);
  const auto late = predictor_.predict(kStart + seconds(20));
  EXPECT_NEAR(late->world_from_base.translation().x(), 0.15, 1e-12) << "not for ever";
}

// A ship's heave: 10 cm, 6 s. 0.3 s ahead at full acceleration.
TEST_F(Predictor, TheBaseKeepsItsAccelerationForAWhile) {
  make_ready();
  const double rate = 2 * 3.14159265 / 6;
  const auto height_m = [&](double t_s) { return 0.1 * std::cos(rate * t_s); };
  for (int i = 0; i <= 90; ++i) {
    const double t_s = i / 30.0;
    BaseMotion base{kStart + seconds(t_s), 7, {}, {0, 0, -0.1 * rate * std::sin(rate * t_s)}, {}};
    base.world_from_base = {Eigen::Quaterniond::Identity(), {0, 0, height_m(t_s)}};
    EXPECT_EQ(predictor_.set_base(base), i > 0) << "the first is not newer than make_ready()'s";
  }
  EXPECT_FALSE(predictor_.set_base({kStart + milliseconds(2500), 7, {}})) << "not newer";
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
  predictor_.set_alignment(
      {7, {2.0, turn, {1, 2, 3}}, {Eigen::Quaterniond::Identity(), {0, 0, 1}}});
  const auto p = predictor_.predict(kStart);
  ASSERT_TRUE(p);
  // Both joints at 0: the hand is 1 m along x, the camera 1 m above it.
  EXPECT_TRUE(p->world_from_cam.translation().isApprox(Eigen::Vector3d(1, 0, 1)));
  const Eigen::Vector3d in_map = turn.conjugate() * (Eigen::Vector3d(0, -2, -2) / 2.0);
  EXPECT_TRUE(p->map_from_cam.translation().isApprox(in_map));
}

}  // namespace
}  // namespace foresight
