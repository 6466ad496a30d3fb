// The simulated robot as its controller, its camera's users and its evaluation see it.
#include "common/errors.h"
#include "common/image_codec.h"
#include "common/robot_messages.h"
#include "foresight/health_t.hpp"
#include "sim/lab.h"
#include "sim/robot/process.h"
#include "sim/sequence.h"
#include "tests/common/files.h"
#include "tests/sim/robot_world.h"

namespace foresight::sim {
namespace {

TEST_F(RobotWorld, SaysWhereItsMotorsAreFiveHundredTimesASecond) {
  start();
  run(1);
  const auto encoders = all<arm_encoders_t>("ARM_ENCODERS");
  ASSERT_EQ(encoders.size(), 500u);
  for (size_t i = 0; i < encoders.size(); ++i) {
    ASSERT_EQ(encoders[i].utime, 1'000'000'000 + 2000 * static_cast<int64_t>(i + 1));
  }
  EXPECT_EQ(all<truth_t>("TRUTH_STATE").size(), 100u);
}

TEST_F(RobotWorld, RestsOnItsStandUntilTorquesCome) {
  start();
  run(2);
  EXPECT_EQ(true_position(), load_arm("wam4").home());
  EXPECT_EQ(newest<arm_encoders_t>("ARM_ENCODERS").safety, +arm_encoders_t::SAFETY_ACTIVE);
  EXPECT_EQ(newest<health_t>("HEALTH").state, +health_t::STATE_WAITING);
}

TEST_F(RobotWorld, IsHeldAndMovedByAController) {
  for (const char* name : {"wam4", "wam7"}) {
    const ArmModel arm = load_arm(name);
    params_.arm_file = std::string(FORESIGHT_ARMS) + "/" + name + ".yaml";
    start();
    add_controller();
    run(2);
    EXPECT_LT((true_position() - arm.home()).norm(), 0.01) << name;
    JointVector target = arm.home();
    target[0] += 0.3;
    target[3] -= 0.3;
    for (int i = 1; i <= 100; ++i) {
      controller_->set_target(arm.home() + i * 0.01 * (target - arm.home()));
      run(0.01);
    }
    run(1);
    EXPECT_LT((true_position() - target).norm(), 0.01) << name;
    EXPECT_EQ(newest<arm_encoders_t>("ARM_ENCODERS").fault, "");
    EXPECT_EQ(newest<health_t>("HEALTH").state, +health_t::STATE_OK);
    world_.remove("controller");
    world_.remove("sim");
  }
}

TEST_F(RobotWorld, SinksIntoIdleWhenItsControllerDiesAndComesBackByAPersonAlone) {
  start();
  add_controller();
  run(1);
  world_.remove("controller");
  run(1);
  EXPECT_EQ(newest<arm_encoders_t>("ARM_ENCODERS").safety, +arm_encoders_t::SAFETY_IDLE);
  EXPECT_NE(newest<arm_encoders_t>("ARM_ENCODERS").fault, "");
  EXPECT_EQ(newest<health_t>("HEALTH").state, +health_t::STATE_DEGRADED);
  const JointVector sunk = true_position();
  EXPECT_GT((sunk - load_arm("wam4").home()).norm(), 0.01);
  add_controller();
  run(1);
  EXPECT_EQ(newest<arm_encoders_t>("ARM_ENCODERS").safety, +arm_encoders_t::SAFETY_IDLE);
  controller_->set_target(true_position());
  press(pendant_t::BUTTON_ACTIVATE);
  run(1);
  EXPECT_EQ(newest<arm_encoders_t>("ARM_ENCODERS").safety, +arm_encoders_t::SAFETY_ACTIVE);
  EXPECT_EQ(newest<health_t>("HEALTH").state, +health_t::STATE_OK);
}

TEST_F(RobotWorld, FaultsWhenItIsThrown) {
  start();
  add_controller();
  run(0.5);
  JointVector target = load_arm("wam4").home();
  target[0] += 2;  // at once: the controller pulls as hard as it may
  controller_->set_target(target);
  run(1.5);
  EXPECT_EQ(newest<arm_encoders_t>("ARM_ENCODERS").safety, +arm_encoders_t::SAFETY_IDLE);
  EXPECT_NE(newest<arm_encoders_t>("ARM_ENCODERS").fault.find("m/s"), std::string::npos);
}

TEST_F(RobotWorld, FaultsOnATorqueThatNoMotorCanGive) {
  start();
  add_controller();
  run(0.5);
  controller_->set_extra_torque(5);
  run(0.01);
  EXPECT_NE(newest<arm_encoders_t>("ARM_ENCODERS").fault.find("torque"), std::string::npos);
}

TEST_F(RobotWorld, BeginsIdleWhenAskedTo) {
  params_.start_active = false;
  start();
  add_controller();
  run(1);
  EXPECT_EQ(true_position(), load_arm("wam4").home());
  EXPECT_EQ(newest<arm_encoders_t>("ARM_ENCODERS").safety, +arm_encoders_t::SAFETY_IDLE);
  press(pendant_t::BUTTON_ACTIVATE);
  run(1);
  EXPECT_EQ(newest<health_t>("HEALTH").state, +health_t::STATE_OK);
}

TEST_F(RobotWorld, RefusesTorquesThatCannotBeMeant) {
  start();
  arm_torques_t torques{};
  torques.utime = world_.now().us;
  torques.n_motors = 7;
  torques.motor_torque_nm.assign(7, 0.5);
  world_.inject(world_.now(), Domain::kRobot, "ARM_TORQUES", encode(torques));
  torques.n_motors = 4;
  torques.motor_torque_nm.resize(4);
  torques.utime += 1'000'000;
  world_.inject(world_.now(), Domain::kRobot, "ARM_TORQUES", encode(torques));
  run(1);
  EXPECT_EQ(true_position(), load_arm("wam4").home());
  for (const PortRecord& port : world_.node("sim").ports()) {
    if (port.spec.channel == "ARM_TORQUES") {
      EXPECT_EQ(port.rejected, 2);
    }
  }
}

// With a controller at work, strangers send torques of every kind, as fast as it.
TEST_F(RobotWorld, ForgedTorquesAreCountedAndChangeATickAtMost) {
  start();
  add_controller();
  run(1);
  const JointVector before = true_position();
  // What no clock shows does not come as far as the arm (message_check.h).
  constexpr int64_t kAbsurd = 9'000'000'000'000'000'000;
  int64_t forged = 0;
  const auto send = [&](int64_t utime, double torque_nm) {
    arm_torques_t torques{};
    torques.utime = utime;
    torques.n_motors = 4;
    torques.motor_torque_nm.assign(4, torque_nm);
    world_.inject(world_.now(), Domain::kRobot, "ARM_TORQUES", encode(torques));
    forged += utime == kAbsurd ? 0 : 1;
  };
  for (int i = 0; i < 500; ++i) {
    const int64_t now_us = world_.now().us;
    for (const int64_t utime :
         {now_us, now_us - 1, now_us - 2000, now_us - 1'000'000, int64_t{0}, kAbsurd}) {
      send(utime, i % 2 == 0 ? 1e9 : -1.5);
    }
    run(0.002);
  }
  EXPECT_EQ(newest<arm_encoders_t>("ARM_ENCODERS").safety, +arm_encoders_t::SAFETY_ACTIVE);
  EXPECT_LT((true_position() - before).cwiseAbs().maxCoeff(), 1e-3);
  run(0.1);
  EXPECT_EQ(metrics().at("refused_torques"), static_cast<double>(forged));
  EXPECT_NE(newest<health_t>("HEALTH").reason.find("somebody else sends torques"),
            std::string::npos);
  run(2);
  EXPECT_EQ(newest<health_t>("HEALTH").state, +health_t::STATE_OK);
}

// Before the controller's own answer to the same reading.
TEST_F(RobotWorld, ATorqueThatComesFirstActsForOneTick) {
  bool forges = false;
  world_.listen(Domain::kRobot, "ARM_ENCODERS", [&](auto bytes) {
    arm_encoders_t message;
    ASSERT_GT(message.decode(bytes.data(), 0, static_cast<int>(bytes.size())), 0);
    if (!forges) return;
    forges = false;
    arm_torques_t torques{};
    torques.utime = message.utime;
    torques.n_motors = 4;
    torques.motor_torque_nm.assign(4, 1e9);
    world_.inject(world_.now(), Domain::kRobot, "ARM_TORQUES", encode(torques));
  });
  start();
  add_controller();
  run(1);
  const JointVector before = true_position();
  forges = true;
  run(0.02);
  EXPECT_EQ(newest<arm_encoders_t>("ARM_ENCODERS").safety, +arm_encoders_t::SAFETY_ACTIVE);
  EXPECT_LT((true_position() - before).cwiseAbs().maxCoeff(), 5e-3);
  run(1);
  EXPECT_LT((true_position() - before).cwiseAbs().maxCoeff(), 1e-3);
}

TEST_F(RobotWorld, IsPushedAlongWithItsBase) {
  params_.base_motion = BaseScript::Kind::kPush;
  params_.base_start_s = 1;
  params_.base_amplitude_m = 0.1;
  params_.base_amplitude_deg = 0;
  start();
  add_controller();
  run(4);
  const auto truth = newest<truth_t>("TRUTH_STATE");
  EXPECT_NEAR(truth.world_from_base_position_m[1], 0.1, 1e-9);
  EXPECT_LT((true_position() - load_arm("wam4").home()).norm(), 0.01);
  const Pose<Base, Cam> base_from_cam = load_arm("wam4").base_from_cam(true_position());
  EXPECT_NEAR(truth.world_from_cam_position_m[1], 0.1 + base_from_cam.translation().y(), 1e-6);
}

TEST_F(RobotWorld, SaysTheSameBytesTwice) {
  params_.camera_rate_hz = 10;
  params_.camera_width_px = 160;
  params_.base_motion = BaseScript::Kind::kWaves;
  params_.base_start_s = 0;
  params_.camera_shutter_s = 0.02;
  std::vector<Said> first;
  for (int i = 0; i < 2; ++i) {
    Simulation world(Time{7'000'000});
    log_.clear();
    world.set_tap([this](Time, Domain domain, const std::string& channel, auto bytes) {
      log_.push_back({domain, channel, {bytes.begin(), bytes.end()}});
    });
    world.add("sim", {Domain::kRobot},
              [this](Node& node) { return std::make_unique<SimProcess>(node, params_); });
    world.add("controller", {}, [this](Node& node) {
      return std::make_unique<TestController>(node, load_arm_file(params_.arm_file));
    });
    world.run_until(Time{9'000'000});
    if (i == 0) first = log_;
  }
  EXPECT_GT(first.size(), 2000u);
  EXPECT_TRUE(first == log_);
}

class Camera : public RobotWorld {
 protected:
  Camera() {
    params_.camera_rate_hz = 20;
    params_.camera_width_px = 160;
    params_.camera_noise_levels = 0;
  }
};

TEST_F(Camera, ShowsWhatTheTruthSays) {
  params_.base_motion = BaseScript::Kind::kWaves;
  params_.base_start_s = 0;
  start();
  add_controller();
  run(1.05);
  const auto images = all<image_t>("IMAGE");
  const auto truths = all<truth_t>("TRUTH_FRAME");
  ASSERT_EQ(images.size(), 20u);
  ASSERT_EQ(truths.size(), images.size());
  const Scene lab = make_lab(1);
  RayCamera camera(lab,
                   {.model = sequence_camera(160, false), .antialiasing = Antialiasing::kNone});
  for (size_t i = 0; i < images.size(); i += 7) {
    EXPECT_EQ(images[i].utime, 1'000'000'000 + 50'000 * static_cast<int64_t>(i + 1));
    EXPECT_EQ(images[i].frame_number, static_cast<int32_t>(i));
    EXPECT_EQ(truths[i].utime, images[i].utime);
    const auto world_from_cam = read_transform<World, Cam>(truths[i].world_from_cam_quat_wxyz,
                                                           truths[i].world_from_cam_position_m);
    ASSERT_TRUE(world_from_cam);
    image_t expected{};
    encode_jpeg(camera.render(*world_from_cam, i), 85, &expected);
    EXPECT_TRUE(expected.data == images[i].data) << "frame " << i;
  }
  const auto info = newest<camera_info_t>("CAMERA_INFO");
  EXPECT_EQ(info.width_px, 160);
  EXPECT_EQ(info.height_px, 120);
  EXPECT_EQ(all<camera_info_t>("CAMERA_INFO").size(), 2u);
}

TEST_F(Camera, IsAsLateAsItsLatency) {
  params_.camera_latency_s = 0.12;  // more than two frames
  start();
  std::vector<int64_t> delays_us;
  world_.listen(Domain::kRobot, "IMAGE", [&](auto bytes) {
    image_t image;
    ASSERT_GT(image.decode(bytes.data(), 0, static_cast<int>(bytes.size())), 0);
    delays_us.push_back(world_.now().us - image.utime);
  });
  run(1);
  EXPECT_EQ(delays_us.size(), 17u);
  for (const int64_t delay_us : delays_us) {
    EXPECT_GE(delay_us, 120'000);
    EXPECT_LT(delay_us, 122'000);
  }
}

TEST_F(Camera, BlursWhatMovesWhileTheShutterIsOpen) {
  const auto sharpness = [&](double shutter_s) {
    params_.camera_shutter_s = shutter_s;
    params_.base_motion = BaseScript::Kind::kRamp;
    params_.base_start_s = 0;
    params_.base_speed_m_per_s = 1;
    log_.clear();
    start();
    run(0.7);
    world_.remove("sim");
    const auto image = decode_image(newest<image_t>("IMAGE"), 1);
    double sum = 0;
    for (size_t i = 1; i < image->bytes.size(); ++i) {
      sum += std::abs(image->bytes[i] - image->bytes[i - 1]);
    }
    return sum;
  };
  EXPECT_GT(sharpness(0), 1.2 * sharpness(0.03));
}

class OwnClock : public RobotWorld {
 protected:
  OwnClock() { params_.clock = WorldClock::kOwn; }
  int64_t simulated_us() const { return newest<sim_clock_t>("CLOCK").utime - 1'000'000'000; }
};

TEST_F(OwnClock, TellsBothSitesTheTimeAtEachTick) {
  start();
  add_controller();
  run(1);
  const auto robot = all<sim_clock_t>("CLOCK"),
             other = all<sim_clock_t>("CLOCK", Domain::kOperator);
  ASSERT_GT(robot.size(), 450u);
  ASSERT_EQ(robot.size(), other.size());
  for (size_t i = 0; i < robot.size(); ++i) {
    ASSERT_EQ(robot[i].utime, 1'000'000'000 + 2000 * static_cast<int64_t>(i + 1));
    ASSERT_EQ(other[i].utime, robot[i].utime);
  }
  EXPECT_EQ(all<arm_encoders_t>("ARM_ENCODERS").size(), robot.size());
}

TEST_F(OwnClock, RunsAtTheSpeedThatIsAskedFor) {
  params_.speed = 0.25;
  start();
  add_controller();
  run(4);
  EXPECT_NEAR(static_cast<double>(simulated_us()), 1e6, 0.02e6);
  EXPECT_NEAR(metrics().at("real_time_factor"), 0.25, 0.01);
}

TEST_F(OwnClock, RunsFasterThanTheWallWhenItCan) {
  params_.speed = 5;
  start();
  add_controller();
  run(1);
  EXPECT_NEAR(static_cast<double>(simulated_us()), 5e6, 0.1e6);
  EXPECT_LT((true_position() - load_arm("wam4").home()).norm(), 0.01);
}

TEST_F(OwnClock, WaitsForASlowController) {
  start();
  world_.listen(Domain::kRobot, "ARM_ENCODERS", [this](auto bytes) {
    arm_encoders_t message;
    ASSERT_GT(message.decode(bytes.data(), 0, static_cast<int>(bytes.size())), 0);
    arm_torques_t answer{};
    answer.utime = message.utime;
    answer.n_motors = 4;
    answer.motor_torque_nm.assign(4, 0);
    world_.inject(world_.now() + milliseconds(10), Domain::kRobot, "ARM_TORQUES", encode(answer));
  });
  run(2);
  EXPECT_NEAR(static_cast<double>(simulated_us()), 2e6 / 5, 0.03e6);  // 2 ms in each 10 ms
  EXPECT_EQ(metrics().at("unanswered_ticks"), 0);
}

TEST(SimProcess, RefusesFilesAndScenesThatAreNotThere) {
  const auto refusal = [](const SimParams& params) {
    Simulation world(Time{0});
    return error_of<StartupError>([&] {
      world.add("sim", {}, [&](Node& node) { return std::make_unique<SimProcess>(node, params); });
    });
  };
  SimParams params;
  params.arm_file = "none.yaml";
  EXPECT_NE(refusal(params).find("none.yaml"), std::string::npos);
  params.arm_file = std::string(FORESIGHT_ARMS) + "/wam4.yaml";
  params.scene = "moon.obj";
  EXPECT_NE(refusal(params).find("moon.obj"), std::string::npos);
}

}  // namespace
}  // namespace foresight::sim
