#include "sim/sequence.h"

#include <algorithm>
#include <array>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "common/errors.h"
#include "common/output_file.h"
#include "sim/lab.h"
#include "sim/scene_loader.h"

namespace foresight::sim {
namespace {

namespace fs = std::filesystem;

constexpr Time kFirstFrame{1'000'000'000};  // stamps begin at 1000 s
constexpr int kJpegQuality = 85;
constexpr size_t kSubFrames = 4;

std::string stamp(Time time) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%" PRId64 ".%06" PRId64, time.us / 1'000'000,
                time.us % 1'000'000);
  return text.data();
}

// A text file that reports when it cannot be written.
class Lines {
 public:
  explicit Lines(const fs::path& path) : path_(path), file_(path) {}
  void add(const std::string& line) { file_ << line << '\n'; }
  void close() {
    file_.close();
    if (!file_) throw UnavailableError(path_.string() + ": cannot be written");
  }

 private:
  fs::path path_;
  std::ofstream file_;
};

void make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw UnavailableError(folder.string() + ": cannot be made: " + error.message());
}

void write_image(const fs::path& path, const cv::Mat& image, const std::vector<int>& options) {
  std::vector<uint8_t> bytes;
  cv::imencode(path.extension().string(), image, bytes, options);
  write_output(path.string(), bytes);
}

void write_colour(const fs::path& path, Image& image) {
  const cv::Mat rgb(image.height_px, image.width_px, CV_8UC3, image.bytes.data());
  cv::Mat bgr;
  cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
  write_image(path, bgr, {cv::IMWRITE_JPEG_QUALITY, kJpegQuality});
}

void write_depth(const fs::path& path, const DepthImage& depth) {
  cv::Mat image(depth.height_px, depth.width_px, CV_16UC1);
  for (int y = 0; y < depth.height_px; ++y) {
    for (int x = 0; x < depth.width_px; ++x) {
      const float depth_m = depth.depth_m[static_cast<size_t>(y) * depth.width_px + x];
      image.at<uint16_t>(y, x) = cv::saturate_cast<uint16_t>(depth_m * 1000);
    }
  }
  write_image(path, image, {cv::IMWRITE_PNG_COMPRESSION, 3});
}

std::string pose_line(Time time, const Pose<World, Cam>& world_from_cam) {
  const Eigen::Vector3d& t = world_from_cam.translation();
  const Eigen::Quaterniond& q = world_from_cam.rotation();
  std::array<char, 256> text;
  std::snprintf(text.data(), text.size(), "%s %.9f %.9f %.9f %.9f %.9f %.9f %.9f",
                stamp(time).c_str(), t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
  return text.data();
}

void write_camera_file(const fs::path& path, const CameraModel& camera, double rate_hz) {
  Lines file(path);
  file.add("%YAML:1.0\n---\nmodel: pinhole_radtan");
  file.add("width: " + std::to_string(camera.width_px));
  file.add("height: " + std::to_string(camera.height_px));
  const auto number = [&file](const char* key, double value) {
    std::array<char, 64> text;
    std::snprintf(text.data(), text.size(), "%s: %.9g", key, value);
    file.add(text.data());
  };
  number("fps", rate_hz);
  number("fx", camera.fx_px);
  number("fy", camera.fy_px);
  number("cx", camera.cx_px);
  number("cy", camera.cy_px);
  const char* names[] = {"k1", "k2", "p1", "p2", "k3"};
  for (size_t i = 0; i < 5; ++i) number(names[i], camera.distortion[i]);
  number("depth_scale", 0.001);
  file.close();
}

using Path = std::function<Pose<World, Cam>(Duration since_start)>;

Path path_of(const SequenceParams& params) {
  if (params.followed.empty()) {
    return [trajectory = Trajectory(params.trajectory, params.seed)](Duration since_start) {
      return trajectory.at(since_start);
    };
  }
  return [track = params.followed](Duration since_start) {
    const Time first = track.front().time, last = track.back().time;
    return *pose_at(track, std::clamp(first + since_start, first, last));
  };
}

// How many pictures begin before the duration is over, the followed track's last pose included.
int64_t count_frames(const SequenceParams& params) {
  double count = std::floor(params.duration_s * params.rate_hz + 1e-9);
  if (!params.followed.empty()) {
    constexpr double kRounding_s = 1e-6;
    const Duration span = params.followed.back().time - params.followed.front().time;
    count = std::min(count, std::floor((span.seconds() + kRounding_s) * params.rate_hz) + 1);
  }
  return static_cast<int64_t>(count);
}

class Writer {
 public:
  Writer(const fs::path& folder, const SequenceParams& params, const Scene& scene)
      : folder_(folder),
        params_(params),
        path_(path_of(params)),
        camera_(scene, {.model = sequence_camera(params.width_px, params.distorted),
                        .noise_levels = params.noise_levels,
                        .antialiasing = params.antialiasing}),
        rgb_(folder / "rgb.txt"),
        truth_(folder / "groundtruth.txt"),
        depth_(folder / "depth.txt") {
    rgb_.add("# timestamp filename");
    truth_.add("# timestamp tx ty tz qx qy qz qw  (camera-to-world, x right y down z forward)");
    depth_.add("# timestamp filename (16 bit, millimetres along the optical axis)");
    if (params.scatter.distance_m > 0 || params.scatter.turn_rad > 0) {
      scatter_.emplace(scene, camera_.model(), params.scatter);
    }
  }

  void write_frame(int64_t index) {
    const Duration since_start = seconds(static_cast<double>(index) / params_.rate_hz);
    const Time time = kFirstFrame + since_start;
    const uint64_t frame_seed = params_.seed * 0x100000001u + static_cast<uint64_t>(index);
    std::optional<Pose<Cam, Cam>> shift;
    if (scatter_) shift = scatter_->shift(path_(since_start), frame_seed);
    Image image = expose(since_start, shift, frame_seed);
    const std::string name = "rgb/" + stamp(time) + ".jpg";
    write_colour(folder_ / name, image);
    rgb_.add(stamp(time) + " " + name);
    const Pose<World, Cam> world_from_cam = pose(since_start, shift);
    truth_.add(pose_line(time, world_from_cam));
    if (params_.depth_every > 0 && index % params_.depth_every == 0) {
      const std::string depth_name = "depth/" + stamp(time) + ".png";
      write_depth(folder_ / depth_name, camera_.render_depth(world_from_cam));
      depth_.add(stamp(time) + " " + depth_name);
    }
  }

  void close() {
    rgb_.close();
    truth_.close();
    depth_.close();
  }

 private:
  Pose<World, Cam> pose(Duration since_start, const std::optional<Pose<Cam, Cam>>& shift) const {
    return shift ? path_(since_start) * *shift : path_(since_start);
  }

  Image expose(Duration middle, const std::optional<Pose<Cam, Cam>>& shift, uint64_t frame_seed) {
    if (params_.shutter_s <= 0) return camera_.render(pose(middle, shift), frame_seed);
    std::array<Pose<World, Cam>, kSubFrames> poses;
    for (size_t i = 0; i < kSubFrames; ++i) {
      const double part = (static_cast<double>(i) + 0.5) / kSubFrames - 0.5;
      poses[i] = pose(middle + seconds(part * params_.shutter_s), shift);
    }
    return camera_.render(poses, frame_seed);
  }

  fs::path folder_;
  const SequenceParams& params_;
  Path path_;
  RayCamera camera_;
  std::optional<Scatter> scatter_;
  Lines rgb_, truth_, depth_;
};

}  // namespace

CameraModel sequence_camera(int width_px, bool distorted) {
  CameraModel camera;
  camera.width_px = width_px;
  camera.height_px = width_px * 3 / 4;
  camera.fx_px = camera.fy_px = 520.0 / 640 * width_px;
  camera.cx_px = (camera.width_px - 1) / 2.0;
  camera.cy_px = (camera.height_px - 1) / 2.0;
  if (distorted) camera.distortion = {-0.25, 0.09, 0.0006, -0.0004, -0.012};
  camera.prepare();
  return camera;
}

std::vector<TimedPose> moved_to_start(std::vector<TimedPose> track, uint64_t seed) {
  const Pose<World, Cam> start = Trajectory(Trajectory::Kind::kDesk, seed).at({});
  const Pose<World, World> world_from_file = start * track.front().world_from_cam.inverse();
  for (TimedPose& pose : track) pose.world_from_cam = world_from_file * pose.world_from_cam;
  return track;
}

std::vector<std::string> write_sequence(const std::string& folder, const SequenceParams& params,
                                        const Progress& progress) {
  const fs::path root(folder);
  LoadReport report;
  const Scene scene = params.scene_file.empty() ? make_lab(params.seed)
                                                : load_scene(params.scene_file, {}, &report);
  make_folder(root / "rgb");
  if (params.depth_every > 0) make_folder(root / "depth");
  write_camera_file(root / "camera.yaml", sequence_camera(params.width_px, params.distorted),
                    params.rate_hz);
  if (params.with_mesh) {
    if (const auto error = write_scene_ply(scene, (root / "mesh_true.ply").string())) {
      throw UnavailableError(*error);
    }
  }
  Writer writer(root, params, scene);
  const int64_t count = count_frames(params);
  for (int64_t i = 0; i < count; ++i) {
    writer.write_frame(i);
    progress(i + 1, count);
  }
  writer.close();
  return report.warnings;
}

}  // namespace foresight::sim
