#include "bench/evaluate/recorded_line_scorer.h"

#include "bench/evaluate/map_points.h"
#include "common/image_codec.h"
#include "common/message_bytes.h"
#include "common/messages.h"
#include "foresight/image_t.hpp"
#include "foresight/view_t.hpp"

namespace foresight {
namespace {

// Listens to the line and scores as it runs.
class RecordedLineScorer {
 public:
  RecordedLineScorer(RecordedLine& line, const ScoringOptions& options, EvaluationResult* result)
      : line_(line),
        options_(options),
        result_(*result),
        undistort_(line.camera()),
        pictures_(options.grid_rows) {
    auto& world = line.world();
    world.listen(Domain::kRobot, "IMAGE", [this](auto bytes) { on_image(bytes); });
    world.listen(Domain::kRobot, "CAMERA_POSE", [this](auto) { on_pose(); });
    world.listen(Domain::kRobot, "MAP_DELTA", [this](auto bytes) { map_.on_message(bytes); });
    world.listen(Domain::kOperator, "VIEW", [this](auto bytes) { on_view(bytes); });
    line.renderer().set_listener([this](const PredictedFrame& f) { on_prediction(f); });
  }
  void finish() {
    pictures_.finish(&result_);
    result_.map_points = map_.points();
    result_.keyframes = map_.keyframes();
    result_.input = line_.source().report();
    result_.focal_px = line_.camera().fx_px;
    result_.intrinsics_are_guessed = line_.source().intrinsics_are_guessed();
  }

 private:
  void on_image(std::span<const uint8_t> bytes) {
    const auto message = decode<image_t>(bytes);
    if (result_.frames++ == 0) first_frame_ = {message.utime};
    truth_time_ = {message.utime};
    truth_message_ = message;
    truth_.rgb.release();
  }
  void on_pose() {
    if (began_) ++result_.frames_after_init;
  }
  void on_view(std::span<const uint8_t> bytes) {
    const auto message = decode<view_t>(bytes);
    const auto image = decode_image(message.image, 3);
    if (!image) return;
    shown_ = {
        {message.utime}, undistort_(to_mat(*image)), read_pose(message.pose), message.pose.epoch};
  }
  void on_prediction(const PredictedFrame& frame) {
    const Time instant = frame.pose.instant;
    if (instant != truth_time_ || shown_.picture.rgb.empty()) return;
    // The camera stands still (its images are refused, or at an end): what it showed last would be
    // compared with itself.
    if (line_.delay_s() > 0 && shown_.time == truth_time_) return;
    if (instant == last_prediction_) return;  // a redraw of the same instant
    last_prediction_ = instant;
    if (!began_) {
      began_ = true;
      result_.frames_after_init = 1;
      result_.first_prediction_s = (instant - first_frame_).seconds();
    }
    if (result_.predicted_frames++ % options_.every != 0) return;
    result_.triangles = static_cast<int>(line_.renderer().triangles());
    if (truth_.rgb.empty()) {
      const auto image = decode_image(truth_message_, 3);
      if (!image) return;
      truth_ = undistort_(to_mat(*image));
    }
    pictures_.score(truth_, shown_, frame, map_.positions_in_map());
    ++result_.scored_frames;
  }

  RecordedLine& line_;
  ScoringOptions options_;
  EvaluationResult& result_;
  Undistorter undistort_;
  PictureScorer pictures_;
  MapPoints map_;
  Time first_frame_, truth_time_, last_prediction_;
  image_t truth_message_;
  MaskedPicture truth_;
  ShownVideo shown_;
  bool began_ = false;
};

}  // namespace

EvaluationResult evaluate(const RecordedLineOptions& options, const ScoringOptions& scoring,
                          const std::function<void(int, int)>& progress) {
  EvaluationResult result;
  result.sequence = options.sequence;
  result.delay_s = options.delay_s;
  RecordedLine line(options);
  RecordedLineScorer scorer(line, scoring, &result);
  int reported = 0;
  while (line.step()) {
    if (result.frames < reported + 30) continue;
    reported = result.frames;
    progress(result.frames, result.scored_frames);
  }
  scorer.finish();
  return result;
}

}  // namespace foresight
