#include "bench/evaluate/picture_scorer.h"

#include <numeric>
#include <opencv2/imgproc.hpp>

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

// Without the pixels whose window of this width reaches out of the mask. The picture's own edge
// does not count.
cv::Mat shrunk(const cv::Mat& mask, int window_px) {
  cv::Mat out;
  cv::erode(mask, out, cv::Mat::ones(window_px, window_px, CV_8U));
  return out;
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

MaskedPicture whole(const cv::Mat& rgb) {
  return {rgb, cv::Mat(rgb.size(), CV_8U, cv::Scalar(255))};
}

Undistorter::Undistorter(const CameraModel& camera) : camera_(camera) {
  const CameraModel plain = camera.undistorted();
  seen_ = cv::Mat::zeros(camera.height_px, camera.width_px, CV_8U);
  map_x_.create(camera.height_px, camera.width_px, CV_32F);
  map_y_.create(camera.height_px, camera.width_px, CV_32F);
  for (int y = 0; y < camera.height_px; ++y) {
    for (int x = 0; x < camera.width_px; ++x) {
      const Eigen::Vector2d ray = plain.unproject({x, y});
      const Eigen::Vector2d p = camera.project_normalized(ray);
      const bool seen = ray.norm() <= camera.max_radius && camera.in_image(p);
      seen_.at<uint8_t>(y, x) = seen ? 255 : 0;
      map_x_.at<float>(y, x) = static_cast<float>(p.x());
      map_y_.at<float>(y, x) = static_cast<float>(p.y());
    }
  }
}

MaskedPicture Undistorter::operator()(const cv::Mat& rgb) const {
  if (!camera_.has_distortion()) return whole(rgb);
  MaskedPicture out;
  cv::remap(rgb, out.rgb, map_x_, map_y_, cv::INTER_LINEAR);
  out.mask = seen_;
  return out;
}

void PictureScorer::score(const MaskedPicture& truth, const ShownVideo& shown,
                          const PredictedFrame& frame,
                          const std::vector<Eigen::Vector3d>& points_in_map) {
  ++scores_.scored_frames;
  const cv::Mat predicted = to_mat(frame.picture.rgb);
  const cv::Mat painted = source_mask(frame.picture, true);
  const cv::Mat measured = source_mask(frame.picture, false);
  MaskedPicture warped = shown.picture;
  if (shown.map_from_cam && shown.epoch == frame.pose.epoch) {
    warped = warp_by_best_plane(frame.camera, shown.picture, *shown.map_from_cam,
                                frame.pose.map_from_cam, points_in_map, truth);
  }
  const cv::Mat everywhere = truth.mask & shown.picture.mask & warped.mask;
  const ScoredPixels pixels{truth.mask, painted & everywhere, measured & everywhere};
  add_scores(shown.picture.rgb, truth.rgb, pixels, &scores_.delayed);
  add_scores(warped.rgb, truth.rgb, pixels, &scores_.homography);
  add_scores(predicted, truth.rgb, pixels, &scores_.predicted);
  truth_share_.push_back(cv::countNonZero(truth.mask) / static_cast<double>(truth.mask.total()));
  const SourceShares shares = count_sources(frame.picture.source);
  coverage_.push_back(shares.newest + shares.earlier + shares.guess);
  measured_.push_back(shares.newest + shares.earlier);
  keep_row(truth.rgb, shown.picture.rgb, warped.rgb, predicted);
}

// The windows of structural similarity and of feature tracking must not reach into the rim of the
// truth either.
void add_scores(const cv::Mat& view, const cv::Mat& truth, const ScoredPixels& pixels,
                DisplayScore* score) {
  const cv::Mat in_windows = shrunk(pixels.truth, kSsimWindow_px);
  const cv::Mat in_tracking = shrunk(pixels.truth, kTrackingWindow_px);
  if (const auto v = psnr_db(view, truth, pixels.measured)) score->psnr_measured_db.push_back(*v);
  if (const auto v = psnr_db(view, truth, pixels.common)) score->psnr_common_db.push_back(*v);
  if (const auto v = psnr_db(view, truth, pixels.truth)) score->psnr_whole_db.push_back(*v);
  if (const auto v = ssim(view, truth, pixels.common & in_windows)) {
    score->ssim_common.push_back(*v);
  }
  if (const auto v = ssim(view, truth, in_windows)) score->ssim_whole.push_back(*v);
  const auto d = feature_displacements_px(truth, view, pixels.common & in_tracking);
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
  scores_.truth_share = mean(truth_share_);
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
