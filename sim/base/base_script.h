// How the base of the robot is moved about, unasked and unmeasured: by a script. Nothing of it is
// published but the truth.
//
//   const BaseScript script({.kind = BaseScript::Kind::kPush, .start_s = 5});
//   Pose<World, Base> world_from_base = script.at(since_start_s);
//   BaseMotion motion = script.motion_at(since_start_s);   // what the arm's bodies feel
//
// Every script begins with world and base the same, at rest; position, velocity and acceleration
// are continuous. Pure arithmetic of time and seed: any instant can be asked for, in any order.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/frames.h"
#include "sim/arm/dynamics.h"

namespace foresight::sim {

class BaseScript {
 public:
  enum class Kind : uint8_t {
    kStill,
    kPush,        // one displacement by amplitude_m and amplitude_rad (yaw), over duration_s
    kRamp,        // constant velocity for duration_s, with a smooth start and stop
    kWaves,       // like a deck: sinusoids in place and in roll, pitch and yaw, period period_s
    kRandomWalk,  // wanders within the amplitudes, seeded
  };
  struct Params {
    Kind kind = Kind::kStill;
    double start_s = 0;
    double duration_s = 1;
    double amplitude_m = 0.1;
    double amplitude_rad = 0.1;
    double direction_rad = 1.5708;  // of push and ramp: about z, from x (forwards) to y (left)
    double speed_m_per_s = 0.05;    // of ramp
    double period_s = 6;            // of waves
    uint64_t seed = 1;              // of random walk
  };

  explicit BaseScript(const Params& params);

  Pose<World, Base> at(double time_s) const;
  /// Velocities, accelerations and gravity in the base (by differences of at(), over 1 ms).
  BaseMotion motion_at(double time_s) const;

 private:
  // amplitude · sin(rate · t + phase)
  struct Swing {
    double amplitude, rate_rad_per_s, phase_rad;
  };
  using Swings = std::vector<Swing>;
  static double sum(const Swings& swings, double time_s);
  Pose<World, Base> displaced(double way_m, double yaw_rad) const;
  Pose<World, Base> swinging(double time_s) const;
  void prepare_waves();
  void prepare_random_walk();

  Params params_;
  std::array<Swings, 3> shift_, turn_;  // x y z; roll pitch yaw
};

}  // namespace foresight::sim
