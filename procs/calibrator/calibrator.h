// The calibrator's core: where the map lies in the robot's world (paper §II-C.1), then where the
// robot's base is (§II-C.2).
//
//   Calibrator calibrator(arm, options);
//   calibrator.set_camera(camera);
//   calibrator.apply_map(epoch, MapChange::kSnapshot, delta);
//   calibrator.add_joints(time, position_rad);
//   calibrator.add_frame(frame);
//   for (const BaseState& b : calibrator.take_base()) publish(b);
//   if (auto t = calibrator.take_task()) calibrator.apply(*t, solve_alignment(t->problem));
//
// World is the base at the time of the first alignment. A new epoch is a new map, which must be
// aligned anew; the base is then taken to stand where it was last seen, so that the world stays
// what it was (what moved unseen cannot be known; the published uncertainty says how long it was
// unseen). What a calibrator knew that was killed (kept()) the next one is given by recall(): used
// once its first frames confirm it. docs/algorithms/calibration.md has the steps.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/arm_model.h"
#include "common/camera_model.h"
#include "common/map_delta.h"
#include "procs/calibrator/alignment.h"
#include "procs/calibrator/arm_history.h"
#include "procs/calibrator/base_filter.h"
#include "procs/calibrator/kept_alignment.h"
#include "procs/calibrator/map_store.h"
#include "procs/calibrator/pair_collector.h"
#include "procs/calibrator/recalled_alignment.h"

namespace foresight::calibration {

struct CalibratorOptions {
  AlignmentOptions alignment;
  PairCollectorOptions pairs;
  ArmHistoryOptions arm;
  BaseFilterOptions filter;
  double joint_delay_s = 0;  // until it is estimated
  // A frame whose tracking is worse is treated as lost.
  double min_quality = 0.4;
  int min_points = 25;
  // A base that has moved by more than this, and 3 sigma of the alignment, has left the place of
  // its alignment; it is back within half of that.
  double leave_m = 0.008;
  double leave_deg = 0.5;
  double joints_wait_s = 0.15;  // frames wait so long for their joints
};

/// What the tracker said about one frame.
struct CameraFrame {
  Time time;
  int64_t epoch = 0;
  std::optional<Pose<Map, Cam>> map_from_cam;  // when tracking
  double quality = 0;
  int points_found = 0;
};

/// How far the alignment has come.
struct AlignmentStatus {
  Time time;          // of the newest pair that contributed
  int64_t epoch = 0;  // of the map; 0: no map yet
  bool is_aligned = false;
  std::string reason = "no map yet";  // which motion is missing; empty when aligned
  // When aligned:
  Similarity<World, Map> world_from_map;
  AlignmentSolution solution;                           // the accepted one
  double position_sigma_m = 0, rotation_sigma_rad = 0;  // in the world, the base's doubt included
};

struct AlignmentTask {
  int64_t epoch = 0;
  Time middle_pair, newest_pair;
  AlignmentProblem problem;
};

enum class MapChange { kDelta, kSnapshot };

/// What became of the alignment of before a restart.
enum class Recall {
  kNone,          // there was none
  kOpen,          // being confirmed
  kOfAnotherMap,  // than the present one; counts again should that one come back
  kConfirmed,
  kContradicted,
  kTooOld,
  kReplaced,  // by an alignment from new pairs before it was confirmed
};

struct CalibratorStatistics {
  int pairs = 0;
  int64_t joint_jumps = 0;  // no arm moves so: the history began anew
  int64_t joints_not_newer = 0;
  int64_t missing_joints = 0;  // frames without joints at their time
  int64_t weak_frames = 0;     // tracked, but too badly
  int64_t frames_of_other_maps = 0;
  bool base_has_left = false;  // the place of its alignment
  AlignmentSolution newest;    // accepted or not
  BaseFilterStatistics filter;
};

class Calibrator {
 public:
  Calibrator(const ArmModel& arm, const CalibratorOptions& options);
  Calibrator(const Calibrator&) = delete;
  Calibrator& operator=(const Calibrator&) = delete;

  void set_camera(const CameraModel& camera) { camera_ = camera; }
  /// At the start, before anything else: the alignment of before a restart.
  void recall(const KeptAlignment& kept);
  Recall recalled() const { return recall_; }
  /// What the next calibrator can go on with; nothing unless aligned and the base is measured.
  std::optional<KeptAlignment> kept() const;

  /// The map's stream says which map is the present one: another epoch begins anew.
  void apply_map(int64_t epoch, MapChange change, const MapDelta& delta);
  /// `position_rad` has one row per joint.
  void add_joints(Time time, const JointVector& position_rad);
  /// A frame of another map than the present one is passed over. False when it is not newer than
  /// the last one.
  [[nodiscard]] bool add_frame(const CameraFrame& frame);

  /// What to solve, when something has changed since the last task.
  std::optional<AlignmentTask> take_task();
  /// True when the alignment or its reason changed.
  bool apply(const AlignmentTask& task, const AlignmentSolution& solution);

  const AlignmentStatus& alignment() const { return alignment_; }
  /// Base poses of frames since the last call, in order.
  std::vector<BaseState> take_base();
  /// The newest one.
  const std::optional<BaseState>& base() const { return base_; }
  CalibratorStatistics statistics() const;

  /// Where the camera should be in the map, by the newest joints and where the base was last seen;
  /// kEarlier: where it was seen for long, if it is believed elsewhere since. Nothing until
  /// aligned.
  struct Expectation {
    Time time;  // of the image that these joints belong to
    int64_t epoch = 0;
    Pose<Map, Cam> map_from_cam;
  };
  enum class BasePlace { kPresent, kEarlier };
  std::optional<Expectation> expected_camera(BasePlace place) const;

 private:
  void begin_epoch(int64_t epoch);
  bool is_collecting() const { return !alignment_.is_aligned || stand_ == Stand::kThere; }
  bool is_good(const CameraFrame& frame) const;
  double joint_delay_s() const;
  AlignmentEstimate guess() const;
  void drain();
  std::optional<BaseState> estimate_base(const CameraFrame& frame);
  BaseState follow(const BaseMeasurement& measurement);
  bool is_confirming() const { return recalled_ && recall_ == Recall::kOpen; }
  void check_recalled(const CameraFrame& frame);
  void use_recalled();
  bool keeps_recalled(const AlignmentSolution& solution) const;
  void note_speed(const BaseState& estimate);
  void watch_stand(const BaseState& estimate);
  bool have_moved(const std::vector<PosePair>& pairs) const;
  void accept(const AlignmentTask& task, const AlignmentSolution& solution);
  void adopt(const AlignmentSolution& solution, Time newest_pair);
  void refuse(const AlignmentTask& task, const AlignmentSolution& solution);

  const ArmModel arm_;
  const CalibratorOptions options_;
  std::optional<CameraModel> camera_;
  int64_t epoch_ = 0;
  MapStore map_;
  ArmHistory history_;
  PairCollector collector_;
  AlignmentStatus alignment_;
  AlignmentSolution newest_;
  std::vector<Pose<Map, Cam>> solved_poses_;  // of the pairs of the last task
  bool has_new_pairs_ = false;
  std::optional<RecalledAlignment> recalled_;  // until confirmed or dropped
  Recall recall_ = Recall::kNone;

  // Where the base stood at alignment, and the doubt about that.
  Pose<World, Base> world_from_aligned_base_;
  double aligned_base_sigma_m_ = 0, aligned_base_sigma_rad_ = 0;
  double doubt_m_ = 0;  // what the alignment's uncertainty makes of it where the camera is now
  Stand stand_ = Stand::kThere;
  std::optional<Time> back_since_, far_since_;

  std::deque<CameraFrame> waiting_;  // for their joints
  Time newest_frame_;
  std::unique_ptr<BaseFilter> filter_;
  bool filter_runs_ = false;
  std::optional<BaseState> base_;
  std::vector<BaseState> new_base_;
  double base_speed_m_per_s_ = 0, base_turn_rad_per_s_ = 0;  // at most, of late
  CalibratorStatistics statistics_;
};

}  // namespace foresight::calibration
