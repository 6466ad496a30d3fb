// A piece of real video (redkitchen, 200 images). Skips where the test data is not installed.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>

#include "bench/slam_eval/evaluation.h"

namespace foresight {
namespace {

TEST(SlamSequence, TracksARealKitchen) {
  const char* from_environment = std::getenv("FORESIGHT_DATA");
  const std::string folder =
      std::string(from_environment ? from_environment : FORESIGHT_DATA_DEFAULT) + "/redkitchen";
  if (!std::filesystem::exists(folder + "/rgb.txt")) {
    GTEST_SKIP() << folder << " is missing: set FORESIGHT_DATA to the folder with the sequences";
  }
  EvaluationRange range;
  range.play.frames = 200;
  const Evaluation e = evaluate(load_sequence(folder), SlamOptions{}, range);
  EXPECT_GE(e.tracked_fraction, 0.75);  // the first second has no parallax
  EXPECT_LT(e.ate_rmse_m, 0.02);
  EXPECT_EQ(e.wrong_by_10_cm, 0);
  EXPECT_EQ(e.statistics.losses, 0);
  EXPECT_GE(e.statistics.published_points, 500);
}

}  // namespace
}  // namespace foresight
