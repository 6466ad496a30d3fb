// Smooth seeded camera motions in the lab, as a camera in the hand of the arm would make them:
// near the arm's base, looking at the desk and the wall behind it; or round the base, looking
// outward. They start from rest, and never exceed kMaxSpeed_m_per_s and kMaxTurn_rad_per_s.
//
//   const Trajectory trajectory(Trajectory::Kind::kDesk, 1);
//   Pose<World, Cam> world_from_cam = trajectory.at(seconds(2.5));
#pragma once

#include <array>
#include <cstdint>

#include "common/frames.h"
#include "common/time.h"

namespace foresight::sim {

constexpr double kMaxSpeed_m_per_s = 0.4;
constexpr double kMaxTurn_rad_per_s = 0.5236;  // 30°/s

class Trajectory {
 public:
  enum class Kind {
    kDesk,      // sweeps along the desk; begins with sideways translation, good to start a map
    kRotation,  // turns on the spot, no translation
    kStatic,    // stands still
    kReturn,    // goes along the desk and comes back to its start, again and again
    kLoop,      // goes round the world's origin, looking outward, again and again
    kWander,    // a hand before the desk: within ±0.3 m, turned by up to 20°, never where it was
  };

  Trajectory(Kind kind, uint64_t seed);

  Pose<World, Cam> at(Duration since_start) const;
  /// When kReturn is back at its start for the count-th time (count ≥ 1).
  Duration time_of_return(int count) const;
  /// When kLoop has ended its count-th lap and is at its start (count ≥ 1).
  Duration time_of_lap(int count) const;

 private:
  // amplitude · sin(rate · t + phase), minus its value at t = 0.
  struct Swing {
    double amplitude = 0, rate_rad_per_s = 0, phase_rad = 0;
    double at(double t_s) const;
  };
  // A circle around the world's vertical, not quite round: radius and height (m) and the angle by
  // which the camera looks down (rad) swing a whole number of times per lap.
  struct Ring {
    double radius_m = 0, height_m = 0, down_rad = 0;
    double start_rad = 0, direction = 1;  // where it begins, from x to y; 1: counterclockwise
    Swing radius, height, down;
  };
  static Ring ring_of(uint64_t seed);
  void wander(uint64_t seed);
  Pose<World, Cam> pose_at_phase(double phase_s) const;
  Pose<World, Cam> pose_on_ring(double phase_s) const;
  double phase_at(double t_s) const;
  double safe_pace() const;

  Kind kind_;
  Eigen::Vector3d start_in_world_, target_in_world_;
  std::array<Swing, 3> position_, position_detail_, target_, target_detail_;
  std::array<Swing, 2> roll_;  // about the optical axis
  Ring ring_;                  // of kLoop, which uses nothing of the above
  double pace_ = 1;            // slows the whole motion so that the limits hold
};

}  // namespace foresight::sim
