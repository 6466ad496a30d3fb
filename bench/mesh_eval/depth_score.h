// How right is the depth that a mesh shows? Pixel by pixel against what a depth camera measured.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "bench/mesh_eval/mesh_view.h"

namespace foresight {

struct DepthScore {
  int images = 0;
  int64_t pixels = 0;  // compared: those with a measured depth
  // What the mesh shows there, shares of these pixels: surface between map points, surface that
  // touches the bounding hull, nothing.
  double measured_share = 0, guessed_share = 0, open_share = 0;
  // Of the pixels with surface between map points: shares by the relative error of the depth.
  double within_5_percent = 0, within_10_percent = 0;
  double in_front_10_percent = 0;   // nearer by more than 10 %: spikes and floaters
  double behind_10_percent = 0;     // farther by more than 10 %: holes
  double median_error_percent = 0;  // absolute, of depth
  /// Of all compared pixels: surface between map points within 10 %.
  double right_share() const { return measured_share * within_10_percent; }
};

/// Relative error of a mesh's depth: > 0 where it lies behind what was measured.
inline float depth_error(float depth_mu, double metres_per_mu, float measured_m) {
  return static_cast<float>(metres_per_mu) * depth_mu / measured_m - 1;
}

class DepthScorer {
 public:
  /// `depth_m`: as load_depth() gives it, of the whole image; `rays`: those that made `seen`.
  void add(const SeenMesh& seen, const PixelRays& rays, const cv::Mat& depth_m,
           double metres_per_mu);
  DepthScore score() const;

 private:
  int images_ = 0;
  int64_t guessed_ = 0, open_ = 0;
  std::vector<float> errors_;  // relative, of the pixels with surface between map points
};

}  // namespace foresight
