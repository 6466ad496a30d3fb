// Keys through a pipe, and through a pseudo-terminal for what only terminals have.
#include "procs/omni/keyboard_device.h"

#include <gtest/gtest.h>
#include <pty.h>

#include "common/errors.h"
#include "tests/common/files.h"
#include "tests/omni/pipes.h"

namespace foresight {
namespace {

class KeyboardDeviceTest : public testing::Test {
 protected:
  DeviceReading read(Duration later = milliseconds(33)) {
    now_ = now_ + later;
    return device_.read(now_);
  }
  DeviceReading type(std::string_view keys) {
    EXPECT_TRUE(pipe_.send(keys));
    return read();
  }
  PipeDevice pipe_;
  KeyboardDevice device_{pipe_.opener(), {.name = "keys", .hold_s = 0.2, .needs_terminal = false}};
  Time now_{5'000'000};
};

TEST_F(KeyboardDeviceTest, AKeyCountsAsHeldForAWhile) {
  device_.open();
  EXPECT_EQ(read().axes, std::vector<double>(7, 0));
  EXPECT_EQ(type("a").axes[0], 1);
  EXPECT_EQ(read(milliseconds(100)).axes[0], 1);
  EXPECT_EQ(type("a").axes[0], 1);
  EXPECT_EQ(read(milliseconds(190)).axes[0], 1) << "repeated in time";
  EXPECT_EQ(read(milliseconds(20)).axes[0], 0);
}

TEST_F(KeyboardDeviceTest, KnowsItsKeys) {
  device_.open();
  const std::string up = "awrtyui", down = "dsfghjk";
  for (size_t axis = 0; axis < 7; ++axis) {
    for (const bool rises : {true, false}) {
      read(seconds(1));
      std::vector<double> expected(7, 0);
      expected[axis] = rises ? 1 : -1;
      EXPECT_EQ(type({rises ? &up[axis] : &down[axis], 1}).axes, expected) << axis;
    }
  }
  EXPECT_EQ(type("D").axes[0], -1) << "capitals too";
}

TEST_F(KeyboardDeviceTest, KnowsArrowsInPiecesAndOverlooksOtherSequences) {
  device_.open();
  EXPECT_EQ(type("\x1b[A").axes[1], 1);
  EXPECT_EQ(type("\x1b[B").axes[1], -1);
  EXPECT_EQ(type("\x1bOD").axes[0], 1);
  type("\x1b");
  type("[");
  EXPECT_EQ(type("C").axes[0], -1);
  read(seconds(1));
  EXPECT_EQ(type("\x1b[15~\x1b[1;5P").axes, std::vector<double>(7, 0));
  EXPECT_FALSE(read().quit);
}

TEST_F(KeyboardDeviceTest, SpaceTogglesTheClutchAndHoldingItCannotSwitchItOn) {
  device_.open();
  EXPECT_FALSE(read().engaged);
  EXPECT_TRUE(type(" ").engaged);
  read(seconds(3));
  EXPECT_TRUE(read().engaged);
  EXPECT_FALSE(type(" ").engaged) << "at once";
  for (int i = 0; i < 50; ++i) EXPECT_FALSE(type(" ").engaged) << "a held space bar repeats";
  read(seconds(1));
  EXPECT_TRUE(type(" ").engaged);
  EXPECT_FALSE(type(" ").engaged) << "letting go is never too early";
}

TEST_F(KeyboardDeviceTest, LetsGoByItselfWhenEngagingHasNoEffect) {
  device_.open();
  EXPECT_TRUE(type(" ").engaged);
  device_.allow_engaging(false);
  EXPECT_FALSE(read().engaged);
  device_.allow_engaging(true);
  EXPECT_FALSE(read(seconds(5)).engaged);
  EXPECT_TRUE(type(" ").engaged) << "one space is a fresh press";
}

TEST_F(KeyboardDeviceTest, QuitsAtQ) {
  device_.open();
  EXPECT_FALSE(type("a").quit);
  EXPECT_TRUE(type("q").quit);
}

TEST_F(KeyboardDeviceTest, IsReleasedWhenItsTerminalGoesAndTriesAgain) {
  device_.open();
  EXPECT_TRUE(type(" ").engaged);
  pipe_.unplug();
  const DeviceReading gone = read();
  EXPECT_FALSE(gone.connected);
  EXPECT_FALSE(gone.engaged);
  EXPECT_NE(gone.problem.find("keys"), std::string::npos);
  read(seconds(2));
  pipe_.is_plugged = true;
  EXPECT_TRUE(read(seconds(2)).connected);
  EXPECT_FALSE(read().engaged);
}

TEST_F(KeyboardDeviceTest, RefusesWhatIsNoTerminal) {
  KeyboardDevice device(pipe_.opener(), {});
  const std::string line = error_of<UnavailableError>([&] { device.open(); });
  EXPECT_NE(line.find("standard input: is no terminal"), std::string::npos) << line;
  EXPECT_NE(line.find("foreground"), std::string::npos) << line;
}

TEST(KeyboardTerminal, IsRawWhileInUseAndRestoredAfterwards) {
  int master = -1, slave = -1;
  ASSERT_EQ(openpty(&master, &slave, nullptr, nullptr, nullptr), 0);
  const DeviceFd ours(master), theirs(slave);
  termios before{}, during{}, after{};
  ASSERT_EQ(tcgetattr(slave, &before), 0);
  {
    KeyboardDevice device([slave] { return DeviceFd(dup(slave)); }, {});
    device.open();
    ASSERT_EQ(tcgetattr(slave, &during), 0);
    EXPECT_EQ(during.c_lflag & static_cast<tcflag_t>(ICANON | ECHO), 0u);
    EXPECT_NE(during.c_lflag & static_cast<tcflag_t>(ISIG), 0u) << "Ctrl-C still works";
    ASSERT_EQ(write(master, "w", 1), 1);
    const DeviceReading reading = device.read(Time{1'000'000});
    EXPECT_EQ(reading.axes[1], 1) << "without return";
    EXPECT_TRUE(device.read(Time{1'100'000}).connected) << "nothing typed is not the end";
  }
  ASSERT_EQ(tcgetattr(slave, &after), 0);
  EXPECT_EQ(after.c_lflag, before.c_lflag);
}

}  // namespace
}  // namespace foresight
