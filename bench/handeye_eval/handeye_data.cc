#include "bench/handeye_eval/handeye_data.h"

#include <filesystem>
#include <fstream>
#include <opencv2/calib3d.hpp>
#include <sstream>

#include "common/errors.h"
#include "common/yaml_reader.h"

namespace foresight {
namespace {

namespace fs = std::filesystem;
using calibration::ArmSample;
using Eigen::Vector3d;

constexpr double kWindow_s = 0.15;

// Rows of `columns` numbers; comments are passed over.
std::vector<std::vector<double>> read_rows(const fs::path& path, size_t columns) {
  std::ifstream file(path);
  if (!file) throw UnavailableError(path.string() + ": cannot be read");
  std::vector<std::vector<double>> rows;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream fields(line);
    std::vector<double> row(columns);
    for (double& value : row) fields >> value;
    if (!fields) {
      throw ConfigError(path.string() + ":" + std::to_string(number) + ": not " +
                        std::to_string(columns) + " numbers");
    }
    rows.push_back(row);
  }
  return rows;
}

// From "stamp tx ty tz qx qy qz qw".
template <class A, class B>
Pose<A, B> pose_of(const std::vector<double>& r) {
  return {Eigen::Quaterniond(r[7], r[4], r[5], r[6]), Vector3d(r[1], r[2], r[3])};
}

Pose<Target, Cam> solve_pnp(const std::vector<TargetCorner>& corners, const CameraModel& camera) {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> rays;
  for (const TargetCorner& c : corners) {
    const Eigen::Vector2d xy = camera.unproject(c.pixel);
    points.emplace_back(c.point_in_target.x(), c.point_in_target.y(), c.point_in_target.z());
    rays.emplace_back(xy.x(), xy.y());
  }
  cv::Vec3d turn, shift;
  cv::solvePnP(points, rays, cv::Matx33d::eye(), cv::noArray(), turn, shift, false,
               cv::SOLVEPNP_ITERATIVE);
  const Vector3d w(turn[0], turn[1], turn[2]);
  const double angle = w.norm();
  const Eigen::Quaterniond rotation(Eigen::AngleAxisd(angle, angle > 0 ? w / angle : w));
  return Pose<Cam, Target>(rotation, Vector3d(shift[0], shift[1], shift[2])).inverse();
}

std::optional<Pose<Ee, Cam>> read_reference(const fs::path& path) {
  if (!fs::exists(path)) return std::nullopt;
  YamlReader camera = YamlReader::open(path.string()).map("flange_T_camera");
  const auto t = camera.numbers("t", 3, -5, 5), q = camera.numbers("q_xyzw", 4, -1, 1);
  return Pose<Ee, Cam>(Eigen::Quaterniond(q[3], q[0], q[1], q[2]), Vector3d(t[0], t[1], t[2]));
}

HandEyeData load_views(const fs::path& root) {
  HandEyeData data;
  data.camera = load_camera_file((root / "camera.yaml").string());
  data.reference = read_reference(root / "handeye.yaml");
  for (const auto& row : read_rows(root / "robot_poses.txt", 8)) {
    HandEyeView view;
    const Time time = Time{} + seconds(row[0]);
    view.arm = {time, {ArmSample{time, pose_of<Base, Ee>(row)}}};
    data.views.push_back(view);
  }
  for (const auto& row : read_rows(root / "corners.txt", 6)) {
    const auto index = static_cast<size_t>(row[0]);
    if (index >= data.views.size()) {
      throw ConfigError((root / "corners.txt").string() + ": view " + std::to_string(index) +
                        " has no pose");
    }
    data.views[index].corners.push_back({{row[1], row[2], row[3]}, {row[4], row[5]}});
  }
  std::erase_if(data.views, [](const HandEyeView& v) { return v.corners.size() < 6; });
  if (data.views.empty()) throw ConfigError(root.string() + ": no view with corners");
  for (HandEyeView& v : data.views) v.target_from_cam = solve_pnp(v.corners, data.camera);
  for (const TargetCorner& c : data.views.front().corners) {
    data.points_in_target.push_back(c.point_in_target);
  }
  return data;
}

std::optional<calibration::ArmTrack> track_around(const std::vector<ArmSample>& arm, Time time) {
  calibration::ArmTrack track{time, {}};
  for (const ArmSample& s : arm) {
    if (std::abs((s.time - time).seconds()) <= kWindow_s) track.samples.push_back(s);
  }
  const bool is_covered = track.samples.size() > 10 &&
                          (time - track.samples.front().time).seconds() > 0.12 &&
                          (track.samples.back().time - time).seconds() > 0.12;
  return is_covered ? std::optional(track) : std::nullopt;
}

HandEyeData load_log(const fs::path& root, int step) {
  HandEyeData data;
  data.is_log = true;
  data.camera.width_px = 640;
  data.camera.height_px = 480;
  data.camera.fx_px = data.camera.fy_px = 600;
  data.camera.cx_px = 319.5;
  data.camera.cy_px = 239.5;
  std::vector<ArmSample> arm;
  for (const auto& row : read_rows(root / "base_T_hinge.txt", 8)) {
    arm.push_back({Time{} + seconds(row[0]), pose_of<Base, Ee>(row)});
  }
  const auto rows = read_rows(root / "target_T_camera.txt", 8);
  for (size_t i = 0; i < rows.size(); i += static_cast<size_t>(step)) {
    const auto track = track_around(arm, Time{} + seconds(rows[i][0]));
    if (track) data.views.push_back({*track, pose_of<Target, Cam>(rows[i]), {}});
  }
  for (int x = -8; x <= 8; ++x) {
    for (int y = -8; y <= 8; ++y) data.points_in_target.emplace_back(0.1 * x, 0.1 * y, 0);
  }
  return data;
}

}  // namespace

HandEyeData load_handeye(const std::string& folder, int step) {
  const fs::path root = fs::weakly_canonical(folder);
  HandEyeData data =
      fs::exists(root / "target_T_camera.txt") ? load_log(root, step) : load_views(root);
  data.name = root.filename().string();
  return data;
}

}  // namespace foresight
