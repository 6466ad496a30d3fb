#include "procs/camera/frame_converter.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "common/image_codec.h"
#include "procs/camera/camera_choice.h"

namespace foresight {
namespace {

cv::Mat as_mat(const Image& image) {
  return {image.height_px, image.width_px, CV_8UC(image.channels),
          const_cast<uint8_t*>(image.bytes.data())};
}

Image as_image(const cv::Mat& mat) {
  Image image{mat.cols, mat.rows, mat.channels(), {}};
  image.bytes.assign(mat.datastart, mat.dataend);
  return image;
}

}  // namespace

FrameConverter::FrameConverter(const CameraModel& camera, const CameraParams& params)
    : input_(camera),
      params_(params),
      scale_(std::min(1.0, static_cast<double>(params.max_width_px) / camera.width_px)) {
  output_ = scale_ < 1 ? input_.scaled(scale_) : input_;
  if (params.undistort && input_.has_distortion()) {
    output_ = output_.undistorted();
    build_maps();
  }
}

void FrameConverter::build_maps() {
  const CameraModel distorted = scale_ < 1 ? input_.scaled(scale_) : input_;
  for (int y = 0; y < output_.height_px; ++y) {
    for (int x = 0; x < output_.width_px; ++x) {
      const Eigen::Vector2d p = distorted.project_normalized(output_.unproject({x, y}));
      map_x_.push_back(static_cast<float>(p.x()));
      map_y_.push_back(static_cast<float>(p.y()));
    }
  }
}

std::optional<image_t> FrameConverter::convert(const Frame& frame) {
  image_t message{};
  const bool unchanged = scale_ == 1.0 && map_x_.empty();
  Picture decoded = picture_of(frame, params_.encoding == Encoding::kGray ? 1 : 3);
  error_ = decoded.error;
  warning_ = decoded.warning;
  if (!error_.empty()) return std::nullopt;
  if (decoded.image.width_px != input_.width_px || decoded.image.height_px != input_.height_px) {
    error_ = wrong_size(decoded.image, input_.width_px, input_.height_px);
    return std::nullopt;
  }
  if (unchanged && decoded.is_plain_jpeg && params_.encoding == Encoding::kJpeg) {
    message.width_px = static_cast<int16_t>(input_.width_px);
    message.height_px = static_cast<int16_t>(input_.height_px);
    message.encoding = image_t::ENCODING_JPEG;
    message.data = frame.jpeg;
    message.n_data = static_cast<int32_t>(message.data.size());
    return message;
  }
  cv::Mat picture = as_mat(decoded.image);
  if (params_.encoding == Encoding::kGray && picture.channels() == 3) {
    cv::cvtColor(picture, picture, cv::COLOR_RGB2GRAY);
  }
  if (scale_ < 1) {
    cv::resize(picture, picture, {output_.width_px, output_.height_px}, 0, 0, cv::INTER_AREA);
  }
  if (!map_x_.empty()) {
    const cv::Mat map_x(output_.height_px, output_.width_px, CV_32F, map_x_.data());
    const cv::Mat map_y(output_.height_px, output_.width_px, CV_32F, map_y_.data());
    cv::remap(picture.clone(), picture, map_x, map_y, cv::INTER_LINEAR);
  }
  if (params_.encoding == Encoding::kGray) {
    encode_raw(as_image(picture), &message);
  } else {
    encode_jpeg(as_image(picture), params_.jpeg_quality, &message);
  }
  return message;
}

}  // namespace foresight
