#include "procs/renderer/pose_source.h"

#include <utility>

#include "common/messages.h"
#include "common/robot_messages.h"
#include "foresight/controller_state_t.hpp"
#include "procs/renderer/camera_predictor.h"

namespace foresight {
namespace {

/// The newest CAMERA_POSE, read on the robot's side without delay.
class RecordedPoseSource : public PoseSource {
 public:
  RecordedPoseSource(Node& node, std::function<void()> on_change)
      : on_change_(std::move(on_change)) {
    node.subscribe<camera_pose_t>({.channel = "CAMERA_POSE",
                                   .domain = Domain::kRobot,
                                   .rate_hz = 30,
                                   .doc = "undelayed; stands in for the operator's command"},
                                  Queue::kLatest, [this](const camera_pose_t& m) { on_pose(m); });
  }
  std::optional<PredictedPose> predict(Time) override { return pose_; }
  std::string reason() const override { return reason_; }

 private:
  void on_pose(const camera_pose_t& message) {
    const auto pose = read_pose(message);
    pose_.reset();
    if (pose) pose_ = PredictedPose{{message.utime}, {}, message.epoch, *pose, {}};
    reason_ = message.reason;
    on_change_();
  }

  std::function<void()> on_change_;
  std::optional<PredictedPose> pose_;
  std::string reason_;
};

/// Predicted from JOINT_COMMAND at once, with everything else delayed.
class RobotPoseSource : public PoseSource {
 public:
  RobotPoseSource(Node& node, const RendererParams& params, std::function<void()> on_change)
      : node_(node), params_(params), on_change_(std::move(on_change)) {
    listen<joint_command_t>("JOINT_COMMAND", 30, "where the operator wants the joints; undelayed",
                            Queue::kAll, &RobotPoseSource::on_command);
    listen<joint_state_t>("JOINT_STATE", 100, "the arm's joints and reference, delayed",
                          Queue::kLatest, &RobotPoseSource::on_joint_state);
    listen<controller_state_t>("CONTROLLER_STATE", 10, "whether the arm follows, delayed",
                               Queue::kLatest, &RobotPoseSource::on_controller);
    listen<alignment_t>("ALIGNMENT", 1, "how the map lies in the robot's world", Queue::kLatest,
                        &RobotPoseSource::on_alignment);
    listen<base_pose_t>("BASE_POSE", 30, "where the base is, delayed", Queue::kLatest,
                        &RobotPoseSource::on_base);
  }
  void start() override {
    const ArmModel arm = load_arm_file(params_.arm_file);
    const CameraPredictorOptions options{
        .joints =
            params_.predict == "command" ? PredictedJoints::kCommand : PredictedJoints::kRobot,
        .limits = {params_.velocity_limit_rad_per_s, params_.acceleration_limit_rad_per_s2},
        .joint_margin_rad = params_.limit_margin_rad,
        .command_timeout = seconds(params_.command_timeout_s)};
    predictor_ = std::make_unique<CameraPredictor>(arm, options);
  }
  std::optional<PredictedPose> predict(Time now) override {
    const auto p = predictor_->predict(now);
    reason_ = predictor_->reason();
    if (!alignment_reason_.empty()) reason_ = alignment_reason_;
    if (!p || !alignment_reason_.empty()) return std::nullopt;
    node_.set_metric("command_delay_ms", 1e3 * predictor_->command_delay().seconds());
    return PredictedPose{p->instant, p->command_time, p->epoch, p->map_from_cam, p->world_from_cam};
  }
  std::string reason() const override { return reason_; }
  std::string note() const override { return note_; }

 private:
  template <class Message>
  void listen(const char* channel, double rate_hz, const char* doc, Queue queue,
              void (RobotPoseSource::*handler)(const Message&)) {
    node_.subscribe<Message>(
        {.channel = channel, .domain = Domain::kOperator, .rate_hz = rate_hz, .doc = doc}, queue,
        [this, handler](const Message& m) { (this->*handler)(m); });
  }
  void on_command(const joint_command_t& message) {
    const auto c = read_command(message);
    if (!c || c->position_rad.size() != message.n_joints ||
        !predictor_->add_command({c->time, c->session, c->engaged, c->position_rad})) {
      return node_.reject_message("JOINT_COMMAND", "is not of this arm, or older than the last");
    }
    on_change_();
  }
  void on_joint_state(const joint_state_t& message) {
    const auto s = read_joint_state(message);
    if (!s || !predictor_->set_joint_state({s->time, s->position_rad, s->reference_rad,
                                            s->reference_velocity_rad_per_s, s->target_rad,
                                            s->command_time, s->command_arrival})) {
      node_.reject_message("JOINT_STATE", "is not of this arm, or older than the last");
    }
  }
  void on_controller(const controller_state_t& message) {
    const bool powered = message.state != controller_state_t::STATE_IDLE &&
                         message.state != controller_state_t::STATE_FAULT;
    predictor_->set_powered(powered);
    note_ = message.state == controller_state_t::STATE_FOLLOWING ? "" : message.reason;
  }
  void on_alignment(const alignment_t& message) {
    const auto a = read_alignment(message);
    alignment_reason_.clear();
    if (!a) {
      alignment_reason_ = "not aligned: " + message.reason;
      return;
    }
    predictor_->set_alignment({a->epoch, a->world_from_map, a->ee_from_cam});
  }
  void on_base(const base_pose_t& message) {
    const auto b = read_base(message);
    if (!b || !predictor_->set_base({b->time, b->epoch, b->world_from_base, b->velocity_m_per_s,
                                     b->angular_velocity_rad_per_s})) {
      node_.reject_message("BASE_POSE", "is no pose, or older than the last");
    }
  }

  Node& node_;
  RendererParams params_;
  std::function<void()> on_change_;
  std::unique_ptr<CameraPredictor> predictor_;
  std::string reason_ = "no JOINT_STATE yet", note_, alignment_reason_;
};

}  // namespace

std::unique_ptr<PoseSource> make_pose_source(Node& node, const RendererParams& params,
                                             std::function<void()> on_change) {
  if (params.predict == "camera_pose") {
    return std::make_unique<RecordedPoseSource>(node, std::move(on_change));
  }
  return std::make_unique<RobotPoseSource>(node, params, std::move(on_change));
}

}  // namespace foresight
