// The motion and structure that explain tracks from a reference image on, without any prior: all
// motions that an essential matrix, a homography or a scan over small motions proposes are refined
// by bundle adjustment over several images in between. A pure function on copied data: slow (about
// 50 ms), for the worker.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/frames.h"
#include "procs/slam/slam_options.h"

namespace foresight::slam {

struct TracksInViews {
  double focal_px = 0;
  /// Of some images since the reference, the first and the last among them: each track's ray
  /// (x/z, y/z).
  std::vector<std::vector<Eigen::Vector2d>> rays;
  /// Second-from-first motions that did well a moment ago: tried again.
  std::vector<Pose<Cam, Cam>> hypotheses;
  int min_points = 80;
};

/// A refined motion, in units of its own.
struct TwoViewSolution {
  Pose<Cam, Cam> second_from_first;
  std::vector<size_t> tracks;           // index of each point's track
  std::vector<Eigen::Vector3d> points;  // in the first camera
  double cost = 0;                      // mean squared error of the better 95 % of tracks, px²
  double rms_px = 0;
  double parallax_deg = 0;  // median
};

/// The cheapest first; empty if nothing explains the tracks.
std::vector<TwoViewSolution> solve_first_map(const TracksInViews& tracks);

/// Two motions that no noise makes of one.
bool differ(const Pose<Cam, Cam>& a, const Pose<Cam, Cam>& b);

}  // namespace foresight::slam
