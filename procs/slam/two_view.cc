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

namespace {

// Instantaneous motion: a point at inverse depth ρ moves by B ω + ρ A t in the image plane
// (Longuet-Higgins, Prazdny). For a given direction t, the part of the flow across A t is linear in
// ω alone: the turn follows by least squares, and what is left over is the cost of t (the subspace
// idea of Heeger and Jepson, with robust weights and positive depths).
class SmallMotionCost {
 public:
  SmallMotionCost(const std::vector<Vector2d>& first, const std::vector<Vector2d>& second,
                  const Matrix3d& rotation, double noise)
      : limit2_(9 * noise * noise), noise_(noise) {
    const size_t step = std::max<size_t>(1, first.size() / kScannedTracks);
    for (size_t i = 0; i < first.size(); i += step) {
      const Vector3d p = rotation * ray_from_xy(first[i]);
      if (p.z() <= 0.1) continue;
      const Vector2d xy = p.head<2>() / p.z();
      Term term;
      term.xy = xy;
      term.flow = second[i] - xy;
      term.by_turn << -xy.x() * xy.y(), 1 + xy.x() * xy.x(), -xy.y(), -1 - xy.y() * xy.y(),
          xy.x() * xy.y(), xy.x();
      terms_.push_back(term);
    }
  }

  struct Fit {
    Vector3d turn = Vector3d::Zero();
    double cost = 0;  // mean over the tracks of min(error², (3 noise)²)
  };
  Fit at(const Vector3d& t) const {
    Fit fit;
    for (int iteration = 0; iteration < 3; ++iteration) {
      Matrix3d hessian = 1e-9 * Matrix3d::Identity();
      Vector3d gradient = Vector3d::Zero();
      for (const Term& term : terms_) {
        const Vector2d along = t.head<2>() - term.xy * t.z();
        const double length = along.norm();
        if (length < 1e-9) continue;
        const Vector2d across(-along.y() / length, along.x() / length);
        const Vector3d row = term.by_turn.transpose() * across;
        const double error = across.dot(term.flow) - row.dot(fit.turn);
        const double weight =
            iteration == 0 || std::abs(error) < noise_ ? 1 : noise_ / std::abs(error);
        hessian.noalias() += weight * row * row.transpose();
        gradient.noalias() += weight * error * row;
      }
      fit.turn += hessian.ldlt().solve(gradient);
    }
    for (const Term& term : terms_) fit.cost += std::min(limit2_, squared_error(term, t, fit.turn));
    fit.cost /= static_cast<double>(std::max<size_t>(1, terms_.size()));
    return fit;
  }

 private:
  static constexpr size_t kScannedTracks = 150;
  struct Term {
    Vector2d xy, flow;
    Eigen::Matrix<double, 2, 3> by_turn;
  };
  // A point cannot be behind the camera: then the best is one at infinity.
  static double squared_error(const Term& term, const Vector3d& t, const Vector3d& turn) {
    const Vector2d along = t.head<2>() - term.xy * t.z();
    const Vector2d rest = term.flow - term.by_turn * turn;
    const double length2 = along.squaredNorm(), forward = along.dot(rest);
    if (length2 < 1e-18 || forward <= 0) return rest.squaredNorm();
    return std::max(0.0, rest.squaredNorm() - forward * forward / length2);
  }

  double limit2_, noise_;
  std::vector<Term> terms_;
};

std::vector<Vector3d> directions_on_sphere(int count) {
  std::vector<Vector3d> directions;
  const double golden = M_PI * (3 - std::sqrt(5.0));
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2 * i + 1.0) / count, radius = std::sqrt(1 - z * z);
    directions.emplace_back(radius * std::cos(golden * i), radius * std::sin(golden * i), z);
  }
  return directions;
}

struct Minimum {
  Vector3d direction;
  SmallMotionCost::Fit fit;
};

// Steps to the best of eight neighbours, with a shrinking step.
Minimum descend(const SmallMotionCost& cost, Minimum from) {
  for (double step = 0.08; step > 0.005;) {
    const Vector3d u = from.direction.unitOrthogonal(), v = from.direction.cross(u);
    Minimum best = from;
    for (int i = 0; i < 8; ++i) {
      const double angle = M_PI / 4 * i;
      const Vector3d there =
          (from.direction + step * (std::cos(angle) * u + std::sin(angle) * v)).normalized();
      const SmallMotionCost::Fit fit = cost.at(there);
      if (fit.cost < best.fit.cost) best = {there, fit};
    }
    if (best.direction == from.direction) step /= 2;
    from = best;
  }
  return from;
}

}  // namespace

std::vector<Pose<Cam, Cam>> small_motions(const std::vector<Vector2d>& first,
                                          const std::vector<Vector2d>& second, double noise) {
  constexpr int kDirections = 240, kMaxMotions = 4;
  constexpr double kBasin = 25 * kDegree;
  std::vector<Pose<Cam, Cam>> motions;
  if (first.size() < 8) return motions;
  const Matrix3d turned = best_rotation(first, second, std::vector<double>(first.size(), 1.0));
  const SmallMotionCost cost(first, second, turned, noise);
  std::vector<Minimum> scanned;
  for (const Vector3d& t : directions_on_sphere(kDirections)) scanned.push_back({t, cost.at(t)});
  std::stable_sort(scanned.begin(), scanned.end(),
                   [](const Minimum& a, const Minimum& b) { return a.fit.cost < b.fit.cost; });
  std::vector<Vector3d> visited;
  for (const Minimum& m : scanned) {
    if (motions.size() == kMaxMotions) break;
    const bool explored = std::any_of(visited.begin(), visited.end(), [&](const Vector3d& t) {
      return angle_between(t, m.direction) < kBasin;
    });
    visited.push_back(m.direction);
    if (explored) continue;
    const Minimum low = descend(cost, m);
    motions.emplace_back(rotation_from_vector(low.fit.turn).toRotationMatrix() * turned,
                         low.direction);
  }
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
