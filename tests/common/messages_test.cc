#include "common/messages.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/robot_messages.h"
#include "tests/common/plain_ids.h"

namespace foresight {
namespace {

MapDelta random_map_delta(int size, uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  MapDelta delta;
  for (int i = 0; i < size; ++i) {
    delta.observations_removed.push_back({KeyframeId(i), PointId(2 * i)});
    delta.points_removed.emplace_back(3 * i);
    delta.keyframes_removed.emplace_back(5 * i);
    delta.keyframes_set.push_back(
        {KeyframeId(i),
         {Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random)),
          Eigen::Vector3d(normal(random), normal(random), normal(random))},
         {1000 + i}});
    delta.points_set.push_back(
        {PointId(i), Eigen::Vector3f::Random(), 0.01f * static_cast<float>(i)});
    delta.observations_added.push_back({KeyframeId(i), PointId(7 * i)});
  }
  return delta;
}

CarvingDelta random_carving_delta(int size) {
  CarvingDelta delta;
  for (int i = 0; i < size; ++i) {
    delta.cells_removed.emplace_back(i);
    delta.vertices_removed.emplace_back(-i);
    delta.vertices_set.push_back(
        {VertexId(i - 8), Eigen::Vector3f::Random(), {i, 0.01f * static_cast<float>(i % 300)}});
    delta.vertices_updated.push_back({VertexId(i), {2 * i, 0.02f * static_cast<float>(i % 100)}});
    delta.cells_added.push_back(carving_cell(i, {-8, i, i + 1, i + 2}, i % 3));
    delta.cells_added.back().votes = {{i, 1, 2, 3}, i % 5, i % 7};
    delta.cells_updated.push_back({CellId(i), 2 * i, {{3, 2, 1, i}, i % 11, i % 13}});
  }
  return delta;
}

void expect_equal(const MapDelta& a, const MapDelta& b) {
  EXPECT_EQ(a.observations_removed, b.observations_removed);
  EXPECT_EQ(a.points_removed, b.points_removed);
  EXPECT_EQ(a.keyframes_removed, b.keyframes_removed);
  EXPECT_EQ(a.observations_added, b.observations_added);
  ASSERT_EQ(a.keyframes_set.size(), b.keyframes_set.size());
  for (size_t i = 0; i < a.keyframes_set.size(); ++i) {
    EXPECT_EQ(a.keyframes_set[i].id, b.keyframes_set[i].id);
    EXPECT_EQ(a.keyframes_set[i].time, b.keyframes_set[i].time);
    EXPECT_TRUE(a.keyframes_set[i].map_from_cam.matrix().isApprox(
        b.keyframes_set[i].map_from_cam.matrix(), 1e-12));
  }
  ASSERT_EQ(a.points_set.size(), b.points_set.size());
  for (size_t i = 0; i < a.points_set.size(); ++i) {
    EXPECT_EQ(a.points_set[i].id, b.points_set[i].id);
    EXPECT_EQ(a.points_set[i].position_in_map, b.points_set[i].position_in_map);
    EXPECT_EQ(a.points_set[i].sigma_mu, b.points_set[i].sigma_mu);
  }
}

void expect_equal(const CarvingDelta& a, const CarvingDelta& b) {
  EXPECT_EQ(a.cells_removed, b.cells_removed);
  EXPECT_EQ(a.vertices_removed, b.vertices_removed);
  ASSERT_EQ(a.vertices_set.size(), b.vertices_set.size());
  ASSERT_EQ(a.cells_added.size(), b.cells_added.size());
  ASSERT_EQ(a.cells_updated.size(), b.cells_updated.size());
  for (size_t i = 0; i < a.vertices_set.size(); ++i) {
    EXPECT_EQ(a.vertices_set[i].id, b.vertices_set[i].id);
    EXPECT_EQ(a.vertices_set[i].position_in_map, b.vertices_set[i].position_in_map);
    EXPECT_EQ(a.vertices_set[i].evidence, b.vertices_set[i].evidence);
  }
  ASSERT_EQ(a.vertices_updated.size(), b.vertices_updated.size());
  for (size_t i = 0; i < a.vertices_updated.size(); ++i) {
    EXPECT_EQ(a.vertices_updated[i].id, b.vertices_updated[i].id);
    EXPECT_EQ(a.vertices_updated[i].evidence, b.vertices_updated[i].evidence);
  }
  for (size_t i = 0; i < a.cells_added.size(); ++i) {
    EXPECT_EQ(a.cells_added[i].id, b.cells_added[i].id);
    EXPECT_EQ(a.cells_added[i].vertices, b.cells_added[i].vertices);
    EXPECT_EQ(a.cells_added[i].constraints, b.cells_added[i].constraints);
    EXPECT_EQ(a.cells_added[i].votes, b.cells_added[i].votes);
  }
  for (size_t i = 0; i < a.cells_updated.size(); ++i) {
    EXPECT_EQ(a.cells_updated[i].id, b.cells_updated[i].id);
    EXPECT_EQ(a.cells_updated[i].constraints, b.cells_updated[i].constraints);
    EXPECT_EQ(a.cells_updated[i].votes, b.cells_updated[i].votes);
  }
}

// Splits, checks the parts, and puts them together again.
template <class Message, class Delta>
void expect_round_trip(const Delta& delta, size_t max_bytes, size_t overhead_bytes) {
  const std::vector<Message> parts = split(delta, max_bytes);
  Delta joined;
  for (size_t i = 0; i < parts.size(); ++i) {
    EXPECT_EQ(parts[i].header.part, static_cast<int32_t>(i));
    EXPECT_EQ(parts[i].header.part_count, static_cast<int32_t>(parts.size()));
    EXPECT_LE(static_cast<size_t>(parts[i].getEncodedSize()), max_bytes + overhead_bytes);
    EXPECT_TRUE(append(parts[i], &joined));
  }
  expect_equal(joined, delta);
}

TEST(Messages, MapDeltaSurvivesInOnePartAndInMany) {
  for (const size_t max_bytes : {100u, 1000u, 400'000u}) {
    expect_round_trip<map_delta_t>(random_map_delta(300, 1), max_bytes, 150);
  }
  EXPECT_EQ(split(random_map_delta(300, 1), 400'000).size(), 1u);
}

TEST(Messages, CarvingDeltaSurvivesInOnePartAndInMany) {
  for (const size_t max_bytes : {100u, 1000u, 400'000u}) {
    expect_round_trip<carving_delta_t>(random_carving_delta(300), max_bytes, 150);
  }
}

TEST(Messages, AnEmptyDeltaIsOnePart) {
  EXPECT_EQ(split(MapDelta{}, 1000).size(), 1u);
  EXPECT_EQ(split(CarvingDelta{}, 1000).size(), 1u);
}

TEST(Messages, AMapDeltaThatMakesNoSenseIsRefusedWhole) {
  const map_delta_t good = split(random_map_delta(5, 2), 100'000).front();
  const auto refuse = [&](const auto& change) {
    map_delta_t bad = good;
    change(&bad);
    MapDelta delta;
    EXPECT_FALSE(append(bad, &delta));
    EXPECT_TRUE(delta.empty()) << "a refused part leaves nothing behind";
  };
  refuse([](map_delta_t* m) { m->point_ids[2] = -1; });
  refuse([](map_delta_t* m) { m->observation_point_ids[0] = -7; });
  refuse([](map_delta_t* m) { m->n_point_coordinates = 14; });
  refuse([](map_delta_t* m) { m->point_sigmas_mu[1] = -0.1f; });
  refuse([](map_delta_t* m) { m->point_sigmas_mu[1] = std::nanf(""); });
  refuse([](map_delta_t* m) { m->keyframe_map_from_cam_quat_wxyz[4] = {0, 0, 0, 0}; });
  refuse([](map_delta_t* m) { m->keyframe_map_from_cam_quat_wxyz[4] = {2, 0, 0, 0}; });
}

TEST(Messages, ACarvingDeltaThatMakesNoSenseIsRefusedWhole) {
  const carving_delta_t good = split(random_carving_delta(5), 100'000).front();
  const auto refuse = [&](const auto& change) {
    carving_delta_t bad = good;
    change(&bad);
    CarvingDelta delta;
    EXPECT_FALSE(append(bad, &delta));
    EXPECT_TRUE(delta.empty());
  };
  refuse([](carving_delta_t* m) { m->cell_ids[0] = -1; });
  refuse([](carving_delta_t* m) { m->cell_constraints[0] = -1; });
  refuse([](carving_delta_t* m) { m->n_cell_vertices = 19; });
  refuse([](carving_delta_t* m) { m->n_vertex_coordinates = 16; });
}

TEST(Messages, PoseSurvives) {
  const Pose<Map, Cam> pose(Eigen::Quaterniond(0.5, -0.5, 0.1, 0.7), Eigen::Vector3d(1, 2, 3));
  camera_pose_t message{};
  message.state = camera_pose_t::STATE_TRACKING;
  write_pose(pose, &message);
  const auto read = read_pose(message);
  ASSERT_TRUE(read);
  EXPECT_TRUE(read->matrix().isApprox(pose.matrix(), 1e-15));
}

TEST(Messages, APoseIsReadOnlyWhenTrackingAndARotation) {
  camera_pose_t message{};
  message.state = camera_pose_t::STATE_TRACKING;
  EXPECT_FALSE(read_pose(message)) << "a zero quaternion";
  message.map_from_cam_quat_wxyz[0] = 1;
  EXPECT_TRUE(read_pose(message));
  message.map_from_cam_quat_wxyz[0] = 1.1;
  EXPECT_FALSE(read_pose(message));
  message.map_from_cam_quat_wxyz[0] = 1;
  message.state = camera_pose_t::STATE_LOST;
  EXPECT_FALSE(read_pose(message));
}

TEST(Messages, CameraInfoThatMakesNoSenseIsRefused) {
  camera_info_t good{};
  good.width_px = 640;
  good.height_px = 480;
  good.fx_px = good.fy_px = 500;
  EXPECT_TRUE(from_message(good));
  camera_info_t bad = good;
  bad.lens = 9;
  EXPECT_FALSE(from_message(bad));
  bad = good;
  bad.width_px = -640;
  EXPECT_FALSE(from_message(bad));
  bad = good;
  bad.fx_px = 0;
  EXPECT_FALSE(from_message(bad));
  for (const double absurd : {-1.0, 0.0, 1e9, 20.0}) {
    bad = good;
    bad.fy_px = absurd;
    EXPECT_FALSE(from_message(bad)) << absurd;
  }
  for (const double absurd : {-1e4, 1e4, 1e300}) {
    bad = good;
    bad.cx_px = absurd;
    EXPECT_FALSE(from_message(bad)) << absurd;
    bad = good;
    bad.distortion[1] = absurd;
    EXPECT_FALSE(from_message(bad)) << absurd;
  }
  bad = good;
  bad.width_px = 32767;
  EXPECT_FALSE(from_message(bad));
}

TEST(Messages, AnAlignmentThatCannotBeIsRefused) {
  alignment_t good{};
  good.state = alignment_t::STATE_ALIGNED;
  good.world_from_map_scale_m_per_mu = 0.4;
  good.world_from_map_quat_wxyz[0] = good.ee_from_cam_quat_wxyz[0] = 1;
  good.joint_delay_s = -0.02;
  const auto read = read_alignment(good);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->joint_delay_s, -0.02);
  for (const double delay_s : {1e300, -1e300, 1e13, 2.0}) {
    alignment_t bad = good;
    bad.joint_delay_s = delay_s;
    EXPECT_FALSE(read_alignment(bad)) << delay_s;
  }
  for (const double scale : {0.0, -1.0, 1e-300, 1e200}) {
    alignment_t bad = good;
    bad.world_from_map_scale_m_per_mu = scale;
    EXPECT_FALSE(read_alignment(bad)) << scale;
  }
}

TEST(Messages, MeshSurvives) {
  Mesh mesh;
  mesh.vertices_in_map = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.vertex_ids = ids<VertexId>({4, -1, 7, 4});
  mesh.confidences = {0.5f, 0, 1, 0.25f};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  const auto read = from_message(to_message(mesh));
  ASSERT_TRUE(read);
  EXPECT_EQ(read->vertices_in_map, mesh.vertices_in_map);
  EXPECT_EQ(read->vertex_ids, mesh.vertex_ids);
  EXPECT_EQ(read->confidences, mesh.confidences);
  EXPECT_EQ(read->triangles, mesh.triangles);
}

TEST(Messages, AMeshWithIndicesOutOfRangeIsRefused) {
  Mesh mesh;
  mesh.vertices_in_map = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.vertex_ids = ids<VertexId>({1, 2, 3});
  mesh.confidences = {1, 1, 1};
  mesh.triangles = {{0, 2, 1}};
  for (const int32_t index : {-1, 3, 1'000'000}) {
    mesh_t message = to_message(mesh);
    message.triangle_vertices[1] = index;
    EXPECT_FALSE(from_message(message)) << index;
  }
}

}  // namespace
}  // namespace foresight
