#include "procs/slam/motion_model.h"

#include <algorithm>

#include "procs/slam/geometry.h"

namespace foresight::slam {
namespace {
constexpr double kMaxExtrapolation = 3;  // intervals
}

MotionModel::MotionModel(const CameraModel& camera)
    : thumbnail_camera_(slam::thumbnail_camera(camera)) {}

Pose<Map, Cam> MotionModel::predict(Time time, const Thumbnail& thumbnail, double depth) const {
  Pose<Cam, Cam> last_from_now;
  if (has_velocity_ && interval_.us > 0) {
    const double factor = (time - last_time_).seconds() / interval_.seconds();
    last_from_now = scaled_motion(last_from_next_, std::clamp(factor, 0.0, kMaxExtrapolation));
  }
  if (!last_thumbnail_.pixels.empty()) {
    const ThumbnailAlignment turned =
        align_thumbnails(last_thumbnail_, thumbnail, thumbnail_camera_, last_from_now, depth);
    last_from_now = turned.source_from_target;
  }
  return map_from_last_ * last_from_now;
}

void MotionModel::update(Time time, const Thumbnail& thumbnail,
                         const Pose<Map, Cam>& map_from_cam) {
  if (!last_thumbnail_.pixels.empty()) {
    last_from_next_ = map_from_last_.inverse() * map_from_cam;
    interval_ = time - last_time_;
    has_velocity_ = interval_.us > 0;
  }
  last_time_ = time;
  last_thumbnail_ = thumbnail;
  map_from_last_ = map_from_cam;
}

void MotionModel::forget() {
  has_velocity_ = false;
  last_thumbnail_ = {};
}

void MotionModel::correct(const Similarity<Map, Map>& new_from_old) {
  map_from_last_ = new_from_old * map_from_last_;
  last_from_next_ = {last_from_next_.rotation(),
                     new_from_old.scale() * last_from_next_.translation()};
}

}  // namespace foresight::slam
