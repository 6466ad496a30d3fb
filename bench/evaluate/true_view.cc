#include "bench/evaluate/true_view.h"

#include <vector>

#include "bench/evaluate/image_scores.h"
#include "bench/evaluate/picture_scorer.h"
#include "sim/robot/camera_rig.h"

namespace foresight {

TrueView::TrueView(const sim::SimParams& params, const CameraModel& camera)
    : scene_(sim::open_scene(params)),
      camera_(camera.undistorted()),
      pictures_(scene_, {.model = camera_, .antialiasing = sim::Antialiasing::kEdges}),
      coarse_camera_(camera_.scaled(16.0 / camera_.width_px)),
      depths_(scene_, {.model = coarse_camera_}) {}

cv::Mat TrueView::picture(const Pose<World, Cam>& world_from_cam) {
  return to_mat(pictures_.render(world_from_cam, 1));
}

double TrueView::shift_px(const Pose<World, Cam>& truth, const Pose<World, Cam>& other) const {
  const sim::DepthImage depth = depths_.render_depth(truth);
  const Pose<Cam, Cam> other_from_true = other.inverse() * truth;
  std::vector<double> shifts;
  for (int y = 0; y < depth.height_px; ++y) {
    for (int x = 0; x < depth.width_px; ++x) {
      const double z = depth.depth_m[static_cast<size_t>(y * depth.width_px + x)];
      const Eigen::Vector2d ray = coarse_camera_.unproject({x, y});
      const Eigen::Vector3d moved = other_from_true * Eigen::Vector3d(z * ray.homogeneous());
      if (z <= 0 || moved.z() <= 1e-3) continue;
      shifts.push_back((camera_.project(moved) - camera_.project_normalized(ray)).norm());
    }
  }
  return percentile(std::move(shifts), 0.5);
}

}  // namespace foresight
