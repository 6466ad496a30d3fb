#include "bench/evaluate/picture_scorer.h"

#include <numeric>
#include <opencv2/imgproc.hpp>

#include "bench/evaluate/homography_baseline.h"
#include "bench/evaluate/image_scores.h"

namespace foresight {
namespace {

double mean(const std::vector<double>& v) {
  return v.empty() ? 0 : std::accumulate(v.begin(), v.end(), 0.0) / static_cast<double>(v.size());
}

// 255 where an image painted the pixel, on measured surface or also on guessed one.
cv::Mat source_mask(const RenderedFrame& picture, bool with_guesses) {
  cv::Mat mask(picture.rgb.height_px, picture.rgb.width_px, CV_8U);
  for (size_t i = 0; i < picture.source.size(); ++i) {
    const uint8_t code = picture.source[i];
    mask.data[i] = source_rank(code) >= 0 && (with_guesses || !source_is_guess(code)) ? 255 : 0;
  }
  return mask;
}

}  // namespace

double DisplayScore::mean_psnr_common_db() const { return mean(psnr_common_db); }
double DisplayScore::mean_psnr_measured_db() const { return mean(psnr_measured_db); }
double DisplayScore::mean_psnr_whole_db() const { return mean(psnr_whole_db); }
double DisplayScore::mean_ssim_common() const { return mean(ssim_common); }
double DisplayScore::mean_ssim_whole() const { return mean(ssim_whole); }

cv::Mat to_mat(const Image& rgb) {
  return cv::Mat(rgb.height_px, rgb.width_px, CV_8UC3, const_cast<uint8_t*>(rgb.bytes.data()))
      .clone();
}

Undistorter::Undistorter(const CameraModel& camera) : camera_(camera) {
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

cv::Mat Undistorter::operator()(const cv::Mat& rgb) const {
  if (!camera_.has_distortion()) return rgb;
  cv::Mat out;
  cv::remap(rgb, out, map_x_, map_y_, cv::INTER_LINEAR);
  return out;
}

void PictureScorer::score(const cv::Mat& truth, const ShownVideo& shown,
                          const PredictedFrame& frame,
                          const std::vector<Eigen::Vector3d>& points_in_map) {
  ++scores_.scored_frames;
  const cv::Mat predicted = to_mat(frame.picture.rgb);
  const cv::Mat painted = source_mask(frame.picture, true);
  const cv::Mat measured = source_mask(frame.picture, false);
  WarpedImage warped{shown.rgb, cv::Mat(truth.size(), CV_8U, cv::Scalar(255))};
  if (shown.map_from_cam && shown.epoch == frame.pose.epoch) {
    warped = warp_by_best_plane(frame.camera, shown.rgb, *shown.map_from_cam,
                                frame.pose.map_from_cam, points_in_map, truth);
  }
  const cv::Mat common = painted & warped.mask, common_measured = measured & warped.mask;
  add(shown.rgb, truth, common, common_measured, &scores_.delayed);
  add(warped.rgb, truth, common, common_measured, &scores_.homography);
  add(predicted, truth, common, common_measured, &scores_.predicted);
  const SourceShares shares = count_sources(frame.picture.source);
  coverage_.push_back(shares.newest + shares.earlier + shares.guess);
  measured_.push_back(shares.newest + shares.earlier);
  keep_row(truth, shown.rgb, warped.rgb, predicted);
}

void PictureScorer::add(const cv::Mat& view, const cv::Mat& truth, const cv::Mat& common,
                        const cv::Mat& measured, DisplayScore* score) {
  if (const auto v = psnr_db(view, truth, measured)) score->psnr_measured_db.push_back(*v);
  if (const auto v = psnr_db(view, truth, common)) score->psnr_common_db.push_back(*v);
  if (const auto v = ssim(view, truth, common)) score->ssim_common.push_back(*v);
  score->psnr_whole_db.push_back(*psnr_db(view, truth));
  score->ssim_whole.push_back(*ssim(view, truth));
  const auto d = feature_displacements_px(truth, view, common);
  score->displacement_px.insert(score->displacement_px.end(), d.begin(), d.end());
}

// Truth, delayed, homography, predicted, and the predicted view's error ×2. Memory is bounded: when
// there are many rows, every second one goes.
void PictureScorer::keep_row(const cv::Mat& truth, const cv::Mat& delayed, const cv::Mat& warped,
                             const cv::Mat& predicted) {
  cv::Mat error, row;
  cv::absdiff(predicted, truth, error);
  error *= 2;
  std::vector<cv::Mat> small;
  for (const cv::Mat& m : {truth, delayed, warped, predicted, error}) {
    cv::Mat s;
    cv::resize(m, s, {320, 320 * m.rows / m.cols}, 0, 0, cv::INTER_AREA);
    small.push_back(s);
  }
  cv::hconcat(small, row);
  grid_.push_back(row);
  if (grid_.size() < 64) return;
  std::vector<cv::Mat> kept;
  for (size_t i = 0; i < grid_.size(); i += 2) kept.push_back(grid_[i]);
  grid_ = kept;
}

void PictureScorer::finish(PictureScores* scores) {
  scores_.coverage = mean(coverage_);
  scores_.measured = mean(measured_);
  const size_t keep = static_cast<size_t>(grid_rows_);
  for (size_t i = 0; i < grid_.size() && scores_.grid_rows.size() < keep; ++i) {
    if (grid_.size() <= keep || i % (grid_.size() / keep) == grid_.size() / keep / 2) {
      scores_.grid_rows.push_back(grid_[i]);
    }
  }
  *scores = std::move(scores_);
}

}  // namespace foresight
