// Events as the kernel writes them (its own header), through a pipe.
#include "procs/omni/gamepad_device.h"

#include <gtest/gtest.h>
#include <linux/joystick.h>

#include "common/errors.h"
#include "tests/common/files.h"
#include "tests/omni/pipes.h"

namespace foresight {
namespace {

class GamepadDeviceTest : public testing::Test {
 protected:
  static js_event event(int type, int number, int value) {
    return {.time = 0,
            .value = static_cast<int16_t>(value),
            .type = static_cast<uint8_t>(type),
            .number = static_cast<uint8_t>(number)};
  }
  void send(int type, int number, int value) {
    const js_event e = event(type, number, value);
    ASSERT_TRUE(pipe_.send(&e, sizeof e));
  }
  DeviceReading read() {
    now_ = now_ + milliseconds(33);
    return device_.read(now_);
  }
  DeviceReading read_for(double span_s) {
    DeviceReading reading;
    for (int i = 0; i < static_cast<int>(span_s / 0.033); ++i) reading = read();
    return reading;
  }
  /// What the driver says at opening, all sticks at rest; then long enough for them to count.
  void rest(std::vector<int> axes = {0, 1, 2, 3, 4, 5, 6, 7}) {
    for (const int axis : axes) send(JS_EVENT_AXIS | JS_EVENT_INIT, axis, 0);
    read_for(0.3);
  }
  PipeDevice pipe_;
  GamepadDevice device_{pipe_.opener(), {.path = "pad", .dead_zone = 0.1, .clutch_button = 6}};
  Time now_{0};
};

TEST_F(GamepadDeviceTest, ReadsSticksAndButtons) {
  device_.open();
  DeviceReading reading = read();
  EXPECT_TRUE(reading.connected);
  EXPECT_FALSE(reading.engaged);
  EXPECT_EQ(reading.kind, AxisKind::kVelocity);
  EXPECT_EQ(reading.axes, std::vector<double>(8, 0));
  rest();
  send(JS_EVENT_AXIS, 0, 32767);
  send(JS_EVENT_AXIS, 1, -32768);
  send(JS_EVENT_AXIS, 4, 3000);  // less than a tenth
  send(JS_EVENT_BUTTON, 5, 1);
  reading = read();
  EXPECT_TRUE(reading.engaged);
  EXPECT_EQ(reading.buttons[5], 1);
  EXPECT_EQ(reading.axes[0], 1);
  EXPECT_EQ(reading.axes[1], -1);
  EXPECT_EQ(reading.axes[4], 0);
  send(JS_EVENT_BUTTON, 5, 0);
  send(JS_EVENT_AXIS, 0, 18022);  // 0.55 of the way, half of what is beyond the dead zone
  reading = read();
  EXPECT_FALSE(reading.engaged);
  EXPECT_NEAR(reading.axes[0], 0.5, 1e-3);
  EXPECT_EQ(reading.axes[1], -1) << "what does not change is not said again";
}

TEST_F(GamepadDeviceTest, TakesEventsInPieces) {
  device_.open();
  const js_event e = event(JS_EVENT_AXIS, 11, 32767);
  const auto* bytes = reinterpret_cast<const uint8_t*>(&e);
  for (size_t i = 0; i < sizeof e; ++i) {
    ASSERT_TRUE(pipe_.send(bytes + i, 1));
    const DeviceReading reading = read();
    EXPECT_EQ(reading.axes.size(), i + 1 < sizeof e ? 8u : 12u);
  }
}

TEST_F(GamepadDeviceTest, IsMissedAtTheStart) {
  pipe_.is_plugged = false;
  const std::string line = error_of<UnavailableError>([&] { device_.open(); });
  EXPECT_NE(line.find("pad: No such file"), std::string::npos) << line;
}

TEST_F(GamepadDeviceTest, IsReleasedWhenItGoesAndComesBackWithinASecond) {
  device_.open();
  rest();
  send(JS_EVENT_AXIS, 0, 32767);
  send(JS_EVENT_BUTTON, 5, 1);
  EXPECT_TRUE(read().engaged);
  pipe_.unplug();
  for (int i = 0; i < 60; ++i) {
    const DeviceReading reading = read();
    EXPECT_FALSE(reading.connected);
    EXPECT_FALSE(reading.engaged);
    EXPECT_NE(reading.problem, "");
  }
  EXPECT_LE(pipe_.openings, 3) << "tried once a second";
  pipe_.is_plugged = true;
  DeviceReading reading;
  for (int i = 0; i < 31; ++i) reading = read();
  EXPECT_TRUE(reading.connected);
  EXPECT_EQ(reading.axes[0], 0) << "at rest until it says otherwise";
  EXPECT_EQ(reading.problem, "");
}

// Triggers of some pads rest at −32767, and they pass through zero when they are pulled.
TEST_F(GamepadDeviceTest, NoAxisCountsBeforeItHasRestedNearZero) {
  device_.open();
  send(JS_EVENT_AXIS | JS_EVENT_INIT, 4, -32767);
  send(JS_EVENT_BUTTON | JS_EVENT_INIT, 5, 1);
  rest({0, 1, 2, 3});
  DeviceReading reading = read_for(4);
  EXPECT_TRUE(reading.engaged);
  EXPECT_EQ(reading.axes, std::vector<double>(8, 0));
  EXPECT_EQ(reading.problem, "axis 5 does not count before it has rested near zero");
  for (const int value : {-20000, 0, 20000, 0, -32767}) {
    send(JS_EVENT_AXIS, 4, value);
    EXPECT_EQ(read().axes[4], 0) << "passes through";
  }
  send(JS_EVENT_AXIS, 1, -32767);
  EXPECT_EQ(read().axes[1], -1) << "the others count";
  send(JS_EVENT_AXIS, 4, 900);
  read_for(0.3);
  send(JS_EVENT_AXIS, 4, -32767);
  EXPECT_EQ(read().axes[4], -1);
}

TEST_F(GamepadDeviceTest, AnAxisOfWhichNothingWasSaidDoesNotCountEither) {
  device_.open();
  read_for(1);
  send(JS_EVENT_AXIS, 4, -32767);
  EXPECT_EQ(read_for(1).axes[4], 0);
}

TEST_F(GamepadDeviceTest, NoAxisCountsAfterItHasBeenOpenedAnew) {
  device_.open();
  rest();
  pipe_.unplug();
  read();
  pipe_.is_plugged = true;
  read_for(1.1);
  send(JS_EVENT_AXIS | JS_EVENT_INIT, 4, -32767);
  EXPECT_EQ(read_for(1).axes[4], 0);
}

// The descriptor stays open (a radio link that has died): a stick that was held would stay so.
TEST_F(GamepadDeviceTest, AHeldStickOfASilentDeviceIsLetGo) {
  device_.open();
  rest();
  send(JS_EVENT_BUTTON, 5, 1);
  EXPECT_FALSE(read_for(60).silent) << "nothing is moved";
  send(JS_EVENT_AXIS, 0, 32767);
  EXPECT_FALSE(read_for(2.9).silent);
  send(JS_EVENT_AXIS, 0, 32700);
  EXPECT_FALSE(read_for(2.9).silent) << "a hand trembles";
  const DeviceReading reading = read_for(0.3);
  EXPECT_TRUE(reading.silent);
  EXPECT_NE(reading.problem.find("says nothing"), std::string::npos) << reading.problem;
  send(JS_EVENT_AXIS, 0, 32767);
  EXPECT_FALSE(read().silent);
}

TEST_F(GamepadDeviceTest, ATriggerThatMovesNothingMayBeHeldForLong) {
  device_.open();
  rest();
  send(JS_EVENT_BUTTON, 5, 1);
  send(JS_EVENT_AXIS, 2, 32767);
  EXPECT_FALSE(read_for(10).silent);
}

TEST_F(GamepadDeviceTest, SaysWhatItIsAndWhatMovesWhat) {
  device_.open();
  EXPECT_EQ(device_.description(),
            "gamepad (without a name) at pad: joint 1: axis 1 x -1, joint 2: axis 2 x -1, joint 4: "
            "axis 5; clutch: button 6");
}

TEST(JoystickDecoder, NonsenseIsHarmless) {
  JoystickDecoder decoder;
  std::vector<uint8_t> bytes;
  for (int i = 0; i < 100'000; ++i) bytes.push_back(static_cast<uint8_t>(i * i * 31 + i / 7));
  decoder.feed(bytes);
  EXPECT_LE(decoder.axes().size(), 256u);
  for (const double axis : decoder.axes()) EXPECT_LE(std::abs(axis), 1);
}

}  // namespace
}  // namespace foresight
