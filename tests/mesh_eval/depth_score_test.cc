// The score itself: meshes and depth images whose shares are known exactly.
#include "bench/mesh_eval/depth_score.h"

#include <gtest/gtest.h>

namespace foresight {
namespace {

constexpr int kWidth_px = 64, kHeight_px = 48;
constexpr double kMetresPerMu = 0.5;

CameraModel make_camera() {
  CameraModel camera;
  camera.width_px = kWidth_px;
  camera.height_px = kHeight_px;
  camera.fx_px = camera.fy_px = 50;
  camera.cx_px = (kWidth_px - 1) / 2.0;
  camera.cy_px = (kHeight_px - 1) / 2.0;
  camera.prepare();
  return camera;
}

// Two triangles at a depth that reach from one column's left border to another's, and beyond the
// picture above and below; they face the camera.
void add_wall(float depth_mu, double from_px, double to_px, int32_t id, Mesh* mesh) {
  const CameraModel camera = make_camera();
  const auto first = static_cast<int32_t>(mesh->vertices_in_map.size());
  for (const double v : {-10.0, kHeight_px + 10.0}) {
    for (const double u : {from_px - 0.5, to_px - 0.5}) {
      const Eigen::Vector2d xy = camera.unproject({u, v});
      mesh->vertices_in_map.push_back(depth_mu * xy.homogeneous().cast<float>());
      mesh->vertex_ids.emplace_back(id);
      mesh->confidences.push_back(0.5f);
    }
  }
  mesh->triangles.push_back({first, first + 2, first + 1});
  mesh->triangles.push_back({first + 1, first + 2, first + 3});
}

DepthScore score(const Mesh& mesh, const cv::Mat& depth_m, int step = 1) {
  const PixelRays rays(make_camera(), step);
  DepthScorer scorer;
  scorer.add(MeshView(mesh).from({}, rays), rays, depth_m, kMetresPerMu);
  return scorer.score();
}

cv::Mat depth_image(double depth_m) { return {kHeight_px, kWidth_px, CV_32F, cv::Scalar(depth_m)}; }

TEST(DepthScore, OfAPlaneWhereItIs) {
  Mesh plane;
  add_wall(4, -10, kWidth_px + 10, 7, &plane);
  const DepthScore s = score(plane, depth_image(2));
  EXPECT_EQ(s.images, 1);
  EXPECT_EQ(s.pixels, kWidth_px * kHeight_px);
  EXPECT_EQ(s.measured_share, 1);
  EXPECT_EQ(s.within_5_percent, 1);
  EXPECT_EQ(s.right_share(), 1);
  EXPECT_NEAR(s.median_error_percent, 0, 1e-4);
}

TEST(DepthScore, SaysWhichSideOfTheTruth) {
  Mesh plane;
  add_wall(4, -10, kWidth_px + 10, 7, &plane);
  cv::Mat depth_m = depth_image(2);          // right: 24 columns
  depth_m.colRange(0, 8).setTo(2 / 1.07);    // the mesh is 7 % too far
  depth_m.colRange(8, 24).setTo(2 / 0.8);    // 20 % too near
  depth_m.colRange(24, 40).setTo(2 / 1.25);  // 25 % too far
  const DepthScore s = score(plane, depth_m);
  EXPECT_DOUBLE_EQ(s.within_5_percent, 24. / 64);
  EXPECT_DOUBLE_EQ(s.within_10_percent, 32. / 64);
  EXPECT_DOUBLE_EQ(s.in_front_10_percent, 16. / 64);
  EXPECT_DOUBLE_EQ(s.behind_10_percent, 16. / 64);
  EXPECT_NEAR(s.median_error_percent, 20, 1e-3);
}

TEST(DepthScore, CountsOnlyMeasuredPixels) {
  Mesh plane;
  add_wall(4, -10, kWidth_px + 10, 7, &plane);
  cv::Mat depth_m = depth_image(2);
  depth_m.colRange(0, 16).setTo(0);
  EXPECT_EQ(score(plane, depth_m).pixels, (kWidth_px - 16) * kHeight_px);
  EXPECT_EQ(score(plane, depth_m, 2).pixels, (kWidth_px - 16) / 2 * kHeight_px / 2);
  EXPECT_EQ(score(plane, depth_image(0)).pixels, 0);
}

TEST(DepthScore, KeepsGuessesAndGapsApart) {
  Mesh mesh;
  add_wall(4, 0, 32, 7, &mesh);
  add_wall(5, 32, 48, -1, &mesh);  // touches the hull; beyond it there is nothing
  const DepthScore s = score(mesh, depth_image(2));
  EXPECT_DOUBLE_EQ(s.measured_share, 0.5);
  EXPECT_DOUBLE_EQ(s.guessed_share, 0.25);
  EXPECT_DOUBLE_EQ(s.open_share, 0.25);
  EXPECT_DOUBLE_EQ(s.within_5_percent, 1);  // of the measured
  EXPECT_DOUBLE_EQ(s.right_share(), 0.5);
}

TEST(DepthScore, AFloaterHidesWhatIsBehindIt) {
  Mesh mesh;
  add_wall(4, -10, kWidth_px + 10, 7, &mesh);
  add_wall(1, 10, 26, 9, &mesh);
  const DepthScore s = score(mesh, depth_image(2));
  EXPECT_DOUBLE_EQ(s.in_front_10_percent, 16. / 64);
  EXPECT_DOUBLE_EQ(s.within_5_percent, 48. / 64);
}

TEST(DepthScore, AddsImagesUp) {
  Mesh plane;
  add_wall(4, -10, kWidth_px + 10, 7, &plane);
  const PixelRays rays(make_camera(), 1);
  const MeshView view(plane);
  DepthScorer scorer;
  // 2 mu nearer: 1 m of depth is left.
  const Pose<Map, Cam> nearer(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 2));
  scorer.add(view.from({}, rays), rays, depth_image(2), kMetresPerMu);
  scorer.add(view.from(nearer, rays), rays, depth_image(2), kMetresPerMu);
  EXPECT_EQ(scorer.score().images, 2);
  EXPECT_EQ(scorer.score().within_5_percent, 0.5);
  EXPECT_EQ(scorer.score().in_front_10_percent, 0.5);
}

TEST(DepthScore, OfNothingIsNothing) {
  const DepthScore s = DepthScorer().score();
  EXPECT_EQ(s.pixels, 0);
  EXPECT_EQ(s.right_share(), 0);
  EXPECT_EQ(score(Mesh{}, depth_image(2)).open_share, 1);
}

TEST(MeshView, LooksThroughBacksAndGuesses) {
  Mesh mesh;
  add_wall(4, -10, kWidth_px + 10, 7, &mesh);
  add_wall(2, -10, kWidth_px + 10, -1, &mesh);
  Mesh turned;  // seen from its back
  add_wall(1, -10, kWidth_px + 10, 7, &turned);
  for (auto& t : turned.triangles) std::swap(t[0], t[1]);
  for (const auto& t : turned.triangles) mesh.triangles.push_back({t[0] + 8, t[1] + 8, t[2] + 8});
  mesh.vertices_in_map.insert(mesh.vertices_in_map.end(), turned.vertices_in_map.begin(),
                              turned.vertices_in_map.end());
  mesh.vertex_ids.insert(mesh.vertex_ids.end(), 4, VertexId(7));
  mesh.confidences.insert(mesh.confidences.end(), 4, 0.5f);
  const PixelRays rays(make_camera(), 8);
  const auto depth_in_the_middle = [&](MeshView::Show show) {
    return MeshView(mesh, 0, show).from({}, rays).depth_mu.at<float>(3, 4);
  };
  EXPECT_NEAR(depth_in_the_middle(MeshView::Show::kAll), 1, 1e-5);
  EXPECT_NEAR(depth_in_the_middle(MeshView::Show::kMeasuredFronts), 4, 1e-5);
}

TEST(MeshView, WhatIsUnsureIsGuessed) {
  Mesh wall;  // of confidence 0.5
  add_wall(2, -10, kWidth_px + 10, 7, &wall);
  const PixelRays rays(make_camera(), 8);
  const auto surface = [&](double least_confidence) {
    return MeshView(wall, least_confidence).from({}, rays).surface.at<uint8_t>(3, 4);
  };
  EXPECT_EQ(surface(0.5), static_cast<uint8_t>(Surface::kMeasured));
  EXPECT_EQ(surface(0.6), static_cast<uint8_t>(Surface::kGuessed));
}

TEST(MeshView, KnowsWhatIsHidden) {
  Mesh plane;
  add_wall(4, -10, kWidth_px + 10, 7, &plane);
  const MeshView view(plane);
  const Eigen::Vector3f camera = Eigen::Vector3f::Zero();
  EXPECT_TRUE(view.is_free(camera, {0, 0, 3}));
  EXPECT_TRUE(view.is_free(camera, {0, 0, 4}));  // on it
  EXPECT_FALSE(view.is_free(camera, {0, 0, 5}));
}

}  // namespace
}  // namespace foresight
