// Writes what a ray-traced camera sees on its way through the lab, or a scene from a file, as a
// folder in the layout of the TUM RGB-D benchmark:
//
//   rgb/<time>.jpg  rgb.txt          pictures (quality 85), "time file" per line
//   groundtruth.txt                  "time tx ty tz qx qy qz qw": camera to world, metres;
//                                    x right, y down, z forward; middle of the exposure
//   depth/<time>.png  depth.txt      16-bit millimetres along the optical axis, 0 = nothing
//   camera.yaml                      intrinsics, for load_camera_file()
//   mesh_true.ply                    the lab's triangles in world coordinates, on request
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/pose_track.h"
#include "sim/ray_camera.h"
#include "sim/scatter.h"
#include "sim/trajectory.h"

namespace foresight::sim {

struct SequenceParams {
  uint64_t seed = 1;       // of lab, trajectory and noise
  std::string scene_file;  // see scene_loader.h; empty: the lab
  double duration_s = 20;  // at most; a followed track may be shorter
  double rate_hz = 30;
  int width_px = 640;  // the height is 3/4 of it
  Trajectory::Kind trajectory = Trajectory::Kind::kDesk;
  /// Instead of the trajectory, from its first time to its last (at least two poses); empty: none.
  std::vector<TimedPose> followed;
  ScatterParams scatter;  // moves each picture's pose on its own
  double noise_levels = 1.5;
  bool distorted = false;  // a lens with k1 = −0.25 and friends
  double shutter_s = 0;    // > 0 blurs by four sub-frames
  Antialiasing antialiasing = Antialiasing::kEdges;
  int depth_every = 10;  // frames; 0 writes no depth
  bool with_mesh = false;
};

/// The sequence's camera: 63° wide, principal point in the middle.
CameraModel sequence_camera(int width_px, bool distorted);

/// The track with its first pose where the desk trajectory of the seed starts and all others moved
/// with it: for a track whose world is not ours.
std::vector<TimedPose> moved_to_start(std::vector<TimedPose> track, uint64_t seed);

/// Called after each frame with the number written so far and in all.
using Progress = std::function<void(int64_t, int64_t)>;

/// Writes the folder, which may exist. Throws UnavailableError where a file cannot be written, and
/// what load_scene() throws. Its warnings come back as lines.
std::vector<std::string> write_sequence(const std::string& folder, const SequenceParams& params,
                                        const Progress& progress);

}  // namespace foresight::sim
