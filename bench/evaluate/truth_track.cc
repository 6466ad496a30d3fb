#include "bench/evaluate/truth_track.h"

#include <algorithm>

#include "common/message_bytes.h"
#include "common/robot_messages.h"

namespace foresight {
namespace {

constexpr Duration kKept = seconds(4);

template <class A, class B>
Pose<A, B> between(const Pose<A, B>& a, const Pose<A, B>& b, double share) {
  return {a.rotation().slerp(share, b.rotation()),
          (1 - share) * a.translation() + share * b.translation()};
}

}  // namespace

void TruthTrack::on_message(std::span<const uint8_t> bytes) {
  const auto m = decode<truth_t>(bytes);
  const auto base =
      read_transform<World, Base>(m.world_from_base_quat_wxyz, m.world_from_base_position_m);
  const auto cam =
      read_transform<World, Cam>(m.world_from_cam_quat_wxyz, m.world_from_cam_position_m);
  const auto position = read_joints(m.joint_position_rad);
  const auto velocity = read_joints(m.joint_velocity_rad_per_s);
  if (!base || !cam || !position || !velocity) return;
  states_.push_back({{m.utime}, *base, *cam, *position, *velocity});
  while (states_.back().time - states_.front().time > kKept) states_.pop_front();
}

std::optional<Truth> TruthTrack::at(Time time) const {
  const auto after = std::lower_bound(states_.begin(), states_.end(), time,
                                      [](const Truth& truth, Time t) { return truth.time < t; });
  if (after == states_.end()) return std::nullopt;
  if (after->time == time) return *after;
  if (after == states_.begin()) return std::nullopt;
  const Truth &a = *(after - 1), &b = *after;
  const double share = (time - a.time).seconds() / (b.time - a.time).seconds();
  return Truth{time, between(a.world_from_base, b.world_from_base, share),
               between(a.world_from_cam, b.world_from_cam, share),
               (1 - share) * a.position_rad + share * b.position_rad,
               (1 - share) * a.velocity_rad_per_s + share * b.velocity_rad_per_s};
}

}  // namespace foresight
