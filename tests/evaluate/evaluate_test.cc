// The scores themselves: known pictures, known answers.
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "bench/evaluate/image_scores.h"
#include "bench/evaluate/picture_scorer.h"

namespace foresight {
namespace {

// Smooth random texture, the same on every run.
cv::Mat make_texture(int width_px, int height_px) {
  cv::Mat noise(height_px, width_px, CV_8UC3), smooth;
  cv::RNG random(3);
  random.fill(noise, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(noise, smooth, {0, 0}, 2.0);
  cv::normalize(smooth, smooth, 0, 255, cv::NORM_MINMAX);
  return smooth;
}

cv::Mat shifted(const cv::Mat& image, double x_px, double y_px) {
  cv::Mat out;
  const cv::Mat move = (cv::Mat_<double>(2, 3) << 1, 0, x_px, 0, 1, y_px);
  cv::warpAffine(image, out, move, image.size(), cv::INTER_LINEAR, cv::BORDER_REFLECT);
  return out;
}

CameraModel make_camera() {
  CameraModel camera;
  camera.width_px = 320;
  camera.height_px = 240;
  camera.fx_px = camera.fy_px = 260;
  camera.cx_px = 159.5;
  camera.cy_px = 119.5;
  camera.prepare();
  return camera;
}

TEST(Psnr, OfAKnownError) {
  const cv::Mat a(10, 10, CV_8UC3, cv::Scalar(100, 100, 100));
  const cv::Mat b(10, 10, CV_8UC3, cv::Scalar(110, 110, 110));
  EXPECT_NEAR(*psnr_db(a, b), 20 * std::log10(255.0 / 10), 1e-9);
  EXPECT_EQ(*psnr_db(a, a), 60);
}

TEST(Psnr, CountsOnlyTheMask) {
  cv::Mat a(10, 10, CV_8UC3, cv::Scalar(100, 100, 100)), b = a.clone();
  b.rowRange(0, 5).setTo(cv::Scalar(0, 0, 0));
  cv::Mat mask(10, 10, CV_8U, cv::Scalar(0));
  EXPECT_FALSE(psnr_db(a, b, mask).has_value());
  mask.rowRange(5, 10).setTo(255);
  EXPECT_EQ(*psnr_db(a, b, mask), 60);
  EXPECT_LT(*psnr_db(a, b), 15);
}

TEST(Ssim, IsOneForEqualAndFallsWithBlur) {
  const cv::Mat a = make_texture(160, 120);
  cv::Mat blurred, more;
  cv::GaussianBlur(a, blurred, {0, 0}, 1.0);
  cv::GaussianBlur(a, more, {0, 0}, 3.0);
  EXPECT_NEAR(*ssim(a, a), 1, 1e-5);
  EXPECT_LT(*ssim(a, blurred), 0.999);
  EXPECT_LT(*ssim(a, more), *ssim(a, blurred));
}

TEST(FeatureDisplacement, IsTheShift) {
  const cv::Mat truth = make_texture(320, 240);
  for (const double shift_px : {0.0, 1.5, 6.0}) {
    const auto d = feature_displacements_px(truth, shifted(truth, shift_px, 0));
    ASSERT_GT(d.size(), 50u);
    EXPECT_NEAR(percentile(d, 0.5), shift_px, 0.15);
  }
}

TEST(Percentile, ByNearestRank) {
  EXPECT_EQ(percentile({4, 1, 3, 2}, 0.5), 2);
  EXPECT_EQ(percentile({4, 1, 3, 2}, 0.95), 4);
  EXPECT_TRUE(std::isnan(percentile({}, 0.5)));
}

// A tilted plane seen from two poses: the warp must reproduce the second picture from the first.
TEST(HomographyBaseline, IsExactForAPlane) {
  const CameraModel camera = make_camera();
  const Eigen::Vector3d normal(0.1, -0.05, 0.5);  // normal · x = 1 in the first camera
  const Pose<Map, Cam> first;
  const Pose<Map, Cam> second(Eigen::Quaterniond(Eigen::AngleAxisd(0.06, Eigen::Vector3d::UnitY())),
                              {0.12, -0.05, 0.1});
  std::vector<Eigen::Vector3d> points;
  for (int y = 10; y < 240; y += 20) {
    for (int x = 10; x < 320; x += 20) {
      const Eigen::Vector3d ray = camera.unproject({x, y}).homogeneous();
      points.push_back(ray / normal.dot(ray));
    }
  }
  const cv::Mat delayed = make_texture(320, 240);
  // Truth by casting each pixel's ray onto the plane.
  cv::Mat map_x(240, 320, CV_32F), map_y(240, 320, CV_32F), truth;
  for (int y = 0; y < 240; ++y) {
    for (int x = 0; x < 320; ++x) {
      const Eigen::Vector3d d = second.rotation() * camera.unproject({x, y}).homogeneous();
      const Eigen::Vector3d c = second.translation();
      const Eigen::Vector2d p = camera.project(c + d * (1 - normal.dot(c)) / normal.dot(d));
      map_x.at<float>(y, x) = static_cast<float>(p.x());
      map_y.at<float>(y, x) = static_cast<float>(p.y());
    }
  }
  cv::remap(delayed, truth, map_x, map_y, cv::INTER_LINEAR);
  const MaskedPicture warped =
      warp_by_best_plane(camera, whole(delayed), first, second, points, whole(truth));
  EXPECT_GT(*psnr_db(warped.rgb, truth, warped.mask), 35);
  EXPECT_LT(*psnr_db(delayed, truth), 20);
  EXPECT_GT(cv::countNonZero(warped.mask), 320 * 240 * 6 / 10);
}

CameraModel make_pincushion() {
  CameraModel camera = make_camera();
  camera.distortion[0] = 0.3;
  camera.prepare();
  return camera;
}

TEST(Undistorter, KnowsWhatTheLensDidNotSee) {
  const CameraModel camera = make_pincushion();
  const cv::Mat white(240, 320, CV_8UC3, cv::Scalar::all(255));
  const MaskedPicture picture = Undistorter(camera)(white);
  const int black = 320 * 240 - cv::countNonZero(picture.mask);
  EXPECT_GT(black, 2000);
  for (int y = 0; y < 240; ++y) {
    for (int x = 0; x < 320; ++x) {
      if (picture.mask.at<uint8_t>(y, x) == 0) continue;
      EXPECT_EQ(picture.rgb.at<cv::Vec3b>(y, x)[0], 255) << x << " " << y;
    }
  }
  EXPECT_EQ(cv::countNonZero(Undistorter(make_camera())(white).mask), 320 * 240);
}

// A view that is right wherever the truth has pixels is perfect, and one that copies the black rim
// gains nothing by it.
TEST(PictureScores, TheRimThatTheTruthDoesNotHaveIsNotScored) {
  const Undistorter undistort(make_pincushion());
  const MaskedPicture truth = undistort(make_texture(320, 240));
  const cv::Mat everywhere(240, 320, CV_8U, cv::Scalar(255));
  const ScoredPixels pixels{truth.mask, everywhere & truth.mask, everywhere & truth.mask};
  cv::Mat right(240, 320, CV_8UC3, cv::Scalar(90, 120, 30));  // in the rim: what a display shows
  truth.rgb.copyTo(right, truth.mask);
  DisplayScore perfect;
  add_scores(right, truth.rgb, pixels, &perfect);
  EXPECT_EQ(perfect.mean_psnr_common_db(), 60);
  EXPECT_EQ(perfect.mean_psnr_measured_db(), 60);
  EXPECT_EQ(perfect.mean_psnr_whole_db(), 60);
  EXPECT_NEAR(perfect.mean_ssim_common(), 1, 1e-6);
  EXPECT_NEAR(perfect.mean_ssim_whole(), 1, 1e-6);
  EXPECT_LT(*psnr_db(right, truth.rgb), 25) << "what it was with the rim";
  EXPECT_LT(percentile(perfect.displacement_px, 0.95), 0.01);
  EXPECT_GT(perfect.displacement_px.size(), 50u);
  // A moved picture: its score is that of the inside alone, with the rim black or not.
  cv::Mat moved = shifted(right, 3, 0), moved_black = moved.clone();
  moved_black.setTo(0, ~truth.mask);
  DisplayScore a, b;
  add_scores(moved, truth.rgb, pixels, &a);
  add_scores(moved_black, truth.rgb, pixels, &b);
  EXPECT_EQ(a.mean_psnr_common_db(), b.mean_psnr_common_db());
  EXPECT_EQ(a.mean_psnr_whole_db(), b.mean_psnr_whole_db());
}

}  // namespace
}  // namespace foresight
