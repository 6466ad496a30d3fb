#include "procs/omni/file_device.h"

#include <cmath>
#include <fstream>
#include <sstream>

#include "common/errors.h"
#include "common/lcm_log.h"
#include "common/message_check.h"
#include "foresight/device_state_t.hpp"

namespace foresight {
namespace {

bool is_table(const std::string& path) { return path.ends_with(".csv") || path.ends_with(".txt"); }

std::vector<MotionSample> read_table(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw ConfigError("device_path: " + path + ": cannot be read");
  std::stringstream text;
  text << file.rdbuf();
  return parse_motion_table(text.str(), path);
}

// Appends what a message says of one kind, unless it says nothing or does not go on from the last.
void append(const device_state_t& state, Time first, const std::vector<double>& axes,
            std::vector<MotionSample>* samples) {
  if (axes.empty()) return;
  const double time_s = (Time{state.utime} - first).seconds();
  if (!samples->empty() &&
      (time_s <= samples->back().time_s || axes.size() != samples->front().position_rad.size())) {
    return;
  }
  samples->push_back({time_s, state.connected != 0 && state.engaged != 0, axes});
}

RecordedMotion read_log(const std::string& path) {
  LogReader log(path);
  RecordedMotion joints{AxisKind::kPosition, {}}, sticks{AxisKind::kVelocity, {}};
  std::optional<Time> first;
  while (const auto event = log.next()) {
    if (event->channel != "DEVICE_STATE") continue;
    const auto state = decode_checked<device_state_t>(event->bytes);
    if (!state) continue;
    if (!first) first = Time{state->utime};
    append(*state, *first, state->position_rad, &joints.samples);
    append(*state, *first, state->deflections, &sticks.samples);
  }
  log.require_whole();  // no arm is moved along what is left of a motion
  RecordedMotion& longer = sticks.samples.size() > joints.samples.size() ? sticks : joints;
  if (longer.samples.empty()) {
    throw ConfigError("device_path: " + path + ": has no DEVICE_STATE with joints or deflections");
  }
  return std::move(longer);
}

}  // namespace

std::string recorded_device(const std::string& path) {
  if (path.empty() || is_table(path)) return {};
  LogReader log(path);
  while (const auto event = log.next()) {
    if (event->channel != "DEVICE_STATE") continue;
    if (const auto state = decode_checked<device_state_t>(event->bytes)) return state->device;
  }
  return {};
}

RecordedMotion read_motion_file(const std::string& path) {
  if (path.empty()) throw ConfigError("device_path: missing; give the file to play");
  RecordedMotion motion =
      is_table(path) ? RecordedMotion{AxisKind::kPosition, read_table(path)} : read_log(path);
  const double first_s = motion.samples.front().time_s;
  for (MotionSample& sample : motion.samples) sample.time_s -= first_s;
  return motion;
}

void FileDevice::open() {
  RecordedMotion motion = read_motion_file(options_.path);
  kind_ = motion.kind;
  motion_.emplace(std::move(motion.samples), options_.style);
}

DeviceReading FileDevice::read(Time now) {
  playback_.update(now);
  double time_s = playback_.time_s();
  DeviceReading reading{.connected = true, .engaged = playback_.is_running(), .kind = kind_};
  if (time_s > motion_->duration_s()) {
    const double passes =
        options_.loop ? std::floor(time_s / std::max(1e-3, motion_->duration_s())) : 0;
    time_s -= passes * motion_->duration_s();
    // Let go at the end, so that the way back to the start is no jump.
    if (!options_.loop || passes != passes_) reading.engaged = false;
    reading.ended = !options_.loop;
    passes_ = passes;
  }
  const MotionSample sample = motion_->at(time_s);
  reading.engaged = reading.engaged && sample.engaged;
  reading.axes = sample.position_rad;
  if (playback_.is_stopped()) {
    reading.problem = "stopped, because the robot did not follow (resume=true goes on by itself)";
  }
  return reading;
}

}  // namespace foresight
