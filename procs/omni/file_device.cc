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

std::vector<MotionSample> read_table(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw ConfigError("device_path: " + path + ": cannot be read");
  std::stringstream text;
  text << file.rdbuf();
  return parse_motion_table(text.str(), path);
}

std::vector<MotionSample> read_log(const std::string& path) {
  LogReader log(path);
  std::vector<MotionSample> samples;
  std::optional<Time> first;
  while (const auto event = log.next()) {
    if (event->channel != "DEVICE_STATE") continue;
    const auto state = decode_checked<device_state_t>(event->bytes);
    if (!state || state->n_joints == 0) continue;
    if (!first) first = Time{state->utime};
    const double time_s = (Time{state->utime} - *first).seconds();
    if (!samples.empty() && (time_s <= samples.back().time_s ||
                             state->position_rad.size() != samples[0].position_rad.size())) {
      continue;
    }
    samples.push_back({time_s, state->connected != 0 && state->engaged != 0, state->position_rad});
  }
  log.require_whole();  // no arm is moved along what is left of a motion
  if (samples.empty()) {
    throw ConfigError("device_path: " + path + ": has no DEVICE_STATE with joint positions");
  }
  return samples;
}

}  // namespace

std::vector<MotionSample> read_motion_file(const std::string& path) {
  if (path.empty()) throw ConfigError("device_path: missing; give the file to play");
  const bool is_table = path.ends_with(".csv") || path.ends_with(".txt");
  std::vector<MotionSample> samples = is_table ? read_table(path) : read_log(path);
  const double first_s = samples.front().time_s;
  for (MotionSample& sample : samples) sample.time_s -= first_s;
  return samples;
}

void FileDevice::open() { motion_.emplace(read_motion_file(options_.path), options_.style); }

DeviceReading FileDevice::read(Time now) {
  if (!started_) started_ = now;
  double time_s = (now - *started_).seconds() - options_.start_delay_s;
  DeviceReading reading{.connected = true, .engaged = time_s >= 0};
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
  return reading;
}

}  // namespace foresight
