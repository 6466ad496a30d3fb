// Small blurred images (a sixteenth of the frame, about 40×30) for two questions: how did the
// camera turn since that frame, and which keyframe looks like this frame (in the manner of PTAM).
#pragma once

#include <opencv2/core.hpp>

#include "common/camera_model.h"
#include "common/frames.h"
#include "procs/slam/image_pyramid.h"

namespace foresight::slam {

struct Thumbnail {
  cv::Mat pixels;  // float, zero mean
};

Thumbnail make_thumbnail(const ImagePyramid& pyramid);

/// The pinhole that thumbnails of this camera follow; lens distortion is negligible at that size.
CameraModel thumbnail_camera(const CameraModel& camera);

/// Mean squared difference, gray levels².
double thumbnail_distance(const Thumbnail& a, const Thumbnail& b);

struct ThumbnailAlignment {
  Pose<Cam, Cam> source_from_target;
  double mean_squared_error = 0;  // after alignment, gray levels²
  double initial_error = 0;       // with the guess
};

/// Turns `guess` (about the target's centre) until `source`, seen as if all of it were at `depth`,
/// looks like `target`.
ThumbnailAlignment align_thumbnails(const Thumbnail& source, const Thumbnail& target,
                                    const CameraModel& thumbnail_camera,
                                    const Pose<Cam, Cam>& guess_source_from_target, double depth);

}  // namespace foresight::slam
