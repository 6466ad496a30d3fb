#include "bench/mesh_eval/mesh_view.h"

#include <algorithm>

namespace foresight {
namespace {

constexpr float kTouching = 0.98f;  // share of the way that has to be free
constexpr float kStepOver = 1e-4f;  // share of the way behind a back that is looked through

bool is_measured(const Mesh& mesh, const std::array<int32_t, 3>& triangle,
                 double least_confidence) {
  return std::all_of(triangle.begin(), triangle.end(), [&](int32_t vertex) {
    const auto v = static_cast<size_t>(vertex);
    return mesh.vertex_ids[v].is_point() &&
           static_cast<double>(mesh.confidences[v]) >= least_confidence;
  });
}

Mesh shown(Mesh mesh, double least_confidence, MeshView::Show show) {
  if (show == MeshView::Show::kMeasuredFronts) {
    std::erase_if(mesh.triangles,
                  [&](const auto& t) { return !is_measured(mesh, t, least_confidence); });
  }
  return mesh;
}

}  // namespace

PixelRays::PixelRays(const CameraModel& camera, int step)
    : step_(step),
      rows_((camera.height_px + step - 1) / step),
      cols_((camera.width_px + step - 1) / step) {
  for (int row = 0; row < rows_; ++row) {
    for (int col = 0; col < cols_; ++col) {
      const Eigen::Vector2d xy = camera.unproject({col * step, row * step});
      rays_in_cam_.push_back(xy.homogeneous().cast<float>());
    }
  }
}

MeshView::MeshView(Mesh mesh, double least_confidence, Show show)
    : least_confidence_(least_confidence),
      mesh_(shown(std::move(mesh), least_confidence, show)),
      show_(show),
      tracer_(mesh_.vertices_in_map, mesh_.triangles) {}

SeenMesh MeshView::from(const Pose<Map, Cam>& map_from_cam, const PixelRays& rays) const {
  const Eigen::Matrix3f rotation = map_from_cam.rotation().toRotationMatrix().cast<float>();
  const Eigen::Vector3f centre = map_from_cam.translation().cast<float>();
  const cv::Size size(rays.cols(), rays.rows());
  SeenMesh seen{cv::Mat::zeros(size, CV_32F), cv::Mat::zeros(size, CV_8U),
                cv::Mat(size, CV_32S, cv::Scalar(-1))};
  for (int row = 0; row < rays.rows(); ++row) {
    for (int col = 0; col < rays.cols(); ++col) {
      const auto hit = nearest(centre, rotation * rays.ray_in_cam(row, col));
      if (!hit) continue;
      seen.depth_mu.at<float>(row, col) = hit->distance;
      seen.surface.at<uint8_t>(row, col) = static_cast<uint8_t>(surface(hit->triangle));
      seen.triangle.at<int>(row, col) = hit->triangle;
    }
  }
  return seen;
}

bool MeshView::is_free(const Eigen::Vector3f& from_in_map, const Eigen::Vector3f& to_in_map) const {
  const auto hit = nearest(from_in_map, to_in_map - from_in_map);
  return !hit || hit->distance >= kTouching;
}

Eigen::Vector3f MeshView::normal_in_map(int triangle) const {
  const auto& t = mesh_.triangles[static_cast<size_t>(triangle)];
  const auto corner = [&](size_t k) { return mesh_.vertices_in_map[static_cast<size_t>(t[k])]; };
  return (corner(1) - corner(0)).cross(corner(2) - corner(0)).normalized();
}

Surface MeshView::surface(int triangle) const {
  const auto& corners = mesh_.triangles[static_cast<size_t>(triangle)];
  const bool measured = is_measured(mesh_, corners, least_confidence_);
  return measured ? Surface::kMeasured : Surface::kGuessed;
}

std::optional<sim::RayHit> MeshView::nearest(const Eigen::Vector3f& from_in_map,
                                             const Eigen::Vector3f& direction) const {
  float passed = 0;
  while (true) {
    auto hit = tracer_.nearest(from_in_map + passed * direction, direction);
    if (!hit) return std::nullopt;
    hit->distance += passed;
    if (show_ == Show::kAll || normal_in_map(hit->triangle).dot(direction) < 0) return hit;
    passed = hit->distance * (1 + kStepOver) + 1e-6f;
  }
}

}  // namespace foresight
