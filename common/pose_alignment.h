// The similarity that brings known poses closest to where they are known to be.
#pragma once

#include <Eigen/SVD>
#include <cstddef>
#include <optional>
#include <vector>

#include "common/frames.h"

namespace foresight {

/// a_from_b, given the same views in a and in b: the turn from the mean of the views' turns (their
/// places do not tell it where a camera hardly moved), scale and place by least squares of the
/// places. Nothing for fewer than two views, or if all are in one place.
template <class A, class B, class View>
std::optional<Similarity<A, B>> align_poses(const std::vector<Pose<A, View>>& in_a,
                                            const std::vector<Pose<B, View>>& in_b) {
  const size_t count = in_a.size();
  if (count < 2 || in_b.size() != count) return std::nullopt;
  Eigen::Matrix3d turns = Eigen::Matrix3d::Zero();
  Eigen::Vector3d middle_a = Eigen::Vector3d::Zero(), middle_b = middle_a;
  for (size_t i = 0; i < count; ++i) {
    turns += (in_a[i].rotation() * in_b[i].rotation().inverse()).toRotationMatrix();
    middle_a += in_a[i].translation() / static_cast<double>(count);
    middle_b += in_b[i].translation() / static_cast<double>(count);
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(turns, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d rotation = svd.matrixU() * svd.matrixV().transpose();
  double along = 0, squared = 0;
  for (size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d arm = rotation * (in_b[i].translation() - middle_b);
    along += arm.dot(in_a[i].translation() - middle_a);
    squared += arm.squaredNorm();
  }
  if (!(along > 0) || !(squared > 0)) return std::nullopt;
  const double scale = along / squared;
  return Similarity<A, B>(scale, Eigen::Quaterniond(rotation),
                          middle_a - scale * (rotation * middle_b));
}

}  // namespace foresight
