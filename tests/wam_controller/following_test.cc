// The whole process in closed loop: following, limits, endings.
#include <gtest/gtest.h>

#include <random>

#include "common/joint_reference.h"
#include "tests/wam_controller/rig.h"

namespace foresight {
namespace {

JointVector read(const std::vector<double>& v) {
  return JointVector::Map(v.data(), static_cast<Eigen::Index>(v.size()));
}

class Following : public testing::Test {
 protected:
  void start() {
    rig.start_arm();
    rig.run(milliseconds(200));
  }
  JointVector near_home(double shift) { return rig.arm.home().array() + shift; }
  // Largest difference of reference and measurement since the run began.
  double worst_error_rad() const {
    double worst = 0;
    for (const joint_state_t& s : rig.joint_states) {
      worst = std::max(
          worst, (read(s.reference_position_rad) - read(s.position_rad)).cwiseAbs().maxCoeff());
    }
    return worst;
  }
  Rig rig{Rig::params_of("wam4")};
};

TEST_F(Following, HoldsWhereItWasActivated) {
  start();
  EXPECT_EQ(rig.does(), ArmState::kHolding);
  EXPECT_EQ(rig.state().reason, "waits for an engaged command");
  rig.run(seconds(2));
  EXPECT_LT((rig.measured() - rig.arm.home()).cwiseAbs().maxCoeff(), 2e-3);
  EXPECT_EQ(rig.joint_states.back().command_utime, 0);
}

TEST_F(Following, GoesWhereItIsCommandedWithSmallError) {
  start();
  const JointVector target = joints({0.8, -0.9, 0.5, 1.4});
  rig.command_for(seconds(3), target);
  EXPECT_EQ(rig.does(), ArmState::kFollowing);
  EXPECT_EQ(rig.state().reason, "");
  EXPECT_LT((rig.measured() - target).cwiseAbs().maxCoeff(), 2e-3);
  EXPECT_LT(worst_error_rad(), 8e-3);
  EXPECT_EQ(read(rig.joint_states.back().target_position_rad), target);
  EXPECT_NEAR(static_cast<double>(rig.joint_states.size()), 320, 2);
  EXPECT_EQ(rig.torques.size(), 1600u + 1);
}

TEST_F(Following, FeedForwardLowersTheTrackingError) {
  WamControllerParams without = Rig::params_of("wam4");
  without.inertia_feed_forward = false;
  Rig plain(without);
  double errors[2] = {0, 0};
  int which = 0;
  for (Rig* r : {&rig, &plain}) {
    r->start_arm();
    r->run(milliseconds(200));
    for (int i = 0; i < 4; ++i) {
      const double side = i % 2 == 0 ? 1 : -1;
      r->command_for(seconds(1.2), joints({side * 0.6, -0.3 - side * 0.5, side * 0.4, 1.8}));
    }
    double sum = 0;
    for (const joint_state_t& s : r->joint_states) {
      sum += (read(s.reference_position_rad) - read(s.position_rad)).squaredNorm();
    }
    errors[which++] = std::sqrt(sum / static_cast<double>(r->joint_states.size()));
  }
  std::printf("tracking error, rms over joints: %.2e rad with feed-forward, %.2e without\n",
              errors[0], errors[1]);
  EXPECT_LT(errors[0], errors[1]);
}

TEST_F(Following, TheReferenceKeepsItsLimitsWhateverIsCommanded) {
  start();
  std::mt19937 random(6);
  std::uniform_real_distribution<double> any(-4, 4);
  rig.command_for(seconds(10), [&](int) {
    return joints({any(random), any(random), any(random), any(random)});
  });
  const JointVector lower = rig.arm.clamp(JointVector::Constant(4, -9), 0.05);
  const JointVector upper = rig.arm.clamp(JointVector::Constant(4, 9), 0.05);
  JointVector last = JointVector::Zero(4);
  for (const joint_state_t& s : rig.joint_states) {
    const JointVector velocity = read(s.reference_velocity_rad_per_s);
    const JointVector position = read(s.reference_position_rad);
    ASSERT_LE(velocity.cwiseAbs().maxCoeff(), 1 + 1e-9);
    ASSERT_LE((velocity - last).cwiseAbs().maxCoeff(), 0.01 + 1e-9);  // 1 rad/s² for 10 ms
    ASSERT_TRUE((position.array() <= upper.array() + 1e-9).all());
    ASSERT_TRUE((position.array() >= lower.array() - 1e-9).all());
    last = velocity;
  }
  EXPECT_GT(rig.state().commands_limited, 100);
  EXPECT_LT(worst_error_rad(), 0.05);
}

TEST_F(Following, BeginsWithoutAJumpWhereverTheArmStands) {
  rig.plant.position = joints({-1, 0.4, 1.5, 0.3});
  rig.safety = arm_encoders_t::SAFETY_IDLE;
  rig.start_arm();
  rig.command_for(seconds(1), near_home(0));  // the operator is early
  EXPECT_EQ(rig.does(), ArmState::kIdle);
  EXPECT_EQ(rig.largest_torque_nm(), 0);
  rig.safety = arm_encoders_t::SAFETY_ACTIVE;
  const JointVector before = rig.measured();
  rig.command_for(milliseconds(100), near_home(0));
  EXPECT_EQ(rig.does(), ArmState::kFollowing);
  EXPECT_LT((rig.measured() - before).cwiseAbs().maxCoeff(), 0.5 * 0.1 * 0.1 + 2e-3);
  rig.command_for(seconds(4), near_home(0));
  EXPECT_LT((rig.measured() - near_home(0)).cwiseAbs().maxCoeff(), 2e-3);
}

TEST_F(Following, RampsDownWhenCommandsStop) {
  start();
  rig.command_for(seconds(1), near_home(-2));
  const int64_t last_command = rig.joint_states.back().command_arrival_utime;
  const size_t before = rig.joint_states.size();
  rig.run(seconds(2));
  EXPECT_TRUE(rig.was_in(ArmState::kStopping));
  EXPECT_EQ(rig.does(), ArmState::kHolding);
  EXPECT_EQ(rig.state().reason, "commands stopped coming");
  for (size_t i = before; i < rig.joint_states.size(); ++i) {
    const joint_state_t& s = rig.joint_states[i];
    const double late_s = 1e-6 * static_cast<double>(s.utime - last_command) - 0.5;
    const double top = std::max(0.0, 1 - std::max(0.0, late_s));
    ASSERT_LE(read(s.reference_velocity_rad_per_s).cwiseAbs().maxCoeff(), top + 1e-9);
  }
  rig.command_for(milliseconds(100), near_home(-0.5));
  EXPECT_EQ(rig.does(), ArmState::kFollowing);
}

TEST_F(Following, RampsDownWhenTheOperatorLetsGo) {
  start();
  rig.command_for(seconds(0.8), near_home(-2));
  joint_command_t let_go = rig.make_command(JointVector(0), false);
  rig.send(let_go);
  rig.run(milliseconds(20));
  EXPECT_EQ(rig.does(), ArmState::kStopping);
  EXPECT_EQ(rig.state().reason, "the operator let go");
  EXPECT_EQ(rig.joint_states.back().command_utime, let_go.utime);
  rig.run(seconds(1));
  EXPECT_EQ(rig.does(), ArmState::kHolding);
  EXPECT_LT(read(rig.joint_states.back().velocity_rad_per_s).cwiseAbs().maxCoeff(), 0.02);
}

TEST_F(Following, ReEngagedWhileStoppingGoesOnWithItsVelocity) {
  start();
  rig.command_for(seconds(0.8), near_home(-2));
  rig.send(rig.make_command(JointVector(0), false));
  rig.run(milliseconds(100));
  const double slowed = read(rig.joint_states.back().reference_velocity_rad_per_s)[0];
  rig.command_for(milliseconds(10), near_home(-2));
  EXPECT_EQ(rig.does(), ArmState::kFollowing);
  EXPECT_NEAR(read(rig.joint_states.back().reference_velocity_rad_per_s)[0], slowed, 0.021);
}

TEST_F(Following, DropsWhatIsOutOfOrderStaleOrMisshapen) {
  start();
  const joint_command_t first = rig.make_command(near_home(0.1));
  const joint_command_t second = rig.make_command(near_home(0.2));
  rig.send(second);
  rig.send(first);
  rig.run(milliseconds(10));
  EXPECT_EQ(read(rig.joint_states.back().target_position_rad), near_home(0.2));
  joint_command_t stale = rig.make_command(near_home(0.3));
  stale.utime -= 3'000'000;
  rig.send(stale);
  rig.send(rig.make_command(joints({1, 2, 3})));
  rig.send(rig.make_command(JointVector::Constant(7, 0.1)));
  joint_command_t many = rig.make_command(near_home(0.3));
  many.position_rad.resize(5'000, 0.5);
  many.n_joints = 5'000;
  rig.send(many);
  rig.run(milliseconds(200));
  EXPECT_EQ(read(rig.joint_states.back().target_position_rad), near_home(0.2));
  EXPECT_EQ(rig.state().commands_accepted, 1);
  EXPECT_EQ(rig.state().commands_out_of_order, 1);
  EXPECT_EQ(rig.state().commands_stale, 1);
  EXPECT_EQ(rig.state().commands_refused, 3);
}

TEST_F(Following, ARestartedOperatorSiteTakesOver) {
  start();
  rig.command_for(seconds(0.5), near_home(-0.4));
  joint_command_t old = rig.make_command(near_home(-0.4));
  rig.session += 500'000;
  rig.seq = 0;
  rig.command_for(milliseconds(50), near_home(0.3));
  rig.send(old);
  rig.run(milliseconds(20));
  EXPECT_EQ(read(rig.joint_states.back().target_position_rad), near_home(0.3));
  EXPECT_EQ(rig.state().commands_out_of_order, 0);
  rig.run(milliseconds(100));
  EXPECT_EQ(rig.state().commands_out_of_order, 1);
}

// What prediction of the robot rests on: commands and arrival times tell the reference.
TEST_F(Following, AnotherJointReferenceFedTheSamePredictsTheSame) {
  start();
  JointReference twin({1, 1});
  twin.rest(rig.world.now(), read(rig.joint_states.back().reference_position_rad));
  Time stop_at{0};
  rig.world.listen(Domain::kRobot, "JOINT_COMMAND", [&](auto bytes) {
    joint_command_t m{};
    ASSERT_GT(m.decode(bytes.data(), 0, static_cast<int>(bytes.size())), 0);
    twin.follow(rig.world.now(), read(m.position_rad));
    stop_at = rig.world.now() + milliseconds(500);
  });
  int compared = 0;
  rig.world.listen(Domain::kRobot, "JOINT_STATE", [&](auto bytes) {
    joint_state_t m{};
    ASSERT_GT(m.decode(bytes.data(), 0, static_cast<int>(bytes.size())), 0);
    if (stop_at.us > 0 && rig.world.now() > stop_at) {
      twin.stop(stop_at);
      stop_at = {0};
    }
    const JointMotion motion = twin.at({m.utime});
    ASSERT_EQ(read(m.reference_position_rad), motion.position_rad);
    ASSERT_EQ(read(m.reference_velocity_rad_per_s), motion.velocity_rad_per_s);
    ++compared;
  });
  std::mt19937 random(8);
  std::uniform_real_distribution<double> any(-0.8, 0.8);
  rig.command_for(seconds(5), [&](int) { return near_home(any(random)); });
  rig.run(seconds(2));
  EXPECT_GT(compared, 690);
}

TEST_F(Following, TwoRunsGiveTheSameBytes) {
  const auto record = [] {
    Rig own(Rig::params_of("wam4"));
    std::vector<uint8_t> all;
    own.world.set_tap([&](Time, Domain, const std::string&, auto bytes) {
      all.insert(all.end(), bytes.begin(), bytes.end());
    });
    own.start_arm();
    own.command_for(seconds(0.5), joints({0.3, 0.1, -0.2, 2}));
    return all;
  };
  EXPECT_EQ(record(), record());
}

TEST(FollowingWith, SevenJoints) {
  Rig rig(Rig::params_of("wam7"));
  rig.start_arm();
  rig.run(milliseconds(100));
  const JointVector target = joints({0.5, -0.6, 0.3, 2.4, 0.4, -0.3, 0.6});
  rig.command_for(seconds(2.5), target);
  EXPECT_EQ(rig.does(), ArmState::kFollowing);
  EXPECT_LT((rig.measured() - target).cwiseAbs().maxCoeff(), 5e-3);
}

}  // namespace
}  // namespace foresight
