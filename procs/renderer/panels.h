// What the status panels over the pictures say. No OpenGL in here.
#pragma once

#include <optional>
#include <string>

#include "common/time.h"
#include "procs/renderer/hud.h"
#include "procs/renderer/scene_renderer.h"

namespace foresight {

struct VideoStatus {
  bool has_video = false;
  Duration age;  // of the newest frame
  double fps = 0;
};

struct PredictionStatus {
  bool is_drawn = false;
  bool was_mapped = false;  // there has been a map: no pose means lost
  std::string reason;       // why it is not drawn
  std::string note;         // what the robot is doing, if not following
  Duration texture_age;
  double fps = 0;
  int triangles = 0;
  std::optional<SourceShares> shares;  // none: not counted yet
};

Panel delayed_panel(const VideoStatus& status);
Panel undelayed_panel(const VideoStatus& status);
Panel predicted_panel(const PredictionStatus& status);

}  // namespace foresight
