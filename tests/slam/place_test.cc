// Places: which keyframes show what an image shows, and what a loop does to a chain of poses.
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "procs/slam/place_index.h"
#include "procs/slam/pose_graph.h"

namespace foresight::slam {
namespace {

std::shared_ptr<Features> random_features(cv::RNG* random, int count) {
  auto features = std::make_shared<Features>();
  features->descriptors.create(count, 32, CV_8U);
  random->fill(features->descriptors, cv::RNG::UNIFORM, 0, 256);
  features->pixels.resize(static_cast<size_t>(count), Eigen::Vector2d::Zero());
  return features;
}

// The same spots in another image: so many bits of each descriptor differ.
std::shared_ptr<Features> seen_again(const Features& features, int flipped_bits, cv::RNG* random) {
  auto again = std::make_shared<Features>();
  again->descriptors = features.descriptors.clone();
  again->pixels = features.pixels;
  for (int row = 0; row < again->descriptors.rows; ++row) {
    for (int i = 0; i < flipped_bits; ++i) {
      const int bit = random->uniform(0, 256);
      again->descriptors.at<uint8_t>(row, bit / 8) ^= static_cast<uint8_t>(1 << (bit % 8));
    }
  }
  return again;
}

TEST(PlaceIndex, FindsThePlaceThoughDescriptorsDiffer) {
  cv::RNG random(4);
  PlaceIndex index;
  std::vector<std::shared_ptr<Features>> places;
  for (int32_t id = 0; id < 40; ++id) {
    places.push_back(random_features(&random, 300));
    index.add(KeyframeId(3 * id), places.back());
  }
  for (const int32_t id : {0, 17, 39}) {
    const auto ranked = index.rank(*seen_again(*places[static_cast<size_t>(id)], 35, &random));
    ASSERT_GE(ranked.size(), 2u);
    EXPECT_EQ(ranked[0].keyframe_id, KeyframeId(3 * id));
    EXPECT_GT(ranked[0].votes, 1.5 * ranked[1].votes);
  }
  index.remove(KeyframeId(3 * 17));
  for (const PlaceIndex::Ranked& r : index.rank(*places[17]))
    EXPECT_NE(r.keyframe_id, KeyframeId(3 * 17));
  EXPECT_EQ(index.size(), 39u);
  EXPECT_TRUE(PlaceIndex().rank(*places[0]).empty());
}

// A ring of cameras; each step is measured with the same small error, and the loop without.
TEST(PoseGraph, SpreadsTheDriftOverTheLoop) {
  constexpr int kCount = 60;
  const auto on_ring = [](int i) {
    const double angle = 2 * M_PI * i / kCount;
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()));
    const Pose<Cam, Map> p = Pose<Map, Cam>(turn, turn * Eigen::Vector3d(0, 0, 2)).inverse();
    return Similarity<Cam, Map>(1, p.rotation(), p.translation());
  };
  const Similarity<Cam, Cam> drift(
      1.004, Eigen::Quaterniond(Eigen::AngleAxisd(0.003, Eigen::Vector3d(1, 2, 0).normalized())),
      {0.002, 0, 0.001});
  PoseGraph graph;
  for (int i = 0; i < kCount; ++i) {
    const Similarity<Cam, Map> pose =
        i == 0 ? on_ring(0)
               : drift * on_ring(i) * on_ring(i - 1).inverse() * graph.vertices.back().cam_from_map;
    if (i > 0) {
      graph.edges.push_back(
          {VertexId(i - 1), VertexId(i), pose * graph.vertices.back().cam_from_map.inverse(), 100});
    }
    graph.vertices.push_back({KeyframeId(i), pose, 2, i == 0});
  }
  const auto error_of_last = [&] {
    const Similarity<Map, Cam> truth = on_ring(kCount - 1).inverse();
    const Similarity<Map, Cam> found = graph.vertices.back().cam_from_map.inverse();
    return (truth.translation() - found.translation()).norm();
  };
  const double before_m = error_of_last();
  EXPECT_GT(before_m, 0.2);
  graph.edges.push_back(
      {VertexId(kCount - 1), VertexId(0), on_ring(0) * on_ring(kCount - 1).inverse(), 10000});
  const PoseGraphReport report = optimize_pose_graph(&graph);
  ASSERT_TRUE(report.usable);
  EXPECT_LT(report.final_cost, 0.1 * report.initial_cost);
  EXPECT_LT(report.iterations, 12);
  EXPECT_LT(error_of_last(), 0.1 * before_m);
  EXPECT_NEAR(graph.vertices.back().cam_from_map.scale(), 1, 0.02);
  EXPECT_EQ(graph.vertices.front().cam_from_map.translation(), on_ring(0).translation());
}

TEST(PoseGraph, WithoutAFixedVertexOrEdgesNothingMoves) {
  PoseGraph empty;
  EXPECT_FALSE(optimize_pose_graph(&empty).usable);
  PoseGraph loose;
  loose.vertices.push_back({KeyframeId(0), {}, 1, true});
  loose.vertices.push_back({KeyframeId(1), {}, 1, false});
  EXPECT_FALSE(optimize_pose_graph(&loose).usable);  // nothing ties the second
}

}  // namespace
}  // namespace foresight::slam
