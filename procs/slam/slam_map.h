// The map: keyframes with their images, points with the corner they come from, and who saw what.
// Ids are never reused within an epoch; iteration is in id order, so that it is deterministic.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include "common/frames.h"
#include "common/id.h"
#include "common/time.h"
#include "procs/slam/features.h"
#include "procs/slam/image_pyramid.h"
#include "procs/slam/thumbnail.h"

namespace foresight::slam {

/// Where one keyframe saw a point.
struct Observation {
  KeyframeId keyframe_id;
  int level = 0;          // pyramid level of the measurement
  Eigen::Vector2d pixel;  // of the full image
  Eigen::Vector2d xy;     // (x/z, y/z) of the ray
  double px_per_xy = 1;   // of the full image, there

  /// Pixels of its level per unit of xy: what turns its error into pixels.
  double scale_px() const { return px_per_xy / level_scale(level); }
};

/// The corner a point (or seed) comes from: the patch that is looked for in other images.
struct Corner {
  KeyframeId keyframe_id;
  int level = 0;
  Eigen::Vector2d pixel;  // of the full image
  /// Rays (z = 1) through the corner and through its neighbours one pixel (of its level) to the
  /// right and below: they carry the patch into other views.
  Eigen::Vector3d ray, ray_right, ray_down;
  double px_per_xy = 1;  // of the full image, there
};

struct Point {
  PointId id;
  Eigen::Vector3d position_in_map;
  Corner source;
  std::vector<Observation> observations;  // sorted by keyframe
  KeyframeId born_keyframe_id;            // newest keyframe when it was made
  int32_t predicted_count = 0;            // images it was searched for in
  int32_t found_count = 0;                // and found
  int32_t outlier_count = 0;              // observations that bundle adjustment threw out
  bool confirmed = false;                 // ended its probation well: receivers know it

  /// By one keyframe, if it sees the point.
  const Observation* observation_in(KeyframeId keyframe_id) const;
  /// Probability of finding it, from its history.
  double find_probability() const { return (found_count + 2.0) / (predicted_count + 3.0); }
};

struct Keyframe {
  KeyframeId id;
  Time time;
  Pose<Map, Cam> map_from_cam;
  ImagePyramid pyramid;
  Thumbnail thumbnail;
  std::shared_ptr<const Features> features;  // null until the worker has detected them
  double median_depth = 1;
  std::set<PointId> point_ids;  // of its observations
};

class SlamMap {
 public:
  const std::map<KeyframeId, Keyframe>& keyframes() const { return keyframes_; }
  const std::map<PointId, Point>& points() const { return points_; }
  const Keyframe* keyframe(KeyframeId id) const;
  const Point* point(PointId id) const;
  bool empty() const { return keyframes_.empty(); }
  const Keyframe& newest_keyframe() const;

  KeyframeId add_keyframe(Keyframe keyframe);  // gives it the next id
  PointId add_point(const Eigen::Vector3d& position_in_map, const Corner& source);
  /// With ids of their own, larger than all before: a stored map's. The observers of the point have
  /// to be there.
  void restore_keyframe(Keyframe keyframe);
  void restore_point(Point point);
  void remove_point(PointId id);
  /// With its observations; no point may have it as its source.
  void remove_keyframe(KeyframeId id);
  void set_source(PointId point_id, const Corner& source);
  void set_features(KeyframeId keyframe_id, std::shared_ptr<const Features> features);
  void move_keyframe(KeyframeId id, const Pose<Map, Cam>& map_from_cam);
  void scale_depth(KeyframeId keyframe_id, double factor);  // its median_depth
  void move_point(PointId id, const Eigen::Vector3d& position_in_map);
  /// Replaces the observation of the same keyframe, if there is one.
  void add_observation(PointId point_id, const Observation& observation);
  void remove_observation(PointId point_id, KeyframeId keyframe_id);
  /// Gives `kept` the observations of `merged` where it has none of its own, and its history.
  void merge_points(PointId kept, PointId merged);
  void count_outlier(PointId point_id);
  void count_prediction(PointId point_id, bool found);
  void confirm_point(PointId id);

  /// Elements touched since the last call, for the delta stream.
  struct Touched {
    std::set<KeyframeId> keyframes;
    std::set<PointId> points;  // those whose observations changed, too
  };
  Touched take_touched();

  /// Estimate of what the map holds, images and the place index's share included.
  size_t memory_bytes() const;

  /// Broken invariants end the process (tests call it after every step).
  void validate() const;

 private:
  Point& point_ref(PointId id);

  std::map<KeyframeId, Keyframe> keyframes_;
  std::map<PointId, Point> points_;
  KeyframeId next_keyframe_id_{0};
  PointId next_point_id_{0};
  Touched touched_;
};

/// The point that the keyframe sees nearest to a pixel of its image; null if none is within radius.
const Point* point_near(const SlamMap& map, const Keyframe& keyframe, const Eigen::Vector2d& pixel,
                        double radius_px);

/// How many of these points each keyframe sees.
std::map<KeyframeId, int> shared_point_counts(const SlamMap& map,
                                              const std::set<PointId>& point_ids);

/// Ids ordered by count, larger first, then the newer keyframe.
std::vector<KeyframeId> by_count(const std::map<KeyframeId, int>& counts);
std::vector<KeyframeId> first_few(std::vector<KeyframeId> ids, int count);

}  // namespace foresight::slam
