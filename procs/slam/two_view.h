// Relative motion of two views from matched rays: every motion that an essential matrix or a
// homography (plane, or nearly pure rotation) allows, and triangulation. Translation has length 1.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "common/frames.h"

namespace foresight::slam {

/// Rays (x/z, y/z) of the same points in both views. `noise` is the standard deviation of a match
/// in the same unit (px / f). Seeded: the same input gives the same output. At most 8 motions.
std::vector<Pose<Cam, Cam>> candidate_motions(const std::vector<Eigen::Vector2d>& first,
                                              const std::vector<Eigen::Vector2d>& second,
                                              double noise);

/// The same for a motion so small that RANSAC on minimal sets is at the mercy of noise: after the
/// best rotation, all directions of translation are scanned by the flow that is left. The best
/// local minima, at most 4, the best first; to be refined.
std::vector<Pose<Cam, Cam>> small_motions(const std::vector<Eigen::Vector2d>& first,
                                          const std::vector<Eigen::Vector2d>& second, double noise);

/// Midpoint of the two rays, in the first camera; empty if behind a camera or the rays are
/// parallel.
std::optional<Eigen::Vector3d> triangulate(const Pose<Cam, Cam>& second_from_first,
                                           const Eigen::Vector2d& first,
                                           const Eigen::Vector2d& second);

/// Root mean square of ray differences (same unit) that the best pure rotation leaves, over the
/// better 80 % of the matches.
double rotation_only_residual(const std::vector<Eigen::Vector2d>& first,
                              const std::vector<Eigen::Vector2d>& second);

}  // namespace foresight::slam
