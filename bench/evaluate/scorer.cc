#include "bench/evaluate/scorer.h"

#include <algorithm>
#include <numeric>
#include <opencv2/imgproc.hpp>

#include "bench/evaluate/homography_baseline.h"
#include "bench/evaluate/image_scores.h"
#include "common/image_codec.h"
#include "common/messages.h"
#include "foresight/display_stats_t.hpp"
#include "foresight/image_t.hpp"
#include "foresight/view_t.hpp"

namespace foresight {
namespace {

double mean(const std::vector<double>& v) {
  return v.empty() ? 0 : std::accumulate(v.begin(), v.end(), 0.0) / static_cast<double>(v.size());
}

cv::Mat to_mat(const Image& image) {
  return cv::Mat(image.height_px, image.width_px, CV_8UC3, const_cast<uint8_t*>(image.bytes.data()))
      .clone();
}

// Removes lens distortion by bilinear sampling.
class Undistorter {
 public:
  explicit Undistorter(const CameraModel& camera) : camera_(camera) {
    const CameraModel plain = camera.undistorted();
    map_x_.create(camera.height_px, camera.width_px, CV_32F);
    map_y_.create(camera.height_px, camera.width_px, CV_32F);
    for (int y = 0; y < camera.height_px; ++y) {
      for (int x = 0; x < camera.width_px; ++x) {
        const Eigen::Vector2d p = camera.project_normalized(plain.unproject({x, y}));
        map_x_.at<float>(y, x) = static_cast<float>(p.x());
        map_y_.at<float>(y, x) = static_cast<float>(p.y());
      }
    }
  }
  cv::Mat operator()(const cv::Mat& rgb) const {
    if (!camera_.has_distortion()) return rgb;
    cv::Mat out;
    cv::remap(rgb, out, map_x_, map_y_, cv::INTER_LINEAR);
    return out;
  }

 private:
  CameraModel camera_;
  cv::Mat map_x_, map_y_;
};

template <class Message>
Message decode(std::span<const uint8_t> bytes) {
  Message message;
  message.decode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return message;
}

struct ShownVideo {
  Time time;
  cv::Mat rgb;
  std::optional<Pose<Map, Cam>> map_from_cam;
  int64_t epoch = 0;
};

// Listens to the line and scores as it runs.
class Scorer {
 public:
  Scorer(RecordedLine& line, const ScoringOptions& options, EvaluationResult* result)
      : line_(line), options_(options), result_(*result), undistort_(line.camera()) {
    auto& world = line.world();
    world.listen(Domain::kRobot, "IMAGE", [this](auto bytes) { on_image(bytes); });
    world.listen(Domain::kRobot, "CAMERA_POSE", [this](auto) { on_pose(); });
    world.listen(Domain::kRobot, "MAP_DELTA", [this](auto bytes) { on_map(bytes); });
    world.listen(Domain::kOperator, "VIEW", [this](auto bytes) { on_view(bytes); });
    line.renderer().set_listener([this](const PredictedFrame& f) { on_prediction(f); });
  }
  void finish() {
    result_.coverage = mean(coverage_);
    result_.measured = mean(measured_);
    result_.map_points = static_cast<int>(points_.size());
    for (size_t i = 0; i < grid_.size(); ++i) {
      const size_t keep = static_cast<size_t>(options_.grid_rows);
      if (grid_.size() <= keep || i % (grid_.size() / keep) == grid_.size() / keep / 2) {
        if (result_.grid_rows.size() < keep) result_.grid_rows.push_back(grid_[i]);
      }
    }
  }

 private:
  void on_image(std::span<const uint8_t> bytes) {
    const auto message = decode<image_t>(bytes);
    if (result_.frames++ == 0) first_frame_ = {message.utime};
    truth_time_ = {message.utime};
    truth_message_ = message;
    truth_.release();
  }
  void on_pose() {
    if (began_) ++result_.frames_after_init;
  }
  void on_map(std::span<const uint8_t> bytes) {
    const auto message = decode<map_delta_t>(bytes);
    MapDelta delta;
    if (!append(message, &delta)) return;
    if (message.header.is_snapshot != 0 && message.header.part == 0) {
      points_.clear();
      keyframes_.clear();
    }
    for (int32_t id : delta.points_removed) points_.erase(id);
    for (const MapPoint& p : delta.points_set) points_[p.id] = p.position_in_map.cast<double>();
    for (const MapKeyframe& k : delta.keyframes_set) keyframes_[k.id] = true;
    for (int32_t id : delta.keyframes_removed) keyframes_.erase(id);
    result_.keyframes = static_cast<int>(keyframes_.size());
  }
  void on_view(std::span<const uint8_t> bytes) {
    const auto message = decode<view_t>(bytes);
    const auto image = decode_image(message.image, 3);
    if (!image) return;
    shown_ = {
        {message.utime}, undistort_(to_mat(*image)), read_pose(message.pose), message.pose.epoch};
  }
  void on_prediction(const PredictedFrame& frame) {
    if (frame.pose.instant != truth_time_ || shown_.rgb.empty()) return;
    if (frame.pose.instant == last_prediction_) return;  // a redraw of the same instant
    last_prediction_ = frame.pose.instant;
    if (!began_) {
      began_ = true;
      result_.frames_after_init = 1;
      result_.first_prediction_s = (frame.pose.instant - first_frame_).seconds();
    }
    if (result_.predicted_frames++ % options_.every != 0) return;
    ++result_.scored_frames;
    result_.triangles = static_cast<int>(line_.renderer().triangles());
    score(frame);
  }
  void score(const PredictedFrame& frame) {
    if (truth_.empty()) {
      const auto image = decode_image(truth_message_, 3);
      if (!image) return;
      truth_ = undistort_(to_mat(*image));
    }
    const cv::Mat predicted = to_mat(frame.picture.rgb);
    const cv::Mat painted = source_mask(frame.picture, true);
    const cv::Mat measured = source_mask(frame.picture, false);
    WarpedImage warped{shown_.rgb, cv::Mat(truth_.size(), CV_8U, cv::Scalar(255))};
    if (shown_.map_from_cam && shown_.epoch == frame.pose.epoch) {
      std::vector<Eigen::Vector3d> points;
      for (const auto& [id, p] : points_) points.push_back(p);
      warped = warp_by_best_plane(frame.camera, shown_.rgb, *shown_.map_from_cam,
                                  frame.pose.map_from_cam, points, truth_);
    }
    const cv::Mat common = painted & warped.mask, common_measured = measured & warped.mask;
    add(shown_.rgb, common, common_measured, &result_.delayed);
    add(warped.rgb, common, common_measured, &result_.homography);
    add(predicted, common, common_measured, &result_.predicted);
    const SourceShares shares = count_sources(frame.picture.source);
    coverage_.push_back(shares.newest + shares.earlier + shares.guess);
    measured_.push_back(shares.newest + shares.earlier);
    grid_.push_back(grid_row(warped.rgb, predicted));
    thin_grid();
  }
  void add(const cv::Mat& view, const cv::Mat& common, const cv::Mat& measured,
           DisplayScore* score) {
    if (const auto v = psnr_db(view, truth_, measured)) score->psnr_measured_db.push_back(*v);
    if (const auto v = psnr_db(view, truth_, common)) score->psnr_common_db.push_back(*v);
    if (const auto v = ssim(view, truth_, common)) score->ssim_common.push_back(*v);
    score->psnr_whole_db.push_back(*psnr_db(view, truth_));
    score->ssim_whole.push_back(*ssim(view, truth_));
    const auto d = feature_displacements_px(truth_, view, common);
    score->displacement_px.insert(score->displacement_px.end(), d.begin(), d.end());
  }
  // 255 where an image painted the pixel, on measured surface or also on guessed one.
  static cv::Mat source_mask(const RenderedFrame& picture, bool with_guesses) {
    cv::Mat mask(picture.rgb.height_px, picture.rgb.width_px, CV_8U);
    for (size_t i = 0; i < picture.source.size(); ++i) {
      const uint8_t code = picture.source[i];
      mask.data[i] = source_rank(code) >= 0 && (with_guesses || !source_is_guess(code)) ? 255 : 0;
    }
    return mask;
  }
  // Truth, delayed, homography, predicted, and the predicted view's error ×2.
  cv::Mat grid_row(const cv::Mat& warped, const cv::Mat& predicted) const {
    cv::Mat error, row;
    cv::absdiff(predicted, truth_, error);
    error *= 2;
    std::vector<cv::Mat> small;
    for (const cv::Mat& m : {truth_, shown_.rgb, warped, predicted, error}) {
      cv::Mat s;
      cv::resize(m, s, {320, 320 * m.rows / m.cols}, 0, 0, cv::INTER_AREA);
      small.push_back(s);
    }
    cv::hconcat(small, row);
    return row;
  }
  // Bounded memory on long sequences: every second row goes when there are many.
  void thin_grid() {
    if (grid_.size() < 64) return;
    std::vector<cv::Mat> kept;
    for (size_t i = 0; i < grid_.size(); i += 2) kept.push_back(grid_[i]);
    grid_ = kept;
  }

  RecordedLine& line_;
  ScoringOptions options_;
  EvaluationResult& result_;
  Undistorter undistort_;
  Time first_frame_, truth_time_, last_prediction_;
  image_t truth_message_;
  cv::Mat truth_;
  ShownVideo shown_;
  std::map<int32_t, Eigen::Vector3d> points_;
  std::map<int32_t, bool> keyframes_;
  std::vector<double> coverage_, measured_;
  std::vector<cv::Mat> grid_;
  bool began_ = false;
};

}  // namespace

double DisplayScore::mean_psnr_common_db() const { return mean(psnr_common_db); }
double DisplayScore::mean_psnr_measured_db() const { return mean(psnr_measured_db); }
double DisplayScore::mean_psnr_whole_db() const { return mean(psnr_whole_db); }
double DisplayScore::mean_ssim_common() const { return mean(ssim_common); }
double DisplayScore::mean_ssim_whole() const { return mean(ssim_whole); }

EvaluationResult evaluate(const RecordedLineOptions& options, const ScoringOptions& scoring,
                          const std::function<void(int, int)>& progress) {
  EvaluationResult result;
  result.sequence = options.sequence;
  result.delay_s = options.delay_s;
  RecordedLine line(options);
  Scorer scorer(line, scoring, &result);
  int reported = 0;
  while (line.step()) {
    if (result.frames >= reported + 30) {
      reported = result.frames;
      progress(result.frames, result.scored_frames);
    }
  }
  scorer.finish();
  return result;
}

}  // namespace foresight
