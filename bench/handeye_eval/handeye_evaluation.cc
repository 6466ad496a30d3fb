#include "bench/handeye_eval/handeye_evaluation.h"

#include <algorithm>

#include "procs/calibrator/geometry.h"

namespace foresight {
namespace {

using Eigen::Vector3d;

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

std::vector<double> corner_errors_px(const HandEyeData& data, const HandEyeView& view,
                                     const HandEyeAnswer& answer) {
  const Pose<Cam, Base> cam_from_base =
      (view.arm.at(answer.joint_delay_s).base_from_ee * answer.ee_from_cam).inverse();
  std::vector<double> errors;
  for (const TargetCorner& c : view.corners) {
    const Vector3d p = cam_from_base * (answer.base_from_target * c.point_in_target);
    errors.push_back(p.z() > 0 ? (data.camera.project(p) - c.pixel).norm() : 1e6);
  }
  return errors;
}

void score_corners(const HandEyeData& data, HandEyeScore* score) {
  std::vector<double> all;
  for (const HandEyeView& v : data.views) {
    const auto errors = corner_errors_px(data, v, score->answer);
    all.insert(all.end(), errors.begin(), errors.end());
    score->worst_view_px = std::max(score->worst_view_px, quantile(errors, 0.5));
  }
  score->median_px = quantile(all, 0.5);
  score->p90_px = quantile(all, 0.9);
}

void score_spread(const HandEyeData& data, HandEyeScore* score) {
  const HandEyeAnswer& a = score->answer;
  std::vector<Vector3d> places;
  Vector3d mean = Vector3d::Zero();
  for (const HandEyeView& v : data.views) {
    const Pose<Base, Cam> base_from_cam = v.arm.at(a.joint_delay_s).base_from_ee * a.ee_from_cam;
    const Pose<Cam, Target> seen = v.target_from_cam.inverse();
    places.push_back(base_from_cam * (a.base_from_target.scale() * seen.translation()));
    mean += places.back() / static_cast<double>(data.views.size());
  }
  std::vector<double> distances_mm;
  for (const Vector3d& p : places) distances_mm.push_back(1e3 * (p - mean).norm());
  score->median_mm = quantile(distances_mm, 0.5);
  score->p90_mm = quantile(distances_mm, 0.9);
}

}  // namespace

HandEyeEvaluation evaluate_handeye(const HandEyeData& data) {
  HandEyeEvaluation e;
  e.dataset = data.name;
  e.views = static_cast<int>(data.views.size());
  e.has_corners = !data.is_log;
  e.has_reference = data.reference.has_value();
  std::vector<HandEyeAnswer> answers{solve_ours(data, &e.solution)};
  for (HandEyeAnswer& a : solve_opencv(data, 0)) answers.push_back(std::move(a));
  if (e.solution.delay_is_estimated) {
    for (HandEyeAnswer& a : solve_opencv(data, e.solution.estimate.joint_delay_s)) {
      a.method += ", our delay";
      answers.push_back(std::move(a));
    }
  }
  for (HandEyeAnswer& a : answers) {
    HandEyeScore score{std::move(a)};
    if (e.has_corners) score_corners(data, &score);
    score_spread(data, &score);
    if (data.reference) {
      const Pose<Cam, Cam> off = data.reference->inverse() * score.answer.ee_from_cam;
      score.camera_shift_mm = 1e3 * off.translation().norm();
      score.camera_turn_deg =
          calibration::vector_from_rotation(off.rotation()).norm() / calibration::kDegree;
    }
    e.scores.push_back(std::move(score));
  }
  return e;
}

}  // namespace foresight
