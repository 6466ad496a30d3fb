// Where the renderer gets the pose from that it draws: on recorded video the newest undelayed
// CAMERA_POSE stands in for the command; with a robot it is predicted from the operator's commands.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/frames.h"
#include "common/node.h"
#include "procs/renderer/display_judge.h"
#include "procs/renderer/params.h"

namespace foresight {

struct PredictedPose {
  Time instant;       // whose view is predicted
  Time command_time;  // of the newest command in it; 0: none
  int64_t epoch = 0;  // of the map
  Pose<Map, Cam> map_from_cam;
  Pose<World, Cam> world_from_cam;  // identity on recorded video, which has no world
};

class PoseSource {
 public:
  virtual ~PoseSource() = default;
  /// Opens what may fail; throws StartupError.
  virtual void start() {}
  /// The pose to draw now, or nothing and a reason().
  virtual std::optional<PredictedPose> predict(Time now) = 0;
  /// One line for people; empty while there is a pose.
  virtual std::string reason() const = 0;
  /// What the operator should know beside the picture: state of the controller, base moving …
  virtual std::string note() const { return {}; }
  /// Adds what the judge of the display should know of the pose and its streams. Once a second.
  virtual void report(DisplayFacts* facts) = 0;
};

/// Declares the ports that `params.predict` needs. `on_change` is called when there is something
/// new to draw.
std::unique_ptr<PoseSource> make_pose_source(Node& node, const RendererParams& params,
                                             std::function<void()> on_change);

}  // namespace foresight
