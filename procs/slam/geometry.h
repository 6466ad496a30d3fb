// Small helpers for rigid motions, rays and medians.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "common/frames.h"

namespace foresight::slam {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector7d = Eigen::Matrix<double, 7, 1>;
using Matrix7d = Eigen::Matrix<double, 7, 7>;

inline Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

inline Eigen::Quaterniond rotation_from_vector(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  if (angle < 1e-12) return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, w / angle));
}

/// First-order motion: p ↦ R(w) p + v for step = (v, w). Its derivative at 0 is [I, −[p]×].
template <class A>
Pose<A, A> small_motion(const Vector6d& step) {
  return {rotation_from_vector(step.tail<3>()), step.head<3>()};
}

/// p ↦ e^σ R(w) p + v for step = (v, w, σ). Its derivative at 0 is [I, −[p]×, p].
template <class A>
Similarity<A, A> small_similarity(const Vector7d& step) {
  return {std::exp(step[6]), rotation_from_vector(step.segment<3>(3)), step.head<3>()};
}

/// x ↦ T_new · scale · T_old⁻¹ x: what a camera saw at its old pose, seen so much larger from its
/// new one.
inline Similarity<Map, Map> between(const Pose<Map, Cam>& new_pose, double scale,
                                    const Pose<Map, Cam>& old_pose) {
  const Similarity<Map, Cam> map_from_scaled(scale, new_pose.rotation(), new_pose.translation());
  const Pose<Cam, Map> inverse = old_pose.inverse();
  return map_from_scaled * Similarity<Cam, Map>(1, inverse.rotation(), inverse.translation());
}

/// The motion repeated `factor` times (fractions allowed).
template <class A>
Pose<A, A> scaled_motion(const Pose<A, A>& motion, double factor) {
  const Eigen::AngleAxisd turn(motion.rotation());
  return {Eigen::Quaterniond(Eigen::AngleAxisd(factor * turn.angle(), turn.axis())),
          factor * motion.translation()};
}

inline double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

constexpr double kDegree = 3.14159265358979323846 / 180;

/// Upper median; `fallback` for none.
inline double median(std::vector<double> values, double fallback = 0) {
  if (values.empty()) return fallback;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Viewing direction (x/z, y/z) to the ray with z = 1.
inline Eigen::Vector3d ray_from_xy(const Eigen::Vector2d& xy) { return {xy.x(), xy.y(), 1.0}; }

}  // namespace foresight::slam
