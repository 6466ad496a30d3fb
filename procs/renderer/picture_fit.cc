#include "procs/renderer/picture_fit.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace foresight {

Image fit_picture(const Image& rgb, int width_px, int height_px) {
  if (rgb.width_px == width_px && rgb.height_px == height_px) return rgb;
  const double scale = std::min(static_cast<double>(width_px) / rgb.width_px,
                                static_cast<double>(height_px) / rgb.height_px);
  const auto side = [scale](int given_px, int most_px) {
    return std::clamp(static_cast<int>(std::lround(scale * given_px)), 1, most_px);
  };
  const cv::Size size(side(rgb.width_px, width_px), side(rgb.height_px, height_px));
  Image framed{width_px, height_px, 3, {}};
  framed.bytes.resize(static_cast<size_t>(width_px) * height_px * 3);
  cv::Mat frame(height_px, width_px, CV_8UC3, framed.bytes.data());
  const cv::Mat picture(rgb.height_px, rgb.width_px, CV_8UC3,
                        const_cast<uint8_t*>(rgb.bytes.data()));
  const cv::Rect place((width_px - size.width) / 2, (height_px - size.height) / 2, size.width,
                       size.height);
  cv::resize(picture, frame(place), size, 0, 0, scale < 1 ? cv::INTER_AREA : cv::INTER_LINEAR);
  return framed;
}

}  // namespace foresight
