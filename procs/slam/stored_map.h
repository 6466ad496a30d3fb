// A map at rest: all that Slam needs to find itself in it again, and what others want of it. See
// map_folder.h for how it lies on the disk.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "common/camera_model.h"
#include "common/frames.h"
#include "common/id.h"
#include "common/time.h"

namespace foresight {

struct StoredMap {
  struct Keyframe {
    KeyframeId id;
    Time time;
    Pose<Map, Cam> map_from_cam;
    double median_depth = 1;  // mu
    cv::Mat image;            // 8-bit gray, as the camera gave it; shared, not to be changed
  };
  struct Observation {
    KeyframeId keyframe_id;
    int level = 0;                // pyramid level of the measurement
    Eigen::Vector2d pixel{0, 0};  // of the full image; the centre of the first pixel is (0, 0)
  };
  struct Point {
    PointId id;
    Eigen::Vector3d position_in_map{0, 0, 0};
    KeyframeId source_keyframe_id;  // whose image its patch comes from; it is among the observers
    bool confirmed = false;
    int32_t predicted_count = 0, found_count = 0, outlier_count = 0;
    KeyframeId born_keyframe_id;            // newest keyframe when it was made
    std::vector<Observation> observations;  // by keyframe id, increasing
  };
  CameraModel camera;
  std::vector<Keyframe> keyframes;  // by id, increasing
  std::vector<Point> points;        // by id, increasing
};

}  // namespace foresight
