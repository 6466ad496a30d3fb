#include "procs/calibrator/recalled_alignment.h"

#include "procs/calibrator/geometry.h"

namespace foresight::calibration {

RecalledAlignment::Opinion RecalledAlignment::opinion(Time time,
                                                      const Pose<World, Base>& world_from_base,
                                                      const BaseBounds& bounds) const {
  const Duration age = time - kept_.time;
  if (age < Duration{} || age > kLongestAge) return Opinion::kOfAnotherTime;
  const Pose<Base, Base> moved = kept_.world_from_base.inverse() * world_from_base;
  const double far_m = bounds.position_m + kept_.base_speed_m_per_s * age.seconds();
  const double far_rad = bounds.rotation_rad + kept_.base_turn_rad_per_s * age.seconds();
  const bool agrees = moved.translation().norm() <= far_m &&
                      vector_from_rotation(moved.rotation()).norm() <= far_rad;
  return agrees ? Opinion::kAgrees : Opinion::kContradicts;
}

RecalledAlignment::Verdict RecalledAlignment::judge(Time time,
                                                    const Pose<World, Base>& world_from_base,
                                                    const BaseBounds& bounds) {
  const Opinion now = opinion(time, world_from_base, bounds);
  if (now != running_) {
    running_ = now;
    since_ = time;
    frames_ = 0;
  }
  ++frames_;
  const Duration needed = now == Opinion::kAgrees ? kConfirm : kContradict;
  if (frames_ < kFrames || time - since_ < needed) return Verdict::kOpen;
  if (now == Opinion::kAgrees) return Verdict::kConfirmed;
  return now == Opinion::kContradicts ? Verdict::kContradicted : Verdict::kTooOld;
}

}  // namespace foresight::calibration
