#include "procs/slam/features.h"

#include <opencv2/features2d.hpp>

namespace foresight::slam {
namespace {

constexpr int kFeatures = 800, kOctaves = 5;
constexpr float kOctaveStep = 1.3f;

}  // namespace

std::shared_ptr<const Features> detect_features(const ImagePyramid& pyramid) {
  const cv::Ptr<cv::ORB> orb = cv::ORB::create(kFeatures, kOctaveStep, kOctaves);
  std::vector<cv::KeyPoint> keypoints;
  auto features = std::make_shared<Features>();
  orb->detectAndCompute(pyramid.levels[0], cv::noArray(), keypoints, features->descriptors);
  for (const cv::KeyPoint& k : keypoints) features->pixels.emplace_back(k.pt.x, k.pt.y);
  return features;
}

}  // namespace foresight::slam
