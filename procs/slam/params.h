#pragma once

#include <string>

#include "common/params.h"
#include "procs/slam/slam_options.h"

namespace foresight {

struct SlamParams {
  SlamOptions options;
  double view_rate_hz = 30;
  double mapping_cost_s = 0.1;
  std::string map_folder;
  std::string map_root;
  double keep_map_every_s = 10;

  template <class V>
  void visit(V& v) {
    v("init_min_parallax_deg", options.init_min_parallax_deg,
      {.unit = "deg", .min = 0.2, .max = 10, .doc = "median parallax that a first map needs"});
    v("init_min_points", options.init_min_points,
      {.unit = "1", .min = 30, .max = 2000, .doc = "points that a first map needs"});
    v("max_tracked_points", options.max_tracked_points,
      {.unit = "1", .min = 50, .max = 5000, .doc = "points searched per frame"});
    v("seeds_per_keyframe", options.seeds_per_keyframe,
      {.unit = "1", .min = 0, .max = 5000, .doc = "corners of a keyframe whose depth is sought"});
    v("keyframe_baseline", options.keyframe_baseline,
      {.unit = "1",
       .min = 0.005,
       .max = 1,
       .doc = "distance between keyframes as a share of the scene's depth"});
    v("bundle_keyframes", options.bundle_keyframes,
      {.unit = "1", .min = 3, .max = 50, .doc = "keyframes adjusted together"});
    v("adjust_all_keyframes", options.adjust_all_keyframes,
      {.unit = "1",
       .min = 0,
       .max = 1000,
       .doc = "keyframes from one adjustment of the whole map to the next; 0: only after loops"});
    v("close_loops", options.close_loops,
      {.doc = "recognise places and spread the drift since: the map may jump a little"});
    v("min_quality", options.min_quality,
      {.unit = "1",
       .min = 0.05,
       .max = 0.95,
       .doc = "share of points found below which it is lost"});
    v("restart_after_s", options.restart_after_s,
      {.unit = "s",
       .min = 0.5,
       .max = 3600,
       .doc = "a tiny map that stays lost so long is given up for a new one"});
    v("memory_limit_mb", options.memory_limit_mb,
      {.unit = "MB",
       .min = 0,
       .max = 1e6,
       .doc = "when the map needs more, the keyframes that add least are forgotten; 0: no limit"});
    v("delta_threshold_px", options.delta_threshold_px,
      {.unit = "px",
       .min = 0,
       .max = 10,
       .doc = "points that moved less, as seen in the image, are not sent again"});
    v("view_rate_hz", view_rate_hz,
      {.unit = "Hz", .min = 0.1, .max = 1000, .doc = "VIEW messages per second at most"});
    v("map_folder", map_folder,
      {.doc = "a saved map to start with (slam-map save); empty: start from nothing"});
    v("map_root", map_root,
      {.doc = "folder below which slam-map saves and loads; empty: $XDG_DATA_HOME/foresight/maps, "
              "else ~/.local/share/foresight/maps"});
    v("keep_map_every_s", keep_map_every_s,
      {.unit = "s",
       .min = 0,
       .max = 3600,
       .doc = "how often at most the map is kept below map_root, for slam to go on in it after a "
              "crash; 0, in replay and on a simulated clock: never"});
    v("mapping_cost_s", mapping_cost_s,
      {.unit = "s",
       .min = 0,
       .max = 10,
       .doc = "how long a bundle adjustment takes on a simulated clock (measured: about 0.1 s); "
              "the search for new points a fifth of it"});
  }
};

}  // namespace foresight
