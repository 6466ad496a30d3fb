// The first map, without a user: corners of a reference image are followed until a motion explains
// them (first_map_solver.h). It is taken only if it is clearly better than every different one,
// has parallax, is not a mere rotation, stays the same from image to image, and if the rest of the
// picture moves, too (still_camera.h). Otherwise it says why and waits.
//
//   initializer.feed(time, pyramid);                                 // every image
//   if (auto attempt = initializer.take_attempt())                   // now and then, beside
//     outcome = initializer.apply(Initializer::run(*attempt));
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/camera_model.h"
#include "common/frames.h"
#include "common/time.h"
#include "procs/slam/corner_detector.h"
#include "procs/slam/first_map_solver.h"
#include "procs/slam/image_pyramid.h"
#include "procs/slam/slam_options.h"
#include "procs/slam/still_camera.h"

namespace foresight::slam {

/// Two keyframes and their points, in the first camera's frame; median depth 1.
struct InitialMap {
  struct View {
    Time time;
    ImagePyramid pyramid;
    Pose<Map, Cam> map_from_cam;
  };
  struct PointInit {
    DetectedCorner corner;         // in the first view
    Eigen::Vector2d second_pixel;  // in the second view
    Eigen::Vector3d position_in_map;
  };
  View first, second;
  std::vector<PointInit> points;
};

class Initializer {
 public:
  Initializer(const CameraModel& camera, const SlamOptions& options);

  /// What a worker needs to look for a motion between the reference and the present image.
  struct Attempt {
    int reference = 0;  // counts reference images
    InitialMap::View first, second;
    std::vector<DetectedCorner> corners;         // in the first view
    std::vector<Eigen::Vector2d> second_pixels;  // in the second
    TracksInViews tracks;
  };
  struct Answer {
    Attempt attempt;
    std::vector<TwoViewSolution> solutions;
  };
  /// The best motion of an attempt, accepted or not.
  struct Diagnosis {
    int tracks = 0;
    double parallax_deg = 0, rms_px = 0;
    double share = 0;           // of the tracks that fit
    double rotation_ratio = 0;  // residual of a pure rotation / of this motion
    double ambiguity = 0;       // cost of the next best different motion / of this; 1e9: none
    int stable_attempts = 0;    // in a row that found the same motion
    Pose<Cam, Cam> second_from_first;
  };
  struct Outcome {
    std::optional<InitialMap> map;
    std::string reason;                  // why there is no map yet
    std::optional<Diagnosis> diagnosis;  // of an attempt that found some motion
  };

  /// Follows the corners. Returns why there is no map yet.
  std::string feed(Time time, const ImagePyramid& pyramid);
  /// Once per image that moved enough.
  std::optional<Attempt> take_attempt();
  static Answer run(Attempt attempt);  // pure; any thread; about 50 ms
  Outcome apply(const Answer& answer);
  void restart() {
    tracks_.clear();
    attempt_due_ = false;
  }
  /// The camera was found to stand still: believed for a while, as long as the picture confirms it.
  void believe_still(Time time, StillEvidence evidence);
  static const char* still_reason();

 private:
  struct Track {
    DetectedCorner corner;
    std::vector<cv::Point2f> path;  // pixel in the reference and in every image since
  };

  void start_reference(Time time, const ImagePyramid& pyramid);
  void follow(const ImagePyramid& pyramid);
  double median_flow_px() const;
  std::vector<size_t> views_between() const;
  Diagnosis diagnose(const Answer& answer);
  std::string objection(const Diagnosis& diagnosis) const;  // why not accepted; empty: accepted
  bool shows_still_camera(const Answer& answer);
  static InitialMap make_map(const Attempt& attempt, const TwoViewSolution& solution);

  CameraModel camera_;
  SlamOptions options_;
  std::vector<Track> tracks_;
  int reference_count_ = 0;
  int stable_attempts_ = 0;
  std::vector<Pose<Cam, Cam>> hypotheses_;  // second_from_first of the last attempt, best first
  size_t started_with_ = 0;
  bool attempt_due_ = false;
  Time reference_time_, last_time_;
  ImagePyramid reference_, last_;
  std::string reason_;  // of the last attempt with this reference
  std::optional<StillEvidence> still_;
  Time still_time_;
};

}  // namespace foresight::slam
