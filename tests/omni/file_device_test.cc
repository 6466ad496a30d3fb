#include "procs/omni/file_device.h"

#include <gtest/gtest.h>

#include "common/errors.h"
#include "common/lcm_log.h"
#include "common/node.h"
#include "foresight/device_state_t.hpp"
#include "tests/common/files.h"

namespace foresight {
namespace {

class FileDeviceTest : public testing::Test {
 protected:
  DeviceReading at(FileDevice& device, double time_s) {
    return device.read(Time{7'000'000} + seconds(time_s));
  }
  TemporaryFolder folder_;
};

TEST_F(FileDeviceTest, PlaysARecordingWithItsClutchAndEnds) {
  const std::string path = folder_.write(
      "hand.csv", "time_s,engaged,j1,j2\n100,1,0,1\n101,0,1,1\n102,1,2,1\n103,1,3,1\n");
  FileDevice device({.path = path, .start_delay_s = 1});
  device.open();
  EXPECT_FALSE(at(device, 0).engaged) << "waits";
  EXPECT_EQ(at(device, 0.5).axes, (std::vector<double>{0, 1}));
  EXPECT_TRUE(at(device, 1.5).engaged);
  EXPECT_EQ(at(device, 1.5).axes, (std::vector{0.5, 1.0}));
  EXPECT_FALSE(at(device, 2.5).engaged);
  EXPECT_TRUE(at(device, 3.5).engaged);
  const DeviceReading end = at(device, 4.1);
  EXPECT_TRUE(end.ended);
  EXPECT_FALSE(end.engaged);
  EXPECT_TRUE(end.connected);
  EXPECT_EQ(end.axes[0], 3);
}

TEST_F(FileDeviceTest, BeginsAgainWithTheClutchLetGoOnce) {
  const std::string path = folder_.write("way.csv", "time_s j1\n0 0\n2 1\n");
  FileDevice device({.path = path, .style = MotionStyle::kRest, .start_delay_s = 0, .loop = true});
  device.open();
  EXPECT_FALSE(at(device, 0).engaged) << "let go before it is pressed";
  EXPECT_NEAR(at(device, 1).axes[0], 0.5, 1e-12);
  const DeviceReading turn = at(device, 2.01);
  EXPECT_FALSE(turn.engaged);
  EXPECT_FALSE(turn.ended);
  EXPECT_TRUE(at(device, 2.5).engaged);
  EXPECT_NEAR(at(device, 3).axes[0], 0.5, 1e-12);
}

TEST_F(FileDeviceTest, ReadsWhatThisProcessPublishedFromALog) {
  const std::string path = folder_.path() + "/operator.lcmlog";
  {
    LogWriter log(path);
    for (int i = 0; i < 10; ++i) {
      device_state_t state{};
      state.utime = 1'000'000 + 100'000 * i;
      state.device = "openhaptics";
      state.connected = 1;
      state.engaged = i >= 5 ? 1 : 0;
      state.n_joints = 2;
      state.position_rad = {0.1 * i, -0.1 * i};
      log.write({state.utime}, "DEVICE_STATE", encode(state));
      log.write({state.utime}, "SOMETHING", std::vector<uint8_t>{1, 2, 3});
    }
    log.write({9'000'000}, "DEVICE_STATE", std::vector<uint8_t>{1, 2, 3});
    log.close();
  }
  const RecordedMotion motion = read_motion_file(path);
  EXPECT_EQ(motion.kind, AxisKind::kPosition);
  EXPECT_EQ(recorded_device(path), "openhaptics");
  const auto& samples = motion.samples;
  ASSERT_EQ(samples.size(), 10u);
  EXPECT_EQ(samples[0].time_s, 0);
  EXPECT_NEAR(samples[9].time_s, 0.9, 1e-9);
  EXPECT_FALSE(samples[4].engaged);
  EXPECT_TRUE(samples[5].engaged);
  EXPECT_EQ(samples[9].position_rad, (std::vector{0.1 * 9, -0.1 * 9}));
}

TEST_F(FileDeviceTest, PlaysRecordedDeflections) {
  const std::string path = folder_.path() + "/sticks.lcmlog";
  {
    LogWriter log(path);
    for (int i = 0; i <= 10; ++i) {
      device_state_t state{};
      state.utime = 1'000'000 + 100'000 * i;
      state.device = "gamepad";
      state.connected = state.engaged = 1;
      state.n_deflections = 2;
      state.deflections = {0.1 * i, -1};
      log.write({state.utime}, "DEVICE_STATE", encode(state));
    }
    log.close();
  }
  EXPECT_EQ(recorded_device(path), "gamepad");
  FileDevice device({.path = path, .start_delay_s = 0});
  device.open();
  at(device, 0);
  const DeviceReading reading = at(device, 0.5);
  EXPECT_TRUE(reading.engaged);
  EXPECT_EQ(reading.kind, AxisKind::kVelocity);
  EXPECT_NEAR(reading.axes[0], 0.5, 1e-9);
}

// What a robot that does not follow does to a device that moves by itself.
TEST_F(FileDeviceTest, StandsStillWhileItMayNotEngageAndResumesOnlyIfItIsTold) {
  const std::string path = folder_.write("way.csv", "time_s j1\n0 0\n10 10\n");
  for (const bool resume : {true, false}) {
    FileDevice device({.path = path, .start_delay_s = 1, .resume = resume});
    device.open();
    device.allow_engaging(false);
    for (int i = 0; i < 30; ++i) EXPECT_FALSE(at(device, 0.1 * i).engaged);
    device.allow_engaging(true);
    EXPECT_FALSE(at(device, 3).engaged) << "the clutch is seen let go first";
    for (int i = 31; i <= 40; ++i) EXPECT_TRUE(at(device, 0.1 * i).engaged);
    EXPECT_NEAR(at(device, 4).axes[0], 1, 1e-9);
    device.allow_engaging(false);
    for (int i = 41; i < 60; ++i) EXPECT_FALSE(at(device, 0.1 * i).engaged);
    device.allow_engaging(true);
    for (int i = 60; i < 69; ++i) EXPECT_FALSE(at(device, 0.1 * i).engaged) << "waits again";
    for (int i = 71; i <= 80; ++i) EXPECT_EQ(at(device, 0.1 * i).engaged, resume);
    EXPECT_EQ(at(device, 8).problem.empty(), resume);
    EXPECT_NEAR(at(device, 8).axes[0], resume ? 2.1 : 1, 0.11);
  }
}

TEST_F(FileDeviceTest, SaysWhatIsWrongWithTheFile) {
  EXPECT_NE(error_of<ConfigError>([] { read_motion_file(""); }).find("device_path: missing"),
            std::string::npos);
  EXPECT_NE(error_of<ConfigError>([] { read_motion_file("nowhere.csv"); }).find("nowhere.csv"),
            std::string::npos);
  EXPECT_NE(error_of<UnavailableError>([] { read_motion_file("nowhere.lcmlog"); }).find("nowhere"),
            std::string::npos);
  const std::string empty = folder_.path() + "/empty.lcmlog";
  LogWriter(empty).close();
  error_of<StartupError>([&] { read_motion_file(empty); });
}

}  // namespace
}  // namespace foresight
