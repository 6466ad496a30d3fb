#include "procs/slam/map_storage.h"

#include <optional>
#include <utility>

#include "procs/slam/corner_detector.h"
#include "procs/slam/patch.h"

namespace foresight::slam {

StoredMap store(const SlamMap& map, const CameraModel& camera) {
  StoredMap stored;
  stored.camera = camera;
  for (const auto& [id, k] : map.keyframes()) {
    stored.keyframes.push_back({id, k.time, k.map_from_cam, k.median_depth, k.pyramid.levels[0]});
  }
  for (const auto& [id, p] : map.points()) {
    StoredMap::Point point;
    point.id = id;
    point.position_in_map = p.position_in_map;
    point.source_keyframe_id = p.source.keyframe_id;
    point.confirmed = p.confirmed;
    point.predicted_count = p.predicted_count;
    point.found_count = p.found_count;
    point.outlier_count = p.outlier_count;
    point.born_keyframe_id = p.born_keyframe_id;
    for (const Observation& o : p.observations) {
      point.observations.push_back({o.keyframe_id, o.level, o.pixel});
    }
    stored.points.push_back(std::move(point));
  }
  return stored;
}

SlamMap restored(const StoredMap& stored, const CameraModel& camera) {
  SlamMap map;
  for (const StoredMap::Keyframe& k : stored.keyframes) {
    Keyframe keyframe;
    keyframe.id = k.id;
    keyframe.time = k.time;
    keyframe.map_from_cam = k.map_from_cam;
    keyframe.median_depth = k.median_depth;
    keyframe.pyramid = build_pyramid(
        {k.image.data, k.image.cols, k.image.rows, static_cast<int>(k.image.step[0])});
    keyframe.thumbnail = make_thumbnail(keyframe.pyramid);
    map.restore_keyframe(std::move(keyframe));
  }
  for (const StoredMap::Point& p : stored.points) {
    Point point;
    point.id = p.id;
    point.position_in_map = p.position_in_map;
    point.confirmed = p.confirmed;
    point.predicted_count = p.predicted_count;
    point.found_count = p.found_count;
    point.outlier_count = p.outlier_count;
    point.born_keyframe_id = p.born_keyframe_id;
    std::optional<Corner> source;
    for (const StoredMap::Observation& o : p.observations) {
      const Eigen::Vector2d xy = camera.unproject(o.pixel);
      point.observations.push_back({o.keyframe_id, o.level, o.pixel, xy, camera.px_per_xy(xy)});
      if (o.keyframe_id == p.source_keyframe_id) {
        source = make_corner(camera, o.keyframe_id, {o.pixel, o.level});
      }
    }
    if (!source) continue;
    point.source = *source;
    map.restore_point(std::move(point));
  }
  return map;
}

}  // namespace foresight::slam
