#include "common/frames.h"

#include <gtest/gtest.h>

#include <random>

namespace foresight {
namespace {

// What must not compile: wrong order, mixed frames, metres times map units.
template <class L, class R>
concept Composes = requires(const L& l, const R& r) {
  l* r;
};

static_assert(Composes<Pose<World, Base>, Pose<Base, Cam>>);
static_assert(!Composes<Pose<Base, Cam>, Pose<World, Base>>, "wrong order");
static_assert(!Composes<Pose<World, Cam>, Pose<World, Cam>>, "not a chain");
static_assert(!Composes<Pose<World, Base>, Pose<Map, Cam>>, "metres times map units");
static_assert(!Composes<Pose<Map, Cam>, Similarity<World, Map>>, "wrong order");
static_assert(Composes<Similarity<World, Map>, Pose<Map, Cam>>);
static_assert(!Composes<Similarity<World, Map>, Pose<World, Cam>>, "already in metres");
static_assert(!std::is_convertible_v<Pose<Map, Cam>, Pose<World, Cam>>);
static_assert(!std::is_convertible_v<Pose<World, Cam>, Pose<Cam, World>>);
static_assert(std::is_same_v<decltype(Pose<World, Base>() * Pose<Base, Cam>()), Pose<World, Cam>>);
static_assert(
    std::is_same_v<decltype(Similarity<World, Map>() * Pose<Map, Cam>()), Pose<World, Cam>>);
static_assert(std::is_same_v<decltype(Pose<World, Cam>().inverse()), Pose<Cam, World>>);

class Frames : public testing::Test {
 protected:
  Eigen::Vector3d random_vector() {
    std::normal_distribution<double> normal(0, 2);
    return {normal(random_), normal(random_), normal(random_)};
  }
  Eigen::Quaterniond random_rotation() {
    std::normal_distribution<double> normal;
    return Eigen::Quaterniond(normal(random_), normal(random_), normal(random_), normal(random_))
        .normalized();
  }
  template <class A, class B>
  Pose<A, B> random_pose() {
    return {random_rotation(), random_vector()};
  }
  Similarity<World, Map> random_similarity() {
    const double scale = std::exp(std::uniform_real_distribution<double>(-2, 2)(random_));
    return {scale, random_rotation(), random_vector()};
  }
  std::mt19937 random_{7};
};

TEST_F(Frames, PoseTimesInverseIsIdentity) {
  for (int i = 0; i < 1000; ++i) {
    const auto pose = random_pose<World, Cam>();
    EXPECT_TRUE((pose * pose.inverse()).matrix().isIdentity(1e-12));
    EXPECT_TRUE((pose.inverse() * pose).matrix().isIdentity(1e-12));
  }
}

TEST_F(Frames, CompositionIsAssociativeAndThatOfMatrices) {
  for (int i = 0; i < 1000; ++i) {
    const auto a = random_pose<World, Base>();
    const auto b = random_pose<Base, Ee>();
    const auto c = random_pose<Ee, Cam>();
    EXPECT_TRUE(((a * b) * c).matrix().isApprox((a * (b * c)).matrix(), 1e-12));
    EXPECT_TRUE((a * b * c).matrix().isApprox(a.matrix() * b.matrix() * c.matrix(), 1e-12));
  }
}

TEST_F(Frames, TransformingAPointIsMultiplyingItsMatrix) {
  for (int i = 0; i < 1000; ++i) {
    const auto pose = random_pose<Map, Cam>();
    const Eigen::Vector3d p = random_vector();
    EXPECT_TRUE((pose * p).isApprox((pose.matrix() * p.homogeneous()).head<3>(), 1e-12));
  }
}

TEST_F(Frames, SimilarityInvertsAndScalesDistances) {
  for (int i = 0; i < 1000; ++i) {
    const auto world_from_map = random_similarity();
    const Eigen::Vector3d p = random_vector(), q = random_vector();
    EXPECT_TRUE((world_from_map.inverse() * (world_from_map * p)).isApprox(p, 1e-10));
    EXPECT_NEAR((world_from_map * p - world_from_map * q).norm(),
                world_from_map.scale() * (p - q).norm(), 1e-9);
    EXPECT_TRUE((world_from_map * p)
                    .isApprox((world_from_map.matrix() * p.homogeneous()).head<3>(), 1e-12));
  }
}

// Eq. (7): the camera seen in the world looks at the same thing; its picture does not change.
TEST_F(Frames, SimilarityOfAPoseKeepsWhatTheCameraSees) {
  for (int i = 0; i < 1000; ++i) {
    const auto world_from_map = random_similarity();
    const auto map_from_cam = random_pose<Map, Cam>();
    const auto world_from_cam = world_from_map * map_from_cam;
    const Eigen::Vector3d point_in_map = random_vector();
    const Eigen::Vector3d in_cam_mu = map_from_cam.inverse() * point_in_map;
    const Eigen::Vector3d in_cam_m = world_from_cam.inverse() * (world_from_map * point_in_map);
    EXPECT_TRUE(in_cam_m.isApprox(world_from_map.scale() * in_cam_mu, 1e-9));
  }
}

TEST_F(Frames, RotationStaysOfUnitLengthOverManyProducts) {
  Pose<World, World> chain;
  const auto step = random_pose<World, World>();
  for (int i = 0; i < 100'000; ++i) chain = chain * step;
  EXPECT_NEAR(chain.rotation().norm(), 1, 1e-12);
}

}  // namespace
}  // namespace foresight
