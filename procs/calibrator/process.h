#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common/delta_input.h"
#include "common/kept_file.h"
#include "common/newest_stamp.h"
#include "common/node.h"
#include "common/persistent_value.h"
#include "common/process_main.h"
#include "common/run_identity.h"
#include "foresight/alignment_t.hpp"
#include "foresight/base_pose_t.hpp"
#include "foresight/camera_info_t.hpp"
#include "foresight/camera_pose_t.hpp"
#include "foresight/joint_state_t.hpp"
#include "foresight/map_delta_t.hpp"
#include "procs/calibrator/calibrator.h"
#include "procs/calibrator/params.h"

namespace foresight {

/// CAMERA_INFO, CAMERA_POSE, MAP_DELTA and JOINT_STATE in; ALIGNMENT, BASE_POSE and, while SLAM is
/// lost, POSE_HINT out (paper §II-C).
class CalibratorProcess : public Process {
 public:
  using Params = CalibratorParams;
  static constexpr ProcessInfo kInfo{
      "calibrator", "Aligns the map with the robot and follows the motion of its base.",
      Domain::kRobot};

  /// `run`: within which the alignment outlives this process; none: it does not.
  CalibratorProcess(Node& node, const CalibratorParams& params,
                    const std::optional<RunIdentity>& run);
  CalibratorProcess(Node& node, const CalibratorParams& params)
      : CalibratorProcess(node, params,
                          node.is_simulated() ? std::nullopt : std::optional(this_run())) {}
  /// Ended on purpose: nobody is to go on with the alignment.
  ~CalibratorProcess() override;
  void start() override;

  /// For evaluations that run the process in a Simulation. Only after start().
  const calibration::AlignmentStatus& alignment() const { return core_->alignment(); }
  /// Empty until the first frame after alignment.
  const std::optional<BaseState>& base() const { return core_->base(); }

 private:
  void on_camera_info(const camera_info_t& message);
  void on_camera_pose(const camera_pose_t& message);
  void apply_map(const DeltaStep<MapDelta>& step);
  void on_joint_state(const joint_state_t& message);
  void solve();
  void publish_alignment();
  void publish_base();
  void publish_hint();
  void publish_health();
  void find_kept();
  void keep();
  void watch_recall();
  std::string missing_input() const;

  Node& node_;
  CalibratorParams params_;
  Input camera_info_input_, camera_pose_input_, joint_state_input_;
  Publisher<alignment_t> alignments_;
  Publisher<base_pose_t> base_poses_;
  Publisher<pose_hint_t> hints_;
  DeltaInput<map_delta_t, MapDelta> map_;
  std::unique_ptr<calibration::Calibrator> core_;
  int joints_ = 0;                          // of the arm
  PersistentValue<CameraModel> camera_{2};  // stated once a second
  NewestStamp joint_stamps_, frame_stamps_;
  std::optional<Time> last_joints_, last_frame_;  // by the clock, when they arrived
  std::optional<BaseTracking> base_tracking_;
  int64_t hints_given_ = 0;

  std::optional<RunIdentity> run_;
  std::shared_ptr<const KeptFile> kept_;  // shared with the worker; none: nothing is kept
  bool keep_is_due_ = false;
  std::string keep_trouble_;
  calibration::Recall recall_ = calibration::Recall::kNone;  // as it was said last
};

}  // namespace foresight
