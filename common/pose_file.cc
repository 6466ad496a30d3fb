#include <array>
#include <charconv>
#include <cmath>
#include <fstream>

#include "common/errors.h"
#include "common/pose_track.h"

namespace foresight {
namespace {

constexpr std::string_view kBlank = " \t\r";
constexpr double kMaxTime_s = 1e11;  // beyond that microseconds are not exact

// The numbers of a line; nothing unless there are exactly as many, all finite.
template <size_t kCount>
std::optional<std::array<double, kCount>> numbers(std::string_view text) {
  std::array<double, kCount> values{};
  for (double& value : values) {
    text.remove_prefix(std::min(text.find_first_not_of(kBlank), text.size()));
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || !std::isfinite(value)) return std::nullopt;
    text.remove_prefix(static_cast<size_t>(end - text.data()));
    if (!text.empty() && kBlank.find(text.front()) == std::string_view::npos) return std::nullopt;
  }
  if (text.find_first_not_of(kBlank) != std::string_view::npos) return std::nullopt;
  return values;
}

std::optional<TimedPose> timed_pose(std::string_view line) {
  constexpr double kTolerance = 0.01;  // of the quaternion's norm: files have few decimals
  const auto n = numbers<8>(line);
  if (!n || std::abs((*n)[0]) > kMaxTime_s) return std::nullopt;
  const auto [t, x, y, z, qx, qy, qz, qw] = *n;
  const Eigen::Quaterniond rotation(qw, qx, qy, qz);
  if (std::abs(rotation.norm() - 1) > kTolerance) return std::nullopt;
  return TimedPose{Time{} + seconds(t), {rotation, Eigen::Vector3d(x, y, z)}};
}

bool is_data(std::string_view line) {
  const size_t first = line.find_first_not_of(kBlank);
  return first != std::string_view::npos && line[first] != '#';
}

}  // namespace

std::vector<TimedPose> load_pose_track(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw UnavailableError(path + ": cannot be read");
  std::vector<TimedPose> track;
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    if (!is_data(line)) continue;
    const std::string where = path + ": line " + std::to_string(number) + ": ";
    const auto pose = timed_pose(line);
    if (!pose) {
      throw ConfigError(where + "not a pose (time tx ty tz qx qy qz qw; unit quaternion)");
    }
    if (!track.empty() && pose->time == track.back().time) continue;  // real files have these
    if (!track.empty() && pose->time < track.back().time) {
      throw ConfigError(where + "its time is before that of the pose above it");
    }
    track.push_back(*pose);
  }
  if (file.bad()) throw UnavailableError(path + ": cannot be read");  // such as a folder
  if (track.size() < 2) {
    throw ConfigError(path + ": has " + (track.empty() ? "0 poses" : "1 pose") + " but needs two");
  }
  return track;
}

}  // namespace foresight
