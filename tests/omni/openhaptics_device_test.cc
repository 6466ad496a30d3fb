// Against a stand-in for the vendor's library (fake_hd.cc).
#include "procs/omni/openhaptics_device.h"

#include <gtest/gtest.h>

#include "common/errors.h"
#include "tests/common/files.h"

namespace foresight {
namespace {

class OpenHapticsDeviceTest : public testing::Test {
 protected:
  OpenHapticsDeviceTest() {
    fake_.find("fake_hd_reset", reset_);
    fake_.find("fake_hd_plug", plug_);
    fake_.find("fake_hd_move", move_);
    fake_.find("fake_hd_fail", fail_);
    fake_.find("fake_hd_calibration", calibrate_);
    fake_.find("fake_hd_tick", tick_);
    fake_.find("fake_hd_initialised", initialised_);
    fake_.find("fake_hd_disabled", disabled_);
    fake_.find("fake_hd_updates", updates_);
    fake_.find("fake_hd_is_running", is_running_);
    fake_.find("fake_hd_name", name_);
    reset_();
    device_ = std::make_unique<OpenHapticsDevice>(
        OpenHapticsOptions{.library = FAKE_HD, .device_name = "left hand"});
  }
  void move(std::array<double, 6> six_rad, int buttons) { move_(six_rad.data(), buttons); }
  DeviceReading read(bool ticks = true) {
    now_ = now_ + milliseconds(33);
    if (ticks) tick_();
    return device_->read(now_);
  }
  DeviceLibrary fake_{FAKE_HD, ""};
  void (*reset_)() = nullptr;
  void (*plug_)(int) = nullptr;
  void (*move_)(const double*, int) = nullptr;
  void (*fail_)(unsigned int) = nullptr;
  void (*calibrate_)(unsigned int) = nullptr;
  void (*tick_)() = nullptr;
  int (*initialised_)() = nullptr;
  int (*disabled_)() = nullptr;
  int (*updates_)() = nullptr;
  int (*is_running_)() = nullptr;
  const char* (*name_)() = nullptr;
  std::unique_ptr<OpenHapticsDevice> device_;
  Time now_{1'000'000};
};

TEST_F(OpenHapticsDeviceTest, ReadsJointsGimbalAndButtons) {
  device_->open();
  EXPECT_STREQ(name_(), "left hand");
  EXPECT_FALSE(read(false).connected) << "no reading yet";
  move({0.1, 0.2, 0.3, 0.4, 0.5, 0.6}, 0);
  DeviceReading reading = read();
  EXPECT_TRUE(reading.connected);
  EXPECT_FALSE(reading.engaged);
  EXPECT_EQ(reading.kind, AxisKind::kPosition);
  EXPECT_EQ(reading.axes, (std::vector{0.1, 0.2, 0.3, 0.4, 0.5, 0.6}));
  move({0, 0, 0, 0, 0, 0}, 1);
  reading = read();
  EXPECT_TRUE(reading.engaged);
  EXPECT_EQ(reading.buttons, (std::vector<uint8_t>{1, 0, 0, 0}));
  move({0, 0, 0, 0, 0, 0}, 2);
  reading = read();
  EXPECT_FALSE(reading.engaged) << "the other button";
  EXPECT_EQ(reading.buttons[1], 1);
}

TEST_F(OpenHapticsDeviceTest, SaysWhatToInstall) {
  OpenHapticsDevice device({.library = "libHD_that_is_not_there.so"});
  const std::string line = error_of<UnavailableError>([&] { device.open(); });
  EXPECT_NE(line.find("libHD_that_is_not_there.so"), std::string::npos) << line;
  EXPECT_NE(line.find("install OpenHaptics"), std::string::npos) << line;
  EXPECT_EQ(line.find('\n'), std::string::npos);
}

TEST_F(OpenHapticsDeviceTest, RefusesALibraryOfAnotherKind) {
  OpenHapticsDevice device({.library = FAKE_SPNAV});
  const std::string line = error_of<UnavailableError>([&] { device.open(); });
  EXPECT_NE(line.find("has no function hdInitDevice"), std::string::npos) << line;
}

TEST_F(OpenHapticsDeviceTest, IsMissedAtTheStart) {
  plug_(0);
  const std::string line = error_of<UnavailableError>([&] { device_->open(); });
  EXPECT_NE(line.find("Device fault"), std::string::npos) << line;
}

TEST_F(OpenHapticsDeviceTest, ComesBackAfterACommunicationError) {
  device_->open();
  move({0.1, 0, 0, 0, 0, 0}, 1);
  EXPECT_TRUE(read().engaged);
  plug_(0);
  fail_(0x0302);
  DeviceReading reading = read();
  EXPECT_FALSE(reading.connected);
  EXPECT_FALSE(reading.engaged);
  EXPECT_NE(reading.problem.find("Communication error"), std::string::npos);
  EXPECT_EQ(reading.axes[0], 0.1) << "the last that is known";
  EXPECT_EQ(disabled_(), 1);
  for (int i = 0; i < 60; ++i) EXPECT_FALSE(read().connected);
  plug_(1);
  for (int i = 0; i < 35; ++i) reading = read();
  EXPECT_TRUE(reading.connected);
  EXPECT_EQ(initialised_(), 2);
}

TEST_F(OpenHapticsDeviceTest, NoticesAServoLoopThatStandsStill) {
  device_->open();
  move({0, 0, 0, 0, 0, 0}, 1);
  EXPECT_TRUE(read().engaged);
  for (int i = 0; i < 7; ++i) EXPECT_TRUE(read(false).connected) << "a hiccup";
  const DeviceReading reading = read(false);
  EXPECT_FALSE(reading.connected);
  EXPECT_NE(reading.problem.find("stands still"), std::string::npos);
}

TEST_F(OpenHapticsDeviceTest, OverlooksErrorsOfForcesItDoesNotUse) {
  device_->open();
  fail_(0x0203);  // exceeded velocity
  EXPECT_TRUE(read().connected);
}

TEST_F(OpenHapticsDeviceTest, IsNotEngagedUntilCalibrated) {
  device_->open();
  move({0, 0, 0, 0, 0, 0}, 1);
  calibrate_(0x5002);
  DeviceReading reading = read();
  EXPECT_TRUE(reading.connected);
  EXPECT_FALSE(reading.engaged);
  EXPECT_NE(reading.problem.find("inkwell"), std::string::npos);
  calibrate_(0x5001);  // in the inkwell now
  read();
  EXPECT_EQ(updates_(), 1);
  reading = read();
  EXPECT_TRUE(reading.engaged);
  EXPECT_EQ(reading.problem, "");
}

TEST_F(OpenHapticsDeviceTest, StopsTheServoLoopBeforeItGoes) {
  device_->open();
  EXPECT_EQ(is_running_(), 1);
  device_.reset();
  EXPECT_EQ(is_running_(), 0);
  EXPECT_EQ(disabled_(), 1);
  tick_();  // calls nobody
}

}  // namespace
}  // namespace foresight
