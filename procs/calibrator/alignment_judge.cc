#include "procs/calibrator/alignment_judge.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "procs/calibrator/geometry.h"

namespace foresight::calibration {
namespace {

constexpr double kDriftSigmas = 4;
constexpr double kMaxRequest_m = 1.0;

template <class... Args>
std::string text(const char* format, Args... args) {
  char buffer[200];
  std::snprintf(buffer, sizeof buffer, format, args...);
  return buffer;
}

void say(AlignmentSolution* s, AlignmentVerdict verdict, std::string reason) {
  s->verdict = verdict;
  s->reason = std::move(reason);
}

std::string translate_more(double missing_m) {
  const double cm = 100 * std::clamp(missing_m, 0.01, kMaxRequest_m);
  return text("translate the camera >= %.0f cm more", std::ceil(cm - 1e-6));
}

bool is_drifting(const AlignmentOptions& options, const Drift& d) {
  return (d.shift_m > options.max_drift_m && d.shift_m > kDriftSigmas * d.shift_sigma_m) ||
         (d.turn_rad > options.max_drift_deg * kDegree &&
          d.turn_rad > kDriftSigmas * d.turn_sigma_rad);
}

// A base that moves slowly cannot be told from one that is still until the arm has moved to and
// fro.
bool may_drift(const AlignmentOptions& options, const Drift& d) {
  return !d.is_determined || 2 * d.shift_sigma_m > options.max_drift_m ||
         2 * d.turn_sigma_rad > options.max_drift_deg * kDegree;
}

void judge_certainty(const AlignmentOptions& options, const Drift& drift, AlignmentSolution* s) {
  if (s->scale_sigma > options.max_scale_sigma) {
    // The scale's error falls with the distance that the poses span.
    const double missing_m = s->baseline_m * (s->scale_sigma / options.max_scale_sigma - 1);
    return say(s, AlignmentVerdict::kUncertain,
               translate_more(missing_m) + text(" (scale known to %.1f %%)", 100 * s->scale_sigma));
  }
  if (s->position_sigma_m > options.max_position_sigma_m) {
    return say(s, AlignmentVerdict::kUncertain,
               text("move the arm on: position known to %.1f mm", 1e3 * s->position_sigma_m));
  }
  if (s->rotation_sigma_rad > options.max_rotation_sigma_deg * kDegree) {
    return say(
        s, AlignmentVerdict::kUncertain,
        text("move the arm on: orientation known to %.2f deg", s->rotation_sigma_rad / kDegree));
  }
  if (may_drift(options, drift)) {
    return say(s, AlignmentVerdict::kUncertain,
               "move the arm to and fro: a slowly moving base cannot be excluded yet");
  }
  say(s, AlignmentVerdict::kAccepted, "");
}

}  // namespace

bool has_enough_motion(const AlignmentOptions& options, AlignmentSolution* s) {
  const int pairs = static_cast<int>(s->is_inlier.size());
  if (pairs < options.min_pairs) {
    say(s, AlignmentVerdict::kFewPairs,
        text("move the arm: %d of %d poses", pairs, options.min_pairs));
  } else if (s->pairs_with_points < options.min_pairs) {
    say(s, AlignmentVerdict::kFewPoints,
        text("too few map points in view: %d of %d poses have enough", s->pairs_with_points,
             pairs));
  } else if (s->baseline_m < options.min_baseline_m) {
    say(s, AlignmentVerdict::kBaseline, translate_more(options.min_baseline_m - s->baseline_m));
  } else {
    return true;
  }
  return false;
}

void judge(const AlignmentOptions& options, const Drift& drift, double second_axis_turn_rad,
           AlignmentSolution* s) {
  const double share = s->inliers / static_cast<double>(s->pairs_with_points);
  if (s->residual_px > options.max_residual_px || share < options.min_inlier_share) {
    return say(s, AlignmentVerdict::kInconsistent,
               text("base is moving, or the arm or its camera is described wrongly: %.0f %% of the "
                    "poses agree to %.1f px",
                    100 * share, s->residual_px));
  }
  if (is_drifting(options, drift)) {
    return say(s, AlignmentVerdict::kDrifting,
               text("base is moving: %.0f mm, %.1f deg over the poses so far", 1e3 * drift.shift_m,
                    drift.turn_rad / kDegree));
  }
  if (s->delay_is_estimated && std::abs(s->estimate.joint_delay_s) > 0.99 * options.max_delay_s) {
    return say(
        s, AlignmentVerdict::kDelay,
        text("clocks of joints and images differ by more than %.0f ms", 1e3 * options.max_delay_s));
  }
  if (options.refine_camera && second_axis_turn_rad < options.min_axis_turn_deg * kDegree) {
    return say(s, AlignmentVerdict::kAxes, "rotate about a second axis");
  }
  judge_certainty(options, drift, s);
}

}  // namespace foresight::calibration
