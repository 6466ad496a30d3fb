#include "procs/wam_controller/can_arm.h"

#include <algorithm>
#include <cmath>

#include "common/check.h"

namespace foresight {
namespace {

// A puck answers within 75 µs, one after the other (manual §7.2).
constexpr Duration kPositionWait = microseconds(600);
// Frames of others that may come between: with the wait, the bound of one read.
constexpr int kMaxFramesPerRead = 40;
constexpr int kReadsPerBoardQuestion = 10;
constexpr int kMaxBoardSilence = 5;

}  // namespace

CanArm::CanArm(CanBus& bus, const ArmModel& arm, const JointVector& torque_units_per_nm)
    : bus_(bus),
      transmission_(arm),
      home_rad_(arm.home()),
      torque_units_per_nm_(torque_units_per_nm) {
  FORESIGHT_CHECK(torque_units_per_nm.size() == arm.size());
}

bool CanArm::send(const CanFrame& frame) {
  const bool taken = bus_.send(frame);
  if (!taken) ++counts_.send_errors;
  return taken;
}

bool CanArm::start() {
  const bool woken = send(set_frame(group_address(kGroupAll), kPropertyStatus, kStatusReady));
  if (!woken || !collect_positions()) return false;
  const JointVector home_counts = transmission_.motor_counts(home_rad_);
  for (int i = 0; i < transmission_.size(); ++i) {
    const auto motor = static_cast<size_t>(i);
    counts_at_zero_[motor] =
        position_counts_[motor] - static_cast<int32_t>(std::lround(home_counts[i]));
  }
  return true;
}

void CanArm::take(const CanFrame& frame) {
  const auto feedback = read_feedback(frame);
  if (!feedback) {
    ++counts_.unknown_frames;
    return;
  }
  const int motor = feedback->node - 1;
  if (feedback->property == kPropertyPosition && motor < transmission_.size()) {
    position_counts_[static_cast<size_t>(motor)] = feedback->value;
    answered_ |= 1u << motor;
  } else if (feedback->node == kNodeSafetyBoard && feedback->property == kPropertyMode) {
    const bool is_known = feedback->value == static_cast<int>(Safety::kIdle) ||
                          feedback->value == static_cast<int>(Safety::kActive);
    safety_ = is_known ? static_cast<Safety>(feedback->value) : Safety::kEstop;
    board_silence_ = 0;
  }
}

// First takes what came late: an old position must not answer the new question.
bool CanArm::collect_positions() {
  CanFrame frame;
  for (int i = 0; i < kMaxFramesPerRead && bus_.receive({0}, &frame); ++i) take(frame);
  answered_ = 0;
  if (!send(get_frame(group_address(kGroupAll), kPropertyPosition))) return false;
  const uint32_t all = (1u << transmission_.size()) - 1;
  for (int i = 0; i < kMaxFramesPerRead && answered_ != all; ++i) {
    if (!bus_.receive(kPositionWait, &frame)) break;
    take(frame);
  }
  if (answered_ != all) ++counts_.incomplete_reads;
  return answered_ == all;
}

// Its answer comes in with the positions. A board that says nothing counts as stopped.
void CanArm::ask_safety_board() {
  if (reads_++ % kReadsPerBoardQuestion != 0) return;
  if (++board_silence_ > kMaxBoardSilence) safety_ = Safety::kEstop;
  [[maybe_unused]] const bool taken =
      send(get_frame(node_address(kNodeSafetyBoard), kPropertyMode));
}

bool CanArm::read(Time now, ArmReading* reading) {
  ask_safety_board();
  if (!collect_positions()) return false;
  std::array<int32_t, kMaxJoints> counts{};
  const auto size = static_cast<size_t>(transmission_.size());
  for (size_t i = 0; i < size; ++i) counts[i] = position_counts_[i] - counts_at_zero_[i];
  reading->time = now;
  reading->position_rad = transmission_.joint_position_rad({counts.data(), size});
  reading->safety = safety_;
  reading->is_warning = false;
  reading->fault = {};
  return true;
}

void CanArm::write(const JointVector& joint_torque_nm) {
  const JointVector motor_nm = transmission_.motor_torque_nm(joint_torque_nm);
  for (int first = 0; first < transmission_.size(); first += kTorquesPerFrame) {
    std::array<int32_t, kTorquesPerFrame> units{};
    for (int i = first; i < std::min(first + kTorquesPerFrame, transmission_.size()); ++i) {
      units[static_cast<size_t>(i - first)] =
          static_cast<int32_t>(std::lround(motor_nm[i] * torque_units_per_nm_[i]));
    }
    const int group = first == 0 ? kGroupLowerTorques : kGroupUpperTorques;
    [[maybe_unused]] const bool taken = send(torque_frame(group, units));
  }
}

}  // namespace foresight
