#include "procs/slam/two_view.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include "procs/slam/geometry.h"

namespace foresight::slam {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kSeed = 20240817;

std::vector<cv::Point2d> cv_points(const std::vector<Vector2d>& points) {
  std::vector<cv::Point2d> converted;
  converted.reserve(points.size());
  for (const Vector2d& p : points) converted.emplace_back(p.x(), p.y());
  return converted;
}

void append(const cv::Mat& rotation, const cv::Mat& translation,
            std::vector<Pose<Cam, Cam>>* motions) {
  Matrix3d r;
  Vector3d t;
  cv::cv2eigen(rotation, r);
  cv::cv2eigen(translation, t);
  if (!r.allFinite() || !t.allFinite() || t.norm() < 1e-9 || r.determinant() < 0) return;
  motions->emplace_back(r, t.normalized());
}

void append_essential(const std::vector<cv::Point2d>& first, const std::vector<cv::Point2d>& second,
                      double noise, std::vector<Pose<Cam, Cam>>* motions) {
  cv::setRNGSeed(kSeed);
  const cv::Mat essential = cv::findEssentialMat(first, second, cv::Mat::eye(3, 3, CV_64F),
                                                 cv::RANSAC, 0.999, 1.5 * noise, 500);
  if (essential.rows != 3 || essential.cols != 3) return;
  cv::Mat r1, r2, t;
  cv::decomposeEssentialMat(essential, r1, r2, t);
  for (const cv::Mat& r : {r1, r2}) {
    append(r, t, motions);
    append(r, -t, motions);
  }
}

void append_homography(const std::vector<cv::Point2d>& first,
                       const std::vector<cv::Point2d>& second, double noise,
                       std::vector<Pose<Cam, Cam>>* motions) {
  cv::setRNGSeed(kSeed);
  const cv::Mat homography = cv::findHomography(first, second, cv::RANSAC, 2.5 * noise);
  if (homography.empty()) return;
  std::vector<cv::Mat> rotations, translations, normals;
  cv::decomposeHomographyMat(homography, cv::Mat::eye(3, 3, CV_64F), rotations, translations,
                             normals);
  for (size_t i = 0; i < rotations.size(); ++i) append(rotations[i], translations[i], motions);
}

Matrix3d best_rotation(const std::vector<Vector2d>& first, const std::vector<Vector2d>& second,
                       const std::vector<double>& weights) {
  Matrix3d sum = Matrix3d::Zero();
  for (size_t i = 0; i < first.size(); ++i) {
    sum += weights[i] * ray_from_xy(second[i]).normalized() *
           ray_from_xy(first[i]).normalized().transpose();
  }
  const Eigen::JacobiSVD<Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant());
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

}  // namespace

std::vector<Pose<Cam, Cam>> candidate_motions(const std::vector<Vector2d>& first,
                                              const std::vector<Vector2d>& second, double noise) {
  std::vector<Pose<Cam, Cam>> motions;
  if (first.size() < 8) return motions;
  const std::vector<cv::Point2d> a = cv_points(first), b = cv_points(second);
  append_essential(a, b, noise, &motions);
  append_homography(a, b, noise, &motions);
  return motions;
}

std::optional<Vector3d> triangulate(const Pose<Cam, Cam>& second_from_first, const Vector2d& first,
                                    const Vector2d& second) {
  // depth_a · a + t = depth_b · b in the second camera, in the least-squares sense.
  const Vector3d a = second_from_first.rotation() * ray_from_xy(first);
  const Vector3d b = ray_from_xy(second);
  const Vector3d& t = second_from_first.translation();
  const double aa = a.squaredNorm(), ab = a.dot(b), bb = b.squaredNorm();
  const double determinant = aa * bb - ab * ab;
  if (determinant < 1e-10 * aa * bb) return std::nullopt;
  const double depth_a = (-bb * a.dot(t) + ab * b.dot(t)) / determinant;
  const double depth_b = (aa * b.dot(t) - ab * a.dot(t)) / determinant;
  if (!(depth_a > 0) || !(depth_b > 0)) return std::nullopt;
  const Vector3d middle_in_second = 0.5 * (depth_a * a + t + depth_b * b);
  return second_from_first.inverse() * middle_in_second;
}

double rotation_only_residual(const std::vector<Vector2d>& first,
                              const std::vector<Vector2d>& second) {
  std::vector<double> weights(first.size(), 1.0), residuals(first.size());
  for (int iteration = 0; iteration < 5; ++iteration) {
    const Matrix3d rotation = best_rotation(first, second, weights);
    for (size_t i = 0; i < first.size(); ++i) {
      const Vector3d p = rotation * ray_from_xy(first[i]);
      residuals[i] = p.z() > 0 ? (p.head<2>() / p.z() - second[i]).norm() : 1.0;
      weights[i] = 1 / std::max(residuals[i], 1e-3);
    }
  }
  std::sort(residuals.begin(), residuals.end());
  const size_t kept = std::max<size_t>(1, residuals.size() * 8 / 10);
  double sum = 0;
  for (size_t i = 0; i < kept && i < residuals.size(); ++i) sum += residuals[i] * residuals[i];
  return std::sqrt(sum / static_cast<double>(kept));
}

}  // namespace foresight::slam
