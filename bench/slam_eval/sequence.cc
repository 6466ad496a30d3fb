#include "bench/slam_eval/sequence.h"

#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/errors.h"

namespace foresight {
namespace {

constexpr Duration kMaxGap = milliseconds(100);

std::vector<std::string> data_lines(const std::string& path) {
  std::ifstream file(path);
  std::vector<std::string> lines;
  std::string line;
  while (std::getline(file, line)) {
    if (!line.empty() && line[0] != '#') lines.push_back(line);
  }
  return lines;
}

Time from_seconds(double s) { return Time{} + seconds(s); }

std::vector<SequenceImage> load_list(const std::filesystem::path& root, const char* name) {
  std::vector<SequenceImage> images;
  for (const std::string& line : data_lines((root / name).string())) {
    std::istringstream fields(line);
    double stamp_s;
    std::string file;
    if (fields >> stamp_s >> file) {
      images.push_back({from_seconds(stamp_s), (root / file).string()});
    }
  }
  return images;
}

// "key: number" of the camera file; the fallback where it is missing.
double number_in(const std::string& path, const std::string& key, double fallback) {
  for (const std::string& line : data_lines(path)) {
    if (!line.starts_with(key + ":")) continue;
    std::istringstream value(line.substr(key.size() + 1));
    value >> fallback;
  }
  return fallback;
}

// A camera of the depth images' own, without distortion and with the colour images' size.
std::optional<CameraModel> depth_camera_of(const std::string& camera_file,
                                           const CameraModel& camera) {
  CameraModel own = camera.undistorted();
  own.fx_px = number_in(camera_file, "depth_fx", 0);
  own.fy_px = number_in(camera_file, "depth_fy", own.fx_px);
  own.cx_px = number_in(camera_file, "depth_cx", camera.cx_px);
  own.cy_px = number_in(camera_file, "depth_cy", camera.cy_px);
  if (own.fx_px <= 0 || own.fy_px <= 0) return std::nullopt;
  return own;
}

}  // namespace

std::optional<Pose<World, Cam>> Sequence::truth_at(Time time) const {
  return pose_at(truth, time, kMaxGap);
}

Sequence load_sequence(const std::string& folder) {
  Sequence sequence;
  const std::filesystem::path root = std::filesystem::weakly_canonical(folder);
  sequence.name = root.filename().string();
  sequence.camera = load_camera_file((root / "camera.yaml").string());
  sequence.images = load_list(root, "rgb.txt");
  sequence.depth_images = load_list(root, "depth.txt");
  if (!sequence.depth_images.empty()) {
    const std::string camera_file = (root / "camera.yaml").string();
    sequence.depth_scale = number_in(camera_file, "depth_scale", 1.0 / 5000);
    sequence.depth_camera = depth_camera_of(camera_file, sequence.camera);
  }
  if (sequence.images.empty()) {
    throw UnavailableError((root / "rgb.txt").string() + ": no images ('seconds file' per line)");
  }
  const std::filesystem::path truth = root / "groundtruth.txt";
  if (std::filesystem::exists(truth)) sequence.truth = load_pose_track(truth.string());
  return sequence;
}

}  // namespace foresight
