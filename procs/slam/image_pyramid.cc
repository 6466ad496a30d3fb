#include "procs/slam/image_pyramid.h"

#include <opencv2/imgproc.hpp>

namespace foresight::slam {

ImagePyramid build_pyramid(const GrayImageView& image) {
  ImagePyramid pyramid;
  const cv::Mat borrowed(image.height_px, image.width_px, CV_8UC1,
                         const_cast<uint8_t*>(image.pixels),  // cv::Mat has no const view
                         static_cast<size_t>(image.stride_bytes));
  pyramid.levels[0] = borrowed.clone();
  for (int l = 1; l < kLevels; ++l) {
    const cv::Mat& finer = pyramid.levels[l - 1];
    const cv::Size half(finer.cols / 2, finer.rows / 2);
    const cv::Mat even = finer(cv::Rect(0, 0, 2 * half.width, 2 * half.height));
    cv::resize(even, pyramid.levels[l], half, 0, 0, cv::INTER_AREA);
  }
  return pyramid;
}

}  // namespace foresight::slam
