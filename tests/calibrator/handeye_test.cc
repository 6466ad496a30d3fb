// Real robots: recorded hand-eye data. Skips where the test data is not installed.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "bench/handeye_eval/handeye_evaluation.h"

namespace foresight {
namespace {

std::string folder(const std::string& name) {
  const char* from_environment = std::getenv("FORESIGHT_DATA");
  return std::string(from_environment ? from_environment : FORESIGHT_DATA_DEFAULT) + "/handeye/" +
         name;
}

TEST(HandEye, AnArmsLogGivesScaleAndDelay) {
  const std::string path = folder("robotarm_asl_log");
  if (!std::filesystem::exists(path)) {
    GTEST_SKIP() << path << " is missing: set FORESIGHT_DATA to the folder that has handeye/";
  }
  const HandEyeEvaluation e = evaluate_handeye(load_handeye(path, 8));
  const HandEyeScore& ours = e.scores.front();
  // A few poses of this noisy camera need not be enough; but nothing may look like a moving base.
  EXPECT_TRUE(e.solution.verdict == calibration::AlignmentVerdict::kAccepted ||
              e.solution.verdict == calibration::AlignmentVerdict::kUncertain)
      << e.solution.reason;
  EXPECT_TRUE(e.solution.delay_is_estimated);
  EXPECT_NEAR(ours.answer.joint_delay_s, -0.015, 0.006);
  EXPECT_NEAR(ours.answer.base_from_target.scale(), 1, 0.01);
  EXPECT_LT(ours.median_mm, 3.4);
  for (size_t i = 1; i < e.scores.size(); ++i) {
    EXPECT_LT(ours.median_mm, e.scores[i].median_mm) << e.scores[i].answer.method;
  }
}

TEST(HandEye, ViewsOfATargetShowWhereTheCameraIs) {
  const std::string path = folder("ur_1540");
  if (!std::filesystem::exists(path)) {
    GTEST_SKIP() << path << " is missing: set FORESIGHT_DATA to the folder that has handeye/";
  }
  const HandEyeEvaluation e = evaluate_handeye(load_handeye(path, 1));
  const HandEyeScore& ours = e.scores.front();
  EXPECT_LT(ours.median_px, 0.45);
  EXPECT_LT(ours.worst_view_px, 1.2);
  EXPECT_NEAR(ours.answer.base_from_target.scale(), 1, 0.01);
  EXPECT_LT(ours.camera_shift_mm, 5);
  EXPECT_EQ(e.solution.reason, "rotate about a second axis") << "its turns are small";
  for (size_t i = 1; i < e.scores.size(); ++i) {
    EXPECT_LT(ours.median_px, e.scores[i].median_px) << e.scores[i].answer.method;
  }
}

}  // namespace
}  // namespace foresight
