#include "sim/sequence.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "common/errors.h"

namespace foresight::sim {
namespace {

namespace fs = std::filesystem;

SequenceParams small() {
  SequenceParams params;
  params.duration_s = 0.5;
  params.rate_hz = 10;
  params.width_px = 160;
  params.depth_every = 2;
  params.with_mesh = true;
  params.distorted = true;
  return params;
}

class Sequence : public testing::Test {
 protected:
  // One sequence that several tests read.
  static void SetUpTestSuite() {
    written_ = fs::path(testing::TempDir()) / ("sequence_" + std::to_string(getpid()));
    frames_ = 0;
    write_sequence(written_, small(), [](int64_t done, int64_t) { frames_ = done; });
  }
  static void TearDownTestSuite() { fs::remove_all(written_); }

  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    root_ = fs::path(testing::TempDir()) /
            (std::string("sequence_") + info->name() + std::to_string(getpid()));
    fs::create_directories(root_);
  }
  void TearDown() override { fs::remove_all(root_); }

  // Exit code of sim-sequence; what it says goes to output.txt.
  int run(const std::string& arguments) {
    const std::string command = std::string(SIM_SEQUENCE_PROGRAM) + " " + arguments + " > '" +
                                (root_ / "output.txt").string() + "' 2>&1";
    const int status = std::system(command.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  std::vector<std::string> lines(const fs::path& file) {
    std::ifstream in(file);
    std::vector<std::string> all;
    for (std::string line; std::getline(in, line);) {
      if (!line.starts_with("#")) all.push_back(line);
    }
    return all;
  }

  static inline fs::path written_;
  static inline int64_t frames_ = 0;
  fs::path root_;
};

std::string contents(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

TEST_F(Sequence, WritesAFolderThatOthersCanRead) {
  EXPECT_EQ(frames_, 5);
  const auto pictures = lines(written_ / "rgb.txt"), poses = lines(written_ / "groundtruth.txt");
  ASSERT_EQ(pictures.size(), 5u);
  ASSERT_EQ(poses.size(), 5u);
  const Trajectory trajectory(Trajectory::Kind::kDesk, 1);
  for (size_t i = 0; i < 5; ++i) {
    std::istringstream picture(pictures[i]), pose(poses[i]);
    std::string time, name, pose_time;
    picture >> time >> name;
    EXPECT_EQ(cv::imread((written_ / name).string()).size(), cv::Size(160, 120));
    double x, y, z, qx, qy, qz, qw;
    pose >> pose_time >> x >> y >> z >> qx >> qy >> qz >> qw;
    EXPECT_EQ(time, pose_time);
    EXPECT_NEAR(std::stod(time), 1000 + 0.1 * static_cast<double>(i), 1e-6);
    const Pose<World, Cam> expected = trajectory.at(seconds(0.1 * static_cast<double>(i)));
    EXPECT_LT((Eigen::Vector3d(x, y, z) - expected.translation()).norm(), 1e-8);
    EXPECT_LT(Eigen::Quaterniond(qw, qx, qy, qz).angularDistance(expected.rotation()), 1e-6);
  }
  const CameraModel camera = load_camera_file(written_ / "camera.yaml");
  EXPECT_EQ(camera.distortion, sequence_camera(160, true).distortion);
  EXPECT_NEAR(camera.fx_px, 130, 1e-9);
  EXPECT_TRUE(contents(written_ / "mesh_true.ply").starts_with("ply"));
}

TEST_F(Sequence, DepthIsInMillimetres) {
  const auto depths = lines(written_ / "depth.txt");
  ASSERT_EQ(depths.size(), 3u);
  std::istringstream line(depths[0]);
  std::string time, name;
  line >> time >> name;
  const cv::Mat depth = cv::imread((written_ / name).string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(depth.type(), CV_16UC1);
  double least, greatest;
  cv::minMaxLoc(depth, &least, &greatest);
  EXPECT_GT(least, 300);
  EXPECT_LT(greatest, 4000);
}

TEST_F(Sequence, SameSeedSameBytes) {
  write_sequence(root_, small(), [](int64_t, int64_t) {});
  int files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(written_)) {
    if (!entry.is_regular_file()) continue;
    const fs::path name = fs::relative(entry.path(), written_);
    EXPECT_EQ(contents(entry.path()), contents(root_ / name)) << name;
    ++files;
  }
  EXPECT_EQ(files, 5 + 3 + 5);
}

TEST_F(Sequence, ProgramWritesWhatItIsAsked) {
  const std::string folder = (root_ / "out").string();
  ASSERT_EQ(run(folder + " --seconds 0.2 --fps 10 --width 64 --trajectory rotation --no-depth"), 0);
  EXPECT_EQ(lines(root_ / "out/rgb.txt").size(), 2u);
  EXPECT_FALSE(fs::exists(root_ / "out/depth"));
  EXPECT_NE(contents(root_ / "output.txt").find("2 of 2 frames"), std::string::npos);
}

TEST_F(Sequence, ProgramRefusesBadUseInOneLine) {
  const std::string folder = (root_ / "out").string();
  for (const char* bad : {"", "FOLDER --trajectory circle", "FOLDER --seconds -1",
                          "FOLDER --seconds many", "FOLDER --width 3", "FOLDER --unknown",
                          "FOLDER --fps nan", "FOLDER --seed -1", "FOLDER more"}) {
    std::string arguments = bad;
    if (arguments.starts_with("FOLDER")) arguments.replace(0, 6, folder);
    EXPECT_EQ(run(arguments), kExitUsage) << bad;
    EXPECT_EQ(lines(root_ / "output.txt").size(), 1u) << bad;
    EXPECT_FALSE(fs::exists(root_ / "out"));
  }
  EXPECT_EQ(run("--help"), 0);
}

TEST_F(Sequence, ProgramShowsAScene) {
  const std::string scene = (root_ / "box.obj").string();
  std::ofstream(scene) << "v 1 -1 -1\nv 1 1 -1\nv 1 1 1\nv 1 -1 1\nf 1 2 3 4\nmtllib no.mtl\n";
  const std::string folder = (root_ / "out").string();
  const std::string options = " --seconds 0.2 --fps 10 --width 64 --scene ";
  ASSERT_EQ(run(folder + options + scene), 0);
  EXPECT_EQ(lines(root_ / "out/rgb.txt").size(), 2u);
  EXPECT_EQ(run((root_ / "other").string() + options + (root_ / "nowhere.obj").string()),
            kExitUnavailable);
  ASSERT_EQ(lines(root_ / "output.txt").size(), 1u);
  EXPECT_NE(lines(root_ / "output.txt")[0].find("nowhere.obj"), std::string::npos);
  EXPECT_FALSE(fs::exists(root_ / "other"));
}

TEST_F(Sequence, ProgramSaysWhenItCannotWrite) {
  std::ofstream(root_ / "file") << "in the way";
  EXPECT_EQ(run((root_ / "file/out").string()), kExitUnavailable);
  const auto said = lines(root_ / "output.txt");
  ASSERT_EQ(said.size(), 1u);
  EXPECT_NE(said[0].find("file/out"), std::string::npos);
}

}  // namespace
}  // namespace foresight::sim
