#include "procs/calibrator/calibrator.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "procs/calibrator/geometry.h"

namespace foresight::calibration {
namespace {

// What the filter notices late may have spoiled pairs already.
constexpr Duration kDoubt = milliseconds(1500);
constexpr Duration kBack = seconds(1), kFar = seconds(1);
// Nothing is predicted over a longer time between two frames: a clock was set, or all stood still.
constexpr Duration kClockStep = seconds(60);
constexpr double kSigmas = 3;   // of the alignment, that are no motion of the base
constexpr double kFarAway = 3;  // times that limit: it will not come back exactly
// Bundle adjustment that moves pairs by less is not worth a new solution.
constexpr double kMoved_m = 0.0005, kMoved_rad = 0.03 * kDegree;

// The fastest motion of the base is forgotten within so long.
constexpr double kRestless_s = 10;
// New pairs may be less certain than those of before a restart, and count for all that: they follow
// the map as it changes.
constexpr double kWorthReplacing = 1.5, kSameScale = 0.005;

constexpr const char* kBeingConfirmed = "alignment of before the restart, being confirmed";

double hypotenuse(double a, double b) { return std::sqrt(a * a + b * b); }

// The alignment is best where its cameras were; beyond, its scale and turn tell.
double doubt_m(const AlignmentSolution& s, const Pose<Base, Cam>& base_from_cam) {
  const double beyond_m = (base_from_cam.translation() - s.middle_in_base).norm();
  return hypotenuse(s.position_sigma_m, beyond_m * hypotenuse(s.scale_sigma, s.rotation_sigma_rad));
}

}  // namespace

Calibrator::Calibrator(const ArmModel& arm, const CalibratorOptions& options)
    : arm_(arm),
      options_(options),
      history_(options.arm),
      collector_(options.pairs, history_, map_),
      filter_(make_base_filter(options.filter)) {}

void Calibrator::begin_epoch(int64_t epoch) {
  if (base_) {
    world_from_aligned_base_ = base_->world_from_base;
    aligned_base_sigma_m_ = base_->position_sigma_m;
    aligned_base_sigma_rad_ = base_->rotation_sigma_rad;
  }
  epoch_ = epoch;
  map_.clear();
  collector_.clear();
  waiting_.clear();
  alignment_ = {};
  alignment_.epoch = epoch;
  alignment_.reason = "new map: move the arm";
  if (recalled_) {
    recall_ = recalled_->kept().epoch == epoch ? Recall::kOpen : Recall::kOfAnotherMap;
    if (is_confirming()) alignment_.reason = kBeingConfirmed;
  }
  solved_poses_.clear();
  newest_ = {};
  stand_ = Stand::kThere;
  back_since_.reset();
  far_since_.reset();
  filter_runs_ = false;
}

void Calibrator::apply_map(int64_t epoch, MapChange change, const MapDelta& delta) {
  if (epoch != epoch_) begin_epoch(epoch);
  if (change == MapChange::kSnapshot) map_.clear();
  map_.apply(delta);
  if (is_collecting()) {
    collector_.add_keyframes(delta);
  } else {
    collector_.exclude_keyframes(delta);
  }
}

void Calibrator::add_joints(Time time, const JointVector& position_rad) {
  switch (history_.add(time, arm_.base_from_ee(position_rad))) {
    case ArmHistory::Added::kJump:
      ++statistics_.joint_jumps;
      break;
    case ArmHistory::Added::kNotNewer:
      ++statistics_.joints_not_newer;
      return;
    case ArmHistory::Added::kDoubted:
      return;
    case ArmHistory::Added::kAdded:
      break;
  }
  has_new_pairs_ |= collector_.update();
  drain();
}

bool Calibrator::is_good(const CameraFrame& frame) const {
  return frame.map_from_cam && frame.quality >= options_.min_quality &&
         frame.points_found >= options_.min_points;
}

bool Calibrator::add_frame(const CameraFrame& frame) {
  if (frame.time <= newest_frame_ && newest_frame_ - frame.time < seconds(1)) return false;
  // No filter can follow a clock that was set.
  if (frame.time < newest_frame_ || frame.time - newest_frame_ > kClockStep) {
    waiting_.clear();
    filter_runs_ = false;
  }
  newest_frame_ = frame.time;
  if (frame.epoch == 0 || frame.epoch != epoch_) {
    statistics_.frames_of_other_maps += frame.epoch != 0 ? 1 : 0;
    return true;
  }
  const bool good = is_good(frame);
  if (frame.map_from_cam && !good) ++statistics_.weak_frames;
  if (good && is_collecting()) collector_.add_frame(frame.time, *frame.map_from_cam);
  waiting_.push_back(frame);
  drain();
  return true;
}

double Calibrator::joint_delay_s() const { return guess().joint_delay_s; }

// Frames in order, as soon as their joints are there.
void Calibrator::drain() {
  while (!waiting_.empty()) {
    const CameraFrame& frame = waiting_.front();
    const Time joints_time = frame.time + seconds(joint_delay_s());
    const bool must_wait = (alignment_.is_aligned || is_confirming()) && is_good(frame) &&
                           (history_.empty() || history_.newest() < joints_time) &&
                           (newest_frame_ - frame.time).seconds() < options_.joints_wait_s;
    if (must_wait) return;
    check_recalled(frame);
    if (const auto estimate = estimate_base(frame)) {
      note_speed(*estimate);
      base_ = estimate;
      new_base_.push_back(*estimate);
      watch_stand(*estimate);
    }
    waiting_.pop_front();
  }
}

std::optional<Calibrator::Expectation> Calibrator::expected_camera(BasePlace place) const {
  if (!alignment_.is_aligned || !base_ || history_.empty()) return std::nullopt;
  const std::optional<Pose<World, Base>> world_from_base =
      place == BasePlace::kPresent ? base_->world_from_base : filter_->earlier();
  if (!world_from_base) return std::nullopt;
  const auto arm = history_.at(history_.newest());
  if (!arm) return std::nullopt;
  const Pose<World, Cam> world_from_cam =
      *world_from_base * arm->base_from_ee * alignment_.solution.estimate.ee_from_cam;
  return Expectation{history_.newest() - seconds(joint_delay_s()), alignment_.epoch,
                     alignment_.world_from_map.inverse() * world_from_cam};
}

std::optional<BaseState> Calibrator::estimate_base(const CameraFrame& frame) {
  if (!alignment_.is_aligned) return std::nullopt;
  std::optional<ArmMotion> arm;
  if (is_good(frame)) {
    arm = history_.at(frame.time + seconds(joint_delay_s()));
    if (!arm) ++statistics_.missing_joints;
  }
  std::optional<BaseState> e;
  if (arm) {
    // Eq. (7): the camera in the world by way of the map; in the base by way of the arm.
    e = follow({frame.time, alignment_.world_from_map * *frame.map_from_cam,
                arm->base_from_ee * alignment_.solution.estimate.ee_from_cam});
  } else if (filter_runs_) {
    e = filter_->coast(frame.time);
  }
  if (!e) return std::nullopt;
  e->position_sigma_m =
      hypotenuse(e->position_sigma_m, hypotenuse(doubt_m_, aligned_base_sigma_m_));
  e->rotation_sigma_rad = hypotenuse(e->rotation_sigma_rad, alignment_.rotation_sigma_rad);
  return e;
}

BaseState Calibrator::follow(const BaseMeasurement& measurement) {
  if (!filter_runs_) filter_->reset(measurement);
  filter_runs_ = true;
  doubt_m_ = doubt_m(alignment_.solution, measurement.base_from_cam);
  return filter_->update(measurement);
}

// No single pose tells that it has left for good: it must be measured far away for a while.
void Calibrator::watch_stand(const BaseState& estimate) {
  if (estimate.tracking != BaseTracking::kMeasured) far_since_.reset();
  if (estimate.tracking != BaseTracking::kMeasured || stand_ == Stand::kLeft) return;
  const Pose<Base, Base> moved = world_from_aligned_base_.inverse() * estimate.world_from_base;
  const double far_m = options_.leave_m + kSigmas * doubt_m_;
  const double far_rad =
      options_.leave_deg * kDegree + kSigmas * alignment_.solution.rotation_sigma_rad;
  const double share = std::max(moved.translation().norm() / far_m,
                                vector_from_rotation(moved.rotation()).norm() / far_rad);
  if (share <= kFarAway) {
    far_since_.reset();
  } else if (!far_since_) {
    far_since_ = estimate.time;
  }
  if (far_since_ && estimate.time - *far_since_ >= kFar) {
    stand_ = Stand::kLeft;
  } else if (share > 1 && stand_ == Stand::kThere) {
    collector_.discard_after(estimate.time - kDoubt);
    stand_ = Stand::kAway;
    back_since_.reset();
  } else if (share >= 0.5) {
    back_since_.reset();
  } else if (stand_ == Stand::kAway) {
    if (!back_since_) back_since_ = estimate.time;
    if (estimate.time - *back_since_ >= kBack) stand_ = Stand::kThere;
  }
}

void Calibrator::recall(const KeptAlignment& kept) {
  recalled_.emplace(kept);
  recall_ = Recall::kOpen;
}

std::optional<KeptAlignment> Calibrator::kept() const {
  if (!alignment_.is_aligned || !base_ || base_->tracking != BaseTracking::kMeasured)
    return std::nullopt;
  KeptAlignment k;
  k.epoch = alignment_.epoch;
  k.time = base_->time;
  k.newest_pair = alignment_.time;
  k.world_from_map = alignment_.world_from_map;
  k.solution = alignment_.solution;
  k.world_from_aligned_base = world_from_aligned_base_;
  k.aligned_base_sigma_m = aligned_base_sigma_m_;
  k.aligned_base_sigma_rad = aligned_base_sigma_rad_;
  k.stand = stand_;
  k.world_from_base = base_->world_from_base;
  k.base_speed_m_per_s = base_speed_m_per_s_;
  k.base_turn_rad_per_s = base_turn_rad_per_s_;
  return k;
}

// How fast a base that moves to and fro may be by the time that somebody looks again.
void Calibrator::note_speed(const BaseState& estimate) {
  const double since_s = base_ ? std::max(0.0, (estimate.time - base_->time).seconds()) : 0;
  const double left = std::exp(-since_s / kRestless_s);
  base_speed_m_per_s_ = std::max(estimate.velocity_m_per_s.norm(), left * base_speed_m_per_s_);
  base_turn_rad_per_s_ =
      std::max(estimate.angular_velocity_rad_per_s.norm(), left * base_turn_rad_per_s_);
}

void Calibrator::check_recalled(const CameraFrame& frame) {
  if (!is_confirming() || alignment_.is_aligned || !is_good(frame)) return;
  const KeptAlignment& kept = recalled_->kept();
  const auto arm = history_.at(frame.time + seconds(joint_delay_s()));
  if (!arm) return;
  const BaseMeasurement seen{frame.time, kept.world_from_map * *frame.map_from_cam,
                             arm->base_from_ee * kept.solution.estimate.ee_from_cam};
  const BaseBounds bounds{
      options_.leave_m + kSigmas * doubt_m(kept.solution, seen.base_from_cam),
      options_.leave_deg * kDegree + kSigmas * kept.solution.rotation_sigma_rad};
  switch (recalled_->judge(frame.time, seen.world_from_base(), bounds)) {
    case RecalledAlignment::Verdict::kOpen:
      return;
    case RecalledAlignment::Verdict::kConfirmed:
      return use_recalled();
    case RecalledAlignment::Verdict::kContradicted:
      recall_ = Recall::kContradicted;
      alignment_.reason = "alignment of before the restart contradicted: move the arm";
      break;
    case RecalledAlignment::Verdict::kTooOld:
      recall_ = Recall::kTooOld;
      alignment_.reason = "alignment of before the restart is of another time: move the arm";
      break;
  }
  recalled_.reset();
}

void Calibrator::use_recalled() {
  const KeptAlignment kept = recalled_->kept();
  recalled_.reset();
  recall_ = Recall::kConfirmed;
  world_from_aligned_base_ = kept.world_from_aligned_base;
  aligned_base_sigma_m_ = kept.aligned_base_sigma_m;
  aligned_base_sigma_rad_ = kept.aligned_base_sigma_rad;
  base_speed_m_per_s_ = kept.base_speed_m_per_s;
  base_turn_rad_per_s_ = kept.base_turn_rad_per_s;
  stand_ = kept.stand;
  // What was collected meanwhile is of another place of the base.
  if (stand_ != Stand::kThere) collector_.discard_after({});
  AlignmentSolution solution = kept.solution;
  solution.estimate.base_from_map =
      compose(world_from_aligned_base_.inverse(), kept.world_from_map);
  adopt(solution, kept.newest_pair);
}

// Until new pairs are as certain, unless they say something else.
bool Calibrator::keeps_recalled(const AlignmentSolution& solution) const {
  const AlignmentSolution& recalled = alignment_.solution;
  if (solution.position_sigma_m <= kWorthReplacing * recalled.position_sigma_m) return false;
  const Similarity<Base, Map>&is = solution.estimate.base_from_map,
                         &was = recalled.estimate.base_from_map;
  const Eigen::Vector3d middle_then = was * (is.inverse() * solution.middle_in_base);
  const double apart_m = (middle_then - solution.middle_in_base).norm();
  const double apart_rad = angle_between(is.rotation(), was.rotation());
  const double doubt = hypotenuse(solution.position_sigma_m, recalled.position_sigma_m);
  const double turn_doubt = hypotenuse(solution.rotation_sigma_rad, recalled.rotation_sigma_rad);
  const double scale_doubt = hypotenuse(solution.scale_sigma, recalled.scale_sigma);
  return apart_m <= options_.leave_m + kSigmas * doubt &&
         apart_rad <= options_.leave_deg * kDegree + kSigmas * turn_doubt &&
         std::abs(std::log(is.scale() / was.scale())) <= kSameScale + kSigmas * scale_doubt;
}

bool Calibrator::have_moved(const std::vector<PosePair>& pairs) const {
  if (pairs.size() != solved_poses_.size()) return true;
  const double scale = alignment_.is_aligned ? alignment_.world_from_map.scale() : 1;
  for (size_t i = 0; i < pairs.size(); ++i) {
    const Pose<Map, Cam>&now = pairs[i].map_from_cam, &then = solved_poses_[i];
    if (scale * (now.translation() - then.translation()).norm() > kMoved_m ||
        angle_between(now.rotation(), then.rotation()) > kMoved_rad) {
      return true;
    }
  }
  return false;
}

AlignmentEstimate Calibrator::guess() const {
  if (alignment_.is_aligned) return alignment_.solution.estimate;
  if (is_confirming()) return recalled_->kept().solution.estimate;
  return {{}, arm_.ee_from_cam, options_.joint_delay_s};
}

std::optional<AlignmentTask> Calibrator::take_task() {
  if (!camera_ || collector_.size() == 0) return std::nullopt;
  const auto pairs = collector_.pairs();
  if (pairs.empty() || !(has_new_pairs_ || have_moved(pairs))) return std::nullopt;
  has_new_pairs_ = false;
  solved_poses_.clear();
  for (const PosePair& p : pairs) solved_poses_.push_back(p.map_from_cam);
  AlignmentTask task;
  task.epoch = epoch_;
  task.middle_pair = pairs[pairs.size() / 2].time;
  task.newest_pair = pairs.back().time;
  task.problem = {options_.alignment, *camera_, pairs, map_.points_in_map(), guess()};
  return task;
}

bool Calibrator::apply(const AlignmentTask& task, const AlignmentSolution& solution) {
  if (task.epoch != epoch_) return false;
  newest_ = solution;
  if (solution.verdict == AlignmentVerdict::kAccepted) {
    accept(task, solution);
    return true;
  }
  const std::string before = alignment_.reason;
  refuse(task, solution);
  return alignment_.reason != before;
}

void Calibrator::accept(const AlignmentTask& task, const AlignmentSolution& solution) {
  if (alignment_.is_aligned && recall_ == Recall::kConfirmed && keeps_recalled(solution)) return;
  if (recall_ != Recall::kNone && recall_ != Recall::kContradicted && recall_ != Recall::kTooOld) {
    recall_ = Recall::kReplaced;
  }
  recalled_.reset();
  adopt(solution, task.newest_pair);
}

void Calibrator::adopt(const AlignmentSolution& solution, Time newest_pair) {
  alignment_.time = newest_pair;
  alignment_.is_aligned = true;
  alignment_.reason.clear();
  alignment_.solution = solution;
  alignment_.world_from_map = compose(world_from_aligned_base_, solution.estimate.base_from_map);
  alignment_.position_sigma_m = hypotenuse(solution.position_sigma_m, aligned_base_sigma_m_);
  alignment_.rotation_sigma_rad = hypotenuse(solution.rotation_sigma_rad, aligned_base_sigma_rad_);
}

void Calibrator::refuse(const AlignmentTask& task, const AlignmentSolution& solution) {
  const bool contradicts = solution.verdict == AlignmentVerdict::kInconsistent ||
                           solution.verdict == AlignmentVerdict::kDrifting;
  if (alignment_.is_aligned) {  // the answer that we have is better than the new one
    if (contradicts && stand_ == Stand::kThere) collector_.discard_after(alignment_.time);
    return;
  }
  // The older half goes, so that a base that has come to rest is aligned where it stands now.
  if (contradicts) collector_.discard_before(task.middle_pair);
  const bool is_repeated = solution.verdict == AlignmentVerdict::kFewPairs &&
                           alignment_.reason.starts_with("base is moving");
  if (!is_repeated && !is_confirming()) alignment_.reason = solution.reason;
}

std::vector<BaseState> Calibrator::take_base() {
  for (BaseState& base : new_base_) base.epoch = alignment_.epoch;
  return std::exchange(new_base_, {});
}

CalibratorStatistics Calibrator::statistics() const {
  CalibratorStatistics s = statistics_;
  s.pairs = collector_.size();
  s.base_has_left = alignment_.is_aligned && stand_ != Stand::kThere;
  s.newest = newest_;
  s.filter = filter_->statistics();
  return s;
}

}  // namespace foresight::calibration
