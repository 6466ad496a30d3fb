// The complete system with the simulated robot in the loop, in one thread on a simulated clock.
#include "sim/swarm/closed_loop.h"

#include <gtest/gtest.h>

#include "bench/evaluate/closed_loop_scorer.h"
#include "bench/evaluate/image_scores.h"
#include "common/message_bytes.h"
#include "foresight/base_pose_t.hpp"
#include "foresight/controller_state_t.hpp"
#include "foresight/display_stats_t.hpp"
#include "foresight/health_t.hpp"
#include "foresight/joint_command_t.hpp"
#include "foresight/joint_state_t.hpp"
#include "foresight/pendant_t.hpp"
#include "tests/swarm/traffic.h"

namespace foresight {
namespace {

// Small and slow pictures: what is tested does not depend on them.
ClosedLoopOptions options(double seconds, std::vector<std::string> more = {}) {
  ClosedLoopOptions o{.seconds = seconds, .delay_s = 0.3};
  o.settings = {"sim.camera_width_px=320", "sim.camera_rate_hz=15", "renderer.used_views=2"};
  o.settings.insert(o.settings.end(), more.begin(), more.end());
  return o;
}

std::vector<double> of(const std::vector<PoseError>& errors, double PoseError::*member) {
  std::vector<double> values;
  for (const PoseError& e : errors) values.push_back(e.*member);
  return values;
}

// One minute: slam starts, the map is aligned, the base is pushed, the arm moves all the time.
TEST(ClosedLoop, AMinuteTwiceIsTheSameToTheLastByte) {
  const auto session = options(60, {"sim.base_motion=push", "renderer.idle_rate_hz=0.5",
                                    "omni.rate_hz=10", "sim.camera_rate_hz=10"});
  ClosedLoop first(session);
  const Traffic a = run_all(first);
  ClosedLoop second(session);
  const Traffic b = run_all(second);
  EXPECT_EQ(a.counts, b.counts);
  EXPECT_EQ(a.hash, b.hash);
  EXPECT_NEAR(a.counts.at("ARM_ENCODERS"), 30'000, 2);
  EXPECT_NEAR(a.counts.at("ARM_TORQUES"), 30'000, 2);
  EXPECT_GT(a.counts.at("MESH"), 10);
  EXPECT_GT(a.counts.at("BASE_POSE"), 300);
}

TEST(ClosedLoop, PredictsWhereTheCameraWillBeThoughTheBaseIsPushed) {
  // Long enough that the second after the push, which nobody can foresee, is less than 5 % of it.
  const auto r = evaluate(options(40, {"sim.base_motion=push"}), {.every = 60}, [](double) {});
  ASSERT_GT(r.predicted_frames, 300);
  EXPECT_GT(r.first_aligned_s, 0);
  EXPECT_EQ(r.controller_faults, 0);
  // At 320 px a shift of 1.5 px is one of 3 px at 640.
  EXPECT_LT(percentile(of(r.predictions, &PoseError::shift_px), 0.5), 1.5);
  EXPECT_LT(percentile(of(r.predictions, &PoseError::shift_px), 0.95), 4);
  EXPECT_LT(percentile(of(r.base, &PoseError::position_mm), 0.5), 5);
  EXPECT_LT(percentile(of(r.base, &PoseError::angle_deg), 0.5), 0.3);
  EXPECT_LT(std::abs(r.scale_error), 0.01);
  EXPECT_GT(percentile(of(r.commands, &PoseError::shift_px), 0.5),
            3 * percentile(of(r.predictions, &PoseError::shift_px), 0.5))
      << "predicting the robot is worth more than showing the hand";
  EXPECT_GT(r.predicted.mean_psnr_common_db(), r.delayed.mean_psnr_common_db() + 4);
}

// The controller moves at no more than 0.15 rad/s, the renderer's own parameters say 1: untold, the
// view is 28 px off.
TEST(ClosedLoop, TheViewFollowsTheLimitsThatTheControllerTells) {
  const auto r = evaluate(options(20, {"wam_controller.velocity_limit_rad_per_s=0.15"}),
                          {.every = 1000}, [](double) {});
  ASSERT_GT(r.predicted_frames, 100);
  EXPECT_LT(percentile(of(r.predictions, &PoseError::shift_px), 0.5), 1.5);
  EXPECT_LT(percentile(of(r.predictions, &PoseError::shift_px), 0.95), 4);
}

// What the operator's screen and the controller say after an incident at 12 s.
struct Aftermath {
  int predictions = 0, base_poses = 0, following = 0;
  int8_t controller = -1;
  std::string reason;
};

void watch(ClosedLoop& loop, Time since, Aftermath* after) {
  Simulation& world = loop.world();
  world.listen(Domain::kOperator, "DISPLAY_STATS", [=, &world](auto bytes) {
    if (world.now() >= since && decode<display_stats_t>(bytes).epoch != 0) ++after->predictions;
  });
  world.listen(Domain::kRobot, "BASE_POSE", [=, &world](auto) {
    if (world.now() >= since) ++after->base_poses;
  });
  world.listen(Domain::kRobot, "CONTROLLER_STATE", [=](auto bytes) {
    const auto message = decode<controller_state_t>(bytes);
    after->controller = message.state;
    after->reason = message.reason;
  });
}

class KilledInTheLoop : public testing::TestWithParam<const char*> {};

TEST_P(KilledInTheLoop, IsReplacedAndTheOthersGoOn) {
  ClosedLoop loop(options(24));
  Aftermath after;
  watch(loop, loop.start() + seconds(18), &after);
  while (loop.world().now() < loop.start() + seconds(12)) ASSERT_TRUE(loop.step());
  loop.restart(GetParam());
  run_all(loop);
  EXPECT_GT(after.predictions, 30);
  EXPECT_GT(after.base_poses, 30);
  EXPECT_TRUE(after.controller == controller_state_t::STATE_FOLLOWING) << after.reason;
}

INSTANTIATE_TEST_SUITE_P(Processes, KilledInTheLoop,
                         testing::Values("wam_controller", "calibrator", "omni", "link"),
                         [](const auto& param_info) { return std::string(param_info.param); });

// Commands of a session from the future, at the operator's side: nobody is locked out, neither on
// the screen nor at the arm.
TEST(ClosedLoop, AForgedSessionBendsNothing) {
  ClosedLoop loop(options(16));
  Aftermath after;
  watch(loop, loop.start() + seconds(13), &after);
  health_t display{};
  loop.world().listen(Domain::kOperator, "HEALTH", [&display](auto bytes) {
    const auto health = decode<health_t>(bytes);
    if (health.process == "renderer") display = health;
  });
  for (int i = 0; i < 30; ++i) {
    joint_command_t forged{};
    const Time time = loop.start() + seconds(11) + milliseconds(33) * i;
    forged.utime = time.us;
    forged.session = 9'000'000'000'000'000'000;
    forged.seq = i;
    forged.engaged = i % 2 == 0 ? 0 : 1;
    forged.position_rad = {1.5, 1.5, 1.5, 1.5};
    forged.n_joints = 4;
    loop.world().inject(time, Domain::kOperator, "JOINT_COMMAND", encode(forged));
  }
  run_all(loop);
  EXPECT_GT(after.predictions, 30);
  EXPECT_TRUE(after.controller == controller_state_t::STATE_FOLLOWING) << after.reason;
  EXPECT_TRUE(display.state == health_t::STATE_OK) << display.reason;
}

// A person presses the pendant's E-STOP: the controller says so, the view predicts an arm that
// stands still, and nothing moves until the pendant is reset and activated.
TEST(ClosedLoop, AnEmergencyStopStopsTheArmAndThePrediction) {
  ClosedLoop loop(options(20));
  Simulation& world = loop.world();
  Aftermath after;
  watch(loop, loop.start() + seconds(12), &after);
  double speed_rad_per_s = 0;
  world.listen(Domain::kRobot, "JOINT_STATE", [&](auto bytes) {
    const auto message = decode<joint_state_t>(bytes);
    if (world.now() < loop.start() + seconds(14)) return;
    for (double v : message.velocity_rad_per_s) {
      speed_rad_per_s = std::max(speed_rad_per_s, std::abs(v));
    }
  });
  pendant_t stop{};
  stop.utime = (loop.start() + seconds(11)).us;
  stop.button = pendant_t::BUTTON_ESTOP;
  world.inject(loop.start() + seconds(11), Domain::kRobot, "PENDANT", encode(stop));
  run_all(loop);
  EXPECT_TRUE(after.controller == controller_state_t::STATE_IDLE ||
              after.controller == controller_state_t::STATE_FAULT);
  EXPECT_FALSE(after.reason.empty());
  EXPECT_LT(speed_rad_per_s, 1.0) << "it sinks, braked";
  EXPECT_GT(after.predictions, 5) << "the view goes on, and says what the robot is doing";
}

// It used to take the arm smoothly, and the operator was refused from then on.
TEST(ClosedLoop, AForgedCommandNeitherTakesTheArmNorLocksItsOperatorOut) {
  ClosedLoop loop(options(16));
  Simulation& world = loop.world();
  Aftermath after;
  watch(loop, loop.start() + seconds(14), &after);
  int64_t drivers = 0, last_driver = 0;
  bool is_said = false;
  world.listen(Domain::kRobot, "CONTROLLER_STATE", [&](auto bytes) {
    const auto message = decode<controller_state_t>(bytes);
    if (message.driver_session != 0 && message.driver_session != last_driver) ++drivers;
    if (message.driver_session != 0) last_driver = message.driver_session;
  });
  world.listen(Domain::kRobot, "HEALTH", [&](auto bytes) {
    const auto message = decode<health_t>(bytes);
    is_said |= message.process == "wam_controller" &&
               message.reason.find("a second operator commands") != std::string::npos;
  });
  for (int i = 0; i < 60; ++i) {
    const Time time = loop.start() + seconds(9) + milliseconds(33) * i;
    joint_command_t forged{};
    forged.utime = time.us;
    forged.session = i % 2 == 0 ? time.us : 9'000'000'000'000'000'000;
    forged.seq = i;
    forged.engaged = i % 4 == 3 ? 0 : 1;
    forged.n_joints = 4;
    forged.position_rad = {2, 1, 1, 0};
    world.inject(time, Domain::kRobot, "JOINT_COMMAND", encode(forged));
  }
  run_all(loop);
  EXPECT_EQ(drivers, 1);
  EXPECT_TRUE(is_said);
  EXPECT_EQ(after.controller, +controller_state_t::STATE_FOLLOWING) << after.reason;
}

}  // namespace
}  // namespace foresight
