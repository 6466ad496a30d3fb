// What of the robot's messages may change the picture. No single message bends the view for good:
// what contradicts the stream so far counts only when it persists or was asked for.
#pragma once

#include <cstdint>
#include <optional>

#include "common/camera_model.h"
#include "common/frames.h"
#include "common/newest_stamp.h"
#include "common/persistent_value.h"
#include "common/time.h"

namespace foresight {

/// Intrinsics of a lens that somebody could have built.
bool is_possible(const CameraModel& camera);

/// Which images are shown, and which of them paint: in order of their stamps, of one map, and
/// without a pose that jumps away and back.
class ViewGate {
 public:
  /// Of every image: it is shown when is_taken(). After kRestarted later images are to be
  /// forgotten.
  [[nodiscard]] StampVerdict admit(Time now, Time stamp) { return order_.judge(now, stamp); }
  /// Of an image that is shown: whether it may paint. `length_unit_mu`: the scene's size.
  [[nodiscard]] bool may_paint(Time time, int64_t epoch, const Pose<Map, Cam>& map_from_cam,
                               double length_unit_mu);
  /// Of the map that is shown; 0: none yet.
  int64_t epoch() const { return epoch_.value().value_or(0); }

 private:
  NewestStamp order_;
  PersistentValue<int64_t> epoch_;
  int64_t pose_epoch_ = 0;
  Time last_time_;
  std::optional<Pose<Map, Cam>> last_, jumped_;
};

struct MeshName {
  int64_t epoch = 0;
  int32_t version = 0;
  Time time;
  uint64_t digest = 0;  // of what it holds
  bool operator==(const MeshName&) const = default;
};

/// Which meshes are shown. A mesh that does not follow the last one is not: ask for the mesh
/// instead, the answer is. So that a forged mesh which does follow, or comes before the answer,
/// goes too, one that stays is asked for until the answer is the very same.
class MeshGate {
 public:
  /// `view_epoch`: of the images; 0: none yet. False: ask.
  [[nodiscard]] bool admit(Time now, const MeshName& mesh, int64_t view_epoch);
  /// Call it when the mesh is asked for.
  void ask() { is_asked_ = true; }
  bool is_asked() const { return is_asked_; }
  /// The mesh has stayed for a while, and no answer was the same since it or the images' map came.
  bool is_unconfirmed(Time now, int64_t view_epoch) const;
  const std::optional<MeshName>& shown() const { return shown_; }

 private:
  bool follows(Time now, const MeshName& mesh, int64_t view_epoch);

  NewestStamp order_{{.patience = 2, .span = {}}};
  std::optional<MeshName> shown_;
  Time arrival_;
  bool is_asked_ = true;                  // a display starts late
  std::optional<int64_t> confirmed_for_;  // the images' map when it was
};

}  // namespace foresight
