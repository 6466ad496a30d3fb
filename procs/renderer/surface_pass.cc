#include "procs/renderer/surface_pass.h"

#include <algorithm>
#include <cmath>

#include "procs/renderer/shaders.h"

namespace foresight {
namespace {

/// Nearest visible depth as a share of the scene's size: rounding in the 24-bit depth buffer is
/// then z / near / 2^24, 6e-5 of the depth at the size of the scene, and there is no far plane.
constexpr double kNearShare = 1e-3;
constexpr size_t kSamples = 256;
/// "Confidence" of hull corners: no triangle with such a corner is sure anywhere.
constexpr float kHullConfidence = -1e9f;

bool is_sound(const Mesh& mesh) {
  const auto count = static_cast<int64_t>(mesh.vertices_in_map.size());
  if (mesh.vertex_ids.size() != mesh.vertices_in_map.size()) return false;
  if (mesh.confidences.size() != mesh.vertices_in_map.size()) return false;
  if (!std::all_of(mesh.confidences.begin(), mesh.confidences.end(),
                   [](float c) { return std::isfinite(c); })) {
    return false;
  }
  const auto in_range = [count](int32_t i) { return i >= 0 && i < count; };
  return std::all_of(mesh.vertices_in_map.begin(), mesh.vertices_in_map.end(),
                     [](const Eigen::Vector3f& v) { return v.allFinite(); }) &&
         std::all_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const auto& t) {
           return in_range(t[0]) && in_range(t[1]) && in_range(t[2]);
         });
}

float median(std::vector<float>* values) {
  if (values->empty()) return 0;
  const auto middle = values->begin() + static_cast<std::ptrdiff_t>(values->size() / 2);
  std::nth_element(values->begin(), middle, values->end());
  return *middle;
}

/// Measured vertices, or all of them when none is measured.
std::vector<Eigen::Vector3f> measured_vertices(const Mesh& mesh) {
  std::vector<Eigen::Vector3f> points;
  for (size_t i = 0; i < mesh.vertices_in_map.size(); ++i) {
    if (mesh.vertex_ids[i].is_point()) points.push_back(mesh.vertices_in_map[i]);
  }
  return points.empty() ? mesh.vertices_in_map : points;
}

Eigen::Matrix4d clip_from_cam(const CameraModel& camera, double near) {
  const double w = camera.width_px, h = camera.height_px;
  Eigen::Matrix4d m = Eigen::Matrix4d::Zero();
  m.row(0) << 2 * camera.fx_px / w, 0, 2 * (camera.cx_px + 0.5) / w - 1, 0;
  m.row(1) << 0, 2 * camera.fy_px / h, 2 * (camera.cy_px + 0.5) / h - 1, 0;
  m.row(2) << 0, 0, 1, -2 * near;
  m.row(3) << 0, 0, 1, 0;
  return m;
}

}  // namespace

SurfacePass::SurfacePass()
    : program_(make_program("surface", surface_vertex_shader(), surface_fragment_shader())),
      clip_from_map_at_(glGetUniformLocation(program_.name(), "clip_from_map")),
      focal_at_(glGetUniformLocation(program_.name(), "focal_px")),
      least_confidence_at_(glGetUniformLocation(program_.name(), "least_confidence")),
      layout_(make_vertex_array()),
      vertices_(make_buffer()),
      indices_(make_buffer()) {
  glBindVertexArray(layout_.name());
  glBindBuffer(GL_ARRAY_BUFFER, vertices_.name());
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_.name());
  glEnableVertexAttribArray(0);
  glVertexAttribPointer(0, 4, GL_FLOAT, GL_FALSE, 0, nullptr);
  glBindVertexArray(0);
}

bool SurfacePass::set_mesh(const Mesh& mesh) {
  if (!is_sound(mesh)) return false;
  measure(mesh);
  triangles_ = scene_size_mu_ > 0 ? static_cast<int>(mesh.triangles.size()) : 0;
  std::vector<Eigen::Vector4f> vertices(mesh.vertices_in_map.size());
  for (size_t i = 0; i < vertices.size(); ++i) {
    vertices[i] << mesh.vertices_in_map[i],
        mesh.vertex_ids[i].is_point() ? mesh.confidences[i] : kHullConfidence;
  }
  glBindVertexArray(layout_.name());
  glBindBuffer(GL_ARRAY_BUFFER, vertices_.name());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices.size() * sizeof(vertices[0])),
               vertices.data(), GL_STATIC_DRAW);
  glBufferData(GL_ELEMENT_ARRAY_BUFFER,
               static_cast<GLsizeiptr>(mesh.triangles.size() * sizeof(mesh.triangles[0])),
               mesh.triangles.data(), GL_STATIC_DRAW);
  glBindVertexArray(0);
  return true;
}

void SurfacePass::measure(const Mesh& mesh) {
  const std::vector<Eigen::Vector3f> points = measured_vertices(mesh);
  Eigen::Vector3f middle = Eigen::Vector3f::Zero();
  std::vector<float> values(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(points.begin(), points.end(), values.begin(),
                   [axis](const Eigen::Vector3f& p) { return p[axis]; });
    middle[axis] = median(&values);
  }
  std::transform(points.begin(), points.end(), values.begin(),
                 [&middle](const Eigen::Vector3f& p) { return (p - middle).norm(); });
  const double size = median(&values);
  scene_size_mu_ = std::isfinite(size) ? size : 0;

  samples_in_map_.clear();
  const size_t step = points.size() / kSamples + 1;
  for (size_t i = 0; i < points.size(); i += step) samples_in_map_.push_back(points[i]);
}

void SurfacePass::draw(const CameraModel& camera, const Pose<Cam, Map>& cam_from_map,
                       double least_confidence) {
  glViewport(0, 0, camera.width_px, camera.height_px);
  glDisable(GL_BLEND);
  glDisable(GL_CULL_FACE);
  glDisable(GL_SCISSOR_TEST);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glDepthMask(GL_TRUE);
  glClearColor(0, 0, 0, 0);
  glClearDepth(1);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  const Eigen::Matrix4f clip_from_map =
      (clip_from_cam(camera, kNearShare * scene_size_mu_) * cam_from_map.matrix()).cast<float>();
  glUseProgram(program_.name());
  glUniformMatrix4fv(clip_from_map_at_, 1, GL_FALSE, clip_from_map.data());
  glUniform2f(focal_at_, static_cast<float>(camera.fx_px), static_cast<float>(camera.fy_px));
  glUniform1f(least_confidence_at_, static_cast<float>(least_confidence));
  glBindVertexArray(layout_.name());
  glDrawElements(GL_TRIANGLES, 3 * triangles_, GL_UNSIGNED_INT, nullptr);
  glBindVertexArray(0);
  glDisable(GL_DEPTH_TEST);
}

}  // namespace foresight
