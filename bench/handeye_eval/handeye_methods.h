// Ways to find the camera on the hand and the target in the base from recorded data: ours, and
// those of OpenCV.
#pragma once

#include <string>
#include <vector>

#include "bench/handeye_eval/handeye_data.h"
#include "procs/calibrator/alignment.h"

namespace foresight {

struct HandEyeAnswer {
  std::string method;
  Similarity<Base, Target> base_from_target;  // scale 1 where the method knows none
  Pose<Ee, Cam> ee_from_cam;
  double joint_delay_s = 0;
  bool has_scale = false, has_delay = false;
  std::string remark;
};

/// A first ee_from_cam from all pairs of motions: the rotation that turns the camera's rotation
/// vectors into the hand's (SVD), then the shift and the target's scale by linear least squares.
Pose<Ee, Cam> guess_ee_from_cam(const HandEyeData& data);

/// Our alignment with refine_camera. The target's poses are first put into a map of another scale,
/// origin and orientation, as SLAM's would be; `solution` gets everything that it says.
HandEyeAnswer solve_ours(const HandEyeData& data, calibration::AlignmentSolution* solution);

/// calibrateHandEye (Tsai, Park, Horaud, Andreff, Daniilidis; the target by averaging) and
/// calibrateRobotWorldHandEye (Shah, Li), with the joints `joint_delay_s` after the images.
std::vector<HandEyeAnswer> solve_opencv(const HandEyeData& data, double joint_delay_s);

}  // namespace foresight
