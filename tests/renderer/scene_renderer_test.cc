#include "procs/renderer/scene_renderer.h"

#include <cmath>
#include <limits>

#include "tests/renderer/test_scene.h"

namespace foresight {
namespace {

using SceneRendererTest = RendererTest;

RenderedFrame draw(SceneRenderer* renderer, const CameraModel& camera, const Pose<Map, Cam>& pose,
                   const RenderOptions& options = {}) {
  EXPECT_EQ(renderer->render(camera, pose, options).status, RenderStatus::kDrawn);
  return renderer->read_back();
}

TEST_F(SceneRendererTest, SamePoseGivesTheImageBack) {
  const TestScene scene;
  const CameraModel camera = pinhole_camera();
  const auto pose = scene.pose(0.3, -0.2, 0, 0.2);
  SceneRenderer renderer;
  ASSERT_EQ(renderer.set_mesh(scene.mesh()), InputStatus::kAccepted);
  ASSERT_EQ(renderer.add_view(scene.view(1, camera, scene.pose(-1, 0, 0))), InputStatus::kAccepted);
  ASSERT_EQ(renderer.add_view(scene.view(2, camera, pose)), InputStatus::kAccepted);
  const RenderedFrame frame = draw(&renderer, camera, pose);
  save_picture(frame.rgb, "same_pose");
  EXPECT_GT(psnr_db(frame.rgb, scene.image(camera, pose)), 45);
  EXPECT_EQ(count_sources(frame.source).newest, 1.0);
}

TEST_F(SceneRendererTest, SamePoseHoldsForGrazingSurfacesAndAnyMesh) {
  const TestScene scene;
  const CameraModel camera = pinhole_camera();
  const auto pose = scene.pose(2.9, 1.9, -1, -0.1);  // close to a wall and the floor
  for (const int cells : {1, 3, 40}) {
    SceneRenderer renderer;
    ASSERT_EQ(renderer.set_mesh(scene.mesh(cells)), InputStatus::kAccepted);
    ASSERT_EQ(renderer.add_view(scene.view(1, camera, scene.pose(0, 0, 0))),
              InputStatus::kAccepted);
    ASSERT_EQ(renderer.add_view(scene.view(2, camera, pose)), InputStatus::kAccepted);
    const RenderedFrame frame = draw(&renderer, camera, pose);
    EXPECT_GT(psnr_db(frame.rgb, scene.image(camera, pose)), 45) << cells;
    EXPECT_EQ(count_sources(frame.source).newest, 1.0) << cells;
  }
}

TEST_F(SceneRendererTest, MovedPoseShowsTheTrueParallax) {
  const TestScene scene;
  const CameraModel camera = pinhole_camera();
  const auto from = scene.pose(0, 0, 0), to = scene.pose(0.25, 0.1, 0.2, 0.05);
  SceneRenderer renderer;
  ASSERT_EQ(renderer.set_mesh(scene.mesh()), InputStatus::kAccepted);
  ASSERT_EQ(renderer.add_view(scene.view(1, camera, from)), InputStatus::kAccepted);
  const RenderedFrame frame = draw(&renderer, camera, to);
  const Image truth = scene.image(camera, to);
  save_picture(frame.rgb, "moved");
  save_picture(truth, "moved_truth");
  save_picture(colour_sources(frame), "moved_sources");
  const auto painted = [&frame](int u, int v) {
    return source_rank(frame.source[static_cast<size_t>(v) * frame.rgb.width_px + u]) == 0;
  };
  EXPECT_GT(psnr_db(frame.rgb, truth, painted), 30);
  EXPECT_GT(count_sources(frame.source).newest, 0.85);
  EXPECT_LT(psnr_db(scene.image(camera, from), truth), 22);  // the delayed image is far off
}

/// The edge of the box moves by f·b/z.
TEST_F(SceneRendererTest, ShiftMovesAnEdgeByTheAnalyticAmount) {
  const TestScene scene;
  const CameraModel camera = pinhole_camera();
  SceneRenderer renderer;
  ASSERT_EQ(renderer.set_mesh(scene.mesh()), InputStatus::kAccepted);
  ASSERT_EQ(renderer.add_view(scene.view(1, camera, scene.pose(0, 0, 0))), InputStatus::kAccepted);
  const int row = 118;
  for (const double shift : {-0.3, -0.1, 0.1, 0.3}) {
    const RenderedFrame frame = draw(&renderer, camera, scene.pose(shift, 0, 0));
    int left = 0;
    while (left < 319 && !is_box_red(pixel_at(frame.rgb, left, row))) ++left;
    const double expected = camera.cx_px + camera.fx_px * (-0.5 - shift) / 2.0;
    EXPECT_NEAR(left, expected + 0.5, 1.01) << shift;
  }
}

TEST_F(SceneRendererTest, DepthIsTrue) {
  const TestScene scene;
  const CameraModel camera = pinhole_camera();
  const auto pose = scene.pose(0.4, 0.1, 0.3, 0.1);
  SceneRenderer renderer;
  ASSERT_EQ(renderer.set_mesh(scene.mesh()), InputStatus::kAccepted);
  const RenderedFrame frame = draw(&renderer, camera, pose);
  for (const auto& [u, v] : {std::pair{20, 30}, {160, 120}, {300, 200}, {5, 235}}) {
    const double truth = scene.depth(camera, pose, {double(u), double(v)});
    EXPECT_NEAR(frame.depth_mu[static_cast<size_t>(v) * 320 + u] / truth, 1, 1e-3);
  }
}

TEST_F(SceneRendererTest, DistortedImagesPaintAnUndistortedPicture) {
  const TestScene scene;
  for (const CameraModel& camera : {radtan_camera(), fisheye_camera()}) {
    const CameraModel output = camera.undistorted();
    const auto from = scene.pose(0, 0, 0), to = scene.pose(0.15, 0.05, 0.1);
    SceneRenderer renderer;
    ASSERT_EQ(renderer.set_mesh(scene.mesh()), InputStatus::kAccepted);
    ASSERT_EQ(renderer.add_view(scene.view(1, camera, from)), InputStatus::kAccepted);
    RenderedFrame frame = draw(&renderer, output, from);
    const auto painted = [&frame](int u, int v) {
      return source_rank(frame.source[static_cast<size_t>(v) * frame.rgb.width_px + u]) == 0;
    };
    EXPECT_GT(psnr_db(frame.rgb, scene.image(output, from), painted), 30);
    EXPECT_GT(count_sources(frame.source).newest, 0.97);
    frame = draw(&renderer, output, to);
    EXPECT_GT(psnr_db(frame.rgb, scene.image(output, to), painted), 28);
    EXPECT_GT(count_sources(frame.source).newest, 0.85);
    save_picture(frame.rgb, camera.lens == LensModel::kRadtan ? "moved_radtan" : "moved_fisheye");
  }
}

TEST_F(SceneRendererTest, MapScaleDoesNotMatter) {
  const CameraModel camera = pinhole_camera();
  const auto draw_at = [&camera](double scale) {
    const TestScene scene{scale};
    SceneRenderer renderer;
    EXPECT_EQ(renderer.set_mesh(scene.mesh()), InputStatus::kAccepted);
    EXPECT_EQ(renderer.add_view(scene.view(1, camera, scene.pose(-0.8, 0, 0))),
              InputStatus::kAccepted);
    EXPECT_EQ(renderer.add_view(scene.view(2, camera, scene.pose(0, 0, 0))),
              InputStatus::kAccepted);
    return draw(&renderer, camera, scene.pose(0.3, 0.1, 0.2));
  };
  const RenderedFrame reference = draw_at(1);
  for (const double scale : {1e-3, 1e3}) {
    const RenderedFrame frame = draw_at(scale);
    EXPECT_GT(psnr_db(frame.rgb, reference.rgb), 35) << scale;
    int different = 0;
    for (size_t i = 0; i < frame.source.size(); ++i) {
      different += frame.source[i] != reference.source[i] ? 1 : 0;
    }
    EXPECT_LT(different, 100) << scale;  // rounding at edges, of 76 800 pixels
  }
}

TEST_F(SceneRendererTest, WithoutMeshTheImageIsTurned) {
  TestScene scene;
  scene.with_box = false;
  const CameraModel camera = pinhole_camera();
  SceneRenderer renderer;
  ASSERT_EQ(renderer.set_mesh(Mesh{}), InputStatus::kAccepted);
  ASSERT_EQ(renderer.add_view(scene.view(1, camera, scene.pose(0, 0, 0))), InputStatus::kAccepted);
  const RenderedFrame frame = draw(&renderer, camera, scene.pose(0, 0, 0, 0.2));
  save_picture(frame.rgb, "no_mesh_turned");
  const auto painted = [&frame](int u, int v) {
    return source_rank(frame.source[static_cast<size_t>(v) * 320 + u]) == 0;
  };
  EXPECT_GT(psnr_db(frame.rgb, scene.image(camera, scene.pose(0, 0, 0, 0.2)), painted), 30);
  const SourceShares shares = count_sources(frame.source);
  EXPECT_EQ(shares.newest, 0);  // all of it is marked as a guess
  EXPECT_GT(shares.guess, 0.7);
  EXPECT_TRUE(std::isinf(frame.depth_mu[1000]));
  RenderOptions honest;
  honest.paint_background = false;
  EXPECT_EQ(count_sources(draw(&renderer, camera, scene.pose(0, 0, 0), honest).source).unknown, 1);
}

TEST_F(SceneRendererTest, NothingAtAllIsUnknown) {
  SceneRenderer renderer;
  const RenderedFrame frame = draw(&renderer, pinhole_camera(), {});
  EXPECT_EQ(count_sources(frame.source).unknown, 1.0);
}

TEST_F(SceneRendererTest, HullIsAGuessThatCanBeLeftUnpainted) {
  const TestScene scene;
  const CameraModel camera = pinhole_camera();
  Mesh mesh = scene.mesh();
  for (size_t i = 0; i < mesh.vertex_ids.size(); ++i) {  // the far wall
    if (mesh.vertices_in_map[i].z() > 4.9f) mesh.vertex_ids[i] = VertexId::hull_corner(0);
  }
  SceneRenderer renderer;
  ASSERT_EQ(renderer.set_mesh(mesh), InputStatus::kAccepted);
  ASSERT_EQ(renderer.add_view(scene.view(1, camera, scene.pose(0, 0, 0))), InputStatus::kAccepted);
  const size_t far_wall = 30 * 320 + 160, box = 120 * 320 + 160;
  RenderedFrame frame = draw(&renderer, camera, scene.pose(0, 0, 0));
  EXPECT_EQ(frame.source[far_wall], kSourceNewest | kSourceGuessBit);
  EXPECT_EQ(frame.source[box], kSourceNewest);
  RenderOptions honest;
  honest.paint_hull = false;
  frame = draw(&renderer, camera, scene.pose(0, 0, 0), honest);
  EXPECT_EQ(frame.source[far_wall], kSourceUnknown);
  EXPECT_EQ(frame.source[box], kSourceNewest);
}

TEST_F(SceneRendererTest, WhatIsUnsureIsAGuess) {
  const TestScene scene;
  const CameraModel camera = pinhole_camera();
  Mesh mesh = scene.mesh();
  for (size_t i = 0; i < mesh.confidences.size(); ++i) {  // the far wall
    if (mesh.vertices_in_map[i].z() > 4.9f) mesh.confidences[i] = 0.4f;
  }
  SceneRenderer renderer;
  ASSERT_EQ(renderer.set_mesh(mesh), InputStatus::kAccepted);
  ASSERT_EQ(renderer.add_view(scene.view(1, camera, scene.pose(0, 0, 0))), InputStatus::kAccepted);
  const size_t far_wall = 30 * 320 + 160, box = 120 * 320 + 160;
  RenderOptions options;
  options.least_confidence = 0.5;
  RenderedFrame frame = draw(&renderer, camera, scene.pose(0, 0, 0), options);
  EXPECT_EQ(frame.source[far_wall], kSourceNewest | kSourceGuessBit);
  EXPECT_EQ(frame.source[box], kSourceNewest);
  options.least_confidence = 0.3;
  frame = draw(&renderer, camera, scene.pose(0, 0, 0), options);
  EXPECT_EQ(frame.source[far_wall], kSourceNewest);
}

TEST_F(SceneRendererTest, BadInputIsRejected) {
  const TestScene scene;
  const CameraModel camera = pinhole_camera();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Pose<Map, Cam> lost(Eigen::Quaterniond::Identity(), Eigen::Vector3d(nan, 0, 0));
  SceneRenderer renderer;
  TexturingView view = scene.view(1, camera, scene.pose(0, 0, 0));
  view.map_from_cam = lost;
  EXPECT_EQ(renderer.add_view(view), InputStatus::kBadPose);
  view = scene.view(1, camera, scene.pose(0, 0, 0));
  view.image.bytes.clear();
  EXPECT_EQ(renderer.add_view(view), InputStatus::kBadImage);
  view.image = {};
  EXPECT_EQ(renderer.add_view(view), InputStatus::kBadImage);
  view = scene.view(1, camera, scene.pose(0, 0, 0));
  view.camera.fx_px = nan;
  EXPECT_EQ(renderer.add_view(view), InputStatus::kBadCamera);
  EXPECT_EQ(renderer.stored_views(), 0);
  EXPECT_EQ(renderer.render(camera, lost).status, RenderStatus::kBadPose);
  EXPECT_EQ(renderer.render(CameraModel{}, {}).status, RenderStatus::kBadCamera);
  EXPECT_EQ(renderer.render(radtan_camera(), {}).status, RenderStatus::kBadCamera);
}

TEST_F(SceneRendererTest, BadMeshIsRejectedAndTheOldOneStays) {
  const TestScene scene;
  SceneRenderer renderer;
  ASSERT_EQ(renderer.set_mesh(scene.mesh()), InputStatus::kAccepted);
  const int triangles = renderer.triangles();
  Mesh mesh = scene.mesh();
  mesh.triangles[3][1] = 1 << 30;
  EXPECT_EQ(renderer.set_mesh(mesh), InputStatus::kBadMesh);
  mesh.triangles[3][1] = -1;
  EXPECT_EQ(renderer.set_mesh(mesh), InputStatus::kBadMesh);
  mesh = scene.mesh();
  mesh.vertices_in_map[5].x() = std::numeric_limits<float>::infinity();
  EXPECT_EQ(renderer.set_mesh(mesh), InputStatus::kBadMesh);
  mesh = scene.mesh();
  mesh.vertex_ids.pop_back();
  EXPECT_EQ(renderer.set_mesh(mesh), InputStatus::kBadMesh);
  mesh = scene.mesh();
  mesh.confidences.pop_back();
  EXPECT_EQ(renderer.set_mesh(mesh), InputStatus::kBadMesh);
  mesh = scene.mesh();
  mesh.confidences[5] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(renderer.set_mesh(mesh), InputStatus::kBadMesh);
  EXPECT_EQ(renderer.triangles(), triangles);
  mesh = scene.mesh();
  for (auto& vertex : mesh.vertices_in_map) vertex.setOnes();  // all in one point
  EXPECT_EQ(renderer.set_mesh(mesh), InputStatus::kAccepted);
  EXPECT_EQ(renderer.render(pinhole_camera(), {}).status, RenderStatus::kDrawn);
}

TEST_F(SceneRendererTest, GrayImagesWork) {
  const TestScene scene;
  const CameraModel camera = pinhole_camera();
  TexturingView view = scene.view(1, camera, scene.pose(0, 0, 0));
  view.image = Image{320, 240, 1, std::vector<uint8_t>(320 * 240, 77)};
  SceneRenderer renderer;
  ASSERT_EQ(renderer.set_mesh(scene.mesh()), InputStatus::kAccepted);
  ASSERT_EQ(renderer.add_view(view), InputStatus::kAccepted);
  const RenderedFrame frame = draw(&renderer, camera, scene.pose(0, 0, 0));
  EXPECT_EQ(pixel_at(frame.rgb, 100, 100), (Rgb{77, 77, 77}));
}

TEST_F(SceneRendererTest, OutputSizeAndCameraMayChangeBetweenFrames) {
  const TestScene scene;
  SceneRenderer renderer;
  ASSERT_EQ(renderer.set_mesh(scene.mesh()), InputStatus::kAccepted);
  ASSERT_EQ(renderer.add_view(scene.view(1, pinhole_camera(), scene.pose(0, 0, 0))),
            InputStatus::kAccepted);
  for (const double factor : {0.5, 1.5, 1.0}) {
    const CameraModel output = pinhole_camera().scaled(factor);
    const RenderedFrame frame = draw(&renderer, output, scene.pose(0, 0, 0));
    EXPECT_EQ(frame.rgb.width_px, output.width_px);
    EXPECT_GT(psnr_db(frame.rgb, scene.image(output, scene.pose(0, 0, 0))), 30) << factor;
  }
  ASSERT_EQ(renderer.add_view(scene.view(2, fisheye_camera(), scene.pose(0, 0, 0))),
            InputStatus::kAccepted);
  EXPECT_EQ(renderer.stored_views(), 1);  // another lens drops what was there
  EXPECT_EQ(renderer.render(pinhole_camera(), scene.pose(0, 0, 0)).view_ids,
            (std::vector<int64_t>{2}));
}

TEST_F(SceneRendererTest, DepthMapsAreDrawnOncePerViewAndMesh) {
  const TestScene scene;
  const CameraModel camera = pinhole_camera();
  SceneRenderer renderer;
  ASSERT_EQ(renderer.set_mesh(scene.mesh()), InputStatus::kAccepted);
  for (int id = 1; id <= 3; ++id) {
    ASSERT_EQ(renderer.add_view(scene.view(id, camera, scene.pose(0.4 * id, 0, 0))),
              InputStatus::kAccepted);
  }
  EXPECT_EQ(renderer.render(camera, scene.pose(0, 0, 0)).depth_maps_drawn, 3);
  EXPECT_EQ(renderer.render(camera, scene.pose(0.1, 0, 0)).depth_maps_drawn, 0);
  ASSERT_EQ(renderer.add_view(scene.view(2, camera, scene.pose(0.81, 0, 0))),
            InputStatus::kAccepted);
  EXPECT_EQ(renderer.render(camera, scene.pose(0.1, 0, 0)).depth_maps_drawn, 1);
  ASSERT_EQ(renderer.set_mesh(scene.mesh(5)), InputStatus::kAccepted);
  EXPECT_EQ(renderer.render(camera, scene.pose(0.1, 0, 0)).depth_maps_drawn, 3);
}

TEST_F(SceneRendererTest, SameInputGivesTheSameBytes) {
  const TestScene scene;
  const CameraModel camera = pinhole_camera();
  const auto draw_once = [&] {
    SceneRenderer renderer;
    EXPECT_EQ(renderer.set_mesh(scene.mesh()), InputStatus::kAccepted);
    for (int id = 1; id <= 8; ++id) {
      EXPECT_EQ(renderer.add_view(scene.view(id, camera, scene.pose(0.2 * id, 0, 0))),
                InputStatus::kAccepted);
    }
    return draw(&renderer, camera, scene.pose(-0.2, 0.3, 0.1));
  };
  const RenderedFrame a = draw_once(), b = draw_once();
  EXPECT_EQ(a.rgb.bytes, b.rgb.bytes);
  EXPECT_EQ(a.source, b.source);
}

}  // namespace
}  // namespace foresight
