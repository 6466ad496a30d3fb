#include "bench/mesh_eval/view_painter.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "common/errors.h"

namespace foresight {
namespace {

// How different two views are: map units (the first map's median depth is 1) and radians alike.
double difference(const Pose<Map, Cam>& a, const Pose<Map, Cam>& b) {
  return (a.translation() - b.translation()).norm() + a.rotation().angularDistance(b.rotation());
}

}  // namespace

ViewPainter::ViewPainter(const Sequence& sequence, const MeshView& occluders,
                         std::vector<MapKeyframe> keyframes, int step)
    : sequence_(sequence),
      occluders_(occluders),
      keyframes_(std::move(keyframes)),
      camera_(sequence.camera.scaled(1.0 / step)) {}

std::vector<MapKeyframe> ViewPainter::nearest_first(const Pose<Map, Cam>& map_from_cam,
                                                    Time latest) const {
  std::vector<MapKeyframe> chosen;
  for (const MapKeyframe& k : keyframes_) {
    if (k.time <= latest) chosen.push_back(k);
  }
  std::stable_sort(chosen.begin(), chosen.end(), [&](const MapKeyframe& a, const MapKeyframe& b) {
    return difference(a.map_from_cam, map_from_cam) < difference(b.map_from_cam, map_from_cam);
  });
  return chosen;
}

const cv::Mat& ViewPainter::image_of(const MapKeyframe& keyframe) {
  cv::Mat& image = images_[keyframe.id];
  if (!image.empty()) return image;
  const auto entry = std::find_if(sequence_.images.begin(), sequence_.images.end(),
                                  [&](const SequenceImage& i) { return i.time == keyframe.time; });
  if (entry == sequence_.images.end()) throw UnavailableError("a keyframe without an image");
  cv::resize(sequence_.colour(static_cast<size_t>(entry - sequence_.images.begin())), image,
             {camera_.width_px, camera_.height_px}, 0, 0, cv::INTER_AREA);
  return image;
}

std::optional<Eigen::Vector2d> ViewPainter::pixel_in(const MapKeyframe& keyframe,
                                                     const Eigen::Vector3f& point_in_map) const {
  const Eigen::Vector3d p = keyframe.map_from_cam.inverse() * point_in_map.cast<double>();
  if (p.z() <= 0 || (p.head<2>() / p.z()).norm() > camera_.max_radius) return std::nullopt;
  const Eigen::Vector2d pixel = camera_.project(p);
  if (!camera_.in_image(pixel)) return std::nullopt;
  const Eigen::Vector3f centre = keyframe.map_from_cam.translation().cast<float>();
  return occluders_.is_free(centre, point_in_map) ? std::optional(pixel) : std::nullopt;
}

void ViewPainter::paint(const SeenMesh& seen, const PixelRays& rays,
                        const Pose<Map, Cam>& map_from_cam, Time latest, cv::Mat* picture) {
  const Eigen::Isometry3f map_from_view(map_from_cam.matrix().cast<float>());
  cv::Mat waiting = seen.depth_mu > 0;
  for (const MapKeyframe& keyframe : nearest_first(map_from_cam, latest)) {
    cv::Mat from_x = cv::Mat::zeros(waiting.size(), CV_32F), from_y = from_x.clone();
    cv::Mat found = cv::Mat::zeros(waiting.size(), CV_8U), painted;
    for (int row = 0; row < rays.rows(); ++row) {
      for (int col = 0; col < rays.cols(); ++col) {
        if (waiting.at<uint8_t>(row, col) == 0) continue;
        const auto pixel = pixel_in(keyframe, map_from_view * (seen.depth_mu.at<float>(row, col) *
                                                               rays.ray_in_cam(row, col)));
        if (!pixel) continue;
        from_x.at<float>(row, col) = static_cast<float>(pixel->x());
        from_y.at<float>(row, col) = static_cast<float>(pixel->y());
        found.at<uint8_t>(row, col) = 255;
      }
    }
    cv::remap(image_of(keyframe), painted, from_x, from_y, cv::INTER_LINEAR);
    painted.copyTo(*picture, found);
    waiting.setTo(0, found);
  }
}

}  // namespace foresight
