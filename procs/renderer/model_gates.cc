#include "procs/renderer/model_gates.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/snapshot_gate.h"
#include "procs/renderer/view_store.h"

namespace foresight {
namespace {

constexpr double kJump = 1;  // of pose_distance() between two images: nobody moves a camera so fast
constexpr Duration kSoon = milliseconds(500);
constexpr int32_t kVersionsLost = 1000;
// The answer may wait for an interval, and what was forged beside it has gone by then.
constexpr Duration kConfirmAfter = kSnapshotInterval + milliseconds(200);

}  // namespace

bool is_possible(const CameraModel& camera) {
  constexpr int kLeastSide_px = 16, kMaxSide_px = 8192;
  const double width = camera.width_px, height = camera.height_px;
  const double longest = std::max(width, height);
  const auto is_focal = [longest](double f) { return f > 0.02 * longest && f < 100 * longest; };
  const auto is_centre = [](double c, double side) { return c > -side && c < 2 * side; };
  return std::min(width, height) >= kLeastSide_px && longest <= kMaxSide_px &&
         is_focal(camera.fx_px) && is_focal(camera.fy_px) && is_centre(camera.cx_px, width) &&
         is_centre(camera.cy_px, height) && camera.max_radius > 0 &&
         std::all_of(camera.distortion.begin(), camera.distortion.end(),
                     [](double k) { return std::abs(k) < 1e3; });
}

bool ViewGate::may_paint(Time time, int64_t epoch, const Pose<Map, Cam>& map_from_cam,
                         double length_unit_mu) {
  if (!epoch_.offer(epoch)) return false;
  if (std::exchange(pose_epoch_, epoch) != epoch) last_.reset();
  const auto is_near = [&](const std::optional<Pose<Map, Cam>>& pose) {
    return pose && pose_distance(*pose, map_from_cam, length_unit_mu) < kJump;
  };
  const bool is_long_ago = time - last_time_ > kSoon || time < last_time_;
  const bool is_steady = !last_ || is_long_ago || is_near(last_) || is_near(jumped_);
  jumped_.reset();
  (is_steady ? last_ : jumped_) = map_from_cam;
  if (is_steady) last_time_ = time;
  return is_steady;
}

bool MeshGate::follows(Time now, const MeshName& mesh, int64_t view_epoch) {
  const StampVerdict verdict = order_.judge(now, mesh.time);
  if (!is_taken(verdict) && verdict != StampVerdict::kRepeated) return false;
  if (!shown_ || mesh == *shown_) return true;
  if (mesh.epoch != shown_->epoch) return mesh.epoch == view_epoch;
  return mesh.version > shown_->version && int64_t{mesh.version} - shown_->version <= kVersionsLost;
}

bool MeshGate::admit(Time now, const MeshName& mesh, int64_t view_epoch) {
  const bool is_answer = is_asked_ && is_plausible(mesh.time);
  if (!follows(now, mesh, view_epoch) && !is_answer) return false;
  confirmed_for_.reset();
  if (is_answer && mesh == shown_) confirmed_for_ = view_epoch;
  is_asked_ = false;
  shown_ = mesh;
  arrival_ = now;
  return true;
}

bool MeshGate::is_unconfirmed(Time now, int64_t view_epoch) const {
  const bool has_stayed = now - arrival_ >= kConfirmAfter || now < arrival_;
  return shown_ && !is_asked_ && has_stayed && confirmed_for_ != view_epoch;
}

}  // namespace foresight
