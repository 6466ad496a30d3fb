// Typed coordinate frames: a transform is named and typed `a_from_b` and maps coordinates in b to
// coordinates in a, so that composition cancels and a wrong order does not compile:
//
//   Pose<World, Cam> world_from_cam = world_from_base * base_from_cam;   // rigid, metres
//   Similarity<World, Map> world_from_map = ...;                         // rotation, shift, scale
//   Pose<World, Cam> seen = world_from_map * map_from_cam;               // eq. (7): [R, s·t]
//
// docs/frames.md has the table and one picture. `.matrix()` leaves the typed world.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace foresight {

struct Map {};    // SLAM coordinates, arbitrary scale (map units, mu); may jump after adjustment
struct World {};  // robot base at alignment time, fixed; metres
struct Base {};   // robot base now; metres
struct Ee {};     // end effector; metres
struct Cam {};    // x right, y down, z forward; metres (map units inside SLAM)

/// Rigid transform a_from_b. Unit quaternion and translation (of b's origin, in a).
template <class A, class B>
class Pose {
 public:
  Pose() = default;
  Pose(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation)
      : rotation_(rotation.normalized()), translation_(translation) {}
  Pose(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation)
      : Pose(Eigen::Quaterniond(rotation), translation) {}

  const Eigen::Quaterniond& rotation() const { return rotation_; }
  const Eigen::Vector3d& translation() const { return translation_; }

  Pose<B, A> inverse() const {
    const Eigen::Quaterniond r = rotation_.conjugate();
    return {r, -(r * translation_)};
  }
  template <class C>
  Pose<A, C> operator*(const Pose<B, C>& b_from_c) const {
    return {rotation_ * b_from_c.rotation(), rotation_ * b_from_c.translation() + translation_};
  }
  /// Coordinates in b to coordinates in a.
  Eigen::Vector3d operator*(const Eigen::Vector3d& point_in_b) const {
    return rotation_ * point_in_b + translation_;
  }
  Eigen::Matrix4d matrix() const {
    Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
    m.topLeftCorner<3, 3>() = rotation_.toRotationMatrix();
    m.topRightCorner<3, 1>() = translation_;
    return m;
  }
  bool is_finite() const { return rotation_.coeffs().allFinite() && translation_.allFinite(); }

 private:
  Eigen::Quaterniond rotation_ = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation_ = Eigen::Vector3d::Zero();
};

/// Similarity a_from_b: x_a = scale · R · x_b + t (eq. (4): Ŵ · diag(s, s, s, 1)). `scale` is in
/// units of a per unit of b, e.g. metres per map unit.
template <class A, class B>
class Similarity {
 public:
  Similarity() = default;
  Similarity(double scale, const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation)
      : scale_(scale), rotation_(rotation.normalized()), translation_(translation) {}

  double scale() const { return scale_; }
  const Eigen::Quaterniond& rotation() const { return rotation_; }
  const Eigen::Vector3d& translation() const { return translation_; }

  Similarity<B, A> inverse() const {
    const Eigen::Quaterniond r = rotation_.conjugate();
    return {1.0 / scale_, r, -(r * translation_) / scale_};
  }
  Eigen::Vector3d operator*(const Eigen::Vector3d& point_in_b) const {
    return scale_ * (rotation_ * point_in_b) + translation_;
  }
  template <class C>
  Similarity<A, C> operator*(const Similarity<B, C>& b_from_c) const {
    return {scale_ * b_from_c.scale(), rotation_ * b_from_c.rotation(),
            *this * b_from_c.translation()};
  }
  /// A pose known in b, expressed in a (the pose's own axes stay rigid).
  template <class C>
  Pose<A, C> operator*(const Pose<B, C>& b_from_c) const {
    return {rotation_ * b_from_c.rotation(), *this * b_from_c.translation()};
  }
  Eigen::Matrix4d matrix() const {
    Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
    m.topLeftCorner<3, 3>() = scale_ * rotation_.toRotationMatrix();
    m.topRightCorner<3, 1>() = translation_;
    return m;
  }

 private:
  double scale_ = 1.0;
  Eigen::Quaterniond rotation_ = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation_ = Eigen::Vector3d::Zero();
};

}  // namespace foresight
