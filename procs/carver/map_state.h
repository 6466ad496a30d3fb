// What the carver knows of the map, and the net work that a delta causes.
//
// `stage` applies a MapDelta to the records and collects: rays to erase (with the geometry they
// were traced with), rays to trace, points to take out of and to put into the triangulation. A
// moved point or camera retires its rays and issues new ones. Nothing here is geometric.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "common/map_delta.h"
#include "procs/carver/cell_complex.h"
#include "procs/carver/hull.h"

namespace foresight::carving {

struct KeyframeRecord {
  KeyframeId id;
  int64_t arrival = 0;  // ascending with age
  Point3 centre{};
  Feature start;  // where the centre lies; cell −1 = not located
  bool alive = false;
  std::vector<int32_t> rays;
};

struct PointRecord {
  PointId id;
  Point3 position{};
  int32_t vertex = -1;
  bool alive = false;
  bool waiting = false;  // to be put into the triangulation
  std::vector<int32_t> rays;
};

enum class RayState : uint8_t { kFree, kNew, kTraced, kRetired };

struct RayRecord {
  int32_t keyframe = 0;
  int32_t point = 0;
  uint32_t stamp = 0;  // the delta that last queued it
  RayState state = RayState::kFree;
  bool degenerate = false;  // meets an edge or vertex, or runs in a facet
  bool grazing = false;     // runs in a facet or edge, where no cell lists it
  bool tied = false;        // which cell lies behind its point is a matter of convention
  int32_t behind = -1;      // that cell
};

/// A ray to erase from the cells it crosses, as it was traced.
struct RetiredRay {
  int32_t ray = 0;
  Point3 from{};
  Feature start;
  int32_t vertex = 0;
};

struct DetachedPoint {
  int32_t point = 0;
  int32_t vertex = 0;
};

struct StagedChanges {
  std::vector<RetiredRay> retired;
  std::vector<int32_t> issued;  // rays; those that are still kNew are to be traced
  std::vector<DetachedPoint> detached;
  std::vector<int32_t> attached;  // points; those that are alive and waiting
};

class MapState {
 public:
  explicit MapState(double max_coordinate_mu) : max_coordinate_(max_coordinate_mu) {}

  const StagedChanges& stage(const MapDelta& delta);
  /// The staged work is done: traced rays are live, numbers of removed things may be reused.
  void finish();
  /// The staged work cannot be done yet (no hull): new rays and points keep waiting.
  void postpone();
  Extent extent() const;

  std::vector<KeyframeRecord> keyframes;
  std::vector<PointRecord> points;
  std::vector<RayRecord> rays;
  StagedChanges staged;
  int64_t ignored = 0;
  int64_t live_points = 0, live_keyframes = 0, live_rays = 0;
  int64_t thinned_rays = 0;  // forgotten to save memory, since the start

  /// Forgets an observation that has been traced, to save memory; that it is removed later is then
  /// no mistake.
  void thin_ray(int32_t ray);

  /// The number of the point with this id, or −1.
  int32_t find_point(PointId id) const;
  size_t memory_bytes() const;

 private:
  void remove_observation(const MapObservation& observation);
  void remove_point(PointId id);
  void remove_keyframe(KeyframeId id);
  void set_keyframe(const MapKeyframe& keyframe);
  void set_point(const MapPoint& point);
  void add_observation(const MapObservation& observation);
  bool is_sane(const Point3& position) const;
  void issue_ray(int32_t keyframe, int32_t point);
  void retire_ray(int32_t ray);
  void reissue(const std::vector<int32_t>& rays);
  void detach(int32_t point);
  int32_t find_keyframe(KeyframeId id) const;
  int32_t find_ray(int32_t keyframe, int32_t point) const;

  double max_coordinate_;
  int64_t arrivals_ = 0;
  int64_t thinned_unremoved_ = 0;  // thinned rays whose removal has not been asked for
  std::unordered_map<PointId, int32_t> point_by_id_;
  std::unordered_map<KeyframeId, int32_t> keyframe_by_id_;
  std::vector<int32_t> free_points_, free_keyframes_, free_rays_;
  std::vector<int32_t> dropped_points_, dropped_keyframes_, dropped_rays_;
};

}  // namespace foresight::carving
