// An image sequence in TUM RGB-D layout (rgb.txt, camera.yaml, groundtruth.txt, depth.txt), or a
// video with or without a camera.yaml beside it.
#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/camera_model.h"
#include "common/frames.h"
#include "common/pose_track.h"
#include "common/time.h"
#include "procs/camera/image_list.h"
#include "procs/camera/recorded_images.h"

namespace foresight {

using SequenceImage = ListedImage;

struct Sequence {
  std::string name;
  CameraModel camera;
  bool intrinsics_are_guessed = false;
  /// What a user should know of how the sequence was read: scaled intrinsics, truth of another
  /// time.
  std::vector<std::string> notes;
  /// What a video's container promises beyond what there is; empty: nothing.
  std::string shortfall;
  std::vector<SequenceImage> images;
  std::vector<SequenceImage> depth_images;  // may be empty
  std::vector<TimedPose> truth;             // may be empty
  /// Metres per unit of the depth images; 0 if there are none. TUM's default is 1/5000.
  double depth_scale = 0;
  /// What took the depth images, if they are not registered to the colour images (camera.yaml then
  /// has a depth_fx of their own); load_depth() registers them.
  std::optional<CameraModel> depth_camera;

  /// Interpolated; empty outside the truth or in a gap of more than 0.1 s.
  std::optional<Pose<World, Cam>> truth_at(Time time) const;
  /// How many images have a truth.
  int images_with_truth() const;
  /// An image's gray pixels, of the camera's size, or why there are none.
  Picture gray(size_t index) const;
  /// The same in OpenCV's colours (BGR); throws UnavailableError if it cannot be used.
  cv::Mat colour(size_t index) const;

  std::shared_ptr<RecordedImages> recorded;  // what gray() and colour() read
};

/// The pixels, not copied.
cv::Mat view_of(const Image& image);

/// `source`: a folder or a video. Throws StartupError with one line that names the file.
Sequence load_sequence(const std::string& source);

}  // namespace foresight
