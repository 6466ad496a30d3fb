#include "procs/wam_controller/encoder_source.h"

namespace foresight {

EncoderSource::EncoderSource(Node& node, std::function<void()> on_reading)
    : node_(node),
      on_reading_(std::move(on_reading)),
      torques_(node.advertise<arm_torques_t>({.channel = "ARM_TORQUES",
                                              .rate_hz = 500,
                                              .doc = "motor torques, one for each reading"})) {
  input_ = node.subscribe<arm_encoders_t>(
      {.channel = "ARM_ENCODERS", .rate_hz = 500, .doc = "motor positions, safety board"},
      Queue::kLatest, [this](const arm_encoders_t& m) { on_encoders(m); });
}

void EncoderSource::start(const ArmModel& arm, Duration max_age) {
  transmission_.emplace(arm);
  max_age_ = max_age;
  answer_.n_motors = arm.size();
  answer_.motor_torque_nm.resize(static_cast<size_t>(arm.size()));
}

const char* EncoderSource::find_error(const arm_encoders_t& message) const {
  if (!transmission_) return "came before the arm file was read";
  if (message.n_motors != transmission_->size()) return "has another number of motors than the arm";
  if (message.safety < arm_encoders_t::SAFETY_ESTOP ||
      message.safety > arm_encoders_t::SAFETY_ACTIVE) {
    return "has an unknown safety state";
  }
  const Time now = node_.now(), time{message.utime};
  if (time < now - max_age_ || time > now + max_age_) return "is too old, or from the future";
  return nullptr;
}

void EncoderSource::on_encoders(const arm_encoders_t& message) {
  if (const char* error = find_error(message); error != nullptr) {
    input_.reject(error);
    return;
  }
  encoders_ = message;
  is_new_ = true;
  on_reading_();
}

bool EncoderSource::read(Time, ArmReading* reading) {
  if (!is_new_) return false;
  is_new_ = false;
  reading->time = {encoders_.utime};
  reading->position_rad = transmission_->joint_position_rad(encoders_.motor_counts);
  reading->safety = static_cast<Safety>(encoders_.safety);
  reading->is_warning = encoders_.is_warning != 0;
  reading->fault = encoders_.fault;
  return true;
}

void EncoderSource::write(const JointVector& joint_torque_nm) {
  const JointVector motor_nm = transmission_->motor_torque_nm(joint_torque_nm);
  answer_.utime = encoders_.utime;
  for (Eigen::Index i = 0; i < motor_nm.size(); ++i) {
    answer_.motor_torque_nm[static_cast<size_t>(i)] = motor_nm[i];
  }
  torques_.publish(answer_);
}

}  // namespace foresight
