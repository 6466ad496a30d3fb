#include "bench/slam_eval/option_override.h"

#include <map>
#include <variant>

#include "common/errors.h"

namespace foresight {
namespace {

using Member = std::variant<double SlamOptions::*, int SlamOptions::*, bool SlamOptions::*>;

const std::map<std::string, Member>& members() {
  static const std::map<std::string, Member> table = {
      {"init_corners", &SlamOptions::init_corners},
      {"init_min_points", &SlamOptions::init_min_points},
      {"init_min_parallax_deg", &SlamOptions::init_min_parallax_deg},
      {"init_max_rms_px", &SlamOptions::init_max_rms_px},
      {"max_tracked_points", &SlamOptions::max_tracked_points},
      {"min_quality", &SlamOptions::min_quality},
      {"min_found_points", &SlamOptions::min_found_points},
      {"min_zncc", &SlamOptions::min_zncc},
      {"max_reprojection_error_px", &SlamOptions::max_reprojection_error_px},
      {"keyframe_baseline", &SlamOptions::keyframe_baseline},
      {"keyframe_min_overlap", &SlamOptions::keyframe_min_overlap},
      {"keyframe_min_interval_s", &SlamOptions::keyframe_min_interval_s},
      {"seeds_per_keyframe", &SlamOptions::seeds_per_keyframe},
      {"max_seed_searches", &SlamOptions::max_seed_searches},
      {"point_min_parallax_deg", &SlamOptions::point_min_parallax_deg},
      {"point_max_error_px", &SlamOptions::point_max_error_px},
      {"point_confirm_keyframes", &SlamOptions::point_confirm_keyframes},
      {"point_min_found_ratio", &SlamOptions::point_min_found_ratio},
      {"bundle_keyframes", &SlamOptions::bundle_keyframes},
      {"bundle_max_fixed", &SlamOptions::bundle_max_fixed},
      {"bundle_iterations", &SlamOptions::bundle_iterations},
      {"bundle_outlier_px", &SlamOptions::bundle_outlier_px},
      {"adjust_all_keyframes", &SlamOptions::adjust_all_keyframes},
      {"close_loops", &SlamOptions::close_loops},
      {"memory_limit_mb", &SlamOptions::memory_limit_mb},
      {"delta_threshold_px", &SlamOptions::delta_threshold_px},
      {"relocalise_min_quality", &SlamOptions::relocalise_min_quality},
      {"doubtful_quality", &SlamOptions::doubtful_quality},
      {"relocalise_min_inliers", &SlamOptions::relocalise_min_inliers},
      {"restart_after_s", &SlamOptions::restart_after_s},
      {"tiny_map_keyframes", &SlamOptions::tiny_map_keyframes},
  };
  return table;
}

}  // namespace

void override_option(const std::string& assignment, SlamOptions* options) {
  const size_t equals = assignment.find('=');
  const auto it = members().find(assignment.substr(0, equals));
  if (equals == std::string::npos || it == members().end()) {
    throw UsageError("--set " + assignment + ": not a known name=value");
  }
  double value = 0;
  try {
    value = std::stod(assignment.substr(equals + 1));
  } catch (const std::exception&) {
    throw UsageError("--set " + assignment + ": not a number");
  }
  if (const auto* real = std::get_if<double SlamOptions::*>(&it->second)) {
    options->** real = value;
  } else if (const auto* flag = std::get_if<bool SlamOptions::*>(&it->second)) {
    options->** flag = value != 0;
  } else {
    options->*std::get<int SlamOptions::*>(it->second) = static_cast<int>(value);
  }
}

}  // namespace foresight
