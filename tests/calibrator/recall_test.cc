// The alignment outlives a calibrator that was killed (docs/decisions/0007): what is kept, and how
// its successor takes it.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <string>

#include "common/kept_file.h"
#include "procs/calibrator/geometry.h"
#include "procs/calibrator/kept_alignment.h"
#include "procs/calibrator/recalled_alignment.h"
#include "tests/calibrator/process_fixture.h"

namespace foresight {
namespace {

using namespace calibration;
using Eigen::Vector3d;

KeptAlignment example() {
  KeptAlignment k;
  k.epoch = 1'700'000'000'123'456;
  k.time = {1'700'000'010'000'001};
  k.newest_pair = {1'700'000'009'000'000};
  k.world_from_map = {0.371234567890123, rotation_from_vector({0.1, -0.2, 0.3}),
                      Vector3d(1.0 / 3, -2, 0.1)};
  k.solution.verdict = AlignmentVerdict::kAccepted;
  k.solution.estimate.ee_from_cam = {rotation_from_vector({0, 0.5, 0}), Vector3d(0, 0.05, 0.1)};
  k.solution.estimate.joint_delay_s = 0.0123;
  k.solution.scale_sigma = 0.001;
  k.solution.position_sigma_m = 0.0007;
  k.solution.rotation_sigma_rad = 0.0003;
  k.solution.residual_px = 0.4;
  k.solution.middle_in_base = {0.4, 0, 0.5};
  k.solution.inliers = 77;
  k.stand = Stand::kAway;
  k.world_from_base = {rotation_from_vector({0, 0, 0.02}), Vector3d(0.1, 0, 0)};
  k.base_speed_m_per_s = 0.05;
  return k;
}

TEST(KeptAlignment, IsReadAsItWasWritten) {
  const std::string text = to_text(example());
  const auto read = parse_kept_alignment(text);
  ASSERT_TRUE(read) << text;
  EXPECT_EQ(to_text(*read), text) << "every bit";
  EXPECT_EQ(read->epoch, example().epoch);
  EXPECT_EQ(read->stand, Stand::kAway);
  EXPECT_EQ(read->world_from_map.scale(), example().world_from_map.scale());
  EXPECT_EQ(read->solution.inliers, 77);
}

TEST(KeptAlignment, WhatCannotBeIsRefused) {
  const std::string whole = to_text(example());
  for (size_t size = 0; size + 1 < whole.size(); ++size) {
    EXPECT_FALSE(parse_kept_alignment(whole.substr(0, size)) &&
                 whole.substr(size).find('\n') != whole.size() - size - 1)
        << size;
  }
  EXPECT_FALSE(parse_kept_alignment(whole + "more 1\n"));
  EXPECT_FALSE(parse_kept_alignment(""));
  const auto refuses = [](auto&& change) {
    KeptAlignment k = example();
    change(&k);
    return !parse_kept_alignment(to_text(k));
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(refuses([](KeptAlignment* k) { k->solution.estimate.joint_delay_s = 1e300; }));
  EXPECT_TRUE(refuses([](KeptAlignment* k) { k->solution.estimate.joint_delay_s = kNan; }));
  EXPECT_TRUE(refuses([](KeptAlignment* k) { k->solution.scale_sigma = -1; }));
  EXPECT_TRUE(refuses([](KeptAlignment* k) { k->world_from_map = {0, {1, 0, 0, 0}, {0, 0, 0}}; }));
  EXPECT_TRUE(refuses([](KeptAlignment* k) {
    k->world_from_base = {Eigen::Quaterniond(1, 0, 0, 0), Vector3d(1e9, 0, 0)};
  }));
  EXPECT_TRUE(refuses([](KeptAlignment* k) { k->epoch = 0; }));
  EXPECT_TRUE(refuses([](KeptAlignment* k) { k->base_speed_m_per_s = kNan; }));
}

class Recalled : public testing::Test {
 protected:
  RecalledAlignment::Verdict show(int frames, double age_s, const Vector3d& off_m) {
    const Pose<World, Base> seen =
        kept_.world_from_base * Pose<Base, Base>(Eigen::Quaterniond::Identity(), off_m);
    auto verdict = RecalledAlignment::Verdict::kOpen;
    for (int i = 0; i < frames && verdict == RecalledAlignment::Verdict::kOpen; ++i) {
      verdict = recalled_.judge(kept_.time + seconds(age_s + 0.1 * i), seen, {0.01, 0.01});
    }
    return verdict;
  }
  static KeptAlignment still() {
    KeptAlignment k = example();
    k.base_speed_m_per_s = 0;
    return k;
  }
  KeptAlignment kept_ = still();
  RecalledAlignment recalled_{kept_};
};

TEST_F(Recalled, SomeFramesThatAgreeConfirm) {
  EXPECT_EQ(show(5, 1, {0.008, 0, 0}), RecalledAlignment::Verdict::kOpen) << "too few";
  EXPECT_EQ(show(1, 1.5, {0.008, 0, 0}), RecalledAlignment::Verdict::kConfirmed);
}

TEST_F(Recalled, FramesThatDisagreeForLongContradict) {
  EXPECT_EQ(show(15, 1, {0.02, 0, 0}), RecalledAlignment::Verdict::kOpen) << "a tracker's second";
  EXPECT_EQ(show(2, 2.5, {0.02, 0, 0}), RecalledAlignment::Verdict::kContradicted);
}

TEST_F(Recalled, OnlyFramesThatRunCount) {
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(show(3, 1 + i, {0, 0, 0}), RecalledAlignment::Verdict::kOpen);
    EXPECT_EQ(show(3, 1.5 + i, {0.1, 0, 0}), RecalledAlignment::Verdict::kOpen);
  }
}

TEST_F(Recalled, FramesOfAnotherTimeDropIt) {
  EXPECT_EQ(show(100, 61, {0, 0, 0}), RecalledAlignment::Verdict::kTooOld);
  recalled_ = RecalledAlignment(kept_);
  EXPECT_EQ(show(100, -3600, {0, 0, 0}), RecalledAlignment::Verdict::kTooOld);
}

TEST_F(Recalled, ABaseThatMovedMayHaveGoneOn) {
  kept_.base_speed_m_per_s = 0.1;
  recalled_ = RecalledAlignment(kept_);
  EXPECT_EQ(show(8, 1, {0.1, 0, 0}), RecalledAlignment::Verdict::kConfirmed);
  recalled_ = RecalledAlignment(kept_);
  EXPECT_EQ(show(20, 1, {0.5, 0, 0}), RecalledAlignment::Verdict::kContradicted);
}

// A calibrator with its robot; both may be begun again, the robot's time and map go on.
class RestartTest : public ProcessFixture {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(testing::TempDir()) /
              testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::remove_all(folder_);
    params_.keep_folder = folder_.string();
    run_ = RunIdentity{"boot", 7, 1234};
    start({}, params_);
    run(14);
    ASSERT_EQ(alignment_.state, +alignment_t::STATE_ALIGNED) << alignment_.reason;
    before_ = alignment_;
    ASSERT_TRUE(std::filesystem::exists(file()));
  }
  std::filesystem::path file() const { return folder_ / "kept_calibrator.7"; }
  /// SIGKILL: nothing is removed; the successor is given the whole map, as it asks for it.
  void kill() {
    const auto copy = folder_ / "copy";
    std::filesystem::copy_file(file(), copy);
    world_->remove("calibrator");
    std::filesystem::rename(copy, file());
    health_ = {};
    alignment_ = {};
    base_ = {};
  }
  void begin_again() {
    add_calibrator(params_);
    send("CAMERA_INFO", to_message(robot_->camera(), robot_->now()));
    send_whole_map();
  }
  void damage() {
    std::fstream stream(file(), std::ios::in | std::ios::out | std::ios::binary);
    stream.seekp(-20, std::ios::end);
    stream.put('7');
  }
  double error_m() const { return alignment_error(*robot_, process_->alignment()).position_m; }
  std::filesystem::path folder_;
  CalibratorParams params_;
  alignment_t before_{};
  std::string trouble_;
};

TEST_F(RestartTest, GoesOnInItsAlignmentWithinASecondAndWithoutMotion) {
  kill();
  robot_->set_still(true);
  run(0.5);
  begin_again();
  run(0.3);
  EXPECT_EQ(health_.state, +health_t::STATE_WAITING);
  EXPECT_EQ(alignment_.utime, 0) << "says nothing yet";
  run(0.7);
  EXPECT_EQ(health_.state, +health_t::STATE_OK) << health_.reason;
  ASSERT_EQ(alignment_.state, +alignment_t::STATE_ALIGNED) << alignment_.reason;
  EXPECT_EQ(alignment_.world_from_map_scale_m_per_mu, before_.world_from_map_scale_m_per_mu);
  EXPECT_EQ(alignment_.joint_delay_s, before_.joint_delay_s);
  EXPECT_EQ(base_.state, +base_pose_t::STATE_MEASURED);
  robot_->set_still(false);
  run(8);
  EXPECT_EQ(alignment_.state, +alignment_t::STATE_ALIGNED);
  EXPECT_LT(error_m(), 0.005) << "new pairs do no harm";
  EXPECT_EQ(health_.state, +health_t::STATE_OK) << health_.reason;
}

TEST_F(RestartTest, IsBeingConfirmedForAsLongAsNothingIsTracked) {
  kill();
  robot_->set_tracking(SimulatedRobot::Tracking::kLost);
  begin_again();
  run(3);
  EXPECT_EQ(health_.state, +health_t::STATE_WAITING);
  EXPECT_EQ(health_.reason, "alignment of before the restart, being confirmed");
  EXPECT_EQ(alignment_.utime, 0) << "says nothing yet";
  robot_->set_tracking(SimulatedRobot::Tracking::kGood);
  run(1);
  EXPECT_EQ(health_.state, +health_t::STATE_OK) << health_.reason;
  EXPECT_EQ(alignment_.state, +alignment_t::STATE_ALIGNED);
}

TEST_F(RestartTest, WithoutItTheArmMustMove) {
  kill();
  std::filesystem::remove(file());
  robot_->set_still(true);
  begin_again();
  run(3);
  EXPECT_EQ(health_.state, +health_t::STATE_WAITING);
}

TEST_F(RestartTest, ADamagedOneIsNotUsed) {
  kill();
  damage();
  testing::internal::CaptureStderr();
  begin_again();
  EXPECT_NE(testing::internal::GetCapturedStderr().find("kept_calibrator.7: is damaged"),
            std::string::npos);
  robot_->set_still(true);
  run(3);
  EXPECT_EQ(health_.state, +health_t::STATE_WAITING);
}

TEST_F(RestartTest, OneOfAnotherMapIsNotUsed) {
  kill();
  robot_->begin_map(0.5);
  run(0.2);
  testing::internal::CaptureStderr();
  begin_again();
  run(0.5);
  EXPECT_NE(testing::internal::GetCapturedStderr().find("is of another map: not used"),
            std::string::npos);
  EXPECT_EQ(health_.state, +health_t::STATE_WAITING) << health_.reason;
  run(12);
  EXPECT_EQ(alignment_.state, +alignment_t::STATE_ALIGNED) << alignment_.reason;
  EXPECT_LT(error_m(), 0.005);
}

TEST_F(RestartTest, OneThatIsContradictedIsDropped) {
  kill();
  auto kept =
      parse_kept_alignment(*KeptFile(folder_.string(), "calibrator", *run_).read(&trouble_));
  ASSERT_TRUE(kept);
  kept->world_from_map = {kept->world_from_map.scale() * 1.1, kept->world_from_map.rotation(),
                          kept->world_from_map.translation()};
  KeptFile(folder_.string(), "calibrator", *run_).write(to_text(*kept));
  testing::internal::CaptureStderr();
  begin_again();
  run(2.5);
  EXPECT_NE(testing::internal::GetCapturedStderr().find("is contradicted: dropped"),
            std::string::npos);
  EXPECT_EQ(base_.utime, 0) << "nothing was published by it";
  run(10);
  ASSERT_EQ(alignment_.state, +alignment_t::STATE_ALIGNED) << alignment_.reason;
  EXPECT_LT(error_m(), 0.005);
}

TEST_F(RestartTest, AnEndOnPurposeLeavesNothing) {
  world_->remove("calibrator");
  EXPECT_FALSE(std::filesystem::exists(file()));
}

TEST_F(RestartTest, AnotherRunIsNotGivenIt) {
  kill();
  run_->parent_start = 99999;
  robot_->set_still(true);
  begin_again();
  run(3);
  EXPECT_EQ(health_.state, +health_t::STATE_WAITING);
}

TEST_F(RestartTest, AFolderThatCannotBeWrittenIsSaid) {
  std::filesystem::remove_all(folder_);
  std::ofstream(folder_) << "a file";
  run(3);
  EXPECT_EQ(health_.state, +health_t::STATE_OK);
  EXPECT_TRUE(health_.reason.starts_with("the alignment is not kept for a restart: "))
      << health_.reason;
}

}  // namespace
}  // namespace foresight
