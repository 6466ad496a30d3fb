// The process on a simulated clock: its health, what it refuses, and what it shows meanwhile.
#include <cstdlib>
#include <filesystem>
#include <limits>

#include "tests/common/files.h"
#include "tests/renderer/display_rig.h"

namespace foresight {
namespace {

constexpr int64_t kAbsurd = 9'000'000'000'000'000'000;

class RendererProcessTest : public testing::Test {
 protected:
  void start() {
    rig_.start();
    rig_.run(8);
    ASSERT_EQ(rig_.health().reason, "");
    ASSERT_TRUE(rig_.health().state == health_t::STATE_OK);
    rig_.take_drawn();
  }
  bool is_degraded() const { return rig_.health().state == health_t::STATE_DEGRADED; }
  bool says(const std::string& words) const {
    return rig_.health().reason.find(words) != std::string::npos;
  }
  DisplayRig rig_;
};

TEST_F(RendererProcessTest, AStoppedLinkIsSaidAndNothingIsGuessed) {
  start();
  for (const char* channel : {"JOINT_STATE", "CONTROLLER_STATE", "VIEW", "BASE_POSE", "ALIGNMENT",
                              "CAMERA_INFO", "MESH"}) {
    rig_.stopped.insert(channel);
  }
  rig_.run(2);
  rig_.take_drawn();
  rig_.run(3.1);
  EXPECT_TRUE(is_degraded());
  EXPECT_TRUE(says("no prediction: no JOINT_STATE for 3.")) << rig_.health().reason;
  EXPECT_TRUE(says("no VIEW for 3.")) << rig_.health().reason;
  EXPECT_TRUE(says("no BASE_POSE for 3.")) << rig_.health().reason;
  const DisplayRig::Drawn drawn = rig_.take_drawn();
  EXPECT_EQ(drawn.predictions, 0);
  EXPECT_GT(drawn.pictures, 10) << "the delayed video stays, and says why";
  rig_.stopped.clear();
  rig_.run(3);
  EXPECT_TRUE(rig_.health().state == health_t::STATE_OK) << rig_.health().reason;
  EXPECT_GT(rig_.take_drawn().predictions, 10);
}

TEST_F(RendererProcessTest, EachStreamThatEndsIsNamedWithItsAge) {
  for (const char* channel : {"VIEW", "BASE_POSE", "ALIGNMENT", "CONTROLLER_STATE"}) {
    start();
    rig_.stopped.insert(channel);
    rig_.run(6);
    EXPECT_TRUE(is_degraded()) << channel;
    EXPECT_TRUE(says(std::string("no ") + channel + " for ")) << rig_.health().reason;
    EXPECT_GT(rig_.take_drawn().predictions, 40) << "still a prediction";
    rig_.stopped.clear();
  }
}

TEST_F(RendererProcessTest, ADelayThatDoublesIsSaid) {
  start();
  rig_.delay = milliseconds(310);
  rig_.run(4);
  EXPECT_TRUE(is_degraded());
  EXPECT_TRUE(says("delay 0.6") && says("s instead of 0.3")) << rig_.health().reason;
  EXPECT_NEAR(rig_.metric("round_trip_ms"), 620, 20);
}

TEST_F(RendererProcessTest, ASecondCommanderIsSeen) {
  start();
  rig_.senders.insert(kDisplayStart.us - 7'000'000);
  rig_.run(1.5);
  EXPECT_TRUE(is_degraded());
  EXPECT_TRUE(says("2 senders command the arm at once")) << rig_.health().reason;
  rig_.senders.erase(kDisplayStart.us - 7'000'000);
  rig_.run(3);
  EXPECT_TRUE(rig_.health().state == health_t::STATE_OK) << rig_.health().reason;
}

TEST_F(RendererProcessTest, AForgedSessionDoesNotLockTheOperatorOut) {
  start();
  for (const int64_t session : {kAbsurd, std::numeric_limits<int64_t>::max()}) {
    rig_.inject("JOINT_COMMAND", rig_.command(session));
  }
  rig_.run(2);
  EXPECT_TRUE(rig_.health().state == health_t::STATE_OK) << rig_.health().reason;
  const port_health_t& port = rig_.port("JOINT_COMMAND", Domain::kOperator);
  EXPECT_EQ(port.rejected, 2) << "and none of the operator's";
  EXPECT_GT(rig_.take_drawn().predictions, 15);
}

TEST_F(RendererProcessTest, LimitsThatDifferAreFollowedAndNoted) {
  rig_.controller.velocity_limit_rad_per_s = 0.15;
  rig_.start();
  rig_.run(4);
  EXPECT_TRUE(rig_.health().state == health_t::STATE_OK);
  EXPECT_TRUE(says("limits are followed: 0.15 rad/s instead of 1 rad/s")) << rig_.health().reason;
}

TEST_F(RendererProcessTest, AnotherArmIsNamed) {
  start();
  rig_.joint_count = 7;
  rig_.run(4);
  EXPECT_TRUE(is_degraded());
  EXPECT_TRUE(says("the robot's arm has 7 joints") && says("wam4.yaml 4")) << rig_.health().reason;
}

TEST_F(RendererProcessTest, ClocksThatDifferAreSaidInMillisecondsAndNothingIsGuessed) {
  for (const double step_s : {-3.0, 3.0, -0.3}) {
    start();
    rig_.robot_clock = seconds(step_s);
    rig_.run(5);
    rig_.take_drawn();
    rig_.run(2);
    EXPECT_TRUE(is_degraded());
    EXPECT_TRUE(says(" ms ")) << rig_.health().reason;
    EXPECT_EQ(rig_.take_drawn().predictions, 0) << step_s;
    EXPECT_NEAR(rig_.metric("command_delay_ms"), 150 + 1e3 * step_s, 15) << "signed";
    EXPECT_NEAR(rig_.metric("clock_offset_ms"), 1e3 * step_s, 160) << "half a round trip";
    rig_.robot_clock = {};
  }
}

TEST_F(RendererProcessTest, AnUndelayedImageIsCountedOnItsOwnPort) {
  rig_.params.layout = Layout::kUndelayed;
  start();
  view_t damaged = rig_.view();
  damaged.image.data.resize(7);
  damaged.image.n_data = 7;
  rig_.inject("VIEW", damaged, Domain::kRobot);
  rig_.run(1.5);
  EXPECT_EQ(rig_.port("VIEW", Domain::kRobot).rejected, 1);
  EXPECT_EQ(rig_.port("VIEW", Domain::kOperator).rejected, 0);
}

// Each message once with absurd stamps, epochs and contents: 2 s later the picture is the same, to
// the byte, as where nobody forged anything.
class Forgeries : public RendererProcessTest {
 protected:
  template <class Message, class Bend>
  void forge(const char* channel, Message message, const Bend& bend) {
    bend(message);
    rig_.inject(channel, message);
  }
  template <class Message>
  void forge_stamps(const char* channel, const Message& message) {
    for (const int64_t us :
         {std::numeric_limits<int64_t>::max(), std::numeric_limits<int64_t>::min(), int64_t{0},
          kAbsurd, rig_.now().us + 900'000, rig_.now().us + 3'600'000'000,
          rig_.now().us - 3'600'000'000}) {
      forge(channel, message, [us](Message& m) { m.utime = us; });
    }
  }
  template <class Message>
  void forge_epochs(const char* channel, const Message& message) {
    for (const int64_t epoch : {kAbsurd, int64_t{-1}, int64_t{0}, int64_t{1}}) {
      forge(channel, message, [epoch](Message& m) { m.epoch = epoch; });
    }
  }
  void expect_all_as_before() {
    const Image before = rig_.frame().picture.rgb;
    ASSERT_FALSE(before.bytes.empty());
    forge_all();
    rig_.run(2);
    rig_.take_drawn();
    rig_.run(1.5);
    EXPECT_TRUE(rig_.health().state == health_t::STATE_OK) << rig_.health().reason;
    EXPECT_GT(rig_.take_drawn().predictions, 10);
    EXPECT_EQ(rig_.frame().picture.rgb.bytes, before.bytes);
    EXPECT_EQ(rig_.frame().pose.epoch, kDisplayEpoch);
  }
  std::function<void()> forge_all;
};

TEST_F(Forgeries, MeshesBendNothingForGood) {
  start();
  forge_all = [this] {
    const mesh_t mesh = rig_.mesh();
    forge_stamps("MESH", mesh);
    forge_epochs("MESH", mesh);
    for (const int32_t version :
         {std::numeric_limits<int32_t>::max(), std::numeric_limits<int32_t>::min(), 1}) {
      forge("MESH", mesh, [version](mesh_t& m) { m.version = version; });
    }
    forge("MESH", mesh, [](mesh_t& m) { m.vertex_positions_mu[0] = 1e38f; });
    // One that follows the last as a true one would, in a scene where no true one follows.
    forge("MESH", mesh, [](mesh_t& m) {
      ++m.version;
      for (float& x : m.vertex_positions_mu) x *= 0.1f;
    });
  };
  expect_all_as_before();
}

TEST_F(Forgeries, ViewsBendNothingForGood) {
  start();
  forge_all = [this] {
    const view_t view = rig_.view();
    forge_stamps("VIEW", view);
    forge("VIEW", view, [](view_t& m) { m.pose.epoch = kAbsurd; });
    forge("VIEW", view, [](view_t& m) { m.pose.map_from_cam_position_mu[0] = 1e9; });
    forge("VIEW", view, [](view_t& m) { m.image.data.assign(m.image.data.size(), 0); });
    forge("VIEW", view, [](view_t& m) {
      m.image.width_px = m.image.height_px = 16;
      m.image.n_data = 16 * 16 * 3;
      m.image.data.resize(static_cast<size_t>(m.image.n_data));
    });
  };
  expect_all_as_before();
}

TEST_F(Forgeries, IntrinsicsBendNothingForGood) {
  start();
  forge_all = [this] {
    const camera_info_t info = rig_.camera_info();
    forge_stamps("CAMERA_INFO", info);
    forge("CAMERA_INFO", info, [](camera_info_t& m) { m.fx_px *= 2; });
    forge("CAMERA_INFO", info, [](camera_info_t& m) { m.fx_px = 1e300; });
    forge("CAMERA_INFO", info, [](camera_info_t& m) { m.distortion[0] = 1e100; });
    forge("CAMERA_INFO", info, [](camera_info_t& m) { m.width_px = m.height_px = 32'000; });
    forge("CAMERA_INFO", info, [](camera_info_t& m) { m.cx_px = -1e15; });
  };
  expect_all_as_before();
}

TEST_F(Forgeries, WhereTheRobotIsBendsNothingForGood) {
  start();
  forge_all = [this] {
    forge_stamps("BASE_POSE", rig_.base());
    forge_epochs("BASE_POSE", rig_.base());
    forge("BASE_POSE", rig_.base(), [](base_pose_t& m) { m.world_from_base_position_m[0] = 1e9; });
    forge("BASE_POSE", rig_.base(), [](base_pose_t& m) { m.velocity_m_per_s[1] = 1e300; });
    forge_stamps("ALIGNMENT", rig_.alignment());
    forge_epochs("ALIGNMENT", rig_.alignment());
    forge("ALIGNMENT", rig_.alignment(),
          [](alignment_t& m) { m.world_from_map_scale_m_per_mu = 1e200; });
    forge("ALIGNMENT", rig_.alignment(), [](alignment_t& m) { m.joint_delay_s = 1e300; });
    forge_stamps("JOINT_STATE", rig_.joint_state());
    forge("JOINT_STATE", rig_.joint_state(), [](joint_state_t& m) { m.position_rad[0] = 1e300; });
    forge("JOINT_STATE", rig_.joint_state(), [](joint_state_t& m) { m.command_utime = kAbsurd; });
    forge_stamps("CONTROLLER_STATE", rig_.controller);
    forge("CONTROLLER_STATE", rig_.controller, [this](controller_state_t& m) {
      m.utime = rig_.now().us;
      m.velocity_limit_rad_per_s = 50;
      m.driver_session = kAbsurd;
    });
    forge_stamps("JOINT_COMMAND", rig_.command(*rig_.senders.begin()));
  };
  expect_all_as_before();
}

// Forged first, before anything true has come.
TEST_F(Forgeries, ThatComeFirstOfAllBendNothingForGood) {
  rig_.start();
  camera_info_t info = rig_.camera_info();
  info.fx_px *= 3;
  rig_.inject("CAMERA_INFO", info);
  view_t view = rig_.view();
  view.pose.epoch = kAbsurd;
  view.utime = rig_.now().us + 900'000;
  rig_.inject("VIEW", view);
  mesh_t mesh = rig_.mesh();
  mesh.epoch = kAbsurd;
  mesh.version = std::numeric_limits<int32_t>::max();
  rig_.inject("MESH", mesh);
  base_pose_t base = rig_.base();
  base.epoch = kAbsurd;
  rig_.inject("BASE_POSE", base);
  alignment_t alignment = rig_.alignment();
  alignment.epoch = kAbsurd;
  rig_.inject("ALIGNMENT", alignment);
  controller_state_t controller = rig_.controller;
  controller.utime = rig_.now().us + 900'000;
  controller.velocity_limit_rad_per_s = 50;
  rig_.inject("CONTROLLER_STATE", controller);
  rig_.run(6);
  EXPECT_TRUE(rig_.health().state == health_t::STATE_OK) << rig_.health().reason;
  EXPECT_EQ(rig_.health().reason, "");
  EXPECT_EQ(rig_.frame().pose.epoch, kDisplayEpoch);
}

class RecordingTest : public RendererProcessTest {
 protected:
  TemporaryFolder folder_;
};

// One that was stopped, or waits for a disk: it held up the display.
TEST_F(RecordingTest, AnFfmpegThatTakesNothingIsSaidAndTheDisplayGoesOn) {
  const std::string script = folder_.write("ffmpeg", "#!/bin/sh\nexec sleep 1000\n");
  std::filesystem::permissions(script, std::filesystem::perms::owner_all);
  const std::string path = std::getenv("PATH");
  setenv("PATH", (folder_.path() + ":" + path).c_str(), 1);
  rig_.params.record = folder_.path() + "/film.mp4";
  rig_.start();
  rig_.run(8);
  setenv("PATH", path.c_str(), 1);
  EXPECT_TRUE(is_degraded());
  EXPECT_TRUE(says("ffmpeg takes no pictures: ")) << rig_.health().reason;
  EXPECT_GT(rig_.metric("dropped_frames"), 20);
  EXPECT_GT(rig_.take_drawn().predictions, 20);
}

// It used to be overwritten by the next picture, and to blame the disk.
TEST_F(RecordingTest, AnEndedRecordingIsSaidTrulyAndStaysSaid) {
  rig_.params.record = folder_.path() + "/film.nosuchformat";
  rig_.start();
  rig_.run(8);
  EXPECT_TRUE(is_degraded());
  EXPECT_TRUE(says("recording stopped after")) << rig_.health().reason;
  EXPECT_TRUE(says("ffmpeg ended with exit code")) << rig_.health().reason;
  EXPECT_TRUE(says("nosuchformat")) << "ffmpeg's own words: " << rig_.health().reason;
  EXPECT_FALSE(says("disk full?"));
  EXPECT_GT(rig_.take_drawn().predictions, 20) << "the display goes on";
}

}  // namespace
}  // namespace foresight
