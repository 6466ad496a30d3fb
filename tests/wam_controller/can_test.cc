#include <gtest/gtest.h>

#include "common/errors.h"
#include "procs/wam_controller/can_arm.h"
#include "procs/wam_controller/can_socket.h"
#include "procs/wam_controller/transmission.h"
#include "tests/wam_controller/fake_bus.h"
#include "tests/wam_controller/joints.h"

namespace foresight {
namespace {

using Bytes = std::array<uint8_t, 8>;

// The frames of the manual's example (D1001 §7.5).
TEST(PuckCodec, PacksAsInTheManual) {
  EXPECT_EQ(group_address(kGroupAll), 0b10000000000);
  EXPECT_EQ(node_address(3), 0b00000000011);
  const CanFrame ready = set_frame(group_address(kGroupAll), kPropertyStatus, kStatusReady);
  EXPECT_EQ(ready.size, 6);
  EXPECT_EQ(ready.data, (Bytes{0b10000101, 0, 2, 0, 0, 0}));
  const CanFrame ask = get_frame(group_address(kGroupAll), kPropertyPosition);
  EXPECT_EQ(ask.size, 1);
  EXPECT_EQ(ask.data[0], 0b00110000);
  const std::array<int32_t, 4> torques{0x1A55, 1, 0, 0};
  const CanFrame frame = torque_frame(kGroupUpperTorques, torques);
  EXPECT_EQ(frame.id, 0b10000000010);
  EXPECT_EQ(frame.size, 8);
  EXPECT_EQ(frame.data, (Bytes{0b10101010, 0b01101001, 0b01010100, 0, 0b00010000, 0, 0, 0}));
}

TEST(PuckCodec, PacksFourTorquesOfFourteenBits) {
  const std::array<int32_t, 4> torques{-1, 8191, -8191, -99'999};
  const CanFrame frame = torque_frame(kGroupLowerTorques, torques);
  uint64_t bits = 0;
  for (size_t i = 1; i < 8; ++i) bits = bits << 8 | frame.data[i];
  EXPECT_EQ(bits >> 42 & 0x3FFF, 0x3FFFu);
  EXPECT_EQ(bits >> 28 & 0x3FFF, 0x1FFFu);
  EXPECT_EQ(bits >> 14 & 0x3FFF, 0x2001u);
  EXPECT_EQ(bits & 0x3FFF, 0x2001u);  // limited
}

TEST(PuckCodec, ReadsPositionsOfTwentyTwoBits) {
  const auto seven = read_feedback({0b10011000011, 3, {0, 0, 7}});
  ASSERT_TRUE(seven);
  EXPECT_EQ(seven->node, 6);
  EXPECT_EQ(seven->property, kPropertyPosition);
  EXPECT_EQ(seven->value, 7);
  EXPECT_EQ(read_feedback({0b10011100011, 3, {0b00111111, 0xFF, 0xFE}})->value, -2);
  EXPECT_EQ(read_feedback({0b10011100011, 3, {0b11111111, 0xFF, 0xFE}})->value, -2);
  EXPECT_EQ(read_feedback({0b10011100011, 3, {0x1F, 0xFF, 0xFF}})->value, 2097151);
}

TEST(PuckCodec, ReadsPropertiesOfBothLengths) {
  const auto id = static_cast<uint16_t>(0x400 | 10 << 5 | kGroupProperties);
  EXPECT_EQ(read_feedback({id, 4, {0x88, 0, 0xFE, 0xFF}})->value, -2);
  EXPECT_EQ(read_feedback({id, 6, {0x88, 0, 1, 2, 0, 0}})->value, 0x201);
  EXPECT_EQ(read_feedback({10 << 5, 4, {0x88, 0, 2, 0}})->property, kPropertyMode);
}

TEST(PuckCodec, PassesOverWhatIsNoFeedback) {
  EXPECT_FALSE(read_feedback({0x400, 8, {}}));               // from the host
  EXPECT_FALSE(read_feedback({0x400 | 1 << 5 | 3, 2, {}}));  // too short
  EXPECT_FALSE(read_feedback({0x400 | 1 << 5 | 6, 5, {}}));
  EXPECT_FALSE(read_feedback({0x400 | 1 << 5 | 1, 8, {}}));  // to another group
  EXPECT_FALSE(read_feedback({1 << 5 | 2, 4, {}}));          // to another node
  EXPECT_FALSE(read_feedback({0x400 | 1 << 5 | 3, 200, {}}));
}

class CanArmTest : public testing::Test {
 protected:
  // As if the arm stood at home.
  bool start() {
    if (!hardware_.start()) return false;
    set_home(arm_, hardware_);
    return true;
  }
  static void set_home(const ArmModel& arm, CanArm& hardware) {
    const JointVector home_counts = Transmission(arm).motor_counts(arm.home());
    std::vector<int32_t> zero;
    for (int i = 0; i < arm.size(); ++i) {
      zero.push_back(hardware.position_counts()[static_cast<size_t>(i)] -
                     static_cast<int32_t>(std::lround(home_counts[i])));
    }
    hardware.set_zero(zero);
  }
  ArmReading read() {
    ArmReading reading;
    EXPECT_TRUE(hardware_.read(now_ = now_ + milliseconds(2), &reading));
    return reading;
  }
  bool read_fails() {
    ArmReading reading;
    return !hardware_.read(now_ = now_ + milliseconds(2), &reading);
  }
  const ArmModel arm_ = load_arm_file(kArms + "/wam4.yaml");
  FakeBus bus_;
  CanArm hardware_{bus_, arm_, joints({1000, 1000, 1000, 1000})};
  Time now_{1'000'000};
};

TEST_F(CanArmTest, HasNoReadingsBeforeItsZeroIsKnown) {
  ASSERT_TRUE(hardware_.start());
  EXPECT_TRUE(read_fails());
  set_home(arm_, hardware_);
  EXPECT_FALSE(read_fails());
}

TEST_F(CanArmTest, SeesWhetherThePucksWereAwakeAlready) {
  ASSERT_TRUE(hardware_.start());
  EXPECT_FALSE(hardware_.had_been_running());
  ASSERT_TRUE(hardware_.start());
  EXPECT_TRUE(hardware_.had_been_running());
  bus_.status[3] = 0;
  ASSERT_TRUE(hardware_.start());
  EXPECT_FALSE(hardware_.had_been_running());
}

TEST_F(CanArmTest, CountsFromTheHomePosition) {
  bus_.positions = {0, 100, -200, 300, -400};
  ASSERT_TRUE(start());
  EXPECT_LT((read().position_rad - arm_.home()).cwiseAbs().maxCoeff(), 1e-4);
  bus_.positions[1] -= 4096;  // one turn of motor 1 is −1/42 turn of joint 1
  EXPECT_NEAR(read().position_rad[0] - arm_.home()[0], 2 * 3.14159265 / 42, 1e-4);
}

TEST_F(CanArmTest, SendsMotorTorquesInOneFrame) {
  ASSERT_TRUE(start());
  hardware_.write(joints({4.2, 0, 0, -1.8}));
  const std::array<int32_t, 4> expected{-100, 0, 0, 100};
  EXPECT_EQ(bus_.torques[1], torque_frame(kGroupLowerTorques, expected));
}

TEST_F(CanArmTest, SevenJointsTakeTwoFrames) {
  const ArmModel arm = load_arm_file(kArms + "/wam7.yaml");
  FakeBus bus;
  bus.node_count = 7;
  CanArm hardware(bus, arm, JointVector::Constant(7, 100));
  ASSERT_TRUE(hardware.start());
  hardware.write(joints({0, 0, 0, 0, 0, 0, 14.93}));
  EXPECT_EQ(bus.torques[2],
            torque_frame(kGroupUpperTorques, std::array<int32_t, 4>{0, 0, -100, 0}));
}

TEST_F(CanArmTest, ReportsTheSafetyBoardAndTakesItsSilenceForAStop) {
  ASSERT_TRUE(start());
  EXPECT_EQ(read().safety, Safety::kActive);
  bus_.mode = 1;
  for (int i = 0; i < 10; ++i) read();
  EXPECT_EQ(read().safety, Safety::kIdle);
  bus_.mode = 77;
  for (int i = 0; i < 10; ++i) read();
  EXPECT_EQ(read().safety, Safety::kEstop);
  bus_.mode = 2;
  for (int i = 0; i < 10; ++i) read();
  EXPECT_EQ(read().safety, Safety::kActive);
  bus_.has_board = false;
  for (int i = 0; i < 60; ++i) read();
  EXPECT_EQ(read().safety, Safety::kEstop);
}

TEST_F(CanArmTest, ASilentPuckMakesNoReading) {
  bus_.silent_node = 3;
  EXPECT_FALSE(start());
  bus_.silent_node = 0;
  ASSERT_TRUE(start());
  bus_.silent_node = 2;
  EXPECT_TRUE(read_fails());
  EXPECT_EQ(hardware_.counts().incomplete_reads, 2);
  bus_.silent_node = 0;
  EXPECT_FALSE(read_fails());
}

TEST_F(CanArmTest, AnOldAnswerDoesNotAnswerANewQuestion) {
  ASSERT_TRUE(start());
  bus_.positions[4] = 1000;
  bus_.answer_positions();  // late, of the question before
  bus_.positions[4] = 0;
  EXPECT_NEAR(read().position_rad[3], arm_.home()[3], 1e-4);
}

TEST_F(CanArmTest, SurvivesNoiseAndABrokenBus) {
  ASSERT_TRUE(start());
  for (int i = 0; i < 20; ++i) bus_.push({static_cast<uint16_t>(i * 97), 8, {1, 2, 3}});
  EXPECT_FALSE(read_fails());
  EXPECT_GT(hardware_.counts().unknown_frames, 0);
  bus_.is_broken = true;
  EXPECT_TRUE(read_fails());
  hardware_.write(joints({1, 1, 1, 1}));
  EXPECT_GE(hardware_.counts().send_errors, 2);
}

TEST(CanSocketTest, SaysWhichInterfaceIsMissing) {
  try {
    CanSocket socket("nocan7");
    FAIL() << "opened an interface that does not exist";
  } catch (const UnavailableError& e) {
    EXPECT_NE(std::string(e.what()).find("nocan7"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace foresight
