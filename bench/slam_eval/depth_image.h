// The depth images of a sequence, in metres and as the colour camera sees them.
#pragma once

#include <opencv2/core.hpp>

#include "bench/slam_eval/sequence.h"
#include "procs/camera/input_report.h"

namespace foresight {

/// Depth along the colour camera's optical axis for each pixel of its images (CV_32F, m), 0 where
/// none was measured; empty if the file is no 16-bit image of the camera's size. Images of a camera
/// of their own (Sequence::depth_camera) are carried over pixel by pixel, the nearest surface
/// wins; where that camera sits is what Kinects of the first kind have: 25 mm to the left.
/// What cannot be used is said in `report`.
cv::Mat load_depth(const Sequence& sequence, const SequenceImage& entry,
                   InputReport* report = nullptr);

}  // namespace foresight
