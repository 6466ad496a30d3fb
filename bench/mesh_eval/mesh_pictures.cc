#include "bench/mesh_eval/mesh_pictures.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "bench/mesh_eval/view_painter.h"
#include "bench/slam_eval/depth_image.h"
#include "bench/slam_eval/score.h"
#include "common/errors.h"
#include "common/output_file.h"

namespace foresight {
namespace {

constexpr int kRows = 3, kPanelWidth_px = 320, kCaption_px = 20;
constexpr const char* kCaptions[] = {"camera", "mesh between map points; blue: guessed",
                                     "painted with images at least 0.3 s older",
                                     "depth within 5 %, 10 %; red: too near, blue: too far"};
constexpr Duration kAge = milliseconds(300);  // of the images that paint: what an operator has
constexpr int kJpegQuality = 74;
// BGR.
const cv::Vec3f kMeasured(225, 225, 225), kGuessed(215, 150, 95);
const cv::Vec3b kBackground(40, 34, 30), kUnseen(88, 80, 76), kNoDepth(110, 110, 110);
const cv::Vec3b kWithin5(80, 175, 60), kWithin10(70, 215, 245), kFront(60, 50, 225);
const cv::Vec3b kBehind(230, 110, 50);

cv::Mat shade(const MeshView& mesh, const SeenMesh& seen, const PixelRays& rays,
              const Pose<Map, Cam>& map_from_cam) {
  const Eigen::Matrix3f rotation = map_from_cam.rotation().toRotationMatrix().cast<float>();
  cv::Mat picture(seen.depth_mu.size(), CV_8UC3, kBackground);
  for (int row = 0; row < rays.rows(); ++row) {
    for (int col = 0; col < rays.cols(); ++col) {
      const int triangle = seen.triangle.at<int>(row, col);
      if (triangle < 0) continue;
      const Eigen::Vector3f ray = (rotation * rays.ray_in_cam(row, col)).normalized();
      const float light = 0.25f + 0.75f * std::abs(mesh.normal_in_map(triangle).dot(ray));
      const auto surface = static_cast<Surface>(seen.surface.at<uint8_t>(row, col));
      const cv::Vec3f colour = surface == Surface::kMeasured ? kMeasured : kGuessed;
      picture.at<cv::Vec3b>(row, col) = cv::Vec3b(light * colour);
    }
  }
  return picture;
}

cv::Vec3b colour_of(float error) {
  if (std::abs(error) <= 0.05f) return kWithin5;
  if (std::abs(error) <= 0.1f) return kWithin10;
  return error < 0 ? kFront : kBehind;
}

// Guessed surface is dimmed.
cv::Mat draw_errors(const SeenMesh& seen, const PixelRays& rays, const cv::Mat& depth_m,
                    double metres_per_mu) {
  cv::Mat picture(seen.depth_mu.size(), CV_8UC3, kNoDepth);
  for (int row = 0; row < rays.rows(); ++row) {
    for (int col = 0; col < rays.cols(); ++col) {
      const float measured_m = depth_m.at<float>(row * rays.step(), col * rays.step());
      const auto surface = static_cast<Surface>(seen.surface.at<uint8_t>(row, col));
      if (measured_m <= 0) continue;
      cv::Vec3b& pixel = picture.at<cv::Vec3b>(row, col);
      pixel = kBackground;
      if (surface == Surface::kNone) continue;
      pixel = colour_of(depth_error(seen.depth_mu.at<float>(row, col), metres_per_mu, measured_m));
      if (surface == Surface::kGuessed) pixel = cv::Vec3b(0.45f * cv::Vec3f(pixel));
    }
  }
  return picture;
}

cv::Mat caption(const std::string& text, int width_px) {
  cv::Mat strip(kCaption_px, width_px, CV_8UC3, cv::Scalar::all(255));
  cv::putText(strip, text, {6, 14}, cv::FONT_HERSHEY_SIMPLEX, 0.36, cv::Scalar::all(0), 1,
              cv::LINE_AA);
  return strip;
}

size_t index_nearest(const std::vector<SequenceImage>& images, Time time) {
  const auto nearest =
      std::min_element(images.begin(), images.end(), [&](const auto& a, const auto& b) {
        return std::abs((a.time - time).us) < std::abs((b.time - time).us);
      });
  return static_cast<size_t>(nearest - images.begin());
}

cv::Mat side_by_side(const std::vector<cv::Mat>& panels) {
  cv::Mat row;
  cv::hconcat(panels, row);
  return row;
}

// Draws the views of one sequence.
class Drawing {
 public:
  Drawing(const Sequence& sequence, const MeshEvaluation& evaluation, PictureOf what)
      : sequence_(sequence),
        evaluation_(evaluation),
        with_images_(what == PictureOf::kMeshAndImages),
        mesh_(evaluation.mesh, evaluation.least_confidence),
        rays_(sequence.camera, std::max(1, sequence.camera.width_px / kPanelWidth_px)),
        painter_(sequence, mesh_, evaluation.map_keyframes, rays_.step()) {}

  cv::Mat captions() const {
    std::vector<cv::Mat> strips;
    for (const char* text : kCaptions) strips.push_back(caption(text, rays_.cols()));
    return side_by_side(chosen(strips));
  }

  cv::Mat row(Time time, const Pose<Map, Cam>& map_from_cam) {
    const SeenMesh seen = mesh_.from(map_from_cam, rays_);
    const cv::Mat depth_m =
        load_depth(sequence_, sequence_.depth_images[index_nearest(sequence_.depth_images, time)]);
    cv::Mat camera, painted(seen.depth_mu.size(), CV_8UC3, kUnseen);
    cv::resize(sequence_.colour(index_nearest(sequence_.images, time)), camera, painted.size(), 0,
               0, cv::INTER_AREA);
    if (with_images_) painter_.paint(seen, rays_, map_from_cam, time - kAge, &painted);
    return side_by_side(
        chosen({camera, shade(mesh_, seen, rays_, map_from_cam), painted,
                depth_m.empty() ? cv::Mat(painted.size(), CV_8UC3, kUnseen)
                                : draw_errors(seen, rays_, depth_m, evaluation_.metres_per_mu)}));
  }

  // From above and behind the cameras, through what hides the inside; shaded and painted.
  cv::Mat outside_row() {
    const CameraModel camera = outside_camera();
    const PixelRays rays(camera, 1);
    const MeshView fronts(evaluation_.mesh, 0, MeshView::Show::kMeasuredFronts);
    const Pose<Map, Cam> map_from_cam = outside_pose();
    const SeenMesh seen = fronts.from(map_from_cam, rays);
    cv::Mat shaded = shade(fronts, seen, rays, map_from_cam), painted = 0.4 * shaded;
    draw_path(camera, map_from_cam, &shaded);
    if (!with_images_) return shaded;
    painter_.paint(seen, rays, map_from_cam, evaluation_.poses.rbegin()->first, &painted);
    draw_path(camera, map_from_cam, &painted);
    return side_by_side({shaded, painted});
  }

 private:
  std::vector<cv::Mat> chosen(const std::vector<cv::Mat>& columns) const {
    return with_images_ ? columns : std::vector{columns[1], columns[3]};
  }

  CameraModel outside_camera() const {
    CameraModel camera;
    camera.width_px = 2 * rays_.cols();
    camera.height_px = camera.width_px * 9 / 16;
    camera.fx_px = camera.fy_px = camera.width_px;
    camera.cx_px = (camera.width_px - 1) / 2.0;
    camera.cy_px = (camera.height_px - 1) / 2.0;
    camera.prepare();
    return camera;
  }

  // Looks between the points and the cameras from 40° above and 25° beside the cameras' mean
  // direction.
  Pose<Map, Cam> outside_pose() const {
    Eigen::Vector3d ahead = Eigen::Vector3d::Zero(), down = ahead, cameras = ahead;
    for (const MapKeyframe& k : evaluation_.map_keyframes) {
      cameras +=
          k.map_from_cam.translation() / static_cast<double>(evaluation_.map_keyframes.size());
      ahead += k.map_from_cam.rotation() * Eigen::Vector3d::UnitZ();
      down += k.map_from_cam.rotation() * Eigen::Vector3d::UnitY();
    }
    down.normalize();
    ahead = (ahead - ahead.dot(down) * down).normalized();
    const double above = 40 * M_PI / 180, beside = 25 * M_PI / 180;
    const Eigen::Vector3d aside = ahead.cross(down);
    const Eigen::Vector3d look =
        std::cos(above) * (std::cos(beside) * ahead + std::sin(beside) * aside) +
        std::sin(above) * down;
    const auto [middle, reach] = points_extent();
    const Eigen::Vector3d right = down.cross(look).normalized();
    Eigen::Matrix3d axes;
    axes << right, look.cross(right), look;
    return {axes, 0.75 * middle + 0.25 * cameras - 2.9 * reach * look};
  }

  // Component-wise median of the map points in the mesh, and the distance within which most are.
  std::pair<Eigen::Vector3d, double> points_extent() const {
    std::array<std::vector<double>, 3> coordinates;
    std::vector<Eigen::Vector3d> points;
    for (size_t i = 0; i < evaluation_.mesh.vertex_ids.size(); ++i) {
      if (!evaluation_.mesh.vertex_ids[i].is_point()) continue;
      points.push_back(evaluation_.mesh.vertices_in_map[i].cast<double>());
      for (int axis = 0; axis < 3; ++axis)
        coordinates[static_cast<size_t>(axis)].push_back(points.back()[axis]);
    }
    const Eigen::Vector3d middle(quantile(coordinates[0], 0.5), quantile(coordinates[1], 0.5),
                                 quantile(coordinates[2], 0.5));
    std::vector<double> distances;
    for (const Eigen::Vector3d& p : points) distances.push_back((p - middle).norm());
    return {middle, quantile(distances, 0.85)};
  }

  void draw_path(const CameraModel& camera, const Pose<Map, Cam>& map_from_cam,
                 cv::Mat* picture) const {
    const Pose<Cam, Map> cam_from_map = map_from_cam.inverse();
    for (const MapKeyframe& k : evaluation_.map_keyframes) {
      const Eigen::Vector3d p = cam_from_map * k.map_from_cam.translation();
      if (p.z() <= 0) continue;
      const Eigen::Vector2d pixel = camera.project(p);
      cv::circle(*picture, cv::Point2d(pixel.x(), pixel.y()), 2, {0, 140, 255}, cv::FILLED,
                 cv::LINE_AA);
    }
  }

  const Sequence& sequence_;
  const MeshEvaluation& evaluation_;
  bool with_images_;
  MeshView mesh_;
  PixelRays rays_;
  ViewPainter painter_;
};

}  // namespace

cv::Mat draw_mesh(const Sequence& sequence, const MeshEvaluation& evaluation, PictureOf what) {
  if (evaluation.poses.empty()) return {};
  Drawing drawing(sequence, evaluation, what);
  std::vector<cv::Mat> rows{drawing.captions()};
  for (int i = 0; i < kRows; ++i) {
    const auto view =
        std::next(evaluation.poses.begin(),
                  static_cast<std::ptrdiff_t>((2 * i + 1) * evaluation.poses.size() / (2 * kRows)));
    rows.push_back(drawing.row(view->first, view->second));
  }
  rows.push_back(
      caption("from above and behind, through the guessed and the far side; orange: keyframes",
              rows.front().cols));
  rows.push_back(drawing.outside_row());
  cv::Mat picture;
  cv::vconcat(rows, picture);
  return picture;
}

void write_mesh_picture(const Sequence& sequence, const MeshEvaluation& evaluation, PictureOf what,
                        const std::string& path) {
  const cv::Mat picture = draw_mesh(sequence, evaluation, what);
  std::vector<uint8_t> bytes;
  if (!picture.empty()) {
    cv::imencode(".jpg", picture, bytes, {cv::IMWRITE_JPEG_QUALITY, kJpegQuality});
  }
  if (bytes.empty()) throw UnavailableError(path + ": there is nothing to draw");
  write_output(path, bytes);
}

}  // namespace foresight
