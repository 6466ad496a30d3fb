// ORB features of an image: what a place looks like, for relocalisation and loop closing.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "procs/slam/image_pyramid.h"

namespace foresight::slam {

struct Features {
  std::vector<Eigen::Vector2d> pixels;  // of the full image
  cv::Mat descriptors;                  // one row of 32 bytes per pixel
};

/// About 10 ms. Pure; the features are shared and never change.
std::shared_ptr<const Features> detect_features(const ImagePyramid& pyramid);

}  // namespace foresight::slam
