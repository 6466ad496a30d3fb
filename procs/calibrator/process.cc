#include "procs/calibrator/process.h"

#include <algorithm>

#include "common/messages.h"
#include "common/output_file.h"
#include "common/robot_messages.h"
#include "procs/calibrator/alignment_solver.h"

namespace foresight {
namespace {

using calibration::AlignmentSolution;
using calibration::AlignmentTask;
using calibration::Recall;

constexpr Duration kSilence = seconds(1);

alignment_t to_message(const calibration::AlignmentStatus& a) {
  const calibration::AlignmentEstimate& e = a.solution.estimate;
  alignment_t m{};
  write_alignment({.epoch = a.epoch,
                   .world_from_map = a.world_from_map,
                   .ee_from_cam = e.ee_from_cam,
                   .joint_delay_s = e.joint_delay_s},
                  &m);
  m.utime = a.time.us;
  m.state = a.is_aligned ? alignment_t::STATE_ALIGNED : alignment_t::STATE_COLLECTING;
  m.reason = a.reason;
  m.scale_sigma = static_cast<float>(a.solution.scale_sigma);
  m.position_sigma_m = static_cast<float>(a.position_sigma_m);
  m.rotation_sigma_rad = static_cast<float>(a.rotation_sigma_rad);
  m.residual_px = static_cast<float>(a.solution.residual_px);
  m.n_pairs = a.solution.inliers;
  return m;
}

const char* to_string(Recall recall) {
  switch (recall) {
    case Recall::kNone:
      return "is none";
    case Recall::kOpen:
      return "is to be confirmed";
    case Recall::kOfAnotherMap:
      return "is of another map: not used";
    case Recall::kConfirmed:
      return "is confirmed";
    case Recall::kContradicted:
      return "is contradicted: dropped";
    case Recall::kTooOld:
      return "is of another time: dropped";
    case Recall::kReplaced:
      return "is replaced by a new one";
  }
  return "?";
}

}  // namespace

CalibratorProcess::CalibratorProcess(Node& node, const CalibratorParams& params,
                                     const std::optional<RunIdentity>& run)
    : node_(node),
      params_(params),
      alignments_(node.advertise<alignment_t>(
          {.channel = "ALIGNMENT", .rate_hz = 1, .doc = "how the map lies in the world"})),
      base_poses_(node.advertise<base_pose_t>(
          {.channel = "BASE_POSE", .rate_hz = 30, .doc = "where the base is, per frame"})),
      hints_(node.advertise<pose_hint_t>(
          {.channel = "POSE_HINT", .doc = "where the camera should be, while SLAM is lost"})),
      map_(node, {.channel = "MAP_DELTA", .doc = "changes of the SLAM map"},
           [this](const DeltaStep<MapDelta>& step) {
             apply_map(step);
             return std::string();
           }),
      run_(run) {
  camera_info_input_ = node.subscribe<camera_info_t>(
      {.channel = "CAMERA_INFO", .rate_hz = 1, .doc = "intrinsics"}, Queue::kLatest,
      [this](const camera_info_t& m) { on_camera_info(m); });
  camera_pose_input_ = node.subscribe<camera_pose_t>(
      {.channel = "CAMERA_POSE", .rate_hz = 30, .doc = "where SLAM sees the camera"}, Queue::kAll,
      [this](const camera_pose_t& m) { on_camera_pose(m); });
  joint_state_input_ = node.subscribe<joint_state_t>(
      {.channel = "JOINT_STATE", .rate_hz = 100, .doc = "the arm's joints"}, Queue::kAll,
      [this](const joint_state_t& m) { on_joint_state(m); });
  node.every(seconds(params.solve_period_s), "solve", [this] { solve(); });
  node.every(seconds(1), "report", [this] {
    publish_alignment();
    publish_health();
    keep_is_due_ = true;
    keep();
  });
  node.at(node.now(), [this] { publish_health(); });
}

CalibratorProcess::~CalibratorProcess() {
  if (kept_) kept_->remove();
}

void CalibratorProcess::start() {
  const ArmModel arm = load_arm_file(params_.arm_file);
  joints_ = arm.size();
  core_ = std::make_unique<calibration::Calibrator>(arm, params_.options);
  if (run_ && params_.keep_alignment) find_kept();
}

// Of a calibrator of this run that was killed (docs/decisions/0007).
void CalibratorProcess::find_kept() {
  const std::string data = user_data_folder();
  const std::string folder = !params_.keep_folder.empty() ? params_.keep_folder
                             : data.empty()               ? ""
                                                          : data + "/kept";
  if (folder.empty()) {
    keep_trouble_ = "no folder: set keep_folder";
    return;
  }
  auto file = std::make_shared<KeptFile>(folder, node_.name(), *run_);
  file->remove_those_of_ended_runs();
  std::string trouble;
  if (const auto text = file->read(&trouble)) {
    if (const auto kept = calibration::parse_kept_alignment(*text)) {
      core_->recall(*kept);
    } else {
      trouble = file->path() + ": makes no sense";
    }
  }
  if (!trouble.empty()) node_.log("alignment of before the restart is not used: " + trouble);
  kept_ = std::move(file);
  watch_recall();
}

// Once a second, beside the loop: a disk may be slow. An alignment that is being solved goes first.
void CalibratorProcess::keep() {
  if (!kept_ || !keep_is_due_ || node_.job_running()) return;
  const auto kept = core_->kept();
  if (!kept) return;
  keep_is_due_ = false;
  const bool started = node_.run_beside(
      [this, file = kept_, text = to_text(*kept)]() -> std::function<void()> {
        RunErrors errors;
        errors.attempt([&] { file->write(text); });
        return [this, trouble = errors.text()] { keep_trouble_ = trouble; };
      },
      Duration{0});
  static_cast<void>(started);  // job_running() was asked above
}

// Says at once what became of the alignment of before the restart.
void CalibratorProcess::watch_recall() {
  if (core_->recalled() == recall_) return;
  recall_ = core_->recalled();
  node_.log(std::string("alignment of before the restart ") + to_string(recall_));
  if (recall_ == Recall::kConfirmed) publish_alignment();
  publish_health();
}

void CalibratorProcess::on_camera_info(const camera_info_t& message) {
  const auto camera = from_message(message);
  if (!camera) return camera_info_input_.reject("makes no sense as intrinsics");
  const bool is_first = !camera_.value();
  if (!camera_.offer(*camera)) return camera_info_input_.reject("contradicts the last");
  core_->set_camera(*camera_.value());
  if (is_first) publish_health();
}

void CalibratorProcess::on_joint_state(const joint_state_t& message) {
  if (message.n_joints != joints_) {
    return joint_state_input_.reject(std::to_string(message.n_joints) +
                                     " joints, the arm's description has " +
                                     std::to_string(joints_));
  }
  const auto state = read_joint_state(message);
  if (!state) return joint_state_input_.reject("has joints that are none");
  const StampVerdict verdict = joint_stamps_.judge(node_.now(), state->time);
  if (!is_taken(verdict)) return joint_state_input_.reject(to_string(verdict));
  last_joints_ = node_.now();
  core_->add_joints(state->time, state->position_rad);
  watch_recall();
  publish_base();
}

void CalibratorProcess::on_camera_pose(const camera_pose_t& message) {
  const auto pose = read_pose(message);
  if (!pose && message.state == camera_pose_t::STATE_TRACKING) {
    return camera_pose_input_.reject("its quaternion is none");
  }
  const StampVerdict verdict = frame_stamps_.judge(node_.now(), {message.utime});
  if (!is_taken(verdict)) return camera_pose_input_.reject(to_string(verdict));
  last_frame_ = node_.now();
  const bool is_new = core_->add_frame(
      {{message.utime}, message.epoch, pose, message.quality, message.points_found});
  if (!is_new) camera_pose_input_.reject("time-stamp does not increase");
  watch_recall();
  publish_base();
  if (message.state == camera_pose_t::STATE_LOST) publish_hint();
}

// In turn where the base is believed to be and where it was for long: a base that was believed
// elsewhere by mistake would else keep slam from finding what corrects it.
void CalibratorProcess::publish_hint() {
  using Place = calibration::Calibrator::BasePlace;
  auto expected =
      core_->expected_camera(hints_given_++ % 2 == 0 ? Place::kPresent : Place::kEarlier);
  if (!expected) expected = core_->expected_camera(Place::kPresent);
  if (!expected) return;
  pose_hint_t hint{};
  hint.utime = expected->time.us;
  hint.epoch = expected->epoch;
  write_pose(expected->map_from_cam, &hint);
  hints_.publish(hint);
}

void CalibratorProcess::apply_map(const DeltaStep<MapDelta>& step) {
  core_->apply_map(
      step.epoch,
      step.is_snapshot ? calibration::MapChange::kSnapshot : calibration::MapChange::kDelta,
      step.delta);
  watch_recall();
}

void CalibratorProcess::solve() {
  if (node_.job_running()) return;
  auto task = core_->take_task();
  if (!task) return;
  auto shared = std::make_shared<AlignmentTask>(std::move(*task));
  const bool started = node_.run_beside(
      [this, shared]() -> std::function<void()> {
        const AlignmentSolution solution = calibration::solve_alignment(shared->problem);
        return [this, shared, solution] {
          if (core_->apply(*shared, solution)) publish_alignment();
          watch_recall();
          keep();
        };
      },
      seconds(params_.solve_cost_s));
  static_cast<void>(started);  // job_running() was asked above
}

// Not while the alignment of before the restart is being confirmed: whoever draws has that one.
void CalibratorProcess::publish_alignment() {
  if (core_->alignment().epoch != 0 && core_->recalled() != Recall::kOpen)
    alignments_.publish(to_message(core_->alignment()));
}

void CalibratorProcess::publish_base() {
  for (const BaseState& base : core_->take_base()) {
    base_poses_.publish(write_base(base));
    base_tracking_ = base.tracking;
  }
}

std::string CalibratorProcess::missing_input() const {
  const auto is_silent = [this](const std::optional<Time>& last) {
    return !last || node_.now() - *last > kSilence;
  };
  if (!camera_.value()) return "no CAMERA_INFO yet";
  if (is_silent(last_joints_)) return "no JOINT_STATE arrives";
  if (is_silent(last_frame_)) return "no CAMERA_POSE arrives";
  return {};
}

void CalibratorProcess::publish_health() {
  const calibration::CalibratorStatistics s = core_->statistics();
  node_.set_metric("pairs", s.pairs);
  node_.set_metric("agreeing_pairs", s.newest.inliers);
  node_.set_metric("residual_px", s.newest.residual_px);
  node_.set_metric("pair_error_mm", 1e3 * s.newest.pair_position_error_m);
  node_.set_metric("joint_delay_ms", 1e3 * s.newest.estimate.joint_delay_s);
  node_.set_metric("joint_jumps", static_cast<double>(s.joint_jumps));
  node_.set_metric("late_joints", static_cast<double>(s.joints_not_newer));
  node_.set_metric("frames_without_joints", static_cast<double>(s.missing_joints));
  node_.set_metric("weak_frames", static_cast<double>(s.weak_frames));
  node_.set_metric("frames_of_other_maps", static_cast<double>(s.frames_of_other_maps));
  node_.set_metric("base_has_left", s.base_has_left ? 1 : 0);
  node_.set_metric("base_refused", s.filter.refused);
  node_.set_metric("base_reacquisitions", s.filter.reacquisitions);
  node_.set_metric("camera_noise_mm", 1e3 * s.filter.position_noise_m);
  const std::string missing = missing_input();
  if (!missing.empty()) return node_.set_state(ProcessState::kWaiting, missing);
  const calibration::AlignmentStatus& alignment = core_->alignment();
  if (!alignment.is_aligned) return node_.set_state(ProcessState::kWaiting, alignment.reason);
  if (base_tracking_ == BaseTracking::kCoasting) {
    return node_.set_state(ProcessState::kDegraded,
                           "tracking is lost or contradicts: the base is predicted");
  }
  node_.set_state(
      ProcessState::kOk,
      keep_trouble_.empty() ? "" : "the alignment is not kept for a restart: " + keep_trouble_);
}

}  // namespace foresight
