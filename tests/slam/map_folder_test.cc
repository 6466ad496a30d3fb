// A map on the disk: comes back as it was, is read by others, and is not believed when damaged.
#include "procs/slam/map_folder.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "common/errors.h"
#include "common/pose_track.h"
#include "procs/slam/slam.h"
#include "tests/common/files.h"
#include "tests/slam/synthetic_scene.h"

namespace foresight {
namespace {

// COLMAP's camera models as its documentation defines them, with the centre of the first pixel at
// (0.5, 0.5): nothing of ours in it.
Eigen::Vector2d colmap_pixel(const std::string& model, const std::vector<double>& p,
                             const Eigen::Vector3d& in_cam) {
  const double x = in_cam.x() / in_cam.z(), y = in_cam.y() / in_cam.z(), r2 = x * x + y * y;
  if (model == "OPENCV_FISHEYE") {
    const double r = std::sqrt(r2), a = std::atan(r), a2 = a * a;
    const double bent = a * (1 + a2 * (p[4] + a2 * (p[5] + a2 * (p[6] + a2 * p[7])))) / r;
    return {p[0] * x * bent + p[2], p[1] * y * bent + p[3]};
  }
  EXPECT_EQ(model, "FULL_OPENCV");
  const double radial =
      (1 + r2 * (p[4] + r2 * (p[5] + r2 * p[8]))) / (1 + r2 * (p[9] + r2 * (p[10] + r2 * p[11])));
  const double bent_x = x * radial + 2 * p[6] * x * y + p[7] * (r2 + 2 * x * x);
  const double bent_y = y * radial + p[6] * (r2 + 2 * y * y) + 2 * p[7] * x * y;
  return {p[0] * bent_x + p[2], p[1] * bent_y + p[3]};
}

// Two views of a few points up to the image's corners. `shown` is where COLMAP has to see them.
struct LensMap {
  StoredMap map;
  std::vector<Eigen::Vector2d> shown;  // in the second view, by point

  LensMap(const CameraModel& camera, const std::string& model, const std::vector<double>& given) {
    map.camera = camera;
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.1, Eigen::Vector3d(1, 2, 3).normalized()));
    const cv::Mat image(camera.height_px, camera.width_px, CV_8UC1, cv::Scalar::all(90));
    for (const int id : {0, 1}) {
      map.keyframes.push_back(
          {KeyframeId(id), Time{1000 + id}, {turn, {0.1 * id, 0.05, 0}}, 1, image});
    }
    for (int id = 0; id < 35; ++id) {
      const Eigen::Vector3d in_first(0.24 * (id % 7) - 0.7, 0.25 * (id / 7) - 0.48, 1 + 0.02 * id);
      StoredMap::Point point;
      point.id = PointId(id);
      point.position_in_map = map.keyframes[0].map_from_cam * in_first;
      point.confirmed = true;
      for (const StoredMap::Keyframe& k : map.keyframes) {
        shown.resize(static_cast<size_t>(id) + 1);
        shown.back() = colmap_pixel(model, given, k.map_from_cam.inverse() * point.position_in_map);
        point.observations.push_back({k.id, 0, shown.back() - Eigen::Vector2d(0.5, 0.5)});
      }
      map.points.push_back(point);
    }
  }
};

class MapFolderTest : public testing::Test {
 protected:
  static TrackingResult step(Slam* slam, const cv::Mat& image, Time time) {
    const TrackingResult result = slam->track(time, view_of(image));
    while (auto job = slam->take_job()) slam->apply(Slam::run(std::move(*job)));
    return result;
  }
  cv::Mat image_at(double t) const { return scene_.render(camera_, sideways_pose(t)); }
  StoredMap make_map() {
    Slam slam(camera_, SlamOptions{});
    for (int i = 1; i <= 45; ++i) {
      EXPECT_FALSE(step(&slam, image_at(i / 60.0), time_ = time_ + milliseconds(33)).epoch);
    }
    return slam.stored_map();
  }
  std::string folder(const std::string& name) const { return temp_.path() + "/" + name; }
  std::vector<std::string> lines(const std::string& file) const {
    std::ifstream in(file);
    std::vector<std::string> result;
    for (std::string line; std::getline(in, line);) {
      if (line.empty() || line[0] != '#') result.push_back(line);
    }
    return result;
  }
  // Replaces the first occurrence in foresight.txt of a saved map; the error must name a line.
  void expect_refused(const std::string& from, const std::string& to) {
    const std::string damaged = folder("damaged");
    std::filesystem::remove_all(damaged);
    std::filesystem::copy(folder("map"), damaged, std::filesystem::copy_options::recursive);
    std::stringstream text;
    text << std::ifstream(damaged + "/foresight.txt").rdbuf();
    std::string changed = text.str();
    const size_t place = changed.find(from);
    ASSERT_NE(place, std::string::npos) << from;
    changed.replace(place, from.size(), to);
    std::ofstream(damaged + "/foresight.txt") << changed;
    try {
      (void)read_map_folder(damaged);
      ADD_FAILURE() << "accepted with " << to;
    } catch (const ConfigError& error) {
      EXPECT_NE(std::string(error.what()).find("foresight.txt:"), std::string::npos);
    }
  }

  TemporaryFolder temp_;
  CameraModel camera_ = test_camera();
  SyntheticScene scene_{5};
  Time time_;
};

TEST_F(MapFolderTest, ComesBackAsItWas) {
  const StoredMap saved = make_map();
  ASSERT_GE(saved.keyframes.size(), 4u);
  ASSERT_GE(saved.points.size(), 150u);
  write_map_folder(saved, folder("map"));
  write_map_folder(saved, folder("map") + "/");  // replaces
  const StoredMap read = read_map_folder(folder("map"));
  EXPECT_EQ(read.camera, saved.camera);
  ASSERT_EQ(read.keyframes.size(), saved.keyframes.size());
  for (size_t i = 0; i < read.keyframes.size(); ++i) {
    const StoredMap::Keyframe &a = read.keyframes[i], &b = saved.keyframes[i];
    EXPECT_EQ(a.id, b.id);
    EXPECT_EQ(a.time, b.time);
    EXPECT_EQ(a.map_from_cam.translation(), b.map_from_cam.translation());
    EXPECT_LT(a.map_from_cam.rotation().angularDistance(b.map_from_cam.rotation()), 1e-14);
    EXPECT_EQ(cv::norm(a.image, b.image, cv::NORM_INF), 0);
  }
  ASSERT_EQ(read.points.size(), saved.points.size());
  for (size_t i = 0; i < read.points.size(); ++i) {
    const StoredMap::Point &a = read.points[i], &b = saved.points[i];
    EXPECT_EQ(a.id, b.id);
    EXPECT_EQ(a.position_in_map, b.position_in_map);
    EXPECT_EQ(a.source_keyframe_id, b.source_keyframe_id);
    EXPECT_EQ(a.confirmed, b.confirmed);
    ASSERT_EQ(a.observations.size(), b.observations.size());
    for (size_t n = 0; n < a.observations.size(); ++n) {
      EXPECT_EQ(a.observations[n].pixel, b.observations[n].pixel);
    }
  }
}

TEST_F(MapFolderTest, ALoadedMapIsTrackedAndGrows) {
  write_map_folder(make_map(), folder("map"));
  Slam slam(camera_, SlamOptions{});
  slam.restore(read_map_folder(folder("map")));
  EXPECT_EQ(slam.epoch(), 1);
  const SyntheticScene foreign(99);
  for (int i = 1; i <= 125; ++i) {  // for longer than a tiny map is kept: it is not given up
    const TrackingResult lost =
        step(&slam, foreign.render(camera_, {}), time_ = time_ + milliseconds(33));
    ASSERT_EQ(lost.state, TrackingState::kLost);
    ASSERT_EQ(lost.epoch, 1);
  }
  const TrackingResult found = step(&slam, image_at(0.4), time_ = time_ + milliseconds(33));
  ASSERT_EQ(found.state, TrackingState::kTracking) << found.reason;
  EXPECT_TRUE(found.relocalised);
  const int keyframes = slam.statistics().keyframes;
  const size_t published = slam.take_delta().points_set.size();
  EXPECT_GT(published, 100u);
  TrackingResult last;
  for (int i = 1; i <= 40; ++i) {
    last = step(&slam, image_at(0.4 + i / 60.0), time_ = time_ + milliseconds(33));
  }
  EXPECT_EQ(last.state, TrackingState::kTracking) << last.reason;
  EXPECT_GT(slam.statistics().keyframes, keyframes);
}

TEST_F(MapFolderTest, TheTrajectoryIsThatOfTheKeyframes) {
  const StoredMap saved = make_map();
  write_map_folder(saved, folder("map"));
  const std::vector<TimedPose> read = load_pose_track(folder("map") + "/trajectory.txt");
  ASSERT_EQ(read.size(), saved.keyframes.size());
  for (size_t i = 0; i < read.size(); ++i) {
    EXPECT_EQ(read[i].time, saved.keyframes[i].time);
    EXPECT_TRUE(
        read[i].world_from_cam.matrix().isApprox(saved.keyframes[i].map_from_cam.matrix(), 1e-12));
  }
}

// The COLMAP files on their own: what points3D.txt and images.txt say fits the pixels.
TEST_F(MapFolderTest, ColmapFilesFitTogether) {
  const StoredMap saved = make_map();
  write_map_folder(saved, folder("map"));
  struct View {
    Pose<Cam, Map> cam_from_map;
    std::vector<std::pair<Eigen::Vector2d, int>> places;
  };
  std::map<int, View> views;
  const std::vector<std::string> images = lines(folder("map") + "/images.txt");
  ASSERT_EQ(images.size(), 2 * saved.keyframes.size());
  for (size_t i = 0; i < images.size(); i += 2) {
    std::istringstream header(images[i]), body(images[i + 1]);
    int id, camera;
    std::string name;
    Eigen::Quaterniond q;
    Eigen::Vector3d t;
    header >> id >> q.w() >> q.x() >> q.y() >> q.z() >> t.x() >> t.y() >> t.z() >> camera >> name;
    ASSERT_TRUE(header);
    EXPECT_TRUE(std::filesystem::exists(folder("map") + "/images/" + name));
    View view{{q, t}, {}};
    Eigen::Vector2d pixel;
    for (int point; body >> pixel.x() >> pixel.y() >> point;) view.places.push_back({pixel, point});
    views[id] = view;
  }
  std::istringstream camera_words(lines(folder("map") + "/cameras.txt").at(0));
  std::string id, model;
  double width, height, fx, fy, cx, cy;
  camera_words >> id >> model >> width >> height >> fx >> fy >> cx >> cy;
  EXPECT_EQ(model, "FULL_OPENCV");
  int compared = 0, close = 0;
  for (const std::string& line : lines(folder("map") + "/points3D.txt")) {
    std::istringstream words(line);
    int point, r, g, b;
    Eigen::Vector3d x;
    double error;
    words >> point >> x.x() >> x.y() >> x.z() >> r >> g >> b >> error;
    size_t index;
    for (int image; words >> image >> index;) {
      const View& view = views.at(image);
      ASSERT_LT(index, view.places.size());
      ASSERT_EQ(view.places[index].second, point);
      const Eigen::Vector3d p = view.cam_from_map * x;
      const Eigen::Vector2d seen(fx * p.x() / p.z() + cx, fy * p.y() / p.z() + cy);
      ++compared;
      close += (seen - view.places[index].first).norm() < 2;
    }
  }
  EXPECT_GT(compared, 500);
  EXPECT_GT(close, 0.9 * compared);
}

TEST_F(MapFolderTest, IsNotBelievedWhenDamaged) {
  EXPECT_THROW((void)read_map_folder(folder("nothing here")), ConfigError);
  const StoredMap saved = make_map();
  write_map_folder(saved, folder("map"));
  expect_refused("foresight_map 1", "foresight_map 2");
  expect_refused("\nkeyframe 1 ", "\nkeyframe 0 ");
  expect_refused("\nkeyframe 0 ", "\nkeyframe -1 ");
  expect_refused("\nkeyframe 1 ", "\nkeyframe 2147483647 ");
  expect_refused("\nkeyframe 1 ", "\nkeyframe nan ");
  expect_refused("\ncamera ", "\nkeyframe 0 0 1 1 0 0 0 0 0 0\ncamera ");
  expect_refused("\nkeyframe 0 ", "\ncamera 0 320 240 1 1 1 1 0 0 0 0 0\nkeyframe 0 ");
  const std::string first_point =
      "\npoint " + std::to_string(saved.points.front().id.value()) + " ";
  expect_refused(first_point, "\npoint -1 ");
  expect_refused("\npoint ", "\npoint -5 nan ");
  expect_refused("\npoint ", "\nthing ");
  expect_refused("\ncamera 0 640", "\ncamera 0 -640");
  expect_refused("\ncamera 0 640", "\ncamera 0 320");  // the images are larger
  std::filesystem::remove(folder("map") + "/images/000001.png");
  EXPECT_THROW((void)read_map_folder(folder("map")), ConfigError);
}

// The second view's pixels, as the files give them and as the files' camera sees the files' points.
void expect_colmap_sees(const LensMap& truth, const std::string& model,
                        const std::vector<double>& intrinsics, const std::string& header_line,
                        const std::string& pixel_line) {
  std::istringstream header(header_line), body(pixel_line);
  int id, point, count = 0;
  Eigen::Quaterniond q;
  Eigen::Vector3d t;
  header >> id >> q.w() >> q.x() >> q.y() >> q.z() >> t.x() >> t.y() >> t.z();
  Eigen::Vector2d pixel;
  for (; body >> pixel.x() >> pixel.y() >> point; ++count) {
    const auto i = static_cast<size_t>(point - 1);
    const Eigen::Vector3d in_cam = q * truth.map.points.at(i).position_in_map + t;
    EXPECT_LT((pixel - truth.shown[i]).norm(), 1e-6);
    EXPECT_LT((pixel - colmap_pixel(model, intrinsics, in_cam)).norm(), 1e-6);
    const Eigen::Vector2d ours = truth.map.camera.project(in_cam);
    EXPECT_LT((ours + Eigen::Vector2d(0.5, 0.5) - pixel).norm(), 1e-3);
  }
  EXPECT_EQ(count, 35);
}

// The order of a lens's numbers, and the half pixel between COLMAP's coordinates and ours.
TEST_F(MapFolderTest, ColmapSeesThroughOurLenses) {
  struct Lens {
    LensModel lens;
    std::string model;
    std::array<double, 5> distortion;
    std::vector<double> colmap;  // as it has to be written
  };
  const std::vector<Lens> lenses = {
      {LensModel::kRadtan,
       "FULL_OPENCV",
       {-0.28, 0.09, 0.003, -0.002, -0.02},
       {500, 490, 330, 250.5, -0.28, 0.09, 0.003, -0.002, -0.02, 0, 0, 0}},
      {LensModel::kEquidistant,
       "OPENCV_FISHEYE",
       {-0.03, 0.02, -0.008, 0.004, 0},
       {500, 490, 330, 250.5, -0.03, 0.02, -0.008, 0.004}}};
  for (const Lens& lens : lenses) {
    CameraModel camera = camera_;
    camera.lens = lens.lens;
    camera.distortion = lens.distortion;
    camera.fy_px = 490;
    camera.cx_px = 329.5;
    camera.cy_px = 250;
    camera.prepare();
    const LensMap truth(camera, lens.model, lens.colmap);
    write_map_folder(truth.map, folder("lens"));
    std::istringstream words(lines(folder("lens") + "/cameras.txt").at(0));
    std::string id, model, width, height;
    words >> id >> model >> width >> height;
    EXPECT_EQ(model, lens.model);
    std::vector<double> written;
    for (double value; words >> value;) written.push_back(value);
    EXPECT_EQ(written, lens.colmap);
    const std::vector<std::string> images = lines(folder("lens") + "/images.txt");
    expect_colmap_sees(truth, model, written, images.at(2), images.at(3));
  }
}

TEST_F(MapFolderTest, ReplacesNothingButMaps) {
  const StoredMap saved = make_map();
  std::filesystem::create_directories(folder("precious"));
  std::ofstream(folder("precious") + "/letter.txt") << "dear";
  EXPECT_THROW(write_map_folder(saved, folder("precious")), UnavailableError);
  EXPECT_TRUE(std::filesystem::exists(folder("precious") + "/letter.txt"));
  std::filesystem::create_directories(folder("empty"));
  EXPECT_NO_THROW(write_map_folder(saved, folder("empty")));
  EXPECT_THROW(write_map_folder(StoredMap{}, folder("empty")), UnavailableError);
  EXPECT_EQ(read_map_folder(folder("empty")).points.size(), saved.points.size());
  for (const auto& entry : std::filesystem::directory_iterator(temp_.path())) {
    EXPECT_NE(entry.path().filename().string()[0], '.') << "left over: " << entry.path();
  }
}

// What a crash in the midst of saving leaves: the old map, and a half-written new one beside it.
TEST_F(MapFolderTest, ACrashInMidSaveKeepsTheOldMap) {
  const StoredMap saved = make_map();
  write_map_folder(saved, folder("map"));
  const std::string part = folder(".map.part");
  EXPECT_THROW(replace_folder(folder("map"), own_map_files, Durability::kSurvivesThisProcess,
                              [&](const auto& here) {
                                std::filesystem::create_directory(here / "images");
                                std::ofstream(here / "images" / "000001.png") << "half";
                                std::filesystem::copy(here, folder("seen"),
                                                      std::filesystem::copy_options::recursive);
                                throw UnavailableError("crash");
                              }),
               UnavailableError);
  EXPECT_FALSE(std::filesystem::exists(part)) << "an error clears up";
  std::filesystem::rename(folder("seen"), part);  // a crash does not
  EXPECT_EQ(read_map_folder(folder("map")).points.size(), saved.points.size());
  write_map_folder(saved, folder("map"));
  EXPECT_EQ(read_map_folder(folder("map")).points.size(), saved.points.size());
  EXPECT_FALSE(std::filesystem::exists(part));
}

// On a file system that cannot exchange two folders, between its two steps.
TEST_F(MapFolderTest, ACrashBetweenTheStepsOfTheSwapIsMended) {
  const StoredMap saved = make_map();
  write_map_folder(saved, folder("map"));
  std::filesystem::rename(folder("map"), folder(".map.old"));
  EXPECT_EQ(read_map_folder(folder("map")).points.size(), saved.points.size());
  std::filesystem::rename(folder("map"), folder(".map.old"));
  EXPECT_THROW(write_map_folder(StoredMap{}, folder("map")), UnavailableError);
  write_map_folder(saved, folder("map"));
  EXPECT_EQ(read_map_folder(folder("map")).points.size(), saved.points.size());
  EXPECT_FALSE(std::filesystem::exists(folder(".map.old")));
}

// No file may grow beyond a few kilobytes: to a program, that is a full disk.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) {
    getrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit small{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
  }
  ~FullDisk() { setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_{};
};

TEST_F(MapFolderTest, AFullDiskKeepsTheOldMap) {
  const StoredMap saved = make_map();
  write_map_folder(saved, folder("map"));
  for (const rlim_t bytes : {100, 5'000, 100'000}) {
    const FullDisk full(bytes);
    EXPECT_THROW(write_map_folder(saved, folder("map")), UnavailableError) << bytes;
    EXPECT_EQ(read_map_folder(folder("map")).points.size(), saved.points.size());
    EXPECT_FALSE(std::filesystem::exists(folder(".map.part")));
  }
}

TEST_F(MapFolderTest, OneProgramAtATimeSavesInAFolder) {
  const StoredMap saved = make_map();
  std::string trouble;
  replace_folder(
      folder("map"), own_map_files, Durability::kSurvivesThisProcess, [&](const auto& here) {
        trouble = error_of<UnavailableError>([&] { write_map_folder(saved, folder("another")); });
        write_core_files(saved, here, {});
      });
  EXPECT_NE(trouble.find("another program is saving"), std::string::npos) << trouble;
  EXPECT_NO_THROW(write_map_folder(saved, folder("another")));
}

TEST_F(MapFolderTest, ImagesThatLieThereAreNotWrittenAgain) {
  const StoredMap saved = make_map();
  write_map_folder(saved, folder("map"));
  WrittenImages written = written_images(saved, folder("map"));
  written.times[saved.keyframes[0].id].us += 1;  // of another map
  std::filesystem::create_directory(folder("core"));
  write_core_files(saved, folder("core"), written);
  EXPECT_EQ(read_map_folder(folder("core")).points.size(), saved.points.size());
  EXPECT_EQ(std::filesystem::hard_link_count(folder("core") + "/images/000000.png"), 1u);
  EXPECT_EQ(std::filesystem::hard_link_count(folder("core") + "/images/000001.png"), 2u);
}

TEST_F(MapFolderTest, SaysWhereItCannotWrite) {
  std::ofstream(folder("file")) << "x";
  EXPECT_THROW(write_map_folder(make_map(), folder("file") + "/map"), UnavailableError);
}

}  // namespace
}  // namespace foresight
