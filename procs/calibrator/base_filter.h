// The base's motion (paper §II-C.2): from every tracked frame eq. (8) gives B̂ = W E_p E_m⁻¹; a
// filter turns these into the base's pose.
//
//   auto filter = make_base_filter(options);
//   filter->reset({time, world_from_cam, base_from_cam});
//   BaseState estimate = filter->update(measurement);   // or coast(time) when there is none
//
// `paper`: B ← SLERP/lerp(B̂, B; λ). It lags by λ/(1−λ) frames (0.63 s at 30 Hz and λ = 0.95).
// `kalman`: see kalman_base_filter.h.
#pragma once

#include <memory>
#include <optional>

#include "common/frames.h"
#include "common/robot_types.h"
#include "common/time.h"

namespace foresight::calibration {

/// One tracked frame: the camera in the world by way of the map, and in the base by way of the arm.
struct BaseMeasurement {
  Time time;
  Pose<World, Cam> world_from_cam;
  Pose<Base, Cam> base_from_cam;

  /// Eq. (8).
  Pose<World, Base> world_from_base() const { return world_from_cam * base_from_cam.inverse(); }
};

enum class BaseFilterKind { kPaper, kKalman };

struct BaseFilterOptions {
  BaseFilterKind kind = BaseFilterKind::kKalman;
  double lambda = 0.95;  // of the paper's filter
  // Noise of a single camera pose before the filter has measured it: 3D standard deviations.
  double position_noise_m = 0.002;
  double rotation_noise_deg = 0.1;
  double velocity_decay_s = 0.3;  // of the base's velocity while nothing is measured
  double reacquire_s = 1.5;  // so long must measurements contradict consistently to be believed
};

struct BaseFilterStatistics {
  int refused = 0;         // measurements that contradicted the estimate
  int reacquisitions = 0;  // times that a consistent contradiction was believed
  double position_noise_m = 0, rotation_noise_rad = 0;  // as measured
};

/// Filters know no maps: they leave the estimates' epoch 0.
class BaseFilter {
 public:
  virtual ~BaseFilter() = default;
  /// Begins at a measurement, at rest.
  virtual void reset(const BaseMeasurement& measurement) = 0;
  /// A frame with a measurement; coasts when it contradicts. Times increase.
  virtual BaseState update(const BaseMeasurement& measurement) = 0;
  /// A frame without one.
  virtual BaseState coast(Time time) = 0;
  /// Where the base was for long, if it is believed elsewhere since and that is not certain yet.
  virtual std::optional<Pose<World, Base>> earlier() const { return std::nullopt; }
  virtual BaseFilterStatistics statistics() const = 0;
};

std::unique_ptr<BaseFilter> make_base_filter(const BaseFilterOptions& options);

}  // namespace foresight::calibration
