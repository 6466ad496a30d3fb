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
#include "common/time.h"
#include "procs/slam/features.h"
#include "procs/slam/image_pyramid.h"
#include "procs/slam/thumbnail.h"

namespace foresight::slam {

/// Where one keyframe saw a point.
struct Observation {
  int32_t keyframe_id = 0;
  int level = 0;          // pyramid level of the measurement
  Eigen::Vector2d pixel;  // of the full image
  Eigen::Vector2d xy;     // (x/z, y/z) of the ray
  double px_per_xy = 1;   // of the full image, there

  /// Pixels of its level per unit of xy: what turns its error into pixels.
  double scale_px() const { return px_per_xy / level_scale(level); }
};

/// The corner a point (or seed) comes from: the patch that is looked for in other images.
struct Corner {
  int32_t keyframe_id = 0;
  int level = 0;
  Eigen::Vector2d pixel;  // of the full image
  /// Rays (z = 1) through the corner and through its neighbours one pixel (of its level) to the
  /// right and below: they carry the patch into other views.
  Eigen::Vector3d ray, ray_right, ray_down;
  double px_per_xy = 1;  // of the full image, there
};

struct Point {
  int32_t id = 0;
  Eigen::Vector3d position_in_map;
  Corner source;
  std::vector<Observation> observations;  // sorted by keyframe
  int32_t born_keyframe_id = 0;           // newest keyframe when it was made
  int32_t predicted_count = 0;            // images it was searched for in
  int32_t found_count = 0;                // and found
  int32_t outlier_count = 0;              // observations that bundle adjustment threw out
  bool confirmed = false;                 // ended its probation well: receivers know it

  /// By one keyframe, if it sees the point.
  const Observation* observation_in(int32_t keyframe_id) const;
  /// Probability of finding it, from its history.
  double find_probability() const { return (found_count + 2.0) / (predicted_count + 3.0); }
};

struct Keyframe {
  int32_t id = 0;
  Time time;
  Pose<Map, Cam> map_from_cam;
  ImagePyramid pyramid;
  Thumbnail thumbnail;
  std::shared_ptr<const Features> features;  // null until the worker has detected them
  double median_depth = 1;
  std::set<int32_t> point_ids;  // of its observations
};

class SlamMap {
 public:
  const std::map<int32_t, Keyframe>& keyframes() const { return keyframes_; }
  const std::map<int32_t, Point>& points() const { return points_; }
  const Keyframe* keyframe(int32_t id) const;
  const Point* point(int32_t id) const;
  bool empty() const { return keyframes_.empty(); }
  const Keyframe& newest_keyframe() const;

  int32_t add_keyframe(Keyframe keyframe);  // gives it the next id
  int32_t add_point(const Eigen::Vector3d& position_in_map, const Corner& source);
  /// With ids of their own, larger than all before: a stored map's. The observers of the point have
  /// to be there.
  void restore_keyframe(Keyframe keyframe);
  void restore_point(Point point);
  void remove_point(int32_t id);
  /// With its observations; no point may have it as its source.
  void remove_keyframe(int32_t id);
  void set_source(int32_t point_id, const Corner& source);
  void set_features(int32_t keyframe_id, std::shared_ptr<const Features> features);
  void move_keyframe(int32_t id, const Pose<Map, Cam>& map_from_cam);
  void scale_depth(int32_t keyframe_id, double factor);  // its median_depth
  void move_point(int32_t id, const Eigen::Vector3d& position_in_map);
  /// Replaces the observation of the same keyframe, if there is one.
  void add_observation(int32_t point_id, const Observation& observation);
  void remove_observation(int32_t point_id, int32_t keyframe_id);
  /// Gives `kept` the observations of `merged` where it has none of its own, and its history.
  void merge_points(int32_t kept, int32_t merged);
  void count_outlier(int32_t point_id);
  void count_prediction(int32_t point_id, bool found);
  void confirm_point(int32_t id);

  /// Elements touched since the last call, for the delta stream.
  struct Touched {
    std::set<int32_t> keyframes, points;  // points include those whose observations changed
  };
  Touched take_touched();

  /// Estimate of what the map holds, images and the place index's share included.
  size_t memory_bytes() const;

  /// Broken invariants end the process (tests call it after every step).
  void validate() const;

 private:
  Point& point_ref(int32_t id);

  std::map<int32_t, Keyframe> keyframes_;
  std::map<int32_t, Point> points_;
  int32_t next_keyframe_id_ = 0;
  int32_t next_point_id_ = 0;
  Touched touched_;
};

/// The point that the keyframe sees nearest to a pixel of its image; null if none is within radius.
const Point* point_near(const SlamMap& map, const Keyframe& keyframe, const Eigen::Vector2d& pixel,
                        double radius_px);

/// How many of these points each keyframe sees.
std::map<int32_t, int> shared_point_counts(const SlamMap& map, const std::set<int32_t>& point_ids);

/// Ids ordered by count, larger first, then the newer keyframe.
std::vector<int32_t> by_count(const std::map<int32_t, int>& counts);
std::vector<int32_t> first_few(std::vector<int32_t> ids, int count);

}  // namespace foresight::slam
