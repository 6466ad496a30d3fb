// Which delayed images are kept, and which of them paint the next picture. No OpenGL in here.
//
//   ViewStore store(24);
//   const StoredView& kept = store.insert(id, time, camera, map_from_cam, length_unit_mu);
//   upload_image(kept.slot, ...);
//   for (StoredView* view : store.select(query)) ...        // newest first
//
// Kept: the newest view, and earlier ones spread over viewing poses. A view that is no longer the
// newest settles: it takes the place of the stored view whose anchor (the pose that founded the
// place) is nearer than kSamePlace, or founds a place of its own. Anchors stay, so a slowly moving
// camera leaves a trail instead of dragging one place along. When full, the older view of the two
// with the closest anchors goes.
//
// Selected: the newest, then greedily the view with the greatest
//   (share of sample points not yet in a chosen view's image) − kCloseness · distance to the
//   predicted pose, ties to the newer one.
//
// Distance of two poses: rotation angle [rad] + shift / length unit (the scene's size), so the
// map's scale does not matter. Everything is deterministic.
#pragma once

#include <optional>
#include <vector>

#include "common/camera_model.h"
#include "common/frames.h"
#include "common/time.h"

namespace foresight {

struct StoredView {
  int64_t id = 0;
  Time time;
  CameraModel camera;
  Pose<Map, Cam> map_from_cam;
  Pose<Map, Cam> anchor;
  int slot = 0;              // image and depth map live in this layer
  CameraModel depth_camera;  // pinhole of the depth map
  int64_t depth_mesh = -1;   // number of the mesh that the depth map shows; −1: none
};

struct ViewQuery {
  Pose<Map, Cam> map_from_predicted_cam;
  CameraModel camera;
  const std::vector<Eigen::Vector3f>* samples_in_map = nullptr;  // surface points; may be null
  double length_unit_mu = 0;                                     // 0: unknown, shifts do not count
  int count = 6;
};

class ViewStore {
 public:
  static constexpr double kSamePlace = 0.08;
  static constexpr double kCloseness = 0.25;

  explicit ViewStore(int capacity);
  /// Adds a view, or replaces the one with this id. May drop others. O(capacity²).
  StoredView& insert(int64_t id, Time time, const CameraModel& camera,
                     const Pose<Map, Cam>& map_from_cam, double length_unit_mu);
  StoredView* find(int64_t id);
  void clear() { views_.clear(); }
  /// Drops the views that are newer: their stamps were of a clock that has been set since.
  void clear_after(Time time) {
    std::erase_if(views_, [time](const StoredView& view) { return view.time > time; });
  }
  int size() const { return static_cast<int>(views_.size()); }
  const std::vector<StoredView>& views() const { return views_; }
  /// At most query.count views by rank. O(count · capacity · samples). Pointers last until the next
  /// insert or clear.
  std::vector<StoredView*> select(const ViewQuery& query);

 private:
  size_t newest() const;
  void settle(size_t index, double length_unit_mu);
  void evict(double length_unit_mu);
  int free_slot() const;

  int capacity_;
  std::vector<StoredView> views_;
};

double pose_distance(const Pose<Map, Cam>& a, const Pose<Map, Cam>& b, double length_unit_mu);

}  // namespace foresight
