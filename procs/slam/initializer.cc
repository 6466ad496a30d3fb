#include "procs/slam/initializer.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/video/tracking.hpp>

#include "procs/slam/geometry.h"
#include "procs/slam/two_view.h"

namespace foresight::slam {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr size_t kMaxImages = 120;       // since the reference: then it starts anew
constexpr double kMinAliveShare = 0.35;  // of the reference's corners
constexpr double kMinFlow_px = 6;
constexpr double kMinInlierShare = 0.75;
// What a first map needs. A wide parallax leaves little to doubt; a narrow one starts sooner, but
// has to show more.
struct Gate {
  double parallax_deg;     // median angle between the rays of a point
  double beyond_rotation;  // residual of a pure rotation / of the motion
  double unambiguous;      // cost of the next best different motion / of the best
  int stable_attempts;     // in a row that found the same motion
  double depth_sigma;      // relative, of a point: noise / parallax
};
constexpr Gate kWideGate = {1.2, 3.3, 1.3, 1, 0.2};
constexpr Gate kNarrowGate = {0, 3.0, 1.5, 2, 0.085};  // its parallax is an option
constexpr double kNoiseFloor_px = 0.3;                 // in the ratio to a rotation's residual
constexpr double kStableAngle = 20 * kDegree;          // between the ways to the second camera
constexpr size_t kHypotheses = 3;                      // tried again at the next image
constexpr double kSaneDepth = 50;                      // times the median
constexpr Duration kStillBelieved = seconds(5);        // after it was seen last

template <class... Args>
std::string format(const char* pattern, Args... args) {
  char text[160];
  std::snprintf(text, sizeof text, pattern, args...);
  return text;
}

Vector3d center_in_first(const Pose<Cam, Cam>& second_from_first) {
  return second_from_first.inverse().translation();
}

double median_depth(const TwoViewSolution& solution) {
  std::vector<double> depths;
  for (const Vector3d& p : solution.points) depths.push_back(p.z());
  return median(std::move(depths));
}

}  // namespace

Initializer::Initializer(const CameraModel& camera, const SlamOptions& options)
    : camera_(camera), options_(options) {}

void Initializer::start_reference(Time time, const ImagePyramid& pyramid) {
  tracks_.clear();
  hypotheses_.clear();
  stable_attempts_ = 0;
  ++reference_count_;
  attempt_due_ = false;
  reason_.clear();
  OccupancyMask mask(camera_.width_px, camera_.height_px);
  for (const DetectedCorner& c : detect_corners(pyramid, options_.init_corners, &mask)) {
    tracks_.push_back(
        {c, {cv::Point2f(static_cast<float>(c.pixel.x()), static_cast<float>(c.pixel.y()))}});
  }
  started_with_ = tracks_.size();
  reference_time_ = time;
  reference_ = last_ = pyramid;
}

void Initializer::follow(const ImagePyramid& pyramid) {
  std::vector<cv::Point2f> from, to, back;
  for (const Track& t : tracks_) from.push_back(t.path.back());
  std::vector<uchar> forward_ok, back_ok;
  std::vector<float> error;
  const cv::Size window(13, 13);
  cv::calcOpticalFlowPyrLK(last_.levels[0], pyramid.levels[0], from, to, forward_ok, error, window);
  back = from;
  cv::calcOpticalFlowPyrLK(
      pyramid.levels[0], last_.levels[0], to, back, back_ok, error, window, 3,
      cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 30, 0.01),
      cv::OPTFLOW_USE_INITIAL_FLOW);
  std::vector<Track> alive;
  for (size_t i = 0; i < tracks_.size(); ++i) {
    const cv::Point2f gap = back[i] - from[i];
    if (!forward_ok[i] || !back_ok[i] || gap.dot(gap) > 0.7f * 0.7f) continue;
    if (!camera_.in_image({to[i].x, to[i].y}, 5)) continue;
    alive.push_back(std::move(tracks_[i]));
    alive.back().path.push_back(to[i]);
  }
  tracks_ = std::move(alive);
  last_ = pyramid;
}

double Initializer::median_flow_px() const {
  std::vector<double> lengths;
  for (const Track& t : tracks_) lengths.push_back(cv::norm(t.path.back() - t.path.front()));
  return median(std::move(lengths));
}

std::string Initializer::feed(Time time, const ImagePyramid& pyramid) {
  const size_t needed = static_cast<size_t>(options_.init_min_points);
  attempt_due_ = false;
  if (tracks_.empty()) {
    start_reference(time, pyramid);
    return tracks_.size() < needed ? format("%zu corners, need %zu", tracks_.size(), needed)
                                   : "new reference image";
  }
  follow(pyramid);
  last_time_ = time;
  if (tracks_.size() < needed ||
      static_cast<double>(tracks_.size()) < kMinAliveShare * static_cast<double>(started_with_) ||
      tracks_.front().path.size() > kMaxImages) {
    const std::string why =
        format("%zu of %zu tracks left: new reference image", tracks_.size(), started_with_);
    start_reference(time, pyramid);
    return why;
  }
  const double flow_px = median_flow_px();
  if (flow_px < kMinFlow_px || tracks_.front().path.size() < 4) {
    return format("the image moved %.1f px, need %.0f", flow_px, kMinFlow_px);
  }
  attempt_due_ = true;
  return reason_.empty() ? "looking for the motion" : reason_;
}

std::vector<size_t> Initializer::views_between() const {
  const size_t last = tracks_.front().path.size() - 1;
  std::vector<size_t> views = {0};
  for (const size_t quarter : {1u, 2u, 3u}) {
    const size_t view = last * quarter / 4;
    if (view > views.back()) views.push_back(view);
  }
  if (last > views.back()) views.push_back(last);
  return views;
}

std::optional<Initializer::Attempt> Initializer::take_attempt() {
  if (!attempt_due_) return std::nullopt;
  attempt_due_ = false;
  Attempt attempt;
  attempt.reference = reference_count_;
  attempt.first = {reference_time_, reference_, {}};
  attempt.second = {last_time_, last_, {}};
  for (const Track& t : tracks_) {
    attempt.corners.push_back(t.corner);
    attempt.second_pixels.emplace_back(t.path.back().x, t.path.back().y);
  }
  for (const size_t view : views_between()) {
    std::vector<Vector2d> rays;
    for (const Track& t : tracks_) {
      rays.push_back(camera_.unproject({t.path[view].x, t.path[view].y}));
    }
    attempt.tracks.rays.push_back(std::move(rays));
  }
  attempt.tracks.focal_px = camera_.fx_px;
  attempt.tracks.hypotheses = hypotheses_;
  attempt.tracks.min_points = options_.init_min_points;
  return attempt;
}

Initializer::Answer Initializer::run(Attempt attempt) {
  Answer answer;
  answer.solutions = solve_first_map(attempt.tracks);
  answer.attempt = std::move(attempt);
  return answer;
}

Initializer::Diagnosis Initializer::diagnose(const Answer& answer) {
  const TwoViewSolution& best = answer.solutions.front();
  const TracksInViews& tracks = answer.attempt.tracks;
  const bool same =
      !hypotheses_.empty() && angle_between(center_in_first(hypotheses_.front()),
                                            center_in_first(best.second_from_first)) < kStableAngle;
  stable_attempts_ = same ? stable_attempts_ + 1 : 1;
  hypotheses_.clear();
  for (const TwoViewSolution& s : answer.solutions) {
    if (hypotheses_.size() < kHypotheses) hypotheses_.push_back(s.second_from_first);
  }
  Diagnosis d;
  d.stable_attempts = stable_attempts_;
  d.tracks = static_cast<int>(best.tracks.size());
  d.parallax_deg = best.parallax_deg;
  d.rms_px = best.rms_px;
  d.share =
      static_cast<double>(best.tracks.size()) / static_cast<double>(tracks.rays.front().size());
  d.rotation_ratio = tracks.focal_px *
                     rotation_only_residual(tracks.rays.front(), tracks.rays.back()) /
                     std::max(best.rms_px, kNoiseFloor_px);
  d.second_from_first = best.second_from_first;
  d.ambiguity = 1e9;
  for (const TwoViewSolution& other : answer.solutions) {
    if (!differ(other.second_from_first, best.second_from_first)) continue;
    d.ambiguity = std::min(d.ambiguity, other.cost / best.cost);
  }
  return d;
}

std::string Initializer::objection(const Diagnosis& d) const {
  const bool wide = d.parallax_deg >= kWideGate.parallax_deg;
  const Gate& gate = wide ? kWideGate : kNarrowGate;
  if (d.parallax_deg < options_.init_min_parallax_deg) {
    return format("parallax %.1f deg, need %.1f", d.parallax_deg, options_.init_min_parallax_deg);
  }
  if (d.tracks < options_.init_min_points || d.share < kMinInlierShare) {
    return format("%d points (%.0f %% of the tracks) fit, need %d and %.0f %%", d.tracks,
                  100 * d.share, options_.init_min_points, 100 * kMinInlierShare);
  }
  if (d.rms_px > options_.init_max_rms_px) {
    return format("reprojection error %.1f px, need %.1f", d.rms_px, options_.init_max_rms_px);
  }
  if (d.rotation_ratio < gate.beyond_rotation) {
    return format("a pure rotation explains the tracks to %.1f px",
                  d.rotation_ratio * std::max(d.rms_px, kNoiseFloor_px));
  }
  if (d.ambiguity < gate.unambiguous) return "two motions explain the tracks about equally well";
  const double depth_sigma = d.rms_px / (camera_.fx_px * d.parallax_deg * kDegree);
  if (depth_sigma > gate.depth_sigma) {
    return format("parallax %.1f deg: depths are known to %.0f %%, need %.0f", d.parallax_deg,
                  100 * depth_sigma, 100 * gate.depth_sigma);
  }
  if (d.stable_attempts < gate.stable_attempts) {
    return format("parallax %.1f deg, and the motion found still changes", d.parallax_deg);
  }
  return "";
}

const char* Initializer::still_reason() {
  return "the picture changes only in parts: is something moving before a still camera?";
}

void Initializer::believe_still(Time time, StillEvidence evidence) {
  still_ = std::move(evidence);
  still_time_ = time;
}

// What moves may cover so much for a while that nothing else shows: then what was known counts.
bool Initializer::shows_still_camera(const Answer& answer) {
  const TwoViewSolution& best = answer.solutions.front();
  const InitialMap::View &first = answer.attempt.first, &second = answer.attempt.second;
  StillEvidence evidence = still_evidence(
      camera_, {first.pyramid, second.pyramid, best.second_from_first, median_depth(best)});
  const Duration since = second.time - still_time_;
  if (since > kStillBelieved || since < Duration{}) still_.reset();  // or the clock was set
  if (!evidence.says_still()) return still_ && evidence.confirms(*still_);
  believe_still(second.time, std::move(evidence));
  return true;
}

Initializer::Outcome Initializer::apply(const Answer& answer) {
  if (answer.attempt.reference != reference_count_ || tracks_.empty()) {
    return {std::nullopt, "new reference image", std::nullopt};
  }
  Outcome outcome;
  if (answer.solutions.empty()) {
    outcome.reason = "no two-view motion explains the tracks";
  } else {
    const bool stood_still = still_.has_value();
    outcome.diagnosis = diagnose(answer);
    outcome.reason = shows_still_camera(answer) ? still_reason() : objection(*outcome.diagnosis);
    if (outcome.reason.empty()) outcome.map = make_map(answer.attempt, answer.solutions.front());
    // It moves now: what was followed while other things moved is in the way of a first map.
    if (stood_still && outcome.reason != still_reason()) {
      still_.reset();
      restart();
    }
  }
  reason_ = outcome.reason;
  return outcome;
}

InitialMap Initializer::make_map(const Attempt& attempt, const TwoViewSolution& solution) {
  const double scale = 1 / median_depth(solution);
  InitialMap map;
  map.first = attempt.first;
  map.second = attempt.second;
  const Pose<Cam, Cam> motion = solution.second_from_first.inverse();
  map.second.map_from_cam = {motion.rotation(), scale * motion.translation()};
  for (size_t n = 0; n < solution.points.size(); ++n) {
    const Vector3d position = scale * solution.points[n];
    if (position.z() > kSaneDepth) continue;
    const size_t track = solution.tracks[n];
    map.points.push_back({attempt.corners[track], attempt.second_pixels[track], position});
  }
  return map;
}

}  // namespace foresight::slam
