// Against a stand-in for libspnav and its daemon (fake_spnav.cc).
#include "procs/omni/spacemouse_device.h"

#include <gtest/gtest.h>

#include <array>

#include "common/errors.h"
#include "tests/common/files.h"

namespace foresight {
namespace {

class SpaceMouseDeviceTest : public testing::Test {
 protected:
  SpaceMouseDeviceTest() {
    fake_.find("fake_spnav_daemon", daemon_);
    fake_.find("fake_spnav_motion", motion_);
    fake_.find("fake_spnav_button", button_);
    daemon_(1);
  }
  void move(std::array<int, 6> six) { motion_(six.data()); }
  DeviceReading read() {
    now_ = now_ + milliseconds(33);
    return device_.read(now_);
  }
  DeviceLibrary fake_{FAKE_SPNAV, ""};
  void (*daemon_)(int) = nullptr;
  void (*motion_)(const int*) = nullptr;
  void (*button_)(int, int) = nullptr;
  SpaceMouseDevice device_{{.library = FAKE_SPNAV, .dead_zone = 0.1}};
  Time now_{0};
};

TEST_F(SpaceMouseDeviceTest, ReadsItsCapAndButtons) {
  device_.open();
  EXPECT_EQ(read().axes, std::vector<double>(6, 0));
  move({350, -500, 20, 0, 193, 0});
  button_(0, 1);
  DeviceReading reading = read();
  EXPECT_TRUE(reading.connected);
  EXPECT_TRUE(reading.engaged);
  EXPECT_EQ(reading.kind, AxisKind::kVelocity);
  EXPECT_EQ(reading.axes[0], 1);
  EXPECT_EQ(reading.axes[1], -1);
  EXPECT_EQ(reading.axes[2], 0) << "inside the dead zone";
  EXPECT_NEAR(reading.axes[4], 0.5, 0.005);
  button_(0, 0);
  button_(1'000'000, 1);
  button_(-1, 1);
  reading = read();
  EXPECT_FALSE(reading.engaged);
  EXPECT_EQ(reading.axes[0], 1) << "until it says otherwise";
}

TEST_F(SpaceMouseDeviceTest, AHeldCapOfASilentDeviceIsLetGo) {
  device_.open();
  button_(0, 1);
  for (int i = 0; i < 60; ++i) EXPECT_FALSE(read().silent) << "a cap at rest says nothing";
  move({350, 0, 0, 0, 0, 0});
  for (int i = 0; i < 15; ++i) EXPECT_FALSE(read().silent);
  for (int i = 0; i < 5; ++i) read();
  const DeviceReading reading = read();
  EXPECT_TRUE(reading.silent);
  EXPECT_NE(reading.problem, "");
  move({350, 0, 0, 0, 0, 0});
  EXPECT_FALSE(read().silent);
}

TEST_F(SpaceMouseDeviceTest, SaysWhatIsMissing) {
  SpaceMouseDevice device({.library = "libspnav_that_is_not_there.so"});
  EXPECT_NE(
      error_of<UnavailableError>([&] { device.open(); }).find("install the packages libspnav"),
      std::string::npos);
  daemon_(0);
  EXPECT_NE(error_of<UnavailableError>([&] { device_.open(); }).find("spacenavd"),
            std::string::npos);
}

TEST_F(SpaceMouseDeviceTest, IsReleasedWhenItsDaemonGoesAndComesBack) {
  device_.open();
  move({350, 0, 0, 0, 0, 0});
  button_(0, 1);
  EXPECT_TRUE(read().engaged);
  daemon_(0);
  DeviceReading reading = read();
  EXPECT_FALSE(reading.connected);
  EXPECT_FALSE(reading.engaged);
  EXPECT_EQ(reading.axes[0], 0);
  for (int i = 0; i < 40; ++i) EXPECT_FALSE(read().connected);
  daemon_(1);
  for (int i = 0; i < 35; ++i) reading = read();
  EXPECT_TRUE(reading.connected);
  EXPECT_FALSE(reading.engaged);
}

}  // namespace
}  // namespace foresight
