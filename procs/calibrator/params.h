#pragma once

#include <string>

#include "common/params.h"
#include "procs/calibrator/calibrator.h"

namespace foresight {

namespace calibration {
constexpr auto names_of(BaseFilterKind) {
  return std::array{EnumName{BaseFilterKind::kKalman, "kalman"},
                    EnumName{BaseFilterKind::kPaper, "paper"}};
}
}  // namespace calibration

struct CalibratorParams {
  calibration::CalibratorOptions options;
  std::string arm_file = "deploy/arms/wam4.yaml";
  double solve_period_s = 1;
  double solve_cost_s = 0.05;
  bool keep_alignment = true;
  std::string keep_folder;

  template <class V>
  void visit(V& v) {
    visit_general(v);
    visit_alignment(v);
    visit_filter(v);
  }

  template <class V>
  void visit_general(V& v) {
    v("arm_file", arm_file, {.doc = "description of the arm and of the camera on it"});
    v("solve_period_s", solve_period_s,
      {.unit = "s", .min = 0.1, .max = 60, .doc = "least time between two alignments"});
    v("solve_cost_s", solve_cost_s,
      {.unit = "s",
       .min = 0,
       .max = 10,
       .doc = "how long an alignment takes on a simulated clock (measured: about 0.05 s)"});
    v("keep_alignment", keep_alignment,
      {.doc = "leave the alignment to the next calibrator, should this one be killed"});
    v("keep_folder", keep_folder,
      {.doc = "where; '': $XDG_DATA_HOME/foresight/kept, else ~/.local/share/foresight/kept"});
    v("joint_delay_s", options.joint_delay_s,
      {.unit = "s",
       .min = -0.1,
       .max = 0.1,
       .doc = "an image of time t shows the joints of t + this; until it is estimated"});
    v("min_quality", options.min_quality,
      {.unit = "1", .min = 0, .max = 1, .doc = "tracking below this quality counts as lost"});
    v("min_points", options.min_points,
      {.unit = "1", .min = 3, .max = 1000, .doc = "tracking with fewer points counts as lost"});
    v("leave_m", options.leave_m,
      {.unit = "m",
       .min = 0.001,
       .max = 1,
       .doc = "a base this far from where it was aligned has left: no more pairs"});
    v("leave_deg", options.leave_deg,
      {.unit = "deg", .min = 0.05, .max = 45, .doc = "a base turned this far has left"});
  }

  template <class V>
  void visit_alignment(V& v) {
    auto& a = options.alignment;
    v("refine_camera", a.refine_camera, {.doc = "estimate the camera's place on the arm too"});
    v("estimate_delay", a.estimate_delay,
      {.doc = "estimate the joints' delay where motion shows it"});
    v("max_pairs", options.pairs.max_pairs,
      {.unit = "1", .min = 12, .max = 1000, .doc = "pairs of poses kept"});
    v("min_pairs", a.min_pairs,
      {.unit = "1", .min = 3, .max = 500, .doc = "pairs of poses needed"});
    v("pair_spacing_m", options.pairs.spacing_m,
      {.unit = "m", .min = 0.001, .max = 1, .doc = "motion of the hand between two pairs, or …"});
    v("pair_spacing_deg", options.pairs.spacing_deg,
      {.unit = "deg", .min = 0.1, .max = 90, .doc = "… its turn"});
    v("min_baseline_m", a.min_baseline_m,
      {.unit = "m", .min = 0.01, .max = 5, .doc = "distance between camera centres needed"});
    v("max_residual_px", a.max_residual_px,
      {.unit = "px", .min = 0.1, .max = 100, .doc = "RMS error above which the base is not still"});
    v("min_inlier_share", a.min_inlier_share,
      {.unit = "1", .min = 0.5, .max = 1, .doc = "share of the pairs that must agree"});
    v("max_drift_m", a.max_drift_m,
      {.unit = "m", .min = 0.0005, .max = 1, .doc = "steady motion of the base among the pairs"});
    v("max_drift_deg", a.max_drift_deg,
      {.unit = "deg", .min = 0.05, .max = 45, .doc = "steady turn of the base among the pairs"});
    v("min_axis_turn_deg", a.min_axis_turn_deg,
      {.unit = "deg",
       .min = 0.5,
       .max = 90,
       .doc = "RMS turn about a second axis that refine_camera needs"});
    v("max_scale_sigma", a.max_scale_sigma,
      {.unit = "1", .min = 1e-4, .max = 0.2, .doc = "relative standard deviation of the scale"});
    v("max_position_sigma_m", a.max_position_sigma_m,
      {.unit = "m", .min = 1e-4, .max = 0.2, .doc = "standard deviation of the camera's place"});
    v("max_rotation_sigma_deg", a.max_rotation_sigma_deg,
      {.unit = "deg", .min = 0.01, .max = 10, .doc = "standard deviation of the orientation"});
    v("max_delay_sigma_s", a.max_delay_sigma_s,
      {.unit = "s",
       .min = 1e-4,
       .max = 0.1,
       .doc = "standard deviation above which the joints' delay is not estimated"});
  }

  template <class V>
  void visit_filter(V& v) {
    auto& f = options.filter;
    v("filter", f.kind, {.doc = "of the base's motion; the paper's lags by 0.63 s"});
    v("lambda", f.lambda,
      {.unit = "1",
       .min = 0,
       .max = 0.999,
       .doc = "share that the paper's filter keeps per frame"});
    v("position_noise_m", f.position_noise_m,
      {.unit = "m",
       .min = 1e-5,
       .max = 0.1,
       .doc = "noise of a tracked camera's place, until it is measured"});
    v("rotation_noise_deg", f.rotation_noise_deg,
      {.unit = "deg", .min = 1e-3, .max = 5, .doc = "noise of its orientation"});
    v("velocity_decay_s", f.velocity_decay_s,
      {.unit = "s", .min = 0.01, .max = 10, .doc = "of the base while tracking is lost"});
    v("reacquire_s", f.reacquire_s,
      {.unit = "s",
       .min = 0.1,
       .max = 60,
       .doc = "poses that contradict for so long, and agree among themselves, are believed"});
  }
};

}  // namespace foresight
