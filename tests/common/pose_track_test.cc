#include "common/pose_track.h"

#include <gtest/gtest.h>

#include <numbers>

#include "common/errors.h"
#include "tests/common/files.h"

namespace foresight {
namespace {

const std::string kTwo = "1.5 1 2 3 0 0 0 1\n2.5 3 2 1 0 0 0.70710678 0.70710678\n";

class PoseTrack : public testing::Test {
 protected:
  std::vector<TimedPose> load(const std::string& text) {
    return load_pose_track(folder_.write("poses.txt", text));
  }
  // What is said after the file's name.
  std::string refusal(const std::string& text) {
    const std::string said = error_of<ConfigError>([&] { load(text); });
    const std::string name = folder_.path() + "/poses.txt: ";
    EXPECT_TRUE(said.starts_with(name)) << said;
    EXPECT_EQ(said.find('\n'), std::string::npos);
    return said.substr(std::min(name.size(), said.size()));
  }
  TemporaryFolder folder_;
};

TEST_F(PoseTrack, ReadsWhatFilesHave) {
  const auto track = load("# timestamp tx ty tz qx qy qz qw\n\n  # more\r\n" + kTwo +
                          "\t1305031229.0331\t1e-1 -0.2 .3 1 0 0 0 \r\n");
  ASSERT_EQ(track.size(), 3u);
  EXPECT_EQ(track[0].time, Time{1'500'000});
  EXPECT_EQ(track[0].world_from_cam.translation(), Eigen::Vector3d(1, 2, 3));
  EXPECT_LT(
      (track[1].world_from_cam.rotation() * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY())
          .norm(),
      1e-7);
  EXPECT_EQ(track[2].time, Time{1'305'031'229'033'100});
  EXPECT_EQ(track[2].world_from_cam.translation(), Eigen::Vector3d(0.1, -0.2, 0.3));
}

TEST_F(PoseTrack, ReadsCommasMarksAndNanoseconds) {
  const auto track = load(
      "\xEF\xBB\xBF#t,x,y,z,qx,qy,qz,qw\r\n1403636579763555584,1,2,3,0,0,0,1\r\n"
      "1403636579863555584, 3, 2, 1, 0, 0, 0, 1\r\n   \r\n");
  ASSERT_EQ(track.size(), 2u);
  EXPECT_EQ(track[0].time, Time{1'403'636'579'763'555});
  EXPECT_EQ(track[1].time - track[0].time, milliseconds(100));
  EXPECT_EQ(track[1].world_from_cam.translation(), Eigen::Vector3d(3, 2, 1));
}

TEST_F(PoseTrack, NamesTheLineThatIsNoPose) {
  for (const char* bad :
       {"3 1 2 3 0 0 0", "3 1 2 3 0 0 0 1 9", "3 1 2 3 0 0 x 1", "3 1 2 3 0 0 0 1x", "3 1 2 3",
        "3 1 2 nan 0 0 0 1", "3 1 inf 3 0 0 0 1", "3 1 2 3 0 0 0 0", "3 1 2 3 0 0 1 1",
        "1e300 1 2 3 0 0 0 1", "3,1,2,3,,0,0,1", "nan 1 2 3 0 0 0 1", "poses"}) {
    EXPECT_TRUE(refusal("# poses\n" + kTwo + bad + "\n").starts_with("line 4: not a pose")) << bad;
  }
}

TEST_F(PoseTrack, RefusesTimesThatDecreaseAndFewerThanTwoPoses) {
  const std::string back = refusal(kTwo + "2.4 3 2 1 0 0 0 1\n");
  EXPECT_TRUE(back.starts_with("line 3: its time is before")) << back;
  EXPECT_EQ(load(kTwo + "2.5 3 2 1 0 0 0 1\n").size(), 2u);  // twice the same time: the first
  EXPECT_TRUE(refusal(kTwo + "2.4 3 2 1 0 0 0 1\n").starts_with("line 3: "));
  EXPECT_NE(refusal("# nothing\n").find("has 0 poses"), std::string::npos);
  EXPECT_NE(refusal("1 0 0 0 0 0 0 1\n").find("has 1 pose but"), std::string::npos);
  const std::string missing =
      error_of<UnavailableError>([&] { load_pose_track(folder_.path() + "/nowhere.txt"); });
  EXPECT_NE(missing.find("nowhere.txt: cannot be read"), std::string::npos);
  error_of<UnavailableError>([&] { load_pose_track(folder_.path()); });
}

TEST_F(PoseTrack, IsInterpolatedWithinAndNotOutside) {
  const auto track = load(kTwo);
  const auto at = [&](double time_s) { return pose_at(track, Time{} + seconds(time_s)); };
  ASSERT_TRUE(at(1.5) && at(1.75) && at(2.5));
  EXPECT_EQ(at(1.5)->matrix(), track[0].world_from_cam.matrix());
  EXPECT_EQ(at(2.5)->matrix(), track[1].world_from_cam.matrix());
  EXPECT_LT((at(1.75)->translation() - Eigen::Vector3d(1.5, 2, 2.5)).norm(), 1e-12);
  EXPECT_NEAR(at(1.75)->rotation().angularDistance(track[0].world_from_cam.rotation()),
              std::numbers::pi / 8, 1e-7);
  EXPECT_FALSE(at(1.499999) || at(2.500001));
}

TEST_F(PoseTrack, IsNotInterpolatedAcrossAGap) {
  const auto track = load(kTwo + "2.6 0 0 0 0 0 0 1\n");
  const auto at = [&](double time_s) {
    return pose_at(track, Time{} + seconds(time_s), milliseconds(100));
  };
  EXPECT_TRUE(at(1.5) && at(2.5) && at(2.55) && at(2.6));
  EXPECT_FALSE(at(1.6) || at(2.4));
}

TEST_F(PoseTrack, TurnsTheShortWay) {
  // The second quaternion is the first one's negative, turned by a little.
  const auto track = load("1 0 0 0 0 0 0 1\n2 0 0 0 0 0 -0.0998334 -0.9950042\n");
  const auto half = pose_at(track, Time{} + seconds(1.5));
  EXPECT_NEAR(half->rotation().angularDistance(Eigen::Quaterniond::Identity()), 0.1, 1e-6);
}

}  // namespace
}  // namespace foresight
