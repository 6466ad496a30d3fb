// The alignment of the map with the robot (paper §II-C.1).
#include <gtest/gtest.h>

#include <random>

#include "procs/calibrator/alignment_residual.h"
#include "procs/calibrator/alignment_solver.h"
#include "procs/calibrator/geometry.h"
#include "tests/calibrator/simulated_robot.h"

namespace foresight {
namespace {

using namespace calibration;
using Eigen::Vector3d;

ArmModel wam() { return load_arm_file(FORESIGHT_SOURCE_DIR "/deploy/arms/wam4.yaml"); }

// A robot, its calibrator, and time that passes.
struct Site {
  explicit Site(const RobotOptions& robot_options, const CalibratorOptions& options = {},
                const ArmModel& believed_arm = wam())
      : core(believed_arm, options), robot(wam(), robot_options), listener(&core) {
    core.set_camera(robot.camera());
  }
  void run(double seconds_long) { robot.run(seconds_long, &listener); }
  Calibrator core;
  SimulatedRobot robot;
  CoreListener listener;
};

class AlignmentAccuracy : public testing::TestWithParam<unsigned> {};

TEST_P(AlignmentAccuracy, IsWithinFiveMillimetres) {
  RobotOptions options;
  options.seed = GetParam();
  Site site(options);
  site.run(12);
  ASSERT_TRUE(site.core.alignment().is_aligned) << site.core.alignment().reason;
  const AlignmentError error = alignment_error(site.robot, site.core.alignment());
  EXPECT_LT(error.position_m, 0.005);
  EXPECT_LT(error.rotation_deg, 0.3);
  EXPECT_LT(error.scale, 0.01);
  std::printf("  %.2f mm, %.3f deg, scale %.2f %%; sigma %.2f mm, %.3f deg, %.2f %%; %d pairs\n",
              1e3 * error.position_m, error.rotation_deg, 100 * error.scale,
              1e3 * site.core.alignment().position_sigma_m,
              site.core.alignment().rotation_sigma_rad / kDegree,
              100 * site.core.alignment().solution.scale_sigma, site.core.statistics().pairs);
}

INSTANTIATE_TEST_SUITE_P(Seeds, AlignmentAccuracy, testing::Values(1, 2, 3, 4, 5));

TEST(Alignment, StandardDeviationsAreHonest) {
  double position2 = 0, scale2 = 0, rotation2 = 0;
  constexpr int kRuns = 12;
  for (unsigned seed = 1; seed <= kRuns; ++seed) {
    RobotOptions options;
    options.seed = 100 + seed;
    CalibratorOptions calibrator;
    calibrator.alignment.estimate_delay = false;
    Site site(options, calibrator);
    site.run(10);
    const AlignmentStatus& a = site.core.alignment();
    ASSERT_TRUE(a.is_aligned) << a.reason;
    const AlignmentError error = alignment_error(site.robot, a);
    position2 += std::pow(error.position_m / a.position_sigma_m, 2) / kRuns;
    scale2 += std::pow(error.scale / a.solution.scale_sigma, 2) / kRuns;
    rotation2 += std::pow(error.rotation_deg * kDegree / a.rotation_sigma_rad, 2) / kRuns;
  }
  // The position's error is the largest of many places.
  std::printf("  error over sigma: position %.2f, rotation %.2f, scale %.2f\n",
              std::sqrt(position2), std::sqrt(rotation2), std::sqrt(scale2));
  EXPECT_GT(std::sqrt(scale2), 0.4);
  EXPECT_LT(std::sqrt(scale2), 1.7);
  EXPECT_LT(std::sqrt(rotation2), 1.7);
  EXPECT_LT(std::sqrt(position2), 2.5);
}

TEST(Alignment, FindsTheJointsDelay) {
  for (const double delay_s : {0.02, -0.035, 0.0}) {
    RobotOptions options;
    options.joint_delay_s = delay_s;
    Site site(options);
    site.run(15);
    ASSERT_TRUE(site.core.alignment().is_aligned) << site.core.alignment().reason;
    EXPECT_NEAR(site.core.alignment().solution.estimate.joint_delay_s, delay_s, 0.003);
    std::printf("  delay %.1f ms: found %.2f ms\n", 1e3 * delay_s,
                1e3 * site.core.alignment().solution.estimate.joint_delay_s);
    EXPECT_LT(alignment_error(site.robot, site.core.alignment()).position_m, 0.005);
  }
}

TEST(Alignment, RefinesTheCameraOnTheArm) {
  ArmModel believed = wam();
  const Pose<Ee, Cam> truth = believed.ee_from_cam;
  believed.ee_from_cam = truth * Pose<Cam, Cam>(rotation_from_vector({0.05, -0.04, 0.03}),
                                                Vector3d(0.02, -0.015, 0.01));
  RobotOptions robot;
  robot.joint_swing_rad = 0.45;
  CalibratorOptions options;
  options.alignment.refine_camera = true;
  Site site(robot, options, believed);
  site.run(25);
  ASSERT_TRUE(site.core.alignment().is_aligned) << site.core.alignment().reason;
  const Pose<Cam, Cam> error =
      truth.inverse() * site.core.alignment().solution.estimate.ee_from_cam;
  EXPECT_LT(error.translation().norm(), 0.005);
  EXPECT_LT(angle_between(error.rotation(), {1, 0, 0, 0}) / kDegree, 0.3);
  EXPECT_LT(alignment_error(site.robot, site.core.alignment()).position_m, 0.005);
  std::printf("  T_cam: %.2f mm, %.3f deg\n", 1e3 * error.translation().norm(),
              angle_between(error.rotation(), {1, 0, 0, 0}) / kDegree);
}

TEST(Alignment, SurvivesMistrackedKeyframes) {
  RobotOptions options;
  options.wrong_keyframe_share = 0.2;
  Site site(options);
  site.run(15);
  ASSERT_TRUE(site.core.alignment().is_aligned) << site.core.alignment().reason;
  EXPECT_LT(site.core.alignment().solution.inliers, site.core.statistics().pairs);
  EXPECT_LT(alignment_error(site.robot, site.core.alignment()).position_m, 0.005);
}

TEST(Alignment, RefusesABaseThatMoves) {
  for (const double speed_m_per_s : {0.05, 0.004}) {
    RobotOptions options;
    options.base = [=](double t_s) {
      return Pose<World, Base>(Eigen::Quaterniond::Identity(), Vector3d(speed_m_per_s * t_s, 0, 0));
    };
    Site site(options);
    for (int i = 0; i < 15; ++i) {
      site.run(1);
      ASSERT_FALSE(site.core.alignment().is_aligned)
          << speed_m_per_s << " m/s after " << i << " s: off by "
          << alignment_error(site.robot, site.core.alignment()).position_m << " m";
    }
    EXPECT_TRUE(site.core.alignment().reason.starts_with("base is moving"))
        << site.core.alignment().reason;
  }
}

TEST(Alignment, AlignsOnceTheBaseHasComeToRest) {
  RobotOptions options;
  options.base = [](double t_s) {
    return Pose<World, Base>(rotation_from_vector({0, 0, 0.03 * std::min(t_s, 8.0)}),
                             Vector3d(0.03 * std::min(t_s, 8.0), 0, 0));
  };
  Site site(options);
  site.run(30);
  ASSERT_TRUE(site.core.alignment().is_aligned) << site.core.alignment().reason;
  // World is the base where it came to rest.
  const Pose<World, Base> rest = options.base(30);
  const Vector3d camera =
      site.robot.world_from_cam(site.robot.now() - milliseconds(50)).translation();
  const Vector3d in_map = site.robot.world_from_map().inverse() * camera;
  EXPECT_LT((site.core.alignment().world_from_map * in_map - rest.inverse() * camera).norm(),
            0.005);
}

TEST(Alignment, IsTheSameBitForBit) {
  const auto run = [] {
    Site site({});
    site.run(9);
    return site.core.alignment();
  };
  const AlignmentStatus a = run(), b = run();
  EXPECT_EQ(a.world_from_map.matrix(), b.world_from_map.matrix());
  EXPECT_EQ(a.solution.residual_px, b.solution.residual_px);
}

// Problems made by hand: the camera is the hand, its motion is given.
class AlignmentProblems : public testing::Test {
 protected:
  AlignmentProblems() {
    problem_.camera.width_px = 640;
    problem_.camera.height_px = 480;
    problem_.camera.fx_px = problem_.camera.fy_px = 530;
    problem_.camera.cx_px = 319.5;
    problem_.camera.cy_px = 239.5;
    for (int i = 0; i < 600; ++i) {
      const Vector3d p(gaussian(), gaussian(), 1.6 + 0.2 * gaussian());
      problem_.points_in_map.push_back((base_from_map_.inverse() * p).cast<float>());
    }
  }
  double gaussian() { return normal_(generator_); }
  Vector3d gaussian3(double sigma3) {
    const double x = gaussian(), y = gaussian(), z = gaussian();
    return sigma3 / std::sqrt(3.0) * Vector3d(x, y, z);
  }
  void add(const Vector3d& turn_rad, const Vector3d& shift_m) {
    const Pose<Base, Ee> hand(rotation_from_vector(turn_rad), shift_m);
    const Pose<Base, Cam> noisy(hand.rotation() * rotation_from_vector(gaussian3(0.05 * kDegree)),
                                hand.translation() + gaussian3(0.0015));
    const Time time{static_cast<int64_t>(100'000 * problem_.pairs.size())};
    problem_.pairs.push_back({time, base_from_map_.inverse() * noisy, {time, {{time, hand}}}});
  }
  Similarity<Base, Map> base_from_map_{0.4, rotation_from_vector({0.3, -1, 0.5}), {0.2, 0.1, -0.3}};
  AlignmentProblem problem_;
  std::mt19937 generator_{7};
  std::normal_distribution<double> normal_;
};

TEST_F(AlignmentProblems, RotationAloneGivesNoScale) {
  for (int i = 0; i < 60; ++i) add(gaussian3(0.4), Vector3d::Zero());
  const AlignmentSolution s = solve_alignment(problem_);
  EXPECT_EQ(s.verdict, AlignmentVerdict::kBaseline);
  EXPECT_EQ(s.reason, "translate the camera >= 10 cm more");
}

TEST_F(AlignmentProblems, TooLittleTranslationSaysHowMuchIsMissing) {
  for (int i = 0; i < 40; ++i) add(gaussian3(0.2), Vector3d(0.06 * i / 39.0, 0, 0));
  AlignmentSolution s = solve_alignment(problem_);
  EXPECT_EQ(s.reason, "translate the camera >= 4 cm more");

  problem_.pairs.clear();
  for (int i = 0; i < 14; ++i) add(gaussian3(0.2), Vector3d(0.12 * i / 13.0, 0, 0));
  s = solve_alignment(problem_);
  EXPECT_EQ(s.verdict, AlignmentVerdict::kUncertain);
  EXPECT_TRUE(s.reason.starts_with("translate the camera >= ")) << s.reason;
}

TEST_F(AlignmentProblems, OneAxisDoesNotShowWhereTheCameraIs) {
  problem_.options.refine_camera = true;
  for (int i = 0; i < 60; ++i) {
    add(Vector3d(0, 0, 0.01 * (i - 30)), Vector3d(0.3 * std::sin(0.3 * i), 0.01 * i, 0));
  }
  const AlignmentSolution s = solve_alignment(problem_);
  EXPECT_EQ(s.verdict, AlignmentVerdict::kAxes);
  EXPECT_EQ(s.reason, "rotate about a second axis");
}

TEST_F(AlignmentProblems, FewPairsAndNoPointsAreSaid) {
  EXPECT_EQ(solve_alignment(problem_).verdict, AlignmentVerdict::kFewPairs);
  for (int i = 0; i < 30; ++i) add(gaussian3(0.2), gaussian3(0.2));
  problem_.points_in_map.clear();
  EXPECT_EQ(solve_alignment(problem_).verdict, AlignmentVerdict::kFewPoints);
}

TEST_F(AlignmentProblems, DerivativesAreRight) {
  add({0.1, -0.2, 0.05}, {0.1, 0.05, -0.1});
  ArmTrack& arm = problem_.pairs[0].arm;
  const Pose<Base, Ee> hand = arm.samples[0].base_from_ee;
  arm.samples.push_back({arm.centre + milliseconds(10),
                         {hand.rotation() * rotation_from_vector({0.01, 0.02, -0.01}),
                          hand.translation() + Vector3d(0.004, -0.003, 0.005)}});
  const auto pair = sample(problem_.pairs[0], problem_.camera, problem_.points_in_map, 24);
  ASSERT_TRUE(pair);
  AlignmentEstimate guess{
      base_from_map_, {rotation_from_vector({0.1, 0, 0.1}), {0.01, 0.02, 0.03}}, 0.004};
  const PivotedEstimate at(guess, {0.3, 0.2, 0.1});
  const PairResidual r = residual_of(*pair, problem_.camera, at, Derivatives::kAll);
  constexpr double kStep = 1e-6;
  for (int i = 0; i < kSteps; ++i) {
    Step step = Step::Zero();
    step[i] = kStep;
    const auto plus = residual_of(*pair, problem_.camera, at.moved(step), Derivatives::kNone);
    const auto minus = residual_of(*pair, problem_.camera, at.moved(-step), Derivatives::kNone);
    const Eigen::VectorXd numeric = (plus.residual - minus.residual) / (2 * kStep);
    EXPECT_LT((numeric - r.jacobian.col(i)).norm(), 1e-5 * (1 + numeric.norm())) << "step " << i;
  }
}

}  // namespace
}  // namespace foresight
