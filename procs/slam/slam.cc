#include "procs/slam/slam.h"

#include <cmath>
#include <cstdio>
#include <deque>
#include <iterator>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include "procs/slam/loop_correction.h"
#include "procs/slam/map_adjustment.h"
#include "procs/slam/map_storage.h"
#include "procs/slam/mapper.h"
#include "procs/slam/mapping_work.h"
#include "procs/slam/motion_model.h"
#include "procs/slam/published_map.h"
#include "procs/slam/relocalizer.h"
#include "procs/slam/slam_map.h"
#include "procs/slam/still_camera.h"
#include "procs/slam/tracker.h"

namespace foresight {

using slam::Frame;
using slam::SearchWidth;
using slam::TrackingAttempt;

namespace {
constexpr Duration kClockJump = seconds(1);  // older images than by that: the camera's clock is new
constexpr double kSamePlace = 0.1;      // depths, or radians: a better answer, but no other place
constexpr size_t kYoungKeyframes = 16;  // so far images may show that the camera never moved
constexpr int kFirstFocalCheck = 5, kFocalCheckKeyframes = 12;  // keyframes until the next check
// With the right focal length the factor came out within 0.03 of 1, the cost ratio at 0.98 to 1;
// with one that is 20 % off, 0.14 and more away, at cost ratios of 0.3 to 0.72; a map too small to
// tell gave 0.84 at 0.94.
constexpr double kFocalTolerance = 0.05, kFocalEvidence = 0.8;  // factor off by, cost ratio below
}  // namespace

class Slam::Impl {
 public:
  Impl(const CameraModel& camera, const SlamOptions& options)
      : camera_(camera),
        options_(options),
        initializer_(camera_, options),
        mapper_(camera_, options),
        motion_(camera_),
        relocalizer_(camera_, options),
        deltas_(camera_, options) {}

  TrackingResult track(Time time, const GrayImageView& image);
  void reset(const std::string& reason);
  std::optional<MappingJob> take_job();
  void apply(MappingResult result);
  SlamStatistics statistics() const;
  std::string warning() const;
  StoredMap stored_map() const { return slam::store(map_, camera_); }
  void restore(const StoredMap& stored);

  void hint(Time time, const Pose<Map, Cam>& map_from_cam) {
    relocalizer_.hint(time, map_from_cam);
  }
  slam::PublishedMap& deltas() { return deltas_; }
  slam::SlamMap& map() { return map_; }
  int epoch() const { return epoch_; }

 private:
  std::optional<slam::UndescribedKeyframe> undescribed_keyframe() const;
  std::optional<slam::LoopSearch> next_loop_search();
  void close_loop(const slam::SolvedGraph& graph);
  std::string reject(Time time, const GrayImageView& image) const;
  void initialise(const Frame& frame, TrackingResult* result);
  void begin(const slam::InitialMap& initial);
  void follow(const Frame& frame, TrackingResult* result);
  void search_again(const Frame& frame, TrackingResult* result);
  bool good_enough(const TrackingAttempt& attempt) const;
  bool same_place(const TrackingAttempt& a, const TrackingAttempt& b) const;
  TrackingAttempt attempt(const Frame& frame, const Pose<Map, Cam>& pose, SearchWidth width) const;
  void accept(const Frame& frame, const TrackingAttempt& attempt, TrackingResult* result);
  void report(const TrackingAttempt& attempt, TrackingResult* result) const;
  void count_found(const TrackingAttempt& attempt);
  bool refuted_by_newest_keyframe();

  CameraModel camera_;
  SlamOptions options_;
  slam::Initializer initializer_;
  slam::Mapper mapper_;
  slam::MotionModel motion_;
  slam::Relocalizer relocalizer_;
  slam::PublishedMap deltas_;
  slam::SlamMap map_;
  int epoch_ = 0;
  TrackingState state_ = TrackingState::kInitialising;
  std::optional<Time> last_time_;
  Time lost_since_;
  int good_frames_ = 0;  // in a row
  bool bundle_wanted_ = false;
  slam::PlaceIndex places_;
  std::deque<int32_t> unlooped_;  // keyframes that have not been compared with older ones
  std::optional<slam::LoopClosure> closure_;   // recognised, not yet solved
  int keyframes_since_all_ = 0;                // were adjusted
  bool adjust_all_wanted_ = false;             // a loop was closed
  int keyframes_to_check_ = kFirstFocalCheck;  // of the focal length
  std::string reset_reason_;
  bool is_restored_ = false;  // the map was stored: never given up
  SlamStatistics counters_;
};

std::string Slam::Impl::reject(Time time, const GrayImageView& image) const {
  if (image.pixels == nullptr || image.width_px != camera_.width_px ||
      image.height_px != camera_.height_px || image.stride_bytes < image.width_px) {
    return "image is " + std::to_string(image.width_px) + " x " + std::to_string(image.height_px) +
           " px, the camera " + std::to_string(camera_.width_px) + " x " +
           std::to_string(camera_.height_px);
  }
  if (camera_.width_px < 160 || camera_.height_px < 120) return "images below 160 x 120 px";
  if (last_time_ && time <= *last_time_ && *last_time_ - time < kClockJump) {
    return "image is not newer than the last one";
  }
  return "";
}

TrackingResult Slam::Impl::track(Time time, const GrayImageView& image) {
  TrackingResult result;
  result.time = time;
  result.state = state_;
  result.map_from_cam = motion_.last_pose();
  result.epoch = epoch_;
  result.reason = reject(time, image);
  if (!result.reason.empty()) {
    if (state_ == TrackingState::kTracking) result.state = TrackingState::kLost;
    return result;
  }
  if (last_time_ && time <= *last_time_) {
    motion_.forget();
    lost_since_ = time;
  }
  if (!last_time_) lost_since_ = time;
  last_time_ = time;
  Frame frame;
  frame.time = time;
  frame.pyramid = slam::build_pyramid(image);
  frame.thumbnail = slam::make_thumbnail(frame.pyramid);
  switch (state_) {
    case TrackingState::kInitialising:
      initialise(frame, &result);
      break;
    case TrackingState::kTracking:
      follow(frame, &result);
      break;
    case TrackingState::kLost:
      search_again(frame, &result);
      break;
  }
  result.state = state_;
  result.epoch = epoch_;
  return result;
}

void Slam::Impl::initialise(const Frame& frame, TrackingResult* result) {
  result->reason = initializer_.feed(frame.time, frame.pyramid);
  if (!reset_reason_.empty()) result->reason = reset_reason_ + "; " + result->reason;
}

void Slam::Impl::begin(const slam::InitialMap& initial) {
  reset_reason_.clear();
  mapper_.begin(initial, &map_);
  initializer_.restart();
  bundle_wanted_ = true;
  motion_.forget();
  motion_.update(initial.second.time, slam::make_thumbnail(initial.second.pyramid),
                 initial.second.map_from_cam);
  state_ = TrackingState::kTracking;
  good_frames_ = 1;
}

bool Slam::Impl::good_enough(const TrackingAttempt& attempt) const {
  return attempt.quality >= options_.min_quality &&
         attempt.inliers.size() >= static_cast<size_t>(options_.min_found_points);
}

TrackingAttempt Slam::Impl::attempt(const Frame& frame, const Pose<Map, Cam>& pose,
                                    SearchWidth width) const {
  return slam::track_points(camera_, map_, frame.pyramid, pose, width, options_);
}

void Slam::Impl::report(const TrackingAttempt& attempt, TrackingResult* result) const {
  result->map_from_cam = attempt.map_from_cam;
  result->quality = attempt.quality;
  result->points_predicted = static_cast<int>(attempt.searched.size());
  result->points_found = static_cast<int>(attempt.inliers.size());
}

void Slam::Impl::follow(const Frame& frame, TrackingResult* result) {
  const double depth = map_.newest_keyframe().median_depth;
  const Pose<Map, Cam> predicted = motion_.predict(frame.time, frame.thumbnail, depth);
  TrackingAttempt tried = attempt(frame, predicted, SearchWidth::kNarrow);
  if (!good_enough(tried)) {
    TrackingAttempt wide = attempt(frame, predicted, SearchWidth::kWide);
    if (wide.quality > tried.quality) tried = std::move(wide);
  }
  if (good_enough(tried)) {
    TrackingAttempt rival = relocalizer_.rival(map_, frame, tried);
    if (rival.quality > tried.quality) {
      result->relocalised = !same_place(rival, tried);
      tried = std::move(rival);
    }
    if (result->relocalised) {
      ++counters_.losses;
      ++counters_.relocalisations;
      good_frames_ = 0;
      motion_.forget();
    }
    report(tried, result);
    accept(frame, tried, result);
    return;
  }
  report(tried, result);
  state_ = TrackingState::kLost;
  lost_since_ = frame.time;
  ++counters_.losses;
  good_frames_ = 0;
  search_again(frame, result);
}

bool Slam::Impl::same_place(const TrackingAttempt& a, const TrackingAttempt& b) const {
  const Pose<Cam, Cam> between = a.map_from_cam.inverse() * b.map_from_cam;
  return between.translation().norm() < kSamePlace * map_.newest_keyframe().median_depth &&
         between.rotation().angularDistance(Eigen::Quaterniond::Identity()) < kSamePlace;
}

void Slam::Impl::search_again(const Frame& frame, TrackingResult* result) {
  const Pose<Map, Cam> predicted =
      motion_.predict(frame.time, frame.thumbnail, map_.newest_keyframe().median_depth);
  const TrackingAttempt best = relocalizer_.find(map_, places_, frame, predicted);
  report(best, result);
  const double lost_s = (frame.time - lost_since_).seconds();
  result->lost_s = lost_s;
  if (relocalizer_.accepts(best)) {
    state_ = TrackingState::kTracking;
    ++counters_.relocalisations;
    result->relocalised = true;
    relocalizer_.restart();
    motion_.forget();
    accept(frame, best, result);
    return;
  }
  char text[80];
  std::snprintf(text, sizeof text, "lost for %.1f s; found %d of %d points", lost_s,
                result->points_found, result->points_predicted);
  result->reason = text;
  if (!is_restored_ && lost_s > options_.restart_after_s &&
      map_.keyframes().size() <= static_cast<size_t>(options_.tiny_map_keyframes)) {
    reset("lost a tiny map");
    result->reason = reset_reason_;
  }
}

void Slam::Impl::count_found(const TrackingAttempt& attempt) {
  if (attempt.quality < 0.5) return;  // blur or occlusion says little about the points
  auto found = attempt.inliers.begin();
  for (const int32_t id : attempt.searched) {
    while (found != attempt.inliers.end() && found->point_id < id) ++found;
    map_.count_prediction(id, found != attempt.inliers.end() && found->point_id == id);
  }
}

void Slam::Impl::accept(const Frame& frame, const TrackingAttempt& attempt,
                        TrackingResult* result) {
  motion_.update(frame.time, frame.thumbnail, attempt.map_from_cam);
  ++good_frames_;
  count_found(attempt);
  if (good_frames_ < 3) return;
  mapper_.grow(frame, attempt.map_from_cam, &map_);
  if (!mapper_.wants_keyframe(map_, frame.time, attempt)) {
    mapper_.review_if_due(&map_);
    return;
  }
  mapper_.insert_keyframe(frame, attempt, &map_);
  result->is_keyframe = true;
  bundle_wanted_ = true;
  if (options_.close_loops) unlooped_.push_back(map_.newest_keyframe().id);
  --keyframes_to_check_;
  ++keyframes_since_all_;
  if (refuted_by_newest_keyframe()) {
    reset(slam::Initializer::still_reason());
    result->reason = reset_reason_;
    result->is_keyframe = false;
  }
}

// What moves may have hidden, when the map began, that all else stands still: since then it has
// moved on. The keyframe halfway is far enough away to tell, and what moves was elsewhere by then.
bool Slam::Impl::refuted_by_newest_keyframe() {
  if (is_restored_ || map_.keyframes().size() > kYoungKeyframes) return false;
  const auto half = static_cast<std::ptrdiff_t>(map_.keyframes().size() / 2);
  const slam::Keyframe& middle = std::next(map_.keyframes().begin(), half)->second;
  const slam::Keyframe& newest = map_.newest_keyframe();
  const Pose<Cam, Cam> newest_from_middle = newest.map_from_cam.inverse() * middle.map_from_cam;
  slam::StillEvidence evidence = slam::still_evidence(
      camera_, {middle.pyramid, newest.pyramid, newest_from_middle, middle.median_depth});
  if (!evidence.says_still()) return false;
  initializer_.believe_still(newest.time, std::move(evidence));
  return true;
}

void Slam::Impl::reset(const std::string& reason) {
  map_ = slam::SlamMap();
  mapper_ = slam::Mapper(camera_, options_);
  deltas_ = slam::PublishedMap(camera_, options_);
  initializer_.restart();
  motion_ = slam::MotionModel(camera_);
  relocalizer_ = slam::Relocalizer(camera_, options_);
  state_ = TrackingState::kInitialising;
  good_frames_ = 0;
  bundle_wanted_ = false;
  places_ = slam::PlaceIndex();
  unlooped_.clear();
  closure_.reset();
  keyframes_since_all_ = 0;
  adjust_all_wanted_ = false;
  keyframes_to_check_ = kFirstFocalCheck;
  counters_.focal_factor = counters_.focal_cost_ratio = 1;
  reset_reason_ = reason;
  is_restored_ = false;
  ++epoch_;
  ++counters_.restarts;
}

std::optional<slam::UndescribedKeyframe> Slam::Impl::undescribed_keyframe() const {
  for (auto k = map_.keyframes().rbegin(); k != map_.keyframes().rend(); ++k) {
    if (!k->second.features) return slam::UndescribedKeyframe{k->first, k->second.pyramid};
  }
  return std::nullopt;
}

std::optional<MappingJob> Slam::Impl::take_job() {
  auto data = std::make_unique<MappingJob::Data>();
  data->epoch = epoch_;
  if (state_ == TrackingState::kInitialising) {
    std::optional<slam::Initializer::Attempt> attempt = initializer_.take_attempt();
    if (!attempt) return std::nullopt;
    data->work = std::move(*attempt);
    return MappingJob(std::move(data));
  }
  if (map_.empty()) return std::nullopt;
  if (std::optional<slam::SeedSearch> search = mapper_.take_seed_search(map_)) {
    data->work = slam::SeedWork{camera_, options_, std::move(*search)};
    return MappingJob(std::move(data));
  }
  if (bundle_wanted_) {
    bundle_wanted_ = false;
    data->work = slam::bundle_problem(map_, options_);
    return MappingJob(std::move(data));
  }
  if (std::optional<slam::UndescribedKeyframe> undescribed = undescribed_keyframe()) {
    data->work = std::move(*undescribed);
    return MappingJob(std::move(data));
  }
  if (closure_) {
    slam::PoseGraph graph = slam::pose_graph_of(map_, *closure_);
    data->work = slam::GraphWork{std::move(*closure_), std::move(graph)};
    closure_.reset();
    return MappingJob(std::move(data));
  }
  if (std::optional<slam::LoopSearch> search = next_loop_search()) {
    data->work = slam::LoopWork{camera_, options_, std::move(*search)};
    return MappingJob(std::move(data));
  }
  const int every = options_.adjust_all_keyframes;
  if (adjust_all_wanted_ || (every > 0 && keyframes_since_all_ >= every)) {
    keyframes_since_all_ = 0;
    adjust_all_wanted_ = false;
    data->work = slam::global_problem(map_, options_);
    return MappingJob(std::move(data));
  }
  if (keyframes_to_check_ > 0) return std::nullopt;
  keyframes_to_check_ = kFocalCheckKeyframes;
  data->work = slam::FocalWork{slam::focal_problem(map_, options_)};
  return MappingJob(std::move(data));
}

std::optional<slam::LoopSearch> Slam::Impl::next_loop_search() {
  if (!unlooped_.empty()) places_.follow(map_);
  while (!unlooped_.empty()) {
    const int32_t id = unlooped_.front();
    unlooped_.pop_front();
    if (auto search = slam::loop_search(map_, places_, id)) return search;
  }
  return std::nullopt;
}

void Slam::Impl::close_loop(const slam::SolvedGraph& graph) {
  if (!graph.usable || map_.keyframe(graph.closure.keyframe_id) == nullptr) return;
  const slam::MapCorrection correction = slam::correction_by(graph.before, graph.solved, map_);
  mapper_.apply(correction, graph.closure, &map_);
  motion_.correct(correction.at(map_.newest_keyframe().id));
  ++counters_.loops;
  unlooped_.clear();
  adjust_all_wanted_ = true;
}

void Slam::Impl::apply(MappingResult result) {
  if (result.data == nullptr || result.data->epoch != epoch_) return;
  if (const auto* adjusted = std::get_if<slam::AdjustedBundle>(&result.data->result)) {
    motion_.correct(mapper_.apply(adjusted->problem, adjusted->solution, &map_));
  } else if (auto* found = std::get_if<slam::FoundSeeds>(&result.data->result)) {
    mapper_.add_seeds(found->keyframe_id, std::move(found->seeds), &map_);
  } else if (auto* described = std::get_if<slam::DescribedKeyframe>(&result.data->result)) {
    if (map_.keyframe(described->id) == nullptr) return;  // culled meanwhile
    map_.set_features(described->id, std::move(described->features));
  } else if (auto* closure = std::get_if<slam::FoundLoop>(&result.data->result)) {
    closure_ = std::move(*closure);
  } else if (const auto* solved = std::get_if<slam::SolvedGraph>(&result.data->result)) {
    close_loop(*solved);
  } else if (const auto* check = std::get_if<slam::FocalCheck>(&result.data->result)) {
    if (!check->usable) return;
    counters_.focal_factor = check->factor;
    counters_.focal_cost_ratio = check->cost_ratio;
  } else if (state_ == TrackingState::kInitialising) {
    const auto outcome =
        initializer_.apply(std::get<slam::Initializer::Answer>(result.data->result));
    if (outcome.map) begin(*outcome.map);
  }
}

void Slam::Impl::restore(const StoredMap& stored) {
  reset("loaded a map");
  reset_reason_.clear();
  map_ = slam::restored(stored, camera_);
  motion_.update(stored.keyframes.back().time, map_.newest_keyframe().thumbnail,
                 stored.keyframes.back().map_from_cam);
  motion_.forget();
  is_restored_ = true;
  state_ = TrackingState::kLost;
  lost_since_ = last_time_.value_or(Time{});
}

std::string Slam::Impl::warning() const {
  const bool off = std::abs(counters_.focal_factor - 1) > kFocalTolerance &&
                   counters_.focal_cost_ratio < kFocalEvidence;
  char text[160] = "";
  if (off) {
    std::snprintf(text, sizeof text,
                  "the images say that the focal length is %.0f px, not %.0f: calibrate the camera",
                  counters_.focal_factor * camera_.fx_px, camera_.fx_px);
  } else if (mapper_.forgotten_keyframes() > 0) {
    std::snprintf(text, sizeof text,
                  "memory limit of %.6g MB: %d keyframes that add least were forgotten",
                  options_.memory_limit_mb, mapper_.forgotten_keyframes());
  }
  return text;
}

SlamStatistics Slam::Impl::statistics() const {
  SlamStatistics s = counters_;
  s.keyframes = static_cast<int>(map_.keyframes().size());
  s.points = static_cast<int>(map_.points().size());
  s.published_points = static_cast<int>(deltas_.published_points());
  s.forgotten_keyframes = mapper_.forgotten_keyframes();
  s.memory_mb = static_cast<double>(map_.memory_bytes()) / 1e6;
  return s;
}

Slam::Slam(const CameraModel& camera, const SlamOptions& options) {
  CameraModel prepared = camera;
  prepared.prepare();
  cv::setNumThreads(1);  // OpenCV's own pool would be threads behind the host's back
  impl_ = std::make_unique<Impl>(prepared, options);
}
Slam::~Slam() = default;

TrackingResult Slam::track(Time time, const GrayImageView& image) {
  return impl_->track(time, image);
}
void Slam::hint(Time time, const Pose<Map, Cam>& map_from_cam) { impl_->hint(time, map_from_cam); }
MapDelta Slam::take_delta() { return impl_->deltas().take(&impl_->map()); }
MapDelta Slam::snapshot() const { return impl_->deltas().snapshot(); }
StoredMap Slam::stored_map() const { return impl_->stored_map(); }
void Slam::restore(const StoredMap& stored) { impl_->restore(stored); }
int Slam::epoch() const { return impl_->epoch(); }
void Slam::reset(const std::string& reason) { impl_->reset(reason); }
std::optional<MappingJob> Slam::take_job() { return impl_->take_job(); }
void Slam::apply(MappingResult result) { impl_->apply(std::move(result)); }
SlamStatistics Slam::statistics() const { return impl_->statistics(); }
std::string Slam::warning() const { return impl_->warning(); }

}  // namespace foresight
