#include "procs/slam/slam.h"

#include <cstdio>
#include <opencv2/core.hpp>
#include <utility>

#include "procs/slam/initializer.h"
#include "procs/slam/live_map.h"
#include "procs/slam/map_storage.h"
#include "procs/slam/mapping_tasks.h"
#include "procs/slam/tracker.h"

namespace foresight {

using slam::Frame;
using slam::TrackingAttempt;

namespace {
constexpr Duration kClockJump = seconds(1);  // older images than by that: the camera's clock is new

void report(const TrackingAttempt& attempt, TrackingResult* result) {
  result->map_from_cam = attempt.map_from_cam;
  result->quality = attempt.quality;
  result->points_predicted = static_cast<int>(attempt.searched.size());
  result->points_found = static_cast<int>(attempt.inliers.size());
}
}  // namespace

class Slam::Impl {
 public:
  Impl(const CameraModel& camera, const SlamOptions& options)
      : initializer_(camera, options), live_(camera, options) {}

  TrackingResult track(Time time, const GrayImageView& image);
  void reset(const std::string& reason);
  std::optional<MappingJob> take_job();
  void apply(MappingResult result);
  SlamStatistics statistics() const;
  std::string warning() const;
  StoredMap stored_map() const { return slam::store(live_.map, live_.camera); }
  void restore(const StoredMap& stored);
  slam::LiveMap& live() { return live_; }
  int epoch() const { return epoch_; }

 private:
  std::string reject(Time time, const GrayImageView& image) const;
  void initialise(const Frame& frame, TrackingResult* result);
  void follow(const Frame& frame, TrackingResult* result);
  void search_again(const Frame& frame, TrackingResult* result);
  void accept(const Frame& frame, const TrackingAttempt& attempt, TrackingResult* result);
  slam::Mapping mapping() { return {initializer_, live_, counters_}; }

  // Outlive every map.
  slam::Initializer initializer_;
  std::optional<Time> last_time_;
  int epoch_ = 0;
  SlamStatistics counters_;  // those that count since construction

  slam::LiveMap live_;
};

std::string Slam::Impl::reject(Time time, const GrayImageView& image) const {
  const CameraModel& camera = live_.camera;
  if (image.pixels == nullptr || image.width_px != camera.width_px ||
      image.height_px != camera.height_px || image.stride_bytes < image.width_px) {
    return "image is " + std::to_string(image.width_px) + " x " + std::to_string(image.height_px) +
           " px, the camera " + std::to_string(camera.width_px) + " x " +
           std::to_string(camera.height_px);
  }
  if (camera.width_px < 160 || camera.height_px < 120) return "images below 160 x 120 px";
  if (last_time_ && time <= *last_time_ && *last_time_ - time < kClockJump) {
    return "image is not newer than the last one";
  }
  return "";
}

TrackingResult Slam::Impl::track(Time time, const GrayImageView& image) {
  TrackingResult result;
  result.time = time;
  result.state = live_.state;
  result.map_from_cam = live_.motion.last_pose();
  result.epoch = epoch_;
  result.reason = reject(time, image);
  if (!result.reason.empty()) {
    if (live_.state == TrackingState::kTracking) result.state = TrackingState::kLost;
    return result;
  }
  if (last_time_ && time <= *last_time_) {
    live_.motion.forget();
    live_.lost_since = time;
  }
  if (!last_time_) live_.lost_since = time;
  last_time_ = time;
  Frame frame;
  frame.time = time;
  frame.pyramid = slam::build_pyramid(image);
  frame.thumbnail = slam::make_thumbnail(frame.pyramid);
  switch (live_.state) {
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
  result.state = live_.state;
  result.epoch = epoch_;
  return result;
}

void Slam::Impl::initialise(const Frame& frame, TrackingResult* result) {
  result->reason = initializer_.feed(frame.time, frame.pyramid);
  if (!live_.reset_reason.empty()) result->reason = live_.reset_reason + "; " + result->reason;
}

void Slam::Impl::follow(const Frame& frame, TrackingResult* result) {
  const slam::Placement placed = live_.follow(frame);
  report(placed.attempt, result);
  if (placed.is_good) {
    result->relocalised = placed.is_elsewhere;
    if (placed.is_elsewhere) {
      ++counters_.losses;
      ++counters_.relocalisations;
      live_.good_frames = 0;
      live_.motion.forget();
    }
    accept(frame, placed.attempt, result);
    return;
  }
  live_.state = TrackingState::kLost;
  live_.lost_since = frame.time;
  ++counters_.losses;
  live_.good_frames = 0;
  search_again(frame, result);
}

void Slam::Impl::search_again(const Frame& frame, TrackingResult* result) {
  const Pose<Map, Cam> predicted =
      live_.motion.predict(frame.time, frame.thumbnail, live_.map.newest_keyframe().median_depth);
  const TrackingAttempt best = live_.relocalizer.find(live_.map, live_.places, frame, predicted);
  report(best, result);
  const double lost_s = (frame.time - live_.lost_since).seconds();
  result->lost_s = lost_s;
  if (live_.relocalizer.accepts(best)) {
    live_.state = TrackingState::kTracking;
    ++counters_.relocalisations;
    result->relocalised = true;
    live_.relocalizer.restart();
    live_.motion.forget();
    accept(frame, best, result);
    return;
  }
  char text[80];
  std::snprintf(text, sizeof text, "lost for %.1f s; found %d of %d points", lost_s,
                result->points_found, result->points_predicted);
  result->reason = text;
  if (!live_.is_restored && lost_s > live_.options.restart_after_s &&
      live_.map.keyframes().size() <= static_cast<size_t>(live_.options.tiny_map_keyframes)) {
    reset("lost a tiny map");
    result->reason = live_.reset_reason;
  }
}

void Slam::Impl::accept(const Frame& frame, const TrackingAttempt& attempt,
                        TrackingResult* result) {
  live_.motion.update(frame.time, frame.thumbnail, attempt.map_from_cam);
  ++live_.good_frames;
  slam::count_predictions(attempt, &live_.map);
  if (live_.good_frames < 3) return;
  live_.mapper.grow(frame, attempt.map_from_cam, &live_.map);
  if (!live_.mapper.wants_keyframe(live_.map, frame.time, attempt)) {
    live_.mapper.review_if_due(&live_.map);
    return;
  }
  live_.mapper.insert_keyframe(frame, attempt, &live_.map);
  result->is_keyframe = true;
  live_.agenda.note_keyframe(live_.map.newest_keyframe().id, live_.options);
  if (auto refutation = live_.refutation_by_newest_keyframe()) {
    initializer_.believe_still(frame.time, std::move(*refutation));
    reset(slam::Initializer::still_reason());
    result->reason = live_.reset_reason;
    result->is_keyframe = false;
  }
}

void Slam::Impl::reset(const std::string& reason) {
  live_ = slam::LiveMap(live_.camera, live_.options);
  live_.reset_reason = reason;
  initializer_.restart();
  ++epoch_;
  ++counters_.restarts;
}

std::optional<MappingJob> Slam::Impl::take_job() {
  slam::Mapping from = mapping();
  auto task = slam::next_task(&from);
  if (task == nullptr) return std::nullopt;
  return MappingJob(epoch_, std::move(task));
}

void Slam::Impl::apply(MappingResult result) {
  if (result.job_.task == nullptr || result.job_.epoch != epoch_) return;
  slam::Mapping to = mapping();
  result.job_.task->apply(&to);
}

void Slam::Impl::restore(const StoredMap& stored) {
  reset("");
  live_.restore(stored);
  live_.lost_since = last_time_.value_or(Time{});
}

std::string Slam::Impl::warning() const {
  char text[160] = "";
  if (live_.focal.contradicts()) {
    std::snprintf(text, sizeof text,
                  "the images say that the focal length is %.0f px, not %.0f: calibrate the camera",
                  live_.focal.factor * live_.camera.fx_px, live_.camera.fx_px);
  } else if (live_.mapper.forgotten_keyframes() > 0) {
    std::snprintf(text, sizeof text,
                  "memory limit of %.6g MB: %d keyframes that add least were forgotten",
                  live_.options.memory_limit_mb, live_.mapper.forgotten_keyframes());
  }
  return text;
}

SlamStatistics Slam::Impl::statistics() const {
  SlamStatistics s = counters_;
  s.keyframes = static_cast<int>(live_.map.keyframes().size());
  s.points = static_cast<int>(live_.map.points().size());
  s.published_points = static_cast<int>(live_.published.published_points());
  s.forgotten_keyframes = live_.mapper.forgotten_keyframes();
  s.focal_factor = live_.focal.factor;
  s.focal_cost_ratio = live_.focal.cost_ratio;
  s.memory_mb = static_cast<double>(live_.map.memory_bytes()) / 1e6;
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
void Slam::hint(Time time, const Pose<Map, Cam>& map_from_cam) {
  impl_->live().relocalizer.hint(time, map_from_cam);
}
MapDelta Slam::take_delta() { return impl_->live().published.take(&impl_->live().map); }
MapDelta Slam::snapshot() const { return impl_->live().published.snapshot(); }
StoredMap Slam::stored_map() const { return impl_->stored_map(); }
void Slam::restore(const StoredMap& stored) { impl_->restore(stored); }
int Slam::epoch() const { return impl_->epoch(); }
void Slam::reset(const std::string& reason) { impl_->reset(reason); }
SlamStatistics Slam::statistics() const { return impl_->statistics(); }
std::string Slam::warning() const { return impl_->warning(); }

std::optional<MappingJob> Slam::take_job() { return impl_->take_job(); }
MappingResult Slam::run(MappingJob job) {
  job.task->run();
  return MappingResult(std::move(job));
}
void Slam::apply(MappingResult result) { impl_->apply(std::move(result)); }

MappingJob::MappingJob(int job_epoch, std::unique_ptr<slam::MappingTask> job_task)
    : epoch(job_epoch), task(std::move(job_task)) {}
MappingJob::MappingJob(MappingJob&&) noexcept = default;
MappingJob& MappingJob::operator=(MappingJob&&) noexcept = default;
MappingJob::~MappingJob() = default;
double MappingJob::relative_cost() const { return task->relative_cost(); }

}  // namespace foresight
