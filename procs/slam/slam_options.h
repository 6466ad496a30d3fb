// Parameters of the SLAM core, with units and the reason for each default.
#pragma once

namespace foresight {

struct SlamOptions {
  // --- initialisation
  int init_corners = 600;               // corners of the reference image to follow; 100–2000
  int init_min_points = 80;             // triangulated points a first map needs; ≥ 30
  double init_min_parallax_deg = 0.25;  // median angle between the rays of a point; 0.2–5
  double init_max_rms_px = 1.0;         // reprojection error of the adjusted first map

  // --- tracking
  int max_tracked_points = 500;    // searched per image; each about 2 µs and its projection
  double min_quality = 0.3;        // below: lost
  double doubtful_quality = 0.55;  // below: other places in the map may claim the image
  int min_found_points = 25;       // below: lost
  double min_zncc = 0.75;          // correlation of a patch that counts as found; 0…1
  double max_reprojection_error_px = 2.5;  // of an inlier, at the pyramid level of the search

  // --- keyframes
  double keyframe_baseline = 0.035;   // distance to the nearest keyframe, in median depths
  double keyframe_min_overlap = 0.7;  // of the reference keyframe's points still in view
  double keyframe_min_interval_s = 0.1;
  int seeds_per_keyframe = 350;  // corners whose depth is searched for
  int max_seed_searches = 500;   // per image

  // --- new points
  double point_min_parallax_deg = 1.5;  // largest angle among its rays
  double point_max_error_px = 1.5;      // reprojection, at its pyramid level
  int point_confirm_keyframes = 3;      // keyframes that must see it before it is published
  double point_min_found_ratio = 0.25;  // found / predicted; less ends its probation badly

  // --- bundle adjustment
  int bundle_keyframes = 10;  // adjusted; those that share points with them are held fixed
  int bundle_max_fixed = 20;  // of these at most
  int bundle_iterations = 20;
  double bundle_outlier_px = 2.5;  // observations off by more (at their level) are thrown out

  // --- loops
  int adjust_all_keyframes = 10;  // from one adjustment of the whole map to the next; 0: only loops
  bool close_loops = true;        // recognise places, spread the drift, adjust everything

  // --- memory
  double memory_limit_mb = 512;  // beyond it the keyframes that add least are forgotten; 0: none

  // --- deltas
  double delta_threshold_px = 0.5;  // smaller moves, as seen in the image, are not sent again

  // --- after a loss
  double relocalise_min_quality = 0.55;  // a repeating pattern reaches 0.5 in a wrong place
  int relocalise_min_inliers = 40;
  double restart_after_s = 4;  // lost for so long with a tiny map: start a new one
  int tiny_map_keyframes = 8;  // "tiny"
};

}  // namespace foresight
