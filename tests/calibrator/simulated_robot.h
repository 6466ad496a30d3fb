// A WAM whose camera sees a cloud of points, with exact kinematics and SLAM-like noise: what the
// calibrator would receive, and the truth.
#pragma once

#include <functional>
#include <random>
#include <utility>
#include <vector>

#include "common/arm_model.h"
#include "common/camera_model.h"
#include "common/map_delta.h"
#include "procs/calibrator/calibrator.h"

namespace foresight {

struct RobotOptions {
  double joint_swing_rad = 0.3;  // amplitude of the joints' motion
  double joint_delay_s = 0;      // an image of time t shows the joints of t + this
  // 3D standard deviations of a frame's pose; of a keyframe's two thirds of it.
  double noise_m = 0.0015, noise_deg = 0.05;
  double scale_m_per_mu = 0.37;
  double wrong_keyframe_share = 0;                    // of the keyframes: 0.2 m off
  std::function<Pose<World, Base>(double t_s)> base;  // default: still at the origin
  unsigned seed = 1;
};

/// Where the events go.
class RobotListener {
 public:
  virtual ~RobotListener() = default;
  virtual void on_joints(Time time, const JointVector& position_rad) = 0;
  virtual void on_frame(const calibration::CameraFrame& frame) = 0;
  virtual void on_map(int64_t epoch, bool is_first, const MapDelta& delta) = 0;
  virtual void on_second() {}
};

class SimulatedRobot {
 public:
  SimulatedRobot(const ArmModel& arm, const RobotOptions& options);

  /// Joints at 100 Hz, frames at 30 Hz that arrive 20 ms late, keyframes, one on_second() a second.
  void run(double seconds_long, RobotListener* listener);
  /// Another map of the same scene: new epoch, scale and origin; no keyframes yet.
  void begin_map(double scale_m_per_mu);
  /// While set, frames are reported as lost, or off by a constant error.
  enum class Tracking { kGood, kLost, kWrong };
  void set_tracking(Tracking tracking) { tracking_ = tracking; }
  void set_still(bool still) { arm_is_still_ = still; }

  const CameraModel& camera() const { return camera_; }
  Time now() const { return now_; }
  int64_t epoch() const { return epoch_; }
  double seconds_of(Time time) const { return (time - kStart).seconds(); }
  Pose<World, Base> world_from_base(Time time) const { return options_.base(seconds_of(time)); }
  Pose<World, Cam> world_from_cam(Time image_time) const;
  const Similarity<World, Map>& world_from_map() const { return world_from_map_; }

 private:
  static constexpr Time kStart{1'000'000'000};

  JointVector joints(double t_s) const;
  Pose<Map, Cam> seen(Time time, double noise_share);
  Eigen::Vector3d gaussian(double sigma3);
  void make_points();
  void see_frame(Time time, RobotListener* listener);
  void maybe_make_keyframe(Time time, RobotListener* listener);

  ArmModel arm_;
  RobotOptions options_;
  CameraModel camera_;
  std::mt19937 generator_;
  std::normal_distribution<double> normal_;
  std::vector<Eigen::Vector3d> points_in_world_;
  Similarity<World, Map> world_from_map_;
  Time now_ = kStart, next_frame_ = kStart;
  double arm_clock_s_ = 0;
  std::vector<std::pair<Time, double>> arm_clock_;  // the arm's phase at recent instants
  int64_t epoch_ = 0;
  std::vector<Pose<World, Cam>> keyframes_;
  bool arm_is_still_ = false;
  Tracking tracking_ = Tracking::kGood;
};

/// Feeds a calibrator's core directly, and solves once a second.
class CoreListener : public RobotListener {
 public:
  explicit CoreListener(calibration::Calibrator* core) : core_(core) {}
  void on_joints(Time time, const JointVector& position_rad) override;
  void on_frame(const calibration::CameraFrame& frame) override;
  void on_map(int64_t epoch, bool is_first, const MapDelta& delta) override;
  void on_second() override;
  /// Since the last call.
  std::vector<BaseState> take_base() { return std::exchange(base_, {}); }

 private:
  calibration::Calibrator* core_;
  std::vector<BaseState> base_;
};

/// Errors of a calibrator against the robot's truth.
struct AlignmentError {
  double position_m = 0;  // largest over the places of the camera in the last `span`
  double rotation_deg = 0;
  double scale = 0;  // relative
};
AlignmentError alignment_error(const SimulatedRobot& robot,
                               const calibration::AlignmentStatus& alignment);

struct BaseError {
  double median_mm = 0, max_mm = 0, median_deg = 0, max_deg = 0;
};
BaseError base_error(const SimulatedRobot& robot, const std::vector<BaseState>& estimates);

}  // namespace foresight
