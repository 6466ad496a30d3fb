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
    : bus_(bus), transmission_(arm), torque_units_per_nm_(torque_units_per_nm) {
  FORESIGHT_CHECK(torque_units_per_nm.size() == arm.size());
}

bool CanArm::send(const CanFrame& frame) {
  const bool taken = bus_.send(frame);
  if (!taken) ++counts_.send_errors;
  return taken;
}

bool CanArm::start() {
  ask_whether_they_run();
  return send(set_frame(group_address(kGroupAll), kPropertyStatus, kStatusReady)) &&
         collect_positions();
}

// A puck that was switched on and not woken since answers with another status, or not at all.
void CanArm::ask_whether_they_run() {
  running_ = 0;
  CanFrame frame;
  for (int motor = 0; motor < transmission_.size(); ++motor) {
    if (!send(get_frame(node_address(motor + 1), kPropertyStatus))) return;
    for (int i = 0; i < kMaxFramesPerRead && bus_.receive(kPositionWait, &frame); ++i) {
      take(frame);
      if ((running_ >> motor & 1) != 0) break;
    }
  }
}

void CanArm::set_zero(std::span<const int32_t> counts_at_zero) {
  FORESIGHT_CHECK(static_cast<int>(counts_at_zero.size()) == transmission_.size());
  std::copy(counts_at_zero.begin(), counts_at_zero.end(), counts_at_zero_.begin());
  has_zero_ = true;
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
  } else if (feedback->property == kPropertyStatus && motor < transmission_.size()) {
    if (feedback->value == kStatusReady) running_ |= 1u << motor;
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
  for (int i = 0; i < kMaxFramesPerRead && answered_ != all_motors(); ++i) {
    if (!bus_.receive(kPositionWait, &frame)) break;
    take(frame);
  }
  if (answered_ != all_motors()) ++counts_.incomplete_reads;
  return answered_ == all_motors();
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
  if (!collect_positions() || !has_zero_) return false;
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
