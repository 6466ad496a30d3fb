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
  send(JS_EVENT_AXIS | JS_EVENT_INIT, 0, 32767);
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
