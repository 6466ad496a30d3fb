// Whose intrinsics count. A camera's do not change in a session without a word, and a new camera
// needs a new map: so one message that differs bends nothing, a stated change that persists and
// that the images fit is believed, and two publishers that contradict each other change nothing.
//
//   switch (choice.offer(now, stated)) {
//     case CameraVerdict::kNew: begin_with(*choice.camera()); break;
//     case CameraVerdict::kDoubted: …             // counted: choice.doubted()
//     case CameraVerdict::kSame: break;
//   }
#pragma once

#include <cstdint>
#include <optional>

#include "common/camera_model.h"
#include "common/time.h"

namespace foresight {

enum class CameraVerdict { kSame, kNew, kDoubted };

class IntrinsicsChoice {
 public:
  /// The first statement counts at once. A different one when it has been stated three times
  /// running, for two seconds, while most images had its size.
  [[nodiscard]] CameraVerdict offer(Time now, const CameraModel& stated);
  /// The size of an image that has arrived.
  void saw_image(int width_px, int height_px);
  /// Known from before, without a statement in this session: the first statement decides.
  void assume(const CameraModel& camera) {
    camera_ = camera;
    is_assumed_ = true;
  }

  const std::optional<CameraModel>& camera() const { return camera_; }
  /// Statements that were not believed.
  int64_t doubted() const { return doubted_; }

 private:
  struct Contender {
    CameraModel camera;
    Time since;
    int statements = 0, fitting_images = 0, other_images = 0;
  };
  bool persists(Time now) const;

  std::optional<CameraModel> camera_;
  bool is_assumed_ = false;
  std::optional<Contender> contender_;
  int64_t doubted_ = 0;
};

}  // namespace foresight
