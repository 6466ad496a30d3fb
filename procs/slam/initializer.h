// The first map, without a user: corners of a reference image are followed until a two-view motion
// explains them. All motions that an essential matrix or a homography allows are refined by bundle
// adjustment over several images in between; the best is taken only if it is clearly better than
// every different one, has parallax, and is not a mere rotation. Otherwise it says why and waits.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/camera_model.h"
#include "common/frames.h"
#include "common/time.h"
#include "procs/slam/bundle_adjustment.h"
#include "procs/slam/corner_detector.h"
#include "procs/slam/image_pyramid.h"
#include "procs/slam/slam_options.h"

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

  struct Outcome {
    std::optional<InitialMap> map;
    std::string reason;  // why there is no map yet
  };
  Outcome feed(Time time, const ImagePyramid& pyramid);
  void restart() { tracks_.clear(); }

 private:
  struct Track {
    DetectedCorner corner;
    std::vector<cv::Point2f> path;  // pixel in the reference and in every image since
  };
  struct Solution;
  /// Of some views since the reference, each track's ray.
  using RaysPerView = std::vector<std::vector<Eigen::Vector2d>>;

  void start_reference(Time time, const ImagePyramid& pyramid);
  void follow(const ImagePyramid& pyramid);
  double median_flow_px() const;
  std::vector<Eigen::Vector2d> rays_at(size_t image) const;
  std::vector<size_t> views_between() const;
  Solution triangulate_tracks(const Pose<Cam, Cam>& second_from_first,
                              const RaysPerView& rays) const;
  BundleProblem bundle_over_views(const Solution& solution, const RaysPerView& rays) const;
  std::optional<Solution> refine(const Pose<Cam, Cam>& second_from_first,
                                 const RaysPerView& rays) const;
  std::vector<Solution> refined_candidates(const RaysPerView& rays) const;
  Outcome attempt(Time time, const ImagePyramid& pyramid);
  InitialMap make_map(const Solution& solution, Time time, const ImagePyramid& pyramid) const;

  CameraModel camera_;
  SlamOptions options_;
  std::vector<Track> tracks_;
  size_t started_with_ = 0;
  Time reference_time_;
  ImagePyramid reference_, last_;
};

}  // namespace foresight::slam
