// The arm as the controller sees it: joint positions and the safety board's word in, joint torques
// out. Behind it are messages (the simulated arm) or a CAN bus.
#pragma once

#include <string_view>

#include "common/arm_model.h"
#include "common/time.h"

namespace foresight {

/// Of the arm's safety board. Software cannot leave the first two: a person presses the pendant.
enum class Safety : int8_t { kEstop = 0, kIdle = 1, kActive = 2 };

struct ArmReading {
  Time time;                 // of the encoders
  JointVector position_rad;  // one per joint
  Safety safety = Safety::kEstop;
  bool is_warning = false;  // the safety board finds the arm too fast
  std::string_view fault;   // why the board left ACTIVE; valid until the next reading
};

class ArmHardware {
 public:
  virtual ~ArmHardware() = default;
  /// False when the arm did not answer in full; `reading` is then not to be used.
  [[nodiscard]] virtual bool read(Time now, ArmReading* reading) = 0;
  /// Answers the last reading; also the arm's heartbeat.
  virtual void write(const JointVector& joint_torque_nm) = 0;
};

}  // namespace foresight
