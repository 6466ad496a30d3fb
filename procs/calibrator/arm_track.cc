#include "procs/calibrator/arm_track.h"

#include <algorithm>

#include "common/check.h"
#include "procs/calibrator/geometry.h"

namespace foresight::calibration {

ArmMotion interpolate(const ArmSample& a, const ArmSample& b, double share) {
  const double step_s = (b.time - a.time).seconds();
  const Pose<Base, Ee>&pa = a.base_from_ee, &pb = b.base_from_ee;
  const Eigen::Vector3d turn = vector_from_rotation(pa.rotation().conjugate() * pb.rotation());
  const Eigen::Vector3d shift = pb.translation() - pa.translation();
  return {{pa.rotation() * rotation_from_vector(share * turn), pa.translation() + share * shift},
          shift / step_s,
          turn / step_s};
}

ArmMotion ArmTrack::at(double offset_s) const {
  FORESIGHT_CHECK(!samples.empty());
  if (samples.size() == 1) return {samples.front().base_from_ee};
  const auto after = std::lower_bound(
      samples.begin() + 1, samples.end() - 1, offset_s,
      [this](const ArmSample& s, double offset) { return (s.time - centre).seconds() < offset; });
  const ArmSample &a = *(after - 1), &b = *after;
  const double share = (offset_s - (a.time - centre).seconds()) / (b.time - a.time).seconds();
  return interpolate(a, b, share);
}

}  // namespace foresight::calibration
