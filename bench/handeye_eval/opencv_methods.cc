#include <opencv2/calib3d.hpp>

#include "bench/handeye_eval/handeye_methods.h"

namespace foresight {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

// Poses as OpenCV wants them.
struct CvPoses {
  std::vector<cv::Mat> rotations, translations;
  template <class A, class B>
  void push(const Pose<A, B>& pose) {
    const Eigen::Matrix3d r = pose.rotation().toRotationMatrix();
    cv::Mat rotation(3, 3, CV_64F), translation(3, 1, CV_64F);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) rotation.at<double>(i, j) = r(i, j);
      translation.at<double>(i) = pose.translation()[i];
    }
    rotations.push_back(rotation);
    translations.push_back(translation);
  }
};

template <class A, class B>
Pose<A, B> pose_of(const cv::Mat& rotation, const cv::Mat& translation) {
  Eigen::Matrix3d r;
  Vector3d t;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) r(i, j) = rotation.at<double>(i, j);
    t[i] = translation.at<double>(i);
  }
  return {r, t};
}

// The target where the views put it on average.
Similarity<Base, Target> average_target(const HandEyeData& data, const Pose<Ee, Cam>& ee_from_cam,
                                        double joint_delay_s) {
  Vector3d position = Vector3d::Zero();
  Eigen::Vector4d rotation = Eigen::Vector4d::Zero();
  for (const HandEyeView& v : data.views) {
    const Pose<Base, Target> p =
        v.arm.at(joint_delay_s).base_from_ee * ee_from_cam * v.target_from_cam.inverse();
    const Eigen::Vector4d q = p.rotation().coeffs();
    rotation += q.dot(rotation) < 0 ? Eigen::Vector4d(-q) : q;
    position += p.translation() / static_cast<double>(data.views.size());
  }
  return {1, Quaterniond(rotation).normalized(), position};
}

}  // namespace

std::vector<HandEyeAnswer> solve_opencv(const HandEyeData& data, double joint_delay_s) {
  CvPoses base_from_hand, hand_from_base, cam_from_target;
  for (const HandEyeView& v : data.views) {
    const Pose<Base, Ee> hand = v.arm.at(joint_delay_s).base_from_ee;
    base_from_hand.push(hand);
    hand_from_base.push(hand.inverse());
    cam_from_target.push(v.target_from_cam.inverse());
  }
  std::vector<HandEyeAnswer> answers;
  cv::Mat rotation, translation, target_rotation, target_translation;
  const auto add = [&](const char* name, const Pose<Ee, Cam>& ee_from_cam,
                       const Similarity<Base, Target>& target) {
    answers.push_back({name, target, ee_from_cam, joint_delay_s, false, false, {}});
  };
  for (const auto& [method, name] :
       {std::pair(cv::CALIB_HAND_EYE_TSAI, "Tsai"), std::pair(cv::CALIB_HAND_EYE_PARK, "Park"),
        std::pair(cv::CALIB_HAND_EYE_HORAUD, "Horaud"),
        std::pair(cv::CALIB_HAND_EYE_ANDREFF, "Andreff"),
        std::pair(cv::CALIB_HAND_EYE_DANIILIDIS, "Daniilidis")}) {
    cv::calibrateHandEye(base_from_hand.rotations, base_from_hand.translations,
                         cam_from_target.rotations, cam_from_target.translations, rotation,
                         translation, method);
    const auto ee_from_cam = pose_of<Ee, Cam>(rotation, translation);
    add(name, ee_from_cam, average_target(data, ee_from_cam, joint_delay_s));
  }
  for (const auto& [method, name] : {std::pair(cv::CALIB_ROBOT_WORLD_HAND_EYE_SHAH, "Shah"),
                                     std::pair(cv::CALIB_ROBOT_WORLD_HAND_EYE_LI, "Li")}) {
    cv::calibrateRobotWorldHandEye(cam_from_target.rotations, cam_from_target.translations,
                                   hand_from_base.rotations, hand_from_base.translations,
                                   target_rotation, target_translation, rotation, translation,
                                   method);
    const auto target = pose_of<Target, Base>(target_rotation, target_translation).inverse();
    add(name, pose_of<Cam, Ee>(rotation, translation).inverse(),
        {1, target.rotation(), target.translation()});
  }
  return answers;
}

}  // namespace foresight
