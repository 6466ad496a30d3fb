#include "procs/calibrator/alignment_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "procs/calibrator/alignment_certainty.h"
#include "procs/calibrator/alignment_judge.h"
#include "procs/calibrator/alignment_minimiser.h"
#include "procs/calibrator/alignment_start.h"

namespace foresight::calibration {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kOutlierMedians = 3, kLossMedians = 2;  // of the pairs' errors
constexpr double kLeastOutlier_px = 1.5, kLeastLoss_px = 0.5;
constexpr int kGrossRounds = 2, kFineRounds = 2;

struct Fit {
  PivotedEstimate estimate;
  Minimisation task;  // of the last round: its pairs are the inliers
};

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::vector<double> errors_px(const std::vector<SampledPair>& pairs, const CameraModel& camera,
                              const PivotedEstimate& estimate) {
  std::vector<double> errors;
  for (const SampledPair& p : pairs) errors.push_back(rms_px(p, camera, estimate));
  return errors;
}

// The middle of the cameras: there scale and turn disturb the position least.
Eigen::Vector3d pivot_of(const std::vector<SampledPair>& pairs) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const SampledPair& p : pairs) sum += p.pair->map_from_cam.translation();
  return sum / static_cast<double>(pairs.size());
}

// Robust rounds over all pairs, then rounds over those that agree.
Fit fit(const AlignmentProblem& problem, const std::vector<SampledPair>& pairs,
        const PivotedEstimate& start, FreeParts free) {
  Fit f{start, {}};
  f.task.camera = &problem.camera;
  f.task.free = free;
  f.task.max_delay_s = problem.options.max_delay_s;
  f.task.max_iterations = problem.options.max_iterations;
  for (int round = 0; round < kGrossRounds + kFineRounds; ++round) {
    const bool is_gross = round < kGrossRounds;
    const auto errors = errors_px(pairs, problem.camera, f.estimate);
    const double middle_px = median(errors);
    const double cut_px = std::max(kLeastOutlier_px, kOutlierMedians * middle_px);
    f.task.pairs.clear();
    for (size_t i = 0; i < pairs.size(); ++i) {
      if (is_gross || errors[i] <= cut_px) f.task.pairs.push_back(&pairs[i]);
    }
    f.task.loss = is_gross ? Loss::kCauchy : Loss::kHuber;
    f.task.loss_px = std::max(kLeastLoss_px, kLossMedians * middle_px);
    f.estimate = minimise(f.task, f.estimate);
  }
  return f;
}

void fill_numbers(const AlignmentProblem& problem, const Fit& f, const Certainty& c,
                  AlignmentSolution* s) {
  s->estimate = f.estimate.estimate();
  s->middle_in_base = f.estimate.pivot_in_base;
  s->delay_is_estimated = f.task.free.delay;
  s->inliers = static_cast<int>(f.task.pairs.size());
  s->is_inlier.assign(problem.pairs.size(), false);
  double sum = 0;
  for (const SampledPair* pair : f.task.pairs) {
    const double error_px = rms_px(*pair, problem.camera, f.estimate);
    sum += error_px * error_px;
    s->is_inlier[static_cast<size_t>(pair->pair - problem.pairs.data())] = true;
  }
  s->residual_px = std::sqrt(sum / std::max(1, s->inliers));
  s->pair_position_error_m = c.pair_position_error_m;
  s->pair_rotation_error_rad = c.pair_rotation_error_rad;
  const bool known = c.is_determined;
  s->scale_sigma = known ? c.sigma(6) : kInfinity;
  s->position_sigma_m = known ? c.position_sigma_m : kInfinity;
  s->rotation_sigma_rad = known ? c.sigma3(3) : kInfinity;
  s->delay_sigma_s = known && f.task.free.delay ? c.sigma(kDelayStep) : kInfinity;
  if (!f.task.free.camera) return;
  s->ee_from_cam_position_sigma_m = known ? c.sigma3(kCameraStep) : kInfinity;
  s->ee_from_cam_rotation_sigma_rad = known ? c.sigma3(kCameraStep + 3) : kInfinity;
}

bool delay_is_certain(const Certainty& c, const AlignmentOptions& options) {
  return c.is_determined && c.sigma(kDelayStep) <= options.max_delay_sigma_s;
}

std::vector<SampledPair> sample_all(const AlignmentProblem& problem) {
  std::vector<SampledPair> pairs;
  for (const PosePair& pair : problem.pairs) {
    auto sampled =
        sample(pair, problem.camera, problem.points_in_map, problem.options.points_per_pair);
    if (sampled) pairs.push_back(std::move(*sampled));
  }
  return pairs;
}

}  // namespace

AlignmentSolution solve_alignment(const AlignmentProblem& problem) {
  const AlignmentOptions& options = problem.options;
  AlignmentSolution s;
  s.estimate = problem.guess;
  s.is_inlier.assign(problem.pairs.size(), false);
  const auto pairs = sample_all(problem);
  s.baseline_m = largest_baseline_m(pairs, problem.guess);
  s.pairs_with_points = static_cast<int>(pairs.size());
  if (!has_enough_motion(options, &s)) return s;
  const PivotedEstimate start(start_alignment(pairs, problem.camera, problem.guess),
                              pivot_of(pairs));
  FreeParts free{options.refine_camera, options.estimate_delay};
  Fit f = fit(problem, pairs, start, free);
  Certainty c = certainty_of(f.task, f.estimate, options);
  if (free.delay && !delay_is_certain(c, options)) {
    free.delay = false;  // the motion does not show it: keep the given one
    f = fit(problem, pairs, start, free);
    c = certainty_of(f.task, f.estimate, options);
  }
  fill_numbers(problem, f, c, &s);
  judge(options, drift_of(f.task, f.estimate, options), second_axis_turn_rad(f.task.pairs), &s);
  return s;
}

}  // namespace foresight::calibration
