// The alignment of the map with the robot (paper §II-C.1): the problem, its solution, its limits.
//
//   AlignmentProblem problem{options, camera, pairs, points, guess};
//   AlignmentSolution solution = solve_alignment(problem);      // alignment_solver.h
//   if (solution.verdict == AlignmentVerdict::kAccepted) use(solution.estimate.base_from_map);
//
// While pairs are collected the base stands still, so "base" names one frame.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "common/camera_model.h"
#include "common/frames.h"
#include "common/time.h"
#include "procs/calibrator/arm_track.h"

namespace foresight::calibration {

/// The camera's pose twice: as SLAM sees it (E_p) and as the arm says (E_m = hand · ee_from_cam, at
/// the image's time + joint delay).
struct PosePair {
  Time time;                    // of the image
  Pose<Map, Cam> map_from_cam;  // translation in mu
  ArmTrack arm;                 // the hand around `time`
};

/// What is estimated.
struct AlignmentEstimate {
  Similarity<Base, Map> base_from_map;  // W and s; scale in m/mu
  Pose<Ee, Cam> ee_from_cam;            // with T_cam in it
  double joint_delay_s = 0;             // an image of time t shows the joints of t + joint_delay_s
};

struct AlignmentOptions {
  bool refine_camera = false;  // estimate ee_from_cam (the paper's T_cam) too
  bool estimate_delay = true;  // estimate joint_delay_s where the motion permits
  double max_delay_s = 0.1;    // bound of |joint_delay_s|
  int points_per_pair = 24;    // samples of the scene
  int max_iterations = 30;     // of each of the three solutions
  // What is demanded before an answer is believed.
  int min_pairs = 12;
  double min_baseline_m = 0.10;   // largest distance between two camera centres
  double min_axis_turn_deg = 8;   // turns about a second axis (RMS), when refine_camera
  double max_residual_px = 6;     // RMS over the pairs that agree
  double min_inlier_share = 0.7;  // of the pairs
  double max_drift_m = 0.005;     // of the base over the time of collection
  double max_drift_deg = 0.6;
  double max_scale_sigma = 0.004;       // relative
  double max_position_sigma_m = 0.002;  // of the camera's centre in the base
  double max_rotation_sigma_deg = 0.1;  // of base_from_map
  double max_delay_sigma_s = 0.004;     // else the delay keeps its given value
  // Least error of a pair that the covariance assumes.
  double pose_noise_floor_m = 0.0005;
  double pose_noise_floor_deg = 0.02;
};

struct AlignmentProblem {
  AlignmentOptions options;
  CameraModel camera;  // intrinsics; used without its distortion
  std::vector<PosePair> pairs;
  std::vector<Eigen::Vector3f> points_in_map;  // the map's points, mu; each view samples its own
  AlignmentEstimate guess;  // ee_from_cam and joint_delay_s; base_from_map is not used
};

enum class AlignmentVerdict {
  kAccepted,
  kFewPairs,      // too few poses
  kFewPoints,     // too few map points in view
  kBaseline,      // the camera has hardly moved: no scale
  kInconsistent,  // the poses contradict each other, as when the base moves
  kDrifting,      // the poses fit a slowly moving base
  kAxes,          // ee_from_cam needs turns about a second axis
  kUncertain,     // determined, but not well enough
  kDelay,         // the joint delay is at its bound
};

struct AlignmentSolution {
  AlignmentVerdict verdict = AlignmentVerdict::kFewPairs;
  std::string reason;  // for people: what is missing; empty when accepted
  AlignmentEstimate estimate;
  bool delay_is_estimated = false;
  // Standard deviations (infinite where nothing is known).
  double scale_sigma = 0;       // relative
  double position_sigma_m = 0;  // 3D, of the camera's centre in the base, RMS over the pairs
  double rotation_sigma_rad = 0;
  double delay_sigma_s = 0;
  double ee_from_cam_position_sigma_m = 0, ee_from_cam_rotation_sigma_rad = 0;
  // What the answer rests on.
  double residual_px = 0;  // RMS of the reprojection objective over the inliers
  double pair_position_error_m = 0, pair_rotation_error_rad = 0;  // RMS of a pair's disagreement
  double baseline_m = 0;
  Eigen::Vector3d middle_in_base = Eigen::Vector3d::Zero();  // of the cameras, m
  int pairs_with_points = 0, inliers = 0;
  std::vector<bool> is_inlier;  // of each pair of the problem
};

}  // namespace foresight::calibration
