#include "procs/calibrator/alignment_residual.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "procs/calibrator/geometry.h"

namespace foresight::calibration {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kColumns = 6, kRows = 4;
constexpr size_t kMinPoints = 6;
constexpr double kNearestShare = 0.25;    // of the median depth; nearer points would dominate
constexpr double kLeastDepthShare = 0.1;  // of the depth that SLAM sees

struct InView {
  size_t index;
  int cell;
  double depth_mu;
};

std::vector<InView> points_in_view(const Pose<Cam, Map>& cam_from_map, const CameraModel& pinhole,
                                   const std::vector<Eigen::Vector3f>& points_in_map) {
  std::vector<InView> seen;
  for (size_t i = 0; i < points_in_map.size(); ++i) {
    const Vector3d p = cam_from_map * points_in_map[i].cast<double>();
    if (p.z() <= 1e-9) continue;
    const Vector2d pixel = pinhole.project(p);
    if (!pinhole.in_image(pixel)) continue;
    const int column = static_cast<int>(pixel.x() * kColumns / pinhole.width_px);
    const int row = static_cast<int>(pixel.y() * kRows / pinhole.height_px);
    seen.push_back({i, row * kColumns + column, p.z()});
  }
  return seen;
}

double median_depth(const std::vector<InView>& seen) {
  std::vector<double> depths;
  for (const InView& s : seen) depths.push_back(s.depth_mu);
  const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
  std::nth_element(depths.begin(), middle, depths.end());
  return *middle;
}

// Indices of at most `max_points` points: as many as there are from each cell in turn, and those
// spread evenly over the cell's list.
std::vector<size_t> spread(const std::vector<InView>& seen, size_t max_points) {
  std::vector<size_t> chosen;
  if (seen.empty()) return chosen;
  const double nearest_mu = kNearestShare * median_depth(seen);
  std::array<std::vector<size_t>, kColumns * kRows> cells;
  for (const InView& s : seen) {
    if (s.depth_mu >= nearest_mu) cells[static_cast<size_t>(s.cell)].push_back(s.index);
  }
  std::array<size_t, kColumns * kRows> quota{};
  size_t total = 0;
  for (bool grows = true; grows;) {
    grows = false;
    for (size_t c = 0; c < cells.size(); ++c) {
      if (quota[c] == cells[c].size() || total == max_points) continue;
      ++quota[c];
      ++total;
      grows = true;
    }
  }
  for (size_t c = 0; c < cells.size(); ++c) {
    for (size_t k = 0; k < quota[c]; ++k)
      chosen.push_back(cells[c][k * cells[c].size() / quota[c]]);
  }
  return chosen;
}

// What a pair's points have in common.
struct View {
  Matrix3d cam_from_ee, cam_from_base, scaled_rotation;
  Vector3d velocity_in_ee, angular_velocity;
  Pose<Ee, Base> ee_from_base;
  Pose<Cam, Ee> cam_from_ee_pose;
};

View view_of(const PosePair& pair, const PivotedEstimate& e) {
  const ArmMotion arm = pair.arm.at(e.joint_delay_s);
  View v;
  v.ee_from_base = arm.base_from_ee.inverse();
  v.cam_from_ee_pose = e.ee_from_cam.inverse();
  v.cam_from_ee = v.cam_from_ee_pose.rotation().toRotationMatrix();
  v.cam_from_base = v.cam_from_ee * v.ee_from_base.rotation().toRotationMatrix();
  v.scaled_rotation = std::exp(e.log_scale) * e.rotation.toRotationMatrix();
  v.velocity_in_ee = v.ee_from_base.rotation() * arm.velocity_m_per_s;
  v.angular_velocity = arm.angular_velocity_rad_per_s;
  return v;
}

}  // namespace

std::optional<SampledPair> sample(const PosePair& pair, const CameraModel& camera,
                                  const std::vector<Eigen::Vector3f>& points_in_map,
                                  int max_points) {
  const Pose<Cam, Map> cam_from_map = pair.map_from_cam.inverse();
  const auto seen = points_in_view(cam_from_map, camera.undistorted(), points_in_map);
  const auto chosen = spread(seen, static_cast<size_t>(max_points));
  if (chosen.size() < kMinPoints) return std::nullopt;
  SampledPair sampled{&pair, {}, {}, {}};
  for (const size_t index : chosen) {
    const Vector3d point = points_in_map[index].cast<double>();
    const Vector3d p = cam_from_map * point;
    sampled.points_in_map.push_back(point);
    sampled.seen_px.emplace_back(camera.fx_px * p.x() / p.z(), camera.fy_px * p.y() / p.z());
    sampled.seen_depth_mu.push_back(p.z());
  }
  return sampled;
}

PivotedEstimate::PivotedEstimate(const AlignmentEstimate& estimate, const Vector3d& pivot)
    : pivot_in_map(pivot),
      rotation(estimate.base_from_map.rotation()),
      pivot_in_base(estimate.base_from_map * pivot),
      log_scale(std::log(estimate.base_from_map.scale())),
      ee_from_cam(estimate.ee_from_cam),
      joint_delay_s(estimate.joint_delay_s) {}

AlignmentEstimate PivotedEstimate::estimate() const {
  const double scale = std::exp(log_scale);
  return {{scale, rotation, pivot_in_base - scale * (rotation * pivot_in_map)},
          ee_from_cam,
          joint_delay_s};
}

PivotedEstimate PivotedEstimate::moved(const Step& step) const {
  PivotedEstimate m = *this;
  m.pivot_in_base += step.segment<3>(0);
  m.rotation = (rotation_from_vector(step.segment<3>(3)) * rotation).normalized();
  m.log_scale += step[6];
  m.ee_from_cam =
      ee_from_cam * Pose<Cam, Cam>(rotation_from_vector(step.segment<3>(10)), step.segment<3>(7));
  m.joint_delay_s += step[kDelayStep];
  return m;
}

PairResidual residual_of(const SampledPair& pair, const CameraModel& camera,
                         const PivotedEstimate& e, Derivatives derivatives) {
  const View v = view_of(*pair.pair, e);
  const auto n = static_cast<Eigen::Index>(pair.points_in_map.size());
  const double weight = 1 / std::sqrt(static_cast<double>(n));
  const double scale = std::exp(e.log_scale);
  PairResidual out;
  out.residual.resize(2 * n);
  if (derivatives == Derivatives::kAll) out.jacobian.resize(2 * n, kSteps);
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto i = static_cast<size_t>(k);
    const Vector3d arm = v.scaled_rotation * (pair.points_in_map[i] - e.pivot_in_map);
    const Vector3d in_ee = v.ee_from_base * (arm + e.pivot_in_base);
    const Vector3d p = v.cam_from_ee_pose * in_ee;
    const double least_depth = kLeastDepthShare * scale * pair.seen_depth_mu[i];
    const double iz = 1 / std::max(p.z(), least_depth);
    const Vector2d pixel(camera.fx_px * p.x() * iz, camera.fy_px * p.y() * iz);
    out.residual.segment<2>(2 * k) = weight * (pixel - pair.seen_px[i]);
    if (derivatives == Derivatives::kNone) continue;
    Eigen::Matrix<double, 2, 3> by_p;
    by_p << camera.fx_px, 0, -pixel.x(), 0, camera.fy_px, -pixel.y();
    by_p *= weight * iz;
    if (p.z() < least_depth) by_p.col(2).setZero();
    auto j = out.jacobian.middleRows<2>(2 * k);
    j.leftCols<3>() = by_p * v.cam_from_base;
    j.middleCols<3>(3) = -by_p * v.cam_from_base * skew(arm);
    j.col(6) = by_p * v.cam_from_base * arm;
    j.middleCols<3>(7) = -by_p;
    j.middleCols<3>(10) = by_p * skew(p);
    j.col(kDelayStep) =
        -by_p * v.cam_from_ee * (v.angular_velocity.cross(in_ee) + v.velocity_in_ee);
  }
  return out;
}

double rms_px(const SampledPair& pair, const CameraModel& camera, const PivotedEstimate& estimate) {
  return residual_of(pair, camera, estimate, Derivatives::kNone).residual.norm();
}

}  // namespace foresight::calibration
