#include <array>
#include <charconv>
#include <cmath>

#include "common/errors.h"
#include "common/pose_track.h"
#include "common/text_lines.h"

namespace foresight {
namespace {

// The numbers of a line; nothing unless there are exactly as many, all finite.
template <size_t kCount>
std::optional<std::array<double, kCount>> numbers(std::string_view text) {
  std::array<double, kCount> values{};
  for (double& value : values) {
    const std::string_view word = take_word(&text);
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value)) {
      return std::nullopt;
    }
  }
  if (!text.empty()) return std::nullopt;
  return values;
}

std::optional<TimedPose> timed_pose(std::string_view line) {
  constexpr double kTolerance = 0.01;  // of the quaternion's norm: files have few decimals
  const std::optional<Time> time = parse_stamp(take_word(&line));
  const auto n = numbers<7>(line);
  if (!time || !n) return std::nullopt;
  const auto [x, y, z, qx, qy, qz, qw] = *n;
  const Eigen::Quaterniond rotation(qw, qx, qy, qz);
  if (std::abs(rotation.norm() - 1) > kTolerance) return std::nullopt;
  return TimedPose{*time, {rotation, Eigen::Vector3d(x, y, z)}};
}

}  // namespace

std::vector<TimedPose> load_pose_track(const std::string& path) {
  std::vector<TimedPose> track;
  for (const TextLine& line : data_lines(path)) {
    const std::string where = path + ": line " + std::to_string(line.number) + ": ";
    const auto pose = timed_pose(line.text);
    if (!pose) {
      throw ConfigError(where + "not a pose (time tx ty tz qx qy qz qw; unit quaternion)");
    }
    if (!track.empty() && pose->time == track.back().time) continue;  // real files have these
    if (!track.empty() && pose->time < track.back().time) {
      throw ConfigError(where + "its time is before that of the pose above it");
    }
    track.push_back(*pose);
  }
  if (track.size() < 2) {
    throw ConfigError(path + ": has " + (track.empty() ? "0 poses" : "1 pose") + " but needs two");
  }
  return track;
}

}  // namespace foresight
