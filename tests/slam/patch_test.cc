#include "procs/slam/patch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace foresight::slam {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

// A smooth function of the plane, so that both images are exact samples of it.
double pattern(double x, double y) {
  return 128 + 40 * std::sin(0.45 * x + 0.2 * y) + 35 * std::cos(0.5 * y - 0.3 * x) +
         20 * std::sin(0.11 * x * 1.3) * std::cos(0.17 * y);
}

cv::Mat image_of(const Matrix2d& source_from_image, const Vector2d& shift) {
  cv::Mat image(120, 160, CV_8UC1);
  for (int v = 0; v < image.rows; ++v) {
    for (int u = 0; u < image.cols; ++u) {
      const Vector2d p = source_from_image * Vector2d(u, v) + shift;
      image.at<uint8_t>(v, u) = cv::saturate_cast<uint8_t>(pattern(p.x(), p.y()));
    }
  }
  return image;
}

struct Warp {
  Matrix2d source_from_image;
  Vector2d shift;
};

TEST(Patch, FindsTheWarpedCornerToSubPixel) {
  Matrix2d turned;
  turned << 1.05, -0.12, 0.15, 0.93;
  const cv::Mat source = image_of(Matrix2d::Identity(), Vector2d::Zero());
  for (const Vector2d& shift : {Vector2d(3.3, 2.6), Vector2d(4.71, 1.13), Vector2d(2.05, 3.9)}) {
    const cv::Mat image = image_of(turned, shift);
    for (int i = 0; i < 12; ++i) {
      const Vector2d in_image(45 + 5.3 * i, 40 + 3.1 * i);
      const Vector2d in_source = turned * in_image + shift;
      Patch patch;
      ASSERT_TRUE(warp_patch(source, in_source, turned, &patch));
      const Vector2d guess = in_image + Vector2d(3, -2);
      const PatchMatch coarse = search_patch(image, patch, guess, guess, 5);
      EXPECT_GT(coarse.zncc, 0.9);
      const auto fine = align_patch(image, patch, coarse.center);
      ASSERT_TRUE(fine.has_value());
      EXPECT_LT((fine->center - in_image).norm(), 0.05);
      EXPECT_GT(fine->zncc, 0.98);
    }
  }
}

TEST(Patch, ContrastAndBrightnessDoNotMatter) {
  const cv::Mat source = image_of(Matrix2d::Identity(), Vector2d::Zero());
  cv::Mat darker;
  source.convertTo(darker, CV_8U, 0.7, 10);
  Patch patch;
  ASSERT_TRUE(warp_patch(source, {60.5, 50.5}, Matrix2d::Identity(), &patch));
  const PatchMatch match = search_patch(darker, patch, {62, 49}, {62, 49}, 4);
  EXPECT_EQ(match.center, Vector2d(60.5, 50.5));
  EXPECT_GT(match.zncc, 0.99);
}

TEST(Patch, RefusesFlatPatchesAndBorders) {
  const cv::Mat flat(100, 100, CV_8UC1, cv::Scalar::all(90));
  Patch patch;
  EXPECT_FALSE(warp_patch(flat, {50, 50}, Matrix2d::Identity(), &patch));
  const cv::Mat source = image_of(Matrix2d::Identity(), Vector2d::Zero());
  EXPECT_FALSE(warp_patch(source, {2, 50}, Matrix2d::Identity(), &patch));
  EXPECT_FALSE(warp_patch(source, {159, 50}, Matrix2d::Identity(), &patch));
  EXPECT_FALSE(warp_patch(source, {std::nan(""), 50}, Matrix2d::Identity(), &patch));
}

TEST(Patch, SearchesAlongASegmentAndReportsAmbiguity) {
  cv::Mat stripes(100, 200, CV_8UC1);
  for (int u = 0; u < stripes.cols; ++u) {  // repeats every 16 px
    stripes.col(u) = cv::Scalar::all(128 + 80 * std::sin(u * 3.14159265 / 8));
  }
  Patch patch;
  ASSERT_TRUE(warp_patch(stripes, {60.5, 50.5}, Matrix2d::Identity(), &patch));
  const PatchMatch match =
      search_patch(stripes, patch, {40.5, 50.5}, {90.5, 50.5}, 1, Ambiguity::kMeasure);
  EXPECT_GT(match.zncc, 0.99);
  EXPECT_GT(match.second_zncc, 0.95);
  const PatchMatch outside = search_patch(stripes, patch, {-500, 10}, {-400, 10}, 3);
  EXPECT_EQ(outside.zncc, -1);
}

}  // namespace
}  // namespace foresight::slam
