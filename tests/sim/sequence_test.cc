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
  // A single wall, which takes less time than the lab.
  std::string write_scene() {
    std::ofstream(root_ / "box.obj")
        << "v 1 -1 -1\nv 1 1 -1\nv 1 1 1\nv 1 -1 1\nf 1 2 3 4\nmtllib no.mtl\n";
    return (root_ / "box.obj").string();
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

void expect_near(const Pose<World, Cam>& a, const Pose<World, Cam>& b) {
  EXPECT_LT((a.translation() - b.translation()).norm(), 1e-6);
  EXPECT_LT(a.rotation().angularDistance(b.rotation()), 1e-6);
}

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

TEST_F(Sequence, FollowsAnotherRun) {
  const auto followed = load_pose_track(written_ / "groundtruth.txt");
  const std::string out = (root_ / "out").string(), file = (written_ / "groundtruth.txt").string();
  const std::string options =
      out + " --width 64 --no-depth --scene " + write_scene() + " --follow " + file;
  // The file's length, its last pose included, at another rate: between its poses.
  ASSERT_EQ(run(options + " --fps 20"), 0);
  auto track = load_pose_track(root_ / "out/groundtruth.txt");
  ASSERT_EQ(track.size(), 9u);
  for (size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(track[2 * i].time, followed[i].time);
    expect_near(track[2 * i].world_from_cam, followed[i].world_from_cam);
  }
  EXPECT_LT(
      (track[1].world_from_cam.translation() -
       (followed[0].world_from_cam.translation() + followed[1].world_from_cam.translation()) / 2)
          .norm(),
      1e-6);
  ASSERT_EQ(run(options + " --fps 10 --seconds 0.3"), 0);
  EXPECT_EQ(load_pose_track(root_ / "out/groundtruth.txt").size(), 3u);
  ASSERT_EQ(run(options + " --fps 10 --seconds 60"), 0);
  EXPECT_EQ(load_pose_track(root_ / "out/groundtruth.txt").size(), 5u);
}

TEST_F(Sequence, FollowsAForeignTrackFromTheDesksStart) {
  const Pose<World, Cam> start = Trajectory(Trajectory::Kind::kDesk, 1).at({});
  std::ofstream(root_ / "poses.txt") << "7 50 60 70 0.5 0.5 0.5 0.5\n7.1 50 60.2 70 0 0 1 0\n";
  ASSERT_EQ(run((root_ / "out").string() + " --fps 10 --width 64 --no-depth --scene " +
                write_scene() + " --follow-from start --follow " + (root_ / "poses.txt").string()),
            0);
  const auto file = load_pose_track(root_ / "poses.txt"),
             track = load_pose_track(root_ / "out/groundtruth.txt");
  ASSERT_EQ(track.size(), 2u);
  expect_near(track[0].world_from_cam, start);
  const Pose<Cam, Cam> step = file[0].world_from_cam.inverse() * file[1].world_from_cam;
  expect_near(track[1].world_from_cam, start * step);
}

TEST_F(Sequence, ScattersPosesAndTellsTheScatteredOnes) {
  SequenceParams params = small();
  params.noise_levels = 0;
  params.scatter = {.distance_m = 0.2, .turn_rad = 0.3};
  write_sequence(root_ / "scattered", params, [](int64_t, int64_t) {});
  const auto plain = load_pose_track(written_ / "groundtruth.txt"),
             moved = load_pose_track(root_ / "scattered/groundtruth.txt");
  ASSERT_EQ(moved.size(), plain.size());
  for (size_t i = 0; i < moved.size(); ++i) {
    const Pose<Cam, Cam> shift = plain[i].world_from_cam.inverse() * moved[i].world_from_cam;
    EXPECT_LE(shift.translation().norm(), 0.2 + 1e-6);
    EXPECT_LE(shift.rotation().angularDistance(Eigen::Quaterniond::Identity()), 0.3 + 1e-6);
    EXPECT_GT(shift.translation().norm(), 1e-3);
  }
  // The pictures are those of a run that goes through the poses told.
  params.followed = moved;
  params.scatter = {};
  write_sequence(root_ / "followed", params, [](int64_t, int64_t) {});
  for (const std::string& line : lines(root_ / "scattered/rgb.txt")) {
    const std::string name = line.substr(line.find(' ') + 1);
    const cv::Mat a = cv::imread((root_ / "scattered" / name).string()),
                  b = cv::imread((root_ / "followed" / name).string());
    ASSERT_EQ(a.size(), b.size());
    EXPECT_LT(cv::norm(a, b, cv::NORM_L1) / static_cast<double>(a.total() * 3), 0.5) << name;
  }
}

TEST_F(Sequence, ProgramRefusesABadTrackInOneLine) {
  const std::string out = (root_ / "out").string(), file = (root_ / "poses.txt").string();
  std::ofstream(file) << "1 0 0 0 0 0 0 1\n# later\n0.5 0 0 0 0 0 0 1\n";
  EXPECT_EQ(run(out + " --follow " + file), kExitConfig);
  ASSERT_EQ(lines(root_ / "output.txt").size(), 1u);
  EXPECT_NE(lines(root_ / "output.txt")[0].find("poses.txt: line 3: "), std::string::npos);
  EXPECT_EQ(run(out + " --follow " + file + "x"), kExitUnavailable);
  EXPECT_EQ(lines(root_ / "output.txt").size(), 1u);
  EXPECT_FALSE(fs::exists(root_ / "out"));
}

TEST_F(Sequence, ProgramRefusesBadUseInOneLine) {
  const std::string folder = (root_ / "out").string();
  for (const char* bad :
       {"", "FOLDER --trajectory circle", "FOLDER --seconds -1", "FOLDER --seconds many",
        "FOLDER --width 3", "FOLDER --unknown", "FOLDER --fps nan", "FOLDER --seed -1",
        "FOLDER more", "FOLDER --follow a --trajectory desk", "FOLDER --follow-from start",
        "FOLDER --follow a --follow-from b", "FOLDER --scatter-m -1", "FOLDER --scatter-deg 181"}) {
    std::string arguments = bad;
    if (arguments.starts_with("FOLDER")) arguments.replace(0, 6, folder);
    EXPECT_EQ(run(arguments), kExitUsage) << bad;
    EXPECT_EQ(lines(root_ / "output.txt").size(), 1u) << bad;
    EXPECT_FALSE(fs::exists(root_ / "out"));
  }
  EXPECT_EQ(run("--help"), 0);
}

TEST_F(Sequence, ProgramShowsAScene) {
  const std::string scene = write_scene();
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
