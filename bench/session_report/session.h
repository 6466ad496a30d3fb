// What a recorded session of the simulated robot was worth, from the logs of its two sites: every
// predicted view against where the camera really was at the predicted instant, the base's pose
// against the truth, and how long a command took to be seen.
//
//   Session session(sim_params);
//   session.read(robot_log, operator_log);
//   session.write("out/report");
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bench/evaluate/closed_loop_scorer.h"
#include "bench/evaluate/true_view.h"
#include "bench/evaluate/truth_track.h"
#include "common/lcm_log.h"
#include "common/robot_messages.h"
#include "foresight/display_stats_t.hpp"

namespace foresight {

/// One picture on the operator's screen.
struct ShownPicture {
  double time_s = 0;                 // since the session's start
  double motion_to_picture_ms = -1;  // of the command that it is the first to show; −1: none
  double texture_age_ms = 0;         // of its newest image, against the predicted instant
  double draw_ms = 0;
};

class Session {
 public:
  /// `sim_params`: those that sim had.
  explicit Session(const sim::SimParams& sim_params) : sim_params_(sim_params) {}
  /// Throws UnavailableError for a log that cannot be read.
  void read(const std::string& robot_log, const std::string& operator_log);
  /// Throws UnavailableError when a log that was read has damage: the figures miss something.
  void require_whole_logs() const;
  /// FOLDER/predictions.csv, base.csv, pictures.csv, joints.csv, summary.json.
  void write(const std::string& folder) const;
  const ClosedLoopResult& result() const { return result_; }
  const std::vector<ShownPicture>& pictures() const { return pictures_; }

 private:
  struct JointSample {
    double time_s;
    std::vector<double> commanded_rad, measured_rad;
  };
  void on_robot(const LogEvent& event);
  void on_operator(const LogEvent& event);
  void on_alignment(const LogEvent& event);
  void on_base(const LogEvent& event);
  void on_display(const LogEvent& event);
  void on_joint_state(const LogEvent& event);
  double since_start_s(Time time) const { return (time - *start_).seconds(); }
  void score(const display_stats_t& shown, const Truth& truth);
  void score_due();

  sim::SimParams sim_params_;
  std::string damage_;  // of the logs; empty: none
  std::optional<Time> start_;
  TruthTrack truth_;
  std::unique_ptr<TrueView> view_;
  std::optional<Pose<World, World>> true_from_estimated_;
  Time aligned_at_;
  std::deque<display_stats_t> waiting_;
  std::deque<BaseState> waiting_bases_;
  int64_t newest_command_us_ = 0;
  std::vector<double> commanded_rad_;
  std::vector<JointSample> joints_;
  std::vector<ShownPicture> pictures_;
  ClosedLoopResult result_;
};

}  // namespace foresight
