// Small helpers for rigid motions, shared by the calibrator's core.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

#include "common/frames.h"

namespace foresight::calibration {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

constexpr double kDegree = 3.14159265358979323846 / 180;

inline Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

/// exp: the turn by |w| (rad) about w.
inline Eigen::Quaterniond rotation_from_vector(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  if (angle < 1e-12) return Eigen::Quaterniond::Identity();
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, w / angle));
}

/// log: the shortest rotation vector (rad).
inline Eigen::Vector3d vector_from_rotation(const Eigen::Quaterniond& q) {
  const double sine = q.vec().norm();
  if (sine < 1e-12) return Eigen::Vector3d::Zero();
  const double angle = 2 * std::atan2(q.w() < 0 ? -sine : sine, std::abs(q.w()));
  return q.vec() * (angle / sine);
}

/// Angle between two orientations, rad.
inline double angle_between(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return vector_from_rotation(a.conjugate() * b).norm();
}

/// Rigid motion after similarity: moves where the map lies.
template <class A, class B, class C>
Similarity<A, C> compose(const Pose<A, B>& a_from_b, const Similarity<B, C>& b_from_c) {
  return {b_from_c.scale(), a_from_b.rotation() * b_from_c.rotation(),
          a_from_b * b_from_c.translation()};
}

}  // namespace foresight::calibration
