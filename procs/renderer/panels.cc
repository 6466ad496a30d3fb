#include "procs/renderer/panels.h"

#include <cmath>

namespace foresight {
namespace {

constexpr Duration kStaleAfter = seconds(1);

std::string milliseconds_text(Duration d) {
  return std::to_string(std::llround(1e3 * d.seconds())) + " ms";
}

std::string percent_text(double share) { return std::to_string(std::lround(100 * share)) + "%"; }

std::string fps_text(double fps) { return std::to_string(std::lround(fps)) + " fps"; }

Panel video_panel(const VideoStatus& status, const std::string& title) {
  if (!status.has_video) return {Badge::kNoModel, title, {"no video yet"}};
  return {status.age > kStaleAfter ? Badge::kStale : Badge::kOk,
          title,
          {"delay " + milliseconds_text(status.age), fps_text(status.fps)}};
}

}  // namespace

Panel delayed_panel(const VideoStatus& status) { return video_panel(status, "DELAYED VIDEO"); }

Panel undelayed_panel(const VideoStatus& status) {
  return video_panel(status, "UNDELAYED VIDEO (comparison)");
}

Panel predicted_panel(const PredictionStatus& status) {
  if (!status.is_drawn) {
    return {status.was_mapped ? Badge::kLost : Badge::kNoModel,
            "DELAYED VIDEO (no prediction)",
            {status.reason.empty() ? "waiting for the model" : status.reason}};
  }
  Panel panel{status.texture_age > kStaleAfter ? Badge::kStale : Badge::kOk,
              "PREDICTED VIEW",
              {"textures " + milliseconds_text(status.texture_age) + " old", fps_text(status.fps),
               std::to_string(status.triangles) + " triangles"}};
  if (status.shares) {
    panel.lines.push_back(percent_text(status.shares->newest + status.shares->earlier) +
                          " measured, " + percent_text(status.shares->guess) + " guessed");
  }
  if (!status.note.empty()) panel.lines.push_back("robot: " + status.note);
  return panel;
}

}  // namespace foresight
