// The base's motion (paper §II-C.2): the filters alone, and behind an alignment.
#include <gtest/gtest.h>

#include "bench/handeye_eval/base_filter_evaluation.h"
#include "procs/calibrator/geometry.h"
#include "tests/calibrator/simulated_robot.h"

namespace foresight {
namespace {

using namespace calibration;
using Eigen::Vector3d;

BaseFilterOptions paper() {
  BaseFilterOptions options;
  options.kind = BaseFilterKind::kPaper;
  return options;
}

TEST(BaseFilter, FollowsEveryMotionWithinFiveMillimetres) {
  for (const BaseMotionKind kind : kAllBaseMotions) {
    for (const double noise_m : {0.001, 0.003}) {
      BaseMotionOptions options;
      options.noise_m = noise_m;
      const BaseFilterScore s = evaluate_base_filter(make_base_motion(kind, options), {});
      EXPECT_LT(s.median_mm, 3) << to_string(kind);
      EXPECT_LT(s.p95_mm, 6) << to_string(kind);
      EXPECT_LT(s.median_deg, 0.15) << to_string(kind);
      EXPECT_EQ(s.reacquisitions, 0) << to_string(kind);
      EXPECT_LT(s.refused, 20) << to_string(kind) << ": about 6 outliers";
    }
  }
}

TEST(BaseFilter, AStillBaseDoesNotJitter) {
  const auto frames = make_base_motion(BaseMotionKind::kStill, {});
  const BaseFilterScore s = evaluate_base_filter(frames, {});
  EXPECT_LT(s.jitter_mm, 0.2);
  EXPECT_LT(s.jitter_deg, 0.01);
  EXPECT_LT(s.max_mm, 3);
}

TEST(BaseFilter, ThePapersLagsByTwoThirdsOfASecond) {
  BaseMotionOptions options;
  options.outlier_share = 0;
  const auto frames = make_base_motion(BaseMotionKind::kRamp, options);
  const BaseFilterScore lagging = evaluate_base_filter(frames, paper());
  const size_t frame = 9 * 30;  // 5 s into the ramp of 0.1 m/s
  const double behind_m = (lagging.estimates[frame].world_from_base.translation() -
                           frames[frame].world_from_base.translation())
                              .norm();
  EXPECT_NEAR(behind_m, 0.063, 0.004);
}

TEST(BaseFilter, ABurstOfMistrackingDoesNotMoveTheBase) {
  for (const double off_m : {0.05, 0.1, 0.5}) {
    BaseMotionOptions options;
    options.mistrack_length_s = 1;
    options.mistrack_m = off_m;
    const BaseFilterScore s =
        evaluate_base_filter(make_base_motion(BaseMotionKind::kStill, options), {});
    EXPECT_LT(s.max_mm, 4) << off_m;
    EXPECT_LT(s.max_deg, 0.3) << off_m;
    EXPECT_EQ(s.reacquisitions, 0);
  }
}

TEST(BaseFilter, BelievesAConsistentContradictionInTheEnd) {
  BaseMotionOptions options;
  options.mistrack_begin_s = 5;
  options.mistrack_length_s = 100;  // the base was carried off between two frames
  options.outlier_share = 0;
  const auto frames = make_base_motion(BaseMotionKind::kStill, options);
  const BaseFilterScore s = evaluate_base_filter(frames, {});
  EXPECT_EQ(s.reacquisitions, 1);
  const Pose<World, Base> measured = frames.back().measurement.world_from_base();
  EXPECT_LT((s.estimates.back().world_from_base.translation() - measured.translation()).norm(),
            0.01);
}

TEST(BaseFilter, CoastsWithGrowingDoubtAndDyingVelocity) {
  const auto frames = make_base_motion(BaseMotionKind::kRamp, {});
  const auto filter = make_base_filter({});
  filter->reset(frames[0].measurement);
  BaseState last;
  for (size_t i = 0; i < 240; ++i) last = filter->update(frames[i].measurement);  // 8 s
  EXPECT_NEAR(last.velocity_m_per_s.norm(), 0.1, 0.03);
  EXPECT_NEAR(last.angular_velocity_rad_per_s.z() / kDegree, 10, 2);
  double sigma_m = last.position_sigma_m;
  for (int i = 1; i <= 60; ++i) {
    const BaseState e = filter->coast(last.time + milliseconds(33 * i));
    EXPECT_EQ(e.tracking, BaseTracking::kCoasting);
    EXPECT_GT(e.position_sigma_m, sigma_m);
    sigma_m = e.position_sigma_m;
    if (i == 60) {
      EXPECT_LT(e.velocity_m_per_s.norm(), 0.001);
      EXPECT_LT((e.world_from_base.translation() - last.world_from_base.translation()).norm(),
                0.05);
    }
  }
}

// A forged pose, or one of a tracker that is mistaken on its way back: it counts, but when nothing
// agrees with it before the next silence, it is forgotten.
TEST(BaseFilter, OneWrongPoseDoesNotOutlastTheSilenceAfterIt) {
  const auto frames = make_base_motion(BaseMotionKind::kStill, {});
  const Pose<World, World> off{rotation_from_vector({0, 0, 10 * kDegree}), Vector3d(0.1, 0, 0)};
  for (const int wrong : {1, 3}) {
    const auto filter = make_base_filter({});
    filter->reset(frames[0].measurement);
    for (size_t i = 1; i < 150; ++i) filter->update(frames[i].measurement);
    Time now = frames[149].measurement.time;
    const auto lose = [&](double for_s) {
      BaseState e;
      for (int i = 0; i < for_s * 30; ++i) e = filter->coast(now = now + milliseconds(33));
      return e;
    };
    lose(1);
    for (int i = 0; i < wrong; ++i) {
      BaseMeasurement m = frames[149].measurement;
      m.time = now = now + milliseconds(33);
      m.world_from_cam = off * (m.world_from_base() * m.base_from_cam);
      EXPECT_EQ(filter->update(m).tracking, BaseTracking::kMeasured);
    }
    const BaseState after = lose(0.5);
    EXPECT_LT(
        (after.world_from_base.translation() - frames[149].world_from_base.translation()).norm(),
        0.005);
    EXPECT_LT(
        angle_between(after.world_from_base.rotation(), frames[149].world_from_base.rotation()),
        0.2 * kDegree);
  }
}

// Forged poses that agreed for as long as a contender must are believed; the tracker that then
// finds back to where the base was for long need not contend as long.
TEST(BaseFilter, WhatWasProvenIsBelievedAgainAtOnce) {
  BaseMotionOptions options;
  options.outlier_share = 0;
  options.mistrack_begin_s = 5;
  options.mistrack_length_s = 1.7;
  options.mistrack_m = 0.1;
  const auto frames = make_base_motion(BaseMotionKind::kStill, options);
  const auto filter = make_base_filter({});
  filter->reset(frames[0].measurement);
  int off_after = 0;
  for (size_t i = 1; i < 300; ++i) {
    const BaseState e = filter->update(frames[i].measurement);
    const double off_m =
        (e.world_from_base.translation() - frames[i].world_from_base.translation()).norm();
    if (i == 200) EXPECT_GT(off_m, 0.05) << "it was not believed";
    if (i >= 201 && off_m > 0.005) ++off_after;
    EXPECT_EQ(filter->earlier().has_value(), off_m > 0.03) << i;
  }
  EXPECT_LE(off_after, 13) << "0.4 s";
}

// At two frames a second every pause is as long as a silence.
TEST(BaseFilter, ASlowCameraIsFollowed) {
  const auto frames = make_base_motion(BaseMotionKind::kRamp, {});
  const auto filter = make_base_filter({});
  filter->reset(frames[0].measurement);
  for (size_t i = 1; i < 60; ++i) filter->update(frames[i].measurement);
  for (size_t i = 60; i < frames.size(); i += 15) {
    const BaseState e = filter->update(frames[i].measurement);
    EXPECT_LT((e.world_from_base.translation() - frames[i].world_from_base.translation()).norm(),
              0.02)
        << i;
  }
}

// Tracking that is good again after a loss is believed: the base may have gone where it likes.
TEST(BaseFilter, ABaseThatMovedUnseenIsBelievedAndStaysSo) {
  BaseMotionOptions options;
  options.outlier_share = 0;
  options.mistrack_begin_s = 5;
  options.mistrack_length_s = 100;  // it was carried off
  options.mistrack_m = 0.1;
  const auto frames = make_base_motion(BaseMotionKind::kStill, options);
  const auto filter = make_base_filter({});
  filter->reset(frames[0].measurement);
  BaseState e;
  for (size_t i = 1; i < 240; ++i) {
    const bool is_lost = i >= 150 && i < 210;  // from 5 to 7 s; then it is seen for a second
    e = is_lost ? filter->coast(frames[i].measurement.time) : filter->update(frames[i].measurement);
  }
  const Pose<World, Base> there = frames[239].measurement.world_from_base();
  EXPECT_LT((e.world_from_base.translation() - there.translation()).norm(), 0.01);
  for (int i = 1; i <= 60; ++i)
    e = filter->coast(frames[239].measurement.time + milliseconds(33 * i));
  EXPECT_LT((e.world_from_base.translation() - there.translation()).norm(), 0.03);
}

class BaseBehindAlignment : public testing::Test {
 protected:
  explicit BaseBehindAlignment()
      : arm_(load_arm_file(FORESIGHT_SOURCE_DIR "/deploy/arms/wam4.yaml")) {}
  // At rest until 15 s, then 0.1 m/s and 10 deg/s for 6 s.
  static Pose<World, Base> motion(double t_s) {
    const double way_s = std::min(6.0, std::max(0.0, t_s - 15));
    return {rotation_from_vector({0, 0, 10 * kDegree * way_s}),
            Vector3d(0.1 * way_s, 0.02 * way_s, 0)};
  }
  ArmModel arm_;
};

TEST_F(BaseBehindAlignment, FollowsADrivenBase) {
  RobotOptions options;
  options.base = motion;
  Calibrator core(arm_, {});
  SimulatedRobot robot(arm_, options);
  core.set_camera(robot.camera());
  CoreListener listener(&core);
  robot.run(15, &listener);
  ASSERT_TRUE(core.alignment().is_aligned) << core.alignment().reason;
  const BaseError still = base_error(robot, listener.take_base());
  robot.run(0.5, &listener);
  listener.take_base();
  robot.run(5.5, &listener);
  const BaseError moving = base_error(robot, listener.take_base());
  robot.run(5, &listener);
  const BaseError after = base_error(robot, listener.take_base());
  std::printf(
      "  still %.2f mm %.3f deg, moving %.2f mm %.3f deg, after %.2f mm %.3f deg (median)\n",
      still.median_mm, still.median_deg, moving.median_mm, moving.median_deg, after.median_mm,
      after.median_deg);
  EXPECT_LT(still.median_mm, 3);
  EXPECT_LT(moving.median_mm, 5);
  EXPECT_LT(moving.median_deg, 0.3);
  EXPECT_LT(after.median_mm, 5);
  EXPECT_LT(after.median_deg, 0.3);
  EXPECT_TRUE(core.statistics().base_has_left);
  // What was seen while the base drove has not touched the alignment.
  EXPECT_LT(alignment_error(robot, core.alignment()).rotation_deg, 0.3);
}

TEST_F(BaseBehindAlignment, MistrackingAndLossDoNotMoveIt) {
  Calibrator core(arm_, {});
  SimulatedRobot robot(arm_, {});
  core.set_camera(robot.camera());
  CoreListener listener(&core);
  robot.run(15, &listener);
  ASSERT_TRUE(core.alignment().is_aligned) << core.alignment().reason;
  listener.take_base();
  robot.set_tracking(SimulatedRobot::Tracking::kWrong);
  robot.run(1, &listener);
  robot.set_tracking(SimulatedRobot::Tracking::kGood);
  robot.run(2, &listener);
  BaseError error = base_error(robot, listener.take_base());
  EXPECT_LT(error.max_mm, 5);
  EXPECT_LT(error.max_deg, 0.4);
  robot.set_tracking(SimulatedRobot::Tracking::kLost);
  robot.run(2, &listener);
  const auto lost = listener.take_base();
  EXPECT_EQ(lost.back().tracking, BaseTracking::kCoasting);
  EXPECT_LT(base_error(robot, lost).max_mm, 5);
  robot.set_tracking(SimulatedRobot::Tracking::kGood);
  robot.run(1, &listener);
  EXPECT_EQ(core.base()->tracking, BaseTracking::kMeasured);
}

TEST_F(BaseBehindAlignment, ANewMapKeepsTheWorld) {
  RobotOptions options;
  options.base = motion;
  Calibrator core(arm_, {});
  SimulatedRobot robot(arm_, options);
  core.set_camera(robot.camera());
  CoreListener listener(&core);
  robot.run(25, &listener);  // aligned, driven, at rest elsewhere
  ASSERT_TRUE(core.statistics().base_has_left);
  robot.begin_map(1.7);
  robot.run(1, &listener);
  EXPECT_FALSE(core.alignment().is_aligned);
  EXPECT_EQ(core.alignment().epoch, robot.epoch());
  robot.run(14, &listener);
  ASSERT_TRUE(core.alignment().is_aligned) << core.alignment().reason;
  const AlignmentError error = alignment_error(robot, core.alignment());
  EXPECT_LT(error.position_m, 0.008);
  EXPECT_LT(error.rotation_deg, 0.5);
  listener.take_base();
  robot.run(3, &listener);
  EXPECT_LT(base_error(robot, listener.take_base()).median_mm, 8);
}

}  // namespace
}  // namespace foresight
