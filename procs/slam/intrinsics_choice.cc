#include "procs/slam/intrinsics_choice.h"

namespace foresight {
namespace {

constexpr int kStatements = 3;
constexpr Duration kPersistence = seconds(2);

}  // namespace

bool IntrinsicsChoice::persists(Time now) const {
  return contender_->statements >= kStatements && now - contender_->since >= kPersistence &&
         contender_->fitting_images > contender_->other_images;
}

CameraVerdict IntrinsicsChoice::offer(Time now, const CameraModel& stated) {
  const bool first = !camera_ || is_assumed_;
  const bool same = camera_ && stated == *camera_;
  if (first || same) {
    camera_ = stated;
    is_assumed_ = false;
    contender_.reset();
    return same ? CameraVerdict::kSame : CameraVerdict::kNew;
  }
  if (!contender_ || !(contender_->camera == stated) || now < contender_->since) {
    contender_ = Contender{stated, now};
  }
  ++contender_->statements;
  if (!persists(now)) {
    ++doubted_;
    return CameraVerdict::kDoubted;
  }
  camera_ = stated;
  contender_.reset();
  return CameraVerdict::kNew;
}

void IntrinsicsChoice::saw_image(int width_px, int height_px) {
  if (!contender_) return;
  const CameraModel& c = contender_->camera;
  const bool fits = width_px == c.width_px && height_px == c.height_px;
  ++(fits ? contender_->fitting_images : contender_->other_images);
}

}  // namespace foresight
