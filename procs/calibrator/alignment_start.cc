#include "procs/calibrator/alignment_start.h"

#include <algorithm>
#include <limits>

namespace foresight::calibration {
namespace {

struct Baseline {
  size_t near = 0, far = 0;
  double length_m = 0;
};

std::vector<Baseline> farthest_partners(const std::vector<Pose<Base, Cam>>& base_from_cam) {
  std::vector<Baseline> baselines;
  for (size_t i = 0; i < base_from_cam.size(); ++i) {
    Baseline best{i, i, 0};
    for (size_t j = 0; j < base_from_cam.size(); ++j) {
      const double d = (base_from_cam[i].translation() - base_from_cam[j].translation()).norm();
      if (d > best.length_m) best = {i, j, d};
    }
    baselines.push_back(best);
  }
  return baselines;
}

std::vector<Pose<Base, Cam>> all_base_from_cam(const std::vector<SampledPair>& pairs,
                                               const AlignmentEstimate& guess) {
  std::vector<Pose<Base, Cam>> poses;
  for (const SampledPair& p : pairs) poses.push_back(base_from_cam(*p.pair, guess));
  return poses;
}

double largest(const std::vector<Baseline>& baselines) {
  double length_m = 0;
  for (const Baseline& b : baselines) length_m = std::max(length_m, b.length_m);
  return length_m;
}

// Eqs (5) and (6): E_m [R_p, s·t_p]⁻¹ diag(s, s, s, 1).
Similarity<Base, Map> from_two(const Pose<Base, Cam>& arm, const Pose<Map, Cam>& seen,
                               double scale) {
  const Eigen::Quaterniond rotation = arm.rotation() * seen.rotation().conjugate();
  return {scale, rotation, arm.translation() - scale * (rotation * seen.translation())};
}

double median_rms_px(const std::vector<SampledPair>& pairs, const CameraModel& camera,
                     const AlignmentEstimate& estimate) {
  const PivotedEstimate pivoted(estimate, Eigen::Vector3d::Zero());
  std::vector<double> errors_px;
  for (const SampledPair& p : pairs) errors_px.push_back(rms_px(p, camera, pivoted));
  const auto middle = errors_px.begin() + static_cast<std::ptrdiff_t>(errors_px.size() / 2);
  std::nth_element(errors_px.begin(), middle, errors_px.end());
  return *middle;
}

}  // namespace

Pose<Base, Cam> base_from_cam(const PosePair& pair, const AlignmentEstimate& guess) {
  return pair.arm.at(guess.joint_delay_s).base_from_ee * guess.ee_from_cam;
}

double largest_baseline_m(const std::vector<SampledPair>& pairs, const AlignmentEstimate& guess) {
  return largest(farthest_partners(all_base_from_cam(pairs, guess)));
}

AlignmentEstimate start_alignment(const std::vector<SampledPair>& pairs, const CameraModel& camera,
                                  const AlignmentEstimate& guess) {
  const auto arm = all_base_from_cam(pairs, guess);
  const auto baselines = farthest_partners(arm);
  const double least_m = 0.5 * largest(baselines);
  AlignmentEstimate best = guess, candidate = guess;
  double best_px = std::numeric_limits<double>::infinity();
  for (const Baseline& b : baselines) {
    if (b.length_m < least_m) continue;
    const Pose<Map, Cam>& seen = pairs[b.near].pair->map_from_cam;
    const double length_mu =
        (seen.translation() - pairs[b.far].pair->map_from_cam.translation()).norm();
    if (!(length_mu > 0)) continue;
    candidate.base_from_map = from_two(arm[b.near], seen, b.length_m / length_mu);
    const double error_px = median_rms_px(pairs, camera, candidate);
    if (error_px >= best_px) continue;
    best = candidate;
    best_px = error_px;
  }
  return best;
}

}  // namespace foresight::calibration
