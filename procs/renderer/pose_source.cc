#include "procs/renderer/pose_source.h"

#include <utility>

#include "common/messages.h"
#include "common/robot_messages.h"
#include "procs/renderer/camera_predictor.h"

namespace foresight {
namespace {

// Of a stream, beyond its usual interval, after which the operator should know.
constexpr Duration kSilence = seconds(1);

/// The newest CAMERA_POSE, read on the robot's side without delay.
class RecordedPoseSource : public PoseSource {
 public:
  RecordedPoseSource(Node& node, std::function<void()> on_change)
      : node_(node), on_change_(std::move(on_change)) {
    input_ = node.subscribe<camera_pose_t>(
        {.channel = "CAMERA_POSE",
         .domain = Domain::kRobot,
         .rate_hz = 30,
         .doc = "undelayed; stands in for the operator's command"},
        Queue::kLatest, [this](const camera_pose_t& m) { on_pose(m); });
  }
  std::optional<PredictedPose> predict(Time) override { return pose_; }
  std::string reason() const override { return reason_; }
  void report(DisplayFacts* facts) override {
    facts->streams.push_back({"CAMERA_POSE", watch_, kSilence});
  }

 private:
  void on_pose(const camera_pose_t& message) {
    const StampVerdict verdict = order_.judge(node_.now(), {message.utime});
    if (!is_taken(verdict)) return input_.reject(to_string(verdict));
    watch_.arrive(node_.now());
    const auto pose = read_pose(message);
    pose_.reset();
    if (pose) pose_ = PredictedPose{{message.utime}, {}, message.epoch, *pose, {}};
    reason_ = message.reason;
    on_change_();
  }

  Node& node_;
  Input input_;
  std::function<void()> on_change_;
  NewestStamp order_;
  StreamWatch watch_;
  std::optional<PredictedPose> pose_;
  std::string reason_;
};

/// Predicted from JOINT_COMMAND at once, with everything else delayed.
class RobotPoseSource : public PoseSource {
 public:
  RobotPoseSource(Node& node, const RendererParams& params, std::function<void()> on_change)
      : node_(node), params_(params), on_change_(std::move(on_change)) {
    command_input_ = listen<joint_command_t>("JOINT_COMMAND", 30,
                                             "where the operator wants the joints; undelayed",
                                             Queue::kAll, &RobotPoseSource::on_command);
    joint_state_input_ =
        listen<joint_state_t>("JOINT_STATE", 100, "the arm's joints and reference, delayed",
                              Queue::kLatest, &RobotPoseSource::on_joint_state);
    controller_input_ =
        listen<controller_state_t>("CONTROLLER_STATE", 10, "whether the arm follows, delayed",
                                   Queue::kLatest, &RobotPoseSource::on_controller);
    alignment_input_ = listen<alignment_t>("ALIGNMENT", 1, "how the map lies in the robot's world",
                                           Queue::kLatest, &RobotPoseSource::on_alignment);
    base_input_ = listen<base_pose_t>("BASE_POSE", 30, "where the base is, delayed", Queue::kLatest,
                                      &RobotPoseSource::on_base);
  }
  void start() override {
    const ArmModel arm = load_arm_file(params_.arm_file);
    const CameraPredictorOptions options{
        .joints = params_.predict == Predict::kCommand ? PredictedJoints::kCommand
                                                       : PredictedJoints::kRobot,
        .limits = {{params_.velocity_limit_rad_per_s, params_.acceleration_limit_rad_per_s2},
                   params_.limit_margin_rad,
                   seconds(params_.command_timeout_s)},
        .longest_silence = seconds(params_.joint_state_timeout_s)};
    joint_count_ = arm.size();
    predictor_ = std::make_unique<CameraPredictor>(arm, options);
  }
  std::optional<PredictedPose> predict(Time now) override {
    const auto p = predictor_->predict(now);
    reason_ = predictor_->reason();
    if (!alignment_reason_.empty()) reason_ = alignment_reason_;
    if (!p || !alignment_reason_.empty()) return std::nullopt;
    return PredictedPose{p->instant, p->command_time, p->epoch, p->map_from_cam, p->world_from_cam};
  }
  std::string reason() const override { return reason_; }
  std::string note() const override { return note_; }
  void report(DisplayFacts* facts) override {
    facts->streams.insert(facts->streams.end(), {{"JOINT_STATE", states_, state_slack()},
                                                 {"BASE_POSE", bases_, kSilence},
                                                 {"ALIGNMENT", alignments_, kSilence * 2},
                                                 {"CONTROLLER_STATE", controllers_, kSilence * 2}});
    const Time now = node_.now();
    facts->clocks = predictor_->clocks().complaint();
    if (facts->prediction_reason == facts->clocks) facts->clocks.clear();  // said once
    facts->commanders = predictor_->commanders_complaint(now);
    if (other_joints_ != 0) {
      facts->arm = "the robot's arm has " + std::to_string(other_joints_) + " joints, that of " +
                   params_.arm_file + " " + std::to_string(joint_count_);
    }
    delay_.end_second();
    if (delay_.current()) {
      facts->delay = delay_.current();
      facts->normal_delay = delay_.normal();
    }
    facts->note = predictor_->limits_note();
    node_.set_metric("command_delay_ms", 1e3 * predictor_->command_delay().seconds());
    node_.set_metric("clock_offset_ms", 1e3 * predictor_->clocks().offset().seconds());
    if (const auto trip = predictor_->clocks().round_trip()) {
      node_.set_metric("round_trip_ms", 1e3 * trip->seconds());
    }
  }

 private:
  template <class Message>
  Input listen(const char* channel, double rate_hz, const char* doc, Queue queue,
               void (RobotPoseSource::*handler)(const Message&)) {
    return node_.subscribe<Message>(
        {.channel = channel, .domain = Domain::kOperator, .rate_hz = rate_hz, .doc = doc}, queue,
        [this, handler](const Message& m) { (this->*handler)(m); });
  }
  Duration state_slack() const { return seconds(params_.joint_state_timeout_s); }
  void on_command(const joint_command_t& message) {
    const JointCommand command = read_command(message);
    if (command.position_rad.size() == 0) {
      return command_input_.reject("has no joints, or too many");
    }
    const CommandIntake intake = predictor_->add_command(node_.now(), command);
    if (intake != CommandIntake::kTaken) {
      return command_input_.reject(to_string(intake));
    }
    on_change_();
  }
  void on_joint_state(const joint_state_t& message) {
    const auto state = read_joint_state(message);
    if (state && state->position_rad.size() != joint_count_) {
      other_joints_ = static_cast<int>(state->position_rad.size());
      return joint_state_input_.reject("is not of the arm of arm_file");
    }
    const Time now = node_.now();
    if (!state || !predictor_->set_joint_state(now, *state)) {
      return joint_state_input_.reject("makes no sense, or is older than the last");
    }
    other_joints_ = 0;
    states_.arrive(now);
    if (const auto trip = predictor_->clocks().round_trip()) delay_.measure(*trip);
  }
  void on_controller(const controller_state_t& message) {
    const ControllerState controller = read_controller_state(message);
    if (!predictor_->set_controller(node_.now(), controller)) {
      return controller_input_.reject("is older than the last");
    }
    controllers_.arrive(node_.now());
    note_ = controller.state == ArmState::kFollowing ? "" : controller.reason;
  }
  void on_alignment(const alignment_t& message) {
    const auto alignment = read_alignment(message);
    if (!alignment && message.state == alignment_t::STATE_ALIGNED) {
      return alignment_input_.reject("is no similarity, or of a joint delay that cannot be");
    }
    if (alignment && !predictor_->set_alignment(*alignment)) {
      return alignment_input_.reject("is of another map than the last");
    }
    alignments_.arrive(node_.now());
    alignment_reason_ = alignment ? "" : "not aligned: " + message.reason;
  }
  void on_base(const base_pose_t& message) {
    const auto base = read_base(message);
    if (!base || !predictor_->set_base(node_.now(), *base)) {
      return base_input_.reject("is no pose, or is older or of another map than the last");
    }
    bases_.arrive(node_.now());
  }

  Node& node_;
  Input command_input_, joint_state_input_, controller_input_, alignment_input_, base_input_;
  RendererParams params_;
  std::function<void()> on_change_;
  std::unique_ptr<CameraPredictor> predictor_;
  StreamWatch states_, controllers_, alignments_, bases_;
  DelayWatch delay_;  // there and back
  int joint_count_ = 0;
  int other_joints_ = 0;  // of a JOINT_STATE that is not of this arm; 0: it is
  std::string reason_ = "no JOINT_STATE yet", note_, alignment_reason_;
};

}  // namespace

std::unique_ptr<PoseSource> make_pose_source(Node& node, const RendererParams& params,
                                             std::function<void()> on_change) {
  if (params.predict == Predict::kCameraPose) {
    return std::make_unique<RecordedPoseSource>(node, std::move(on_change));
  }
  return std::make_unique<RobotPoseSource>(node, params, std::move(on_change));
}

}  // namespace foresight
