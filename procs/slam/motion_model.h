// Predicts the next camera pose: constant velocity, corrected by the turn that the thumbnails show.
#pragma once

#include <optional>

#include "common/camera_model.h"
#include "common/frames.h"
#include "common/time.h"
#include "procs/slam/thumbnail.h"

namespace foresight::slam {

class MotionModel {
 public:
  explicit MotionModel(const CameraModel& camera);

  /// `depth`: typical distance of the scene, mu.
  Pose<Map, Cam> predict(Time time, const Thumbnail& thumbnail, double depth) const;
  /// A frame was placed.
  void update(Time time, const Thumbnail& thumbnail, const Pose<Map, Cam>& map_from_cam);
  /// The map was moved by this much around the last pose.
  void correct(const Similarity<Map, Map>& new_from_old);
  /// After a loss: the next update starts afresh.
  void forget();
  const Pose<Map, Cam>& last_pose() const { return map_from_last_; }

 private:
  CameraModel thumbnail_camera_;
  Time last_time_;
  Thumbnail last_thumbnail_;
  Pose<Map, Cam> map_from_last_;
  bool has_velocity_ = false;
  Duration interval_;
  Pose<Cam, Cam> last_from_next_;  // motion during `interval_`
};

}  // namespace foresight::slam
