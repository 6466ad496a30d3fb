// What the carver knows of the map, and the net work that a delta causes.
//
// An observation of the map – a keyframe saw a point – is a constraint here: the segment between
// the two is free space.
//
// `stage` applies a MapDelta to the records and collects: constraints to erase (with the geometry
// they were traced with), constraints to trace, points to take out of and to put into the
// triangulation. A moved point or camera retires its constraints and issues new ones. Nothing here
// is geometric.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "common/map_delta.h"
#include "procs/carver/hull.h"
#include "procs/carver/tetrahedra.h"

namespace foresight::carving {

struct KeyframeRecord {
  KeyframeId id;
  int64_t arrival = 0;  // ascending with age
  Point3 centre{};
  Feature start;  // where the centre lies; no cell = not located
  bool alive = false;
  std::vector<ConstraintIndex> constraints;
};

struct PointRecord {
  PointId id;
  Point3 position{};
  VertexIndex vertex;
  bool alive = false;
  bool waiting = false;  // to be put into the triangulation
  std::vector<ConstraintIndex> constraints;
};

enum class ConstraintState : uint8_t { kFree, kNew, kTraced, kRetired };

struct ConstraintRecord {
  KeyframeIndex keyframe;
  PointIndex point;
  uint32_t stamp = 0;  // the delta that last queued it
  ConstraintState state = ConstraintState::kFree;
  bool degenerate = false;  // meets an edge or vertex, or runs in a facet
  bool grazing = false;     // runs in a facet or edge, where no cell lists it
  bool tied = false;        // which cell lies behind its point is a matter of convention
  CellId behind;            // that cell
};

/// A constraint to erase from the cells it crosses, as it was traced.
struct RetiredConstraint {
  ConstraintIndex constraint;
  Point3 from{};
  Feature start;
  VertexIndex vertex;
};

struct DetachedPoint {
  PointIndex point;
  VertexIndex vertex;
};

struct StagedChanges {
  std::vector<RetiredConstraint> retired;
  std::vector<ConstraintIndex> issued;  // constraints; those that are still kNew are to be traced
  std::vector<DetachedPoint> detached;
  std::vector<PointIndex> attached;  // points; those that are alive and waiting
};

class MapState {
 public:
  explicit MapState(double max_coordinate_mu) : max_coordinate_(max_coordinate_mu) {}

  const StagedChanges& stage(const MapDelta& delta);
  /// The staged work is done: traced constraints are live, numbers of removed things may be reused.
  void finish();
  /// The staged work cannot be done yet (no hull): new constraints and points keep waiting.
  void postpone();
  Extent extent() const;

  IdVector<KeyframeIndex, KeyframeRecord> keyframes;
  IdVector<PointIndex, PointRecord> points;
  IdVector<ConstraintIndex, ConstraintRecord> constraints;
  StagedChanges staged;
  int64_t ignored = 0;
  int64_t live_points = 0, live_keyframes = 0, live_constraints = 0;
  int64_t thinned_constraints = 0;  // forgotten to save memory, since the start

  /// Forgets a constraint that has been traced, to save memory; that its observation is removed
  /// later is then no mistake.
  void thin_constraint(ConstraintIndex constraint);

  /// The point with this id, or none.
  PointIndex find_point(PointId id) const;
  size_t memory_bytes() const;

 private:
  void remove_observation(const MapObservation& observation);
  void remove_point(PointId id);
  void remove_keyframe(KeyframeId id);
  void set_keyframe(const MapKeyframe& keyframe);
  void set_point(const MapPoint& point);
  void add_observation(const MapObservation& observation);
  bool is_sane(const Point3& position) const;
  void issue_constraint(KeyframeIndex keyframe, PointIndex point);
  void retire_constraint(ConstraintIndex constraint);
  void reissue(const std::vector<ConstraintIndex>& affected);
  void detach(PointIndex point);
  KeyframeIndex find_keyframe(KeyframeId id) const;
  ConstraintIndex find_constraint(KeyframeIndex keyframe, PointIndex point) const;

  double max_coordinate_;
  int64_t arrivals_ = 0;
  int64_t thinned_unremoved_ = 0;  // thinned constraints whose removal has not been asked for
  std::unordered_map<PointId, PointIndex> point_by_id_;
  std::unordered_map<KeyframeId, KeyframeIndex> keyframe_by_id_;
  std::vector<PointIndex> free_points_, dropped_points_;
  std::vector<KeyframeIndex> free_keyframes_, dropped_keyframes_;
  std::vector<ConstraintIndex> free_constraints_, dropped_constraints_;
};

}  // namespace foresight::carving
