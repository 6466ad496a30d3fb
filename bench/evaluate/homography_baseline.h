// The strongest simple alternative to a model: the delayed image, warped as if the scene were one
// plane. Of a rotation (plane at infinity), a fronto-parallel plane at the median depth and the
// plane that fits most map points, the one that comes closest to the truth is taken: an oracle that
// no real display has.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "common/camera_model.h"
#include "common/frames.h"

namespace foresight {

/// RGB, and 255 where it has pixels.
struct MaskedPicture {
  cv::Mat rgb, mask;
};

/// `delayed` and `truth` are distortion-free RGB images of `camera`; points in map coordinates. The
/// plane is chosen on the pixels that both have.
MaskedPicture warp_by_best_plane(const CameraModel& camera, const MaskedPicture& delayed,
                                 const Pose<Map, Cam>& map_from_delayed_cam,
                                 const Pose<Map, Cam>& map_from_cam,
                                 const std::vector<Eigen::Vector3d>& points_in_map,
                                 const MaskedPicture& truth);

}  // namespace foresight
