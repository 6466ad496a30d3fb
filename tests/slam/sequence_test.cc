// Pieces of real video (redkitchen). Skips where the test data is not installed.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>

#include "bench/slam_eval/evaluation.h"
#include "bench/slam_eval/relocalisation.h"

namespace foresight {
namespace {

class SlamSequence : public testing::Test {
 protected:
  void SetUp() override {
    const char* from_environment = std::getenv("FORESIGHT_DATA");
    const std::string folder =
        std::string(from_environment ? from_environment : FORESIGHT_DATA_DEFAULT) + "/redkitchen";
    if (!std::filesystem::exists(folder + "/rgb.txt")) {
      GTEST_SKIP() << folder << " is missing: set FORESIGHT_DATA to the folder with the sequences";
    }
    kitchen_ = load_sequence(folder);
  }
  Sequence kitchen_;
};

TEST_F(SlamSequence, TracksARealKitchen) {
  EvaluationRange range;
  range.play.frames = 200;
  const Evaluation e = evaluate(kitchen_, SlamOptions{}, range);
  EXPECT_GE(e.tracked_fraction, 0.75);  // the first second has no parallax
  EXPECT_LT(e.ate_rmse_m, 0.02);
  EXPECT_EQ(e.wrong_by_10_cm, 0);
  EXPECT_EQ(e.statistics.losses, 0);
  EXPECT_GE(e.statistics.published_points, 500);
}

// Images that came later, most of them from views that the map has not got.
TEST_F(SlamSequence, ALostCameraFindsItselfFromOtherViews) {
  EvaluationRange range;
  range.play.frames = 320;
  const Evaluation e = evaluate(kitchen_, SlamOptions{}, range);
  RelocalisationRange queries;
  queries.start = 330;
  queries.every = 10;
  int near = 0, right = 0;
  for (const RelocalisationTrial& t :
       try_to_relocalise(e.map, kitchen_, kitchen_, SlamOptions{}, queries)) {
    EXPECT_FALSE(t.wrong()) << t.path << ": off by " << t.error_m << " m";
    if (t.distance_m > 0.3 || t.angle_deg > 20) continue;
    ++near;
    right += t.right() ? 1 : 0;
  }
  EXPECT_GE(near, 8);
  EXPECT_GE(right, 0.75 * near);
}

TEST_F(SlamSequence, DoesNotGrowAtOnePlace) {
  EvaluationRange range;
  range.play.start = 60;
  range.play.frames = 90;
  range.degradation = degradation_named("passes");
  const Evaluation e = evaluate(kitchen_, SlamOptions{}, range);
  EXPECT_GE(e.tracked_fraction, 0.9);
  EXPECT_GT(e.keyframes_at_half, 3);
  EXPECT_LE(e.statistics.keyframes, e.keyframes_at_half + 1);
  EXPECT_LE(e.statistics.points, 1.03 * e.points_at_half);
}

}  // namespace
}  // namespace foresight
