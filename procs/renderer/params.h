#pragma once

#include <string>

#include "common/params.h"
#include "procs/renderer/scene_renderer.h"

namespace foresight {

struct RendererParams {
  std::string display = "auto";
  std::string layout = "side_by_side";
  int picture_width_px = 640;
  double idle_rate_hz = 5;
  int stored_views = SceneOptions{}.stored_views;
  int used_views = RenderOptions{}.used_views;
  bool paint_guesses = true;
  std::string record;
  double record_fps = 15;

  template <class V>
  void visit(V& v) {
    v("display", display,
      {.choices = {"auto", "window", "headless"},
       .doc = "a window, or off screen; auto: a window when there is a display"});
    v("layout", layout,
      {.choices = {"side_by_side", "predicted", "delayed"},
       .doc = "delayed video left and predicted view right, or one of them (keys 1, 2, 3)"});
    v("picture_width_px", picture_width_px,
      {.unit = "px", .min = 64, .max = 4096, .doc = "width of one picture"});
    v("idle_rate_hz", idle_rate_hz,
      {.unit = "Hz",
       .min = 0.2,
       .max = 60,
       .doc = "redraws per second while no new pose arrives; a new pose is drawn at once"});
    v("stored_views", stored_views,
      {.unit = "1", .min = 1, .max = 64, .doc = "delayed images kept as textures"});
    v("used_views", used_views,
      {.unit = "1", .min = 1, .max = 8, .doc = "textures used in one picture, newest first"});
    v("paint_guesses", paint_guesses,
      {.doc = "paint images also where no surface was measured (background)"});
    v("record", record,
      {.doc = "FILE.mp4, or FOLDER/%05d.png: writes what is shown (by ffmpeg); empty: nothing"});
    v("record_fps", record_fps, {.unit = "Hz", .min = 1, .max = 120, .doc = "of the recording"});
  }
};

}  // namespace foresight
